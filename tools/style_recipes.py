"""The recipes of the hairstyles that ship: partings, flows, lengths and cuts over the scalp.

`make styles` makes the files of hairstyles from them. A recipe takes the head and returns the
style; all lengths are in metres, see tools/style_growth.py.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from style_cells import parted_in_cells
from style_growth import (
    CROWN,
    Head,
    Roots,
    addon_module,
    along_skin,
    cut,
    evenly,
    ramp,
    shortened,
    unit,
    waved,
)

SOURCE = "tools/style_recipes.py"

#: name -> what makes the style
RECIPES: dict[str, Callable[[Head], Any]] = {}


def recipe(make: Callable[[Head], Any]) -> Callable[[Head], Any]:
    RECIPES[make.__name__] = make
    return make


def style(title: str, order: int, shapes: Any, look: str, **parts: Any) -> Any:
    """A Hairstyle; `parts`: mask, modifiers, presets, and settings by section. Without shapes it is
    fur, which grows by the section `grow`."""
    hairstyles = addon_module("exchange.hairstyles")
    modifiers = tuple(
        hairstyles.NodeModifier(nodes, inputs) for nodes, inputs in parts.pop("modifiers", ())
    )
    mask = parts.pop("mask", "" if shapes is None else "scalp")
    presets = (f"looks/{look}", *parts.pop("presets", ()))
    return hairstyles.Hairstyle(
        title=title,
        guides=shapes,
        source=SOURCE,
        order=order,
        masks={"children": mask} if mask else {},
        modifiers=modifiers,
        presets=presets,
        settings=parts,
    )


def children(count: int, **values: Any) -> dict[str, Any]:
    return {"method": "multi", "strand_count": count, **values}


def curled(
    radius: float, turns: float, start: float, stray: float, finer: int, apart: float = 0.0
) -> Any:
    """Blender's Curl node.

    Args:
        start: how far along a lock curls begin, 0 to 1.
        stray: how much the places of turns vary between locks, 0 to 1.
        finer: how often each segment is halved first.
        apart: locks nearer to each other than this curl as one [m].
    """
    inputs = {
        "Radius": radius,
        "Frequency": turns,
        "Subdivision": finer,
        "Curl Start": start,
        "Random Offset": stray,
        "Guide Distance": apart,
    }
    return "Curl Hair Curves", inputs


def clumped(factor: float, apart: float) -> Any:
    """Blender's Clump node.

    Args:
        factor: how much locks are drawn together, 0 to 1.
        apart: locks nearer to each other than this clump together [m].
    """
    inputs = {
        "Factor": factor,
        "Shape": 0.45,
        "Preserve Length": True,
        "Guide Distance": apart,
    }
    return "Clump Hair Curves", inputs


def toward(x: Any, y: Any, z: Any) -> np.ndarray:
    """Directions (n, 3) of components that are numbers or (n,)."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=1).astype(float)


def whorl(points: np.ndarray, roots: Roots, _reached: np.ndarray) -> np.ndarray:
    """As hair grows: away from the crown, and a little around it."""
    away = along_skin(roots.place - CROWN, roots)
    return unit(away + 0.3 * np.cross(roots.normal, away))


@recipe
def buzz_cut(head: Head) -> Any:
    roots = head.roots(1200, "scalp")
    length = 0.0045 + 0.0015 * ramp(0.0, 0.06, roots.height)
    locks = head.combed(roots, whorl, length, 6, lift=0.65, clearance=lambda s: 0.3 * s)
    return style(
        "Buzz Cut",
        10,
        head.shapes(roots, locks),
        "brown",
        children=children(45000, length_variation=0.25, clump=0.0, frizz=0.01, scatter=0.5),
        presets=("dynamics/stiff",),
    )


@recipe
def crop_fade(head: Head) -> Any:
    roots = head.roots(2000, "scalp")
    _, y, z = roots.place.T
    top = ramp(0.056, 0.082, z + 0.012 * ramp(0.0, 0.09, y))
    # from stubble at ears and neck, over clipped hair, to hair that is cut with scissors
    faded = z - 0.02 * ramp(0.075, 0.02, y)
    short = 0.0006 + 0.0024 * ramp(-0.065, 0.02, faded) + 0.008 * ramp(0.005, 0.062, faded)
    bundle = bundles(head, roots, (top > 0.4).astype(int), 420)
    own = of_bundle(bundle)
    on_top = 0.025 + 0.021 * ramp(0.05, -0.06, y) + 0.018 * (own[:, 0] - 0.5)
    length = short + top * (on_top - short)
    length = length * (0.85 + 0.3 * roots.random[:, 0])
    front = top * ramp(0.075, 0.035, y)

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        aside = 0.35 + 1.3 * (own[:, 1] - 0.5)
        ahead = unit(toward(aside, -1.0, 0.25 - 1.0 * ramp(0.005, 0.025, reached)))
        return (1.0 - front)[:, None] * whorl(points, roots, reached) + front[:, None] * ahead

    locks = head.combed(
        roots,
        flow,
        length,
        9,
        lift=0.5 + 0.25 * top * own[:, 2],
        follow=0.5,
        hug=on_skull,
        clearance=lambda s: 0.3 * np.minimum(s, 0.03) * (1.0 - top * (0.2 + 0.5 * own[:, 3])),
    )
    locks = np.where((top > 0.4)[:, None, None], in_bundles(locks, bundle, 0.85), locks)
    return style(
        "Crop with Fade",
        20,
        head.shapes(roots, head.pushed_out(locks, 0.0008)),
        "brown",
        children=children(
            50000, length_variation=0.3, clump=0.25, clump_size=8, frizz=0.015, scatter=0.2
        ),
        shading={"melanin": 0.76},
        presets=("dynamics/stiff",),
    )


def on_skull(points: np.ndarray) -> np.ndarray:
    """How strongly hair lies on the head; further down it hangs freely."""
    return 1.2 * ramp(-0.02, 0.04, points[:, 2])


def swept(at: float, back: float) -> Any:
    """Hair that is combed from a parting at x = `at` to both sides, and back."""

    def flow(points: np.ndarray, roots: Roots, _reached: np.ndarray) -> np.ndarray:
        z = points[:, 2]
        side = np.clip((roots.place[:, 0] - at) / spread(roots), -1.0, 1.0)
        on_top = ramp(0.03, 0.085, z)
        return toward(
            side * on_top,
            back * on_top + 0.55 * (1 - on_top),
            0.05 - 0.9 * (1 - on_top) * ramp(0.09, 0.0, z),
        )

    return flow


def short_at_ears(roots: Roots) -> np.ndarray:
    """A factor of the length: sideburns and hair right above the ears do not cover them."""
    _, y, z = roots.place.T
    above_ear = ramp(-0.045, -0.03, y) * ramp(0.05, 0.035, y) * ramp(0.045, 0.022, z)
    return 1.0 - 0.8 * above_ear


def spread(roots: Roots) -> np.ndarray:
    """How wide a parting is: a line at the front that opens towards the crown [m]."""
    return 0.0004 + 0.045 * ramp(0.0, 0.07, roots.place[:, 1])


def swept_over(at: float, bundle: np.ndarray) -> Any:
    """Hair that is combed from a parting at x = `at`, over the top and back, and down at the sides;
    the locks of a bundle (n,) vary alike."""
    own = of_bundle(bundle)

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        side, behind, y_root = side_of(roots, at), ramp(0.05, 0.1, y), roots.place[:, 1]
        on_top = ramp(0.055, 0.095, z) * ramp(0.075, 0.05, np.abs(x)) * ramp(0.1, 0.07, y)
        over = on_top * (0.9 + 0.5 * (own[:, 1] - 0.5))
        back = 0.4 + 0.3 * (own[:, 2] - 0.5) - 0.4 * behind
        back = back + 0.7 * ramp(-0.04, -0.08, y_root) + 0.5 * ramp(0.0, 0.06, y_root)
        down = (1.0 - on_top) * np.maximum(ramp(0.045, 0.07, np.abs(x)), behind)
        return toward(side * over, back, 0.1 * on_top - 1.2 * down)

    return flow


@recipe
def side_part(head: Head) -> Any:
    at = -0.036
    roots = head.roots(1700, "scalp")
    x, y, z = roots.place.T
    is_over = x > at
    bundle = bundles(head, roots, is_over.astype(int), 260)
    own = of_bundle(bundle)
    top = ramp(0.055, 0.095, z) * np.where(is_over, 1.0, 0.3)
    length = 0.006 + 0.008 * ramp(-0.075, 0.0, z) + 0.010 * ramp(-0.01, 0.07, z)
    shorter = 0.02 * ramp(0.02, 0.09, y) + 0.025 * ramp(0.0, 0.06, x)
    length = length + top * (0.062 + 0.02 * (own[:, 0] - 0.5) - shorter)
    length = length * short_at_ears(roots)
    # the wave at the front stands up first
    rise = top * ramp(0.0, -0.07, y)
    locks = head.combed(
        roots,
        swept_over(at, bundle),
        length,
        14,
        lift=0.2 + 0.2 * top + 0.25 * rise,
        follow=0.7,
        hug=on_skull,
        clearance=lambda s: 0.001 + (0.12 + 0.28 * top + 0.15 * rise) * np.minimum(s, 0.03),
    )
    locks = np.where((top > 0.2)[:, None, None], in_bundles(locks, bundle, 0.4), locks)
    return style(
        "Side Part",
        30,
        head.shapes(roots, head.pushed_out(locks, 0.001), is_over.astype(np.int32)),
        "brown",
        children=children(
            36000, length_variation=0.2, clump=0.35, clump_size=16, frizz=0.006, parting=0.9
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def slicked_back(head: Head) -> Any:
    roots = head.roots(1500, "scalp")

    def flow(points: np.ndarray, _roots: Roots, _reached: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        # over the ears it goes straight back
        down = -0.05 - 1.3 * ramp(0.04, 0.1, y) - 0.5 * ramp(0.06, 0.0, z) * ramp(0.03, 0.05, y)
        in_behind = -0.25 * np.sign(x) * ramp(0.0, 0.09, y)
        return toward(in_behind, 1.0 - 0.75 * ramp(0.04, 0.1, y), down)

    length = (0.05 + 0.07 * ramp(0.0, 0.08, roots.height)) * short_at_ears(roots)
    locks = head.combed(
        roots,
        flow,
        length,
        16,
        lift=0.25,
        follow=0.8,
        hug=on_skull,
        clearance=lambda s: 0.0015 + 0.09 * np.minimum(s, 0.07),
    )
    return style(
        "Slicked Back",
        40,
        head.shapes(roots, locks),
        "black",
        children=children(30000, length_variation=0.25, clump=0.5, clump_size=25, frizz=0.004),
        presets=("dynamics/stiff",),
    )


def side_of(roots: Roots, at: float) -> np.ndarray:
    """To which side of a parting at x = `at` each lock goes, -1 to 1; none goes along its line."""
    aside = roots.place[:, 0] - at
    aside = np.copysign(np.maximum(np.abs(aside), 0.001), aside)
    return np.clip(aside / spread(roots), -1.0, 1.0)


def parted(at: float, back: float) -> Any:
    """Hair that falls to both sides of a parting at x = `at`, away from the face."""

    def flow(points: np.ndarray, roots: Roots, _reached: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        side = side_of(roots, at)
        on_top = ramp(0.05, 0.1, z) * ramp(0.078, 0.06, np.abs(x)) * ramp(0.115, 0.09, y)
        behind = ramp(-0.01, -0.07, y) * ramp(-0.16, -0.02, z)
        before_face = ramp(0.088, 0.066, np.abs(x)) * ramp(-0.03, -0.06, y)
        rear = on_top * ramp(0.02, 0.07, roots.place[:, 1])
        return toward(
            side * (1.1 * on_top + 1.3 * before_face),
            back * on_top + 0.8 * rear + 0.9 * behind,
            -0.25 - 1.4 * (1 - on_top),
        )

    return flow


def sides(roots: Roots, at: float) -> np.ndarray:
    """Groups on both sides of a parting: no child lies between them."""
    return (roots.place[:, 0] > at).astype(np.int32)


def parts(roots: Roots, at: float, in_front: np.ndarray | bool = False) -> np.ndarray:
    """Groups on both sides of a parting that ends at the crown, before and behind the shoulders."""
    down_back = (roots.place[:, 1] > 0.055) & ~np.asarray(in_front)
    return np.where(down_back, 4, 2 * sides(roots, at) + in_front).astype(np.int32)


def layers(most: float, per_length: float = 0.14) -> Callable[[np.ndarray], np.ndarray]:
    """The distance that hair keeps from the skin: hair from further up lies over the rest."""
    return lambda reached: 0.002 + np.minimum(per_length * reached, most)


def in_layers(roots: Roots, most: float, over: float = 0.08) -> Callable[[np.ndarray], np.ndarray]:
    """The distance that hair keeps from the skin, in full after a length of `over`: hair from
    further up lies over the rest."""
    layer = 0.25 + 0.55 * ramp(-0.06, 0.1, roots.height) + 0.2 * roots.random[:, 2]
    return lambda reached: 0.002 + most * layer * np.minimum(reached / over, 1.0)


def bundles(head: Head, roots: Roots, group: np.ndarray, count: int) -> np.ndarray:
    """The bundle of each lock (n,): hair falls in bundles of adjacent locks.

    Args:
        group: of each lock (n,); groups share no bundle.
        count: of bundles.
    """
    middles = head.roots(count, "scalp", 3).place
    nearest = np.linalg.norm(roots.place[:, None] - middles, axis=2).argmin(axis=1)
    _, bundle = np.unique(group * len(middles) + nearest, return_inverse=True)
    return bundle


def of_bundle(bundle: np.ndarray, seed: int = 2) -> np.ndarray:
    """Numbers (n, 4) from 0 to 1 that the locks of a bundle (n,) have in common."""
    return np.random.default_rng(seed).random((bundle.max() + 1, 4))[bundle]


def in_bundles(locks: np.ndarray, bundle: np.ndarray, factor: float) -> np.ndarray:
    """Locks drawn towards the middle of their bundle (n,), more so near their tips.

    Args:
        factor: how much tips are drawn together, 0 to 1.
    """
    sums = np.zeros((bundle.max() + 1, *locks.shape[1:]))
    np.add.at(sums, bundle, locks)
    middle = (sums / np.bincount(bundle)[:, None, None])[bundle]
    pull = factor * ramp(0.1, 1.0, np.linspace(0.0, 1.0, locks.shape[1]))
    return locks + pull[None, :, None] * (middle - locks)


@recipe
def bob(head: Head) -> Any:
    roots = head.roots(1600, "scalp")
    falls = parted(-0.022, 0.25)

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        inward = ramp(-0.05, -0.1, points[:, 2])[:, None] * unit(points * (1.0, 1.0, 0.0))
        # hair at the forehead goes back first, so that it does not lie on the forehead
        first = ramp(-0.02, -0.08, roots.place[:, 1]) * ramp(0.06, 0.02, reached)
        back = first[:, None] * np.array([0.0, 0.9, 0.8])
        return unit(falls(points, roots, reached)) - 0.5 * inward + back

    locks = head.combed(
        roots,
        flow,
        0.30,
        26,
        lift=0.25,
        follow=0.55,
        hug=on_skull,
        clearance=in_layers(roots, 0.016, 0.11),
        over_ears=True,
    )
    ragged = np.repeat(0.012 * roots.random[:, 0], locks.shape[1])
    locks = cut(locks, lambda p: p[:, 2] + 0.1 - ragged + 0.22 * np.minimum(-p[:, 1], 0.06))
    group = parts(roots, -0.022)
    locks = in_bundles(locks, bundles(head, roots, group, 180), 0.25)
    return style(
        "Bob",
        50,
        head.shapes(roots, head.pushed_out(locks, 0.003), group),
        "brown",
        children=children(
            28000, length_variation=0.1, clump=0.5, clump_size=30, frizz=0.004, parting=1.0
        ),
        presets=("dynamics/natural",),
    )


def before_shoulders(roots: Roots) -> np.ndarray:
    """Which locks fall in front of the shoulders instead of behind: adjacent locks alike, with an
    irregular border between both."""
    x, y, z = 55.0 * roots.place.T
    uneven = 0.012 * (np.sin(x + 1.3 * z) + np.sin(0.8 * y - 1.1 * z + 2.0))
    return roots.place[:, 1] + uneven + 0.012 * (roots.random[:, 3] - 0.5) < 0.024


def draped(at: float, in_front: np.ndarray) -> Any:
    """Hair that is parted at x = `at`, falls in towards the neck, and then over the chest if it is
    `in_front` (n,), or else down the back."""
    falls = parted(at, 0.3)

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        low = ramp(-0.02, -0.12, z)[:, None]
        # hair from further back lies nearer to the shoulder
        rear = ramp(-0.06, 0.02, roots.place[:, 1])
        side = np.where(roots.place[:, 0] > at, 1.0, -1.0)
        beside = side * (0.045 + 0.03 * roots.random[:, 1] + 0.02 * rear)
        to_x = np.where(in_front, beside, 0.72 * x)
        to_y = np.where(in_front, 0.05 * rear - 0.065, 0.125)
        aim = toward(9.0 * (to_x - x), 9.0 * (to_y - y), -1.0)
        return (1.0 - low) * unit(falls(points, roots, reached)) + low * unit(aim)

    return flow


def long_locks(
    head: Head,
    roots: Roots,
    in_front: np.ndarray,
    hem: Any,
    at: float = 0.0,
    volume: float = 0.013,
    over: float = 0.08,
) -> Any:
    """Long hair over the shoulders, cut where it comes to this height `hem` (n,) [m]."""
    locks = head.combed(
        roots,
        draped(at, in_front),
        0.42,
        40,
        lift=0.25,
        follow=0.6,
        hug=on_skull,
        clearance=in_layers(roots, volume, over),
        over_ears=True,
    )
    ends = np.repeat(hem, locks.shape[1])
    return evenly(cut(locks, lambda p: p[:, 2] - ends), 30)


def hem_at(roots: Roots, in_front: np.ndarray, height: float, ragged: float) -> np.ndarray:
    """Where locks end: a soft round line, from which single ones hang longer and shorter."""
    line = height - 0.012 * ~in_front + 1.2 * roots.place[:, 0] ** 2
    return line + ragged * (roots.random[:, 0] - 0.35)


@recipe
def long_straight(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    in_front = before_shoulders(roots)
    group = parts(roots, 0.0, in_front)
    locks = long_locks(head, roots, in_front, hem_at(roots, in_front, -0.225, 0.05))
    locks = in_bundles(locks, bundles(head, roots, group, 200), 0.35)
    return style(
        "Long and Straight",
        60,
        head.shapes(roots, head.pushed_out(locks, 0.003), group),
        "brown",
        children=children(
            30000,
            length_variation=0.12,
            clump=0.4,
            clump_size=30,
            frizz=0.002,
            parting=1.0,
        ),
        presets=("dynamics/soft",),
    )


@recipe
def long_wavy(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    in_front = before_shoulders(roots)
    group = parts(roots, -0.02, in_front)
    bundle = bundles(head, roots, group, 110)
    own = of_bundle(bundle)
    # each bundle ends at its own height, higher if it is from further up
    hem = hem_at(roots, in_front, -0.245, 0.05)
    hem += (0.035 + 0.045 * ramp(-0.02, 0.09, roots.height)) * own[:, 3]
    locks = evenly(long_locks(head, roots, in_front, hem, -0.02, 0.017), 40)
    locks = in_bundles(locks, bundle, 0.72)
    # some bundles lie over others
    low = ramp(0.05, -0.07, locks[..., 2])
    over = 0.009 * own[:, 2, None] * low
    locks = locks + over[..., None] * unit(locks * (1.0, 1.0, 0.0))
    # adjacent bundles wave at about the same heights, but not alike
    x, y, z = 25.0 * roots.place.T
    phase = 0.7 * (np.sin(x + 0.7 * z) + np.sin(1.1 * y - 0.6 * x)) + 4.2 * own[:, 0]
    phase += 0.5 * (roots.random[:, 2] - 0.5)
    wide = (0.65 + 0.6 * own[:, 1])[:, None] * low
    locks = waved(locks, 0.0105 * wide, 0.095, phase)
    return style(
        "Long and Wavy",
        70,
        head.shapes(roots, head.pushed_out(locks, 0.003), group),
        "brown",
        children=children(
            30000,
            length_variation=0.3,
            clump=0.45,
            clump_size=30,
            frizz=0.003,
            parting=1.0,
        ),
        presets=("dynamics/natural",),
    )


@recipe
def layered_fringe(head: Head) -> Any:
    roots = head.roots(1700, "scalp")
    x, y, z = roots.place.T
    # a triangle, whose point is behind the forehead
    is_fringe = (np.abs(x) < np.minimum(0.008 - 1.1 * (y + 0.022), 0.06)) & (z > 0.035)
    in_front = before_shoulders(roots)
    group = np.where(is_fringe, 5, parts(roots, 0.0, in_front))
    # three layers: hair from the top ends further up, most of all around the face
    uneven = np.sin(70.0 * x + 2.0) + np.sin(60.0 * y) + 1.2 * (roots.random[:, 1] - 0.5)
    layer = np.digitize(uneven, (-0.3, 0.6))
    hem = hem_at(roots, in_front, -0.215, 0.035) + 0.045 * layer * ramp(-0.01, 0.07, z)
    hem += 0.06 * ramp(-0.045, -0.08, y)
    locks = long_locks(head, roots, in_front, hem, 0.0, 0.016)
    outward = unit(locks * (1.0, 1.0, 0.0))
    locks = locks + 0.012 * ramp(0.7, 1.0, np.linspace(0.0, 1.0, 30))[:, None] * outward
    fringe = np.flatnonzero(is_fringe)
    some = roots.take(fringe)

    def ahead(points: np.ndarray, _roots: Roots, _reached: np.ndarray) -> np.ndarray:
        return toward(5.0 * points[:, 0], -1.0 * ramp(-0.1, -0.08, points[:, 1]), -0.45)

    front = head.combed(
        some,
        ahead,
        0.16,
        30,
        lift=0.15,
        follow=0.6,
        hug=on_skull,
        clearance=in_layers(some, 0.008),
    )
    ends = np.repeat(0.020 + 0.014 * (some.random[:, 0] - 0.5), front.shape[1])
    locks[fringe] = cut(front, lambda p: p[:, 2] - ends + np.minimum(9.0 * p[:, 0] ** 2, 0.02))
    locks = in_bundles(locks, bundles(head, roots, group, 200), 0.45)
    return style(
        "Layered with Fringe",
        80,
        head.shapes(roots, head.pushed_out(locks, 0.003), group),
        "red",
        children=children(
            30000,
            length_variation=0.2,
            clump=0.5,
            clump_size=30,
            frizz=0.003,
            parting=0.9,
        ),
        presets=("dynamics/natural",),
    )


@recipe
def curls(head: Head) -> Any:
    roots = head.roots(1700, "scalp")
    in_front = before_shoulders(roots)
    # hair from near the crown ends further up, so that ends make a round outline
    hem = hem_at(roots, in_front, -0.175, 0.09) + 0.05 * ramp(0.03, 0.1, roots.height)
    locks = evenly(long_locks(head, roots, in_front, hem, -0.03, 0.034, 0.13), 22)
    # locks cross each other
    s = np.linspace(0.0, 1.0, 22)
    turns = 2.0 * np.pi * (s[None, :, None] * 0.9 + roots.random[:, None, 1:])
    locks += 0.014 * ramp(0.15, 0.8, s)[:, None] * (np.sin(turns) * (1.0, 1.0, 0.4))
    return style(
        "Curls",
        90,
        head.shapes(roots, head.pushed_out(locks, 0.0125), parts(roots, -0.03, in_front)),
        "brown",
        modifiers=(clumped(0.8, 0.015), curled(0.0075, 8.0, 0.2, 1.0, 2, apart=0.015)),
        children=children(
            18000, method="single", length_variation=0.15, clump=0.7, clump_size=10, frizz=0.004
        ),
        presets=("dynamics/natural",),
    )


@recipe
def coils(head: Head) -> Any:
    roots = head.roots(1200, "scalp")
    _, y, z = roots.place.T
    before_ear = ramp(0.065, 0.015, z) * ramp(0.005, -0.015, y)
    back = before_ear[:, None] * np.array([0.0, 0.9, 0.3])

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        # each coil wanders by itself, and droops more the further out it is
        wander = 30.0 * reached[:, None] + 2.0 * np.pi * roots.random[:, 1:]
        droop = ramp(0.01, 0.08, reached)[:, None] * np.array([0.0, 0.25, -1.1])
        return unit(points - np.array([0.0, 0.015, 0.0])) + back + droop + 0.2 * np.sin(wander)

    length = (0.075 + 0.045 * roots.random[:, 0]) * (1.0 - 0.6 * before_ear)
    length = length * (1.0 - 0.5 * ramp(-0.02, -0.075, z) - 0.2 * ramp(-0.05, -0.085, y))
    locks = head.combed(roots, flow, length, 15, lift=0.7, follow=0.6, clearance=layers(0.025, 0.5))
    return style(
        "Coils",
        100,
        head.shapes(roots, head.pushed_out(locks, 0.005), np.arange(len(locks), dtype=np.int32)),
        "black",
        modifiers=(curled(0.0040, 13.0, 0.02, 1.0, 3),),
        children=children(
            18000,
            method="single",
            length_variation=0.05,
            clump=0.92,
            clump_along=(0.0, 0.9, 1.0, 1.0, 1.0),
            clump_size=4,
            frizz=0.001,
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def afro(head: Head) -> Any:
    roots = head.roots(2600, "scalp")
    _, y, z = roots.place.T
    before_ear = ramp(0.065, 0.015, z) * ramp(0.005, -0.015, y)
    back = before_ear[:, None] * np.array([0.0, 0.9, 0.3])

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        # each lock wanders, so that none is a spike
        wander = 40.0 * reached[:, None] + 2.0 * np.pi * roots.random[:, 1:]
        return unit(points - np.array([0.0, 0.015, 0.0])) + back + 0.55 * np.sin(wander)

    locks = head.combed(
        roots,
        flow,
        0.12 - 0.095 * before_ear,
        16,
        lift=0.6,
        follow=0.7,
        clearance=lambda s: 0.6 * s,
    )
    middle = np.array([0.0, 0.022, 0.035])
    # rounder than the head, less deep below its middle; tufts stand out of it and hang back
    tuft = 0.012 * np.sin(90.0 * roots.place).sum(axis=1) + 0.09 * (roots.random[:, 0] - 0.6)

    def far(p: np.ndarray) -> np.ndarray:
        below = np.where(p[:, 2] < middle[2], 0.118, 0.13)
        axes = np.stack([0 * below + 0.132, 0 * below + 0.136, below], axis=1)
        return np.linalg.norm((p - middle) / axes, axis=1)

    reach = np.repeat(np.maximum(1.0 + tuft, far(roots.place) + 0.12), 16)
    locks = head.pushed_out(cut(locks, lambda p: reach - far(p)), 0.005)
    return style(
        "Afro",
        110,
        head.shapes(roots, locks),
        "black",
        modifiers=(curled(0.0036, 13.0, 0.06, 1.0, 3),),
        children=children(
            18000, method="single", length_variation=0.15, clump=0.8, clump_size=7, frizz=0.03
        ),
        presets=("dynamics/stiff",),
    )


KNOT = np.array([0.0, 0.128, 0.045])


def section(roots: Roots, knot: np.ndarray) -> np.ndarray:
    """The place of each lock in the round cross-section of a tail, (n, 2) up to 1: as its root
    around the knot."""
    seen = roots.place - knot
    angle = np.arctan2(seen[:, 2], seen[:, 0])
    far = np.sqrt(np.argsort(np.argsort(np.linalg.norm(seen, axis=1))) / len(seen))
    return np.stack([far * np.cos(angle), far * np.sin(angle)], axis=1)


def tube(line: np.ndarray, radius: np.ndarray, place: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Paths (n, m, 3) along a line (m, 3), at places (n, 2) of its section.

    Args:
        across: unit vector that is across the line everywhere, the first axis of the section.
    """
    ahead = unit(np.gradient(line, axis=0))
    other = unit(np.cross(ahead, across))
    return (
        line
        + place[:, :1, None] * radius[None, :, None] * across
        + place[:, 1:, None] * (radius[:, None] * other)[None]
    )


def loose_hairs(head: Head, roots: Roots, cv_count: int) -> np.ndarray:
    """Short fine locks that no tie holds, as at the neck."""

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        wander = 3.0 * np.pi * (roots.random[:, 3] + reached / 0.035)
        return toward(0.6 * np.sin(wander), 0.3 * np.cos(wander), -1.0)

    length = 0.012 + 0.02 * roots.random[:, 0]
    return head.combed(
        roots, flow, length, cv_count, lift=0.25, clearance=lambda s: 0.0005 + 0.12 * s
    )


@recipe
def ponytail(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    x, _, z = roots.place.T
    place = section(roots, KNOT)
    s = np.linspace(0.0, 1.0, 30)
    # out of the tie, down in an arc, and at the end a little back again
    turn = np.radians(25.0) - np.radians(118.0) * ramp(0.0, 0.45, s)
    turn = turn + np.radians(30.0) * ramp(0.6, 1.0, s)
    step = 0.30 / (len(s) - 1)
    walked = np.stack([0 * s, np.cos(turn), np.sin(turn)], axis=1) * step
    line = KNOT + np.concatenate([np.zeros((1, 3)), np.cumsum(walked[:-1], axis=0)])
    # it swells after the tie and tapers to a point
    radius = 0.0075 + 0.024 * ramp(0.02, 0.4, s) - 0.022 * ramp(0.45, 1.0, s)
    tail = tube(line, radius, place, np.array([1.0, 0.0, 0.0]))
    # strands of different lengths, which wave and stray more towards their tips
    phase = 2.0 * np.pi * roots.random[:, None, 1:]
    waves = np.sin(2.0 * np.pi * 1.4 * s[None, :, None] + 0.25 * phase) + 0.6 * np.sin(
        2.0 * np.pi * 2.1 * s[None, :, None] + phase
    )
    tail = tail + 0.0045 * ramp(0.1, 0.9, s)[None, :, None] * waves
    tail = shortened(tail, (len(s) - 1) * (1.0 - 0.45 * roots.random[:, 0] ** 1.6))
    # a lock from below the tie is wound around it
    below = np.argsort(np.linalg.norm(roots.place - (KNOT - [0.0, 0.02, 0.03]), axis=1))[:26]
    axis = walked[0] / step
    other = np.cross(axis, [1.0, 0.0, 0.0])
    along = np.linspace(0.0, 1.0, len(s))
    angle = -0.5 * np.pi + 2.0 * np.pi * 2.3 * along
    ring = np.cos(angle)[:, None] * [1.0, 0.0, 0.0] - np.sin(angle)[:, None] * other
    rise = 0.001 + 0.009 * roots.random[below, 2][:, None] + 0.002 * along
    tail[below] = KNOT + rise[..., None] * axis + 0.0105 * ring
    drawn = head.gathered(roots, tail[:, 0], 20)
    locks = evenly(np.concatenate([drawn[:, :-1], tail], axis=1), 40)
    # loose hairs beside the neck would look like an earring from the front
    at_edge = (z < -0.045) & (np.abs(x) < 0.024)
    is_loose = at_edge & (roots.random[:, 3] < 0.07)
    locks[is_loose] = loose_hairs(head, roots.take(np.flatnonzero(is_loose)), 40)
    group = np.zeros(len(locks), np.int32)
    group[below], group[is_loose] = 1, 2
    return style(
        "Ponytail",
        120,
        head.shapes(roots, head.pushed_out(locks), group),
        "blond",
        children=children(
            28000, length_variation=0.2, clump=0.4, clump_size=30, frizz=0.0015, parting=3.0
        ),
        presets=("dynamics/natural",),
    )


@recipe
def bun(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    knot = np.array([0.0, 0.118, 0.062])
    out = unit(np.array([0.0, 0.9, 0.45]))
    one, other = np.array([1.0, 0.0, 0.0]), unit(np.cross(out, [1.0, 0.0, 0.0]))
    place = section(roots, knot)
    angle = np.arctan2(place[:, 1], place[:, 0])[:, None]
    far = np.linalg.norm(place, axis=1)[:, None]
    s = np.linspace(0.0, 1.0, 44)[None]
    wound = angle + 2.0 * np.pi * 1.6 * s
    # around a ring, and around the ring's own core as a rope is twisted
    core = 2.0 * np.pi * (0.9 * s) + 6.0 * far + angle
    ring = 0.006 + 0.02 * ramp(0.0, 0.2, s)
    thick = (0.004 + 0.014 * ramp(0.0, 0.2, s)) * np.sqrt(0.15 + 0.85 * far)
    away = ring + thick * np.cos(core)
    height = 0.012 + thick * np.sin(core)
    knots = (
        knot
        + away[..., None] * (np.cos(wound)[..., None] * one + np.sin(wound)[..., None] * other)
        + height[..., None] * out
    )
    drawn = head.gathered(roots, knots[:, 0], 20)
    locks = evenly(np.concatenate([drawn[:, :-1], knots], axis=1), 48)
    return style(
        "Bun",
        130,
        head.shapes(roots, head.pushed_out(locks)),
        "brown",
        children=children(
            26000, length_variation=0.03, clump=0.3, clump_size=40, frizz=0.0012, parting=3.0
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def braid(head: Head) -> Any:
    roots = head.roots(1800, "scalp")
    knot = np.array([0.0, 0.112, -0.03])
    group = np.digitize(roots.place[:, 0], (-0.028, 0.028))
    cv_count, length = 48, 0.2
    s = np.linspace(0.0, 1.0, cv_count)
    line = knot + np.stack([0 * s, 0.02 * ramp(0, 0.2, s) + 0.0 * s, -length * s], axis=1)
    for _ in range(3):  # down the neck and over the back
        distance, outward = head.away(line)
        line = line + np.maximum(0.024 - distance, 0.0)[:, None] * outward
    phase = 2.0 * np.pi * length / 0.062 * s
    narrow = 1.0 - 0.35 * s
    tied = 1.0 - 0.75 * np.exp(-(((s - 0.88) / 0.025) ** 2))
    paths = np.empty((len(roots.place), cv_count, 3))
    for part in range(3):
        of_part = np.flatnonzero(group == part)
        shift = phase + 2.0 * np.pi * part / 3.0
        is_woven = ramp(0.0, 0.08, s) * ramp(0.9, 0.86, s)
        center = line + (0.0155 * narrow * is_woven * np.sin(shift))[:, None] * [1.0, 0.0, 0.0]
        center = center + (0.0085 * narrow * is_woven * np.sin(2.0 * shift))[:, None] * [0, 1.0, 0]
        place = section(roots.take(of_part), knot)
        radius = 0.0135 * narrow * tied
        paths[of_part] = tube(center, radius, place, np.array([1.0, 0.0, 0.0]))
    drawn = head.gathered(roots, paths[:, 0], 20, 0.005)
    locks = evenly(np.concatenate([drawn[:, :-1], paths], axis=1), 72)
    return style(
        "Braid",
        140,
        head.shapes(roots, head.pushed_out(locks), group.astype(np.int32)),
        "brown",
        children=children(
            24000, length_variation=0.06, clump=0.2, clump_size=40, frizz=0.0012, parting=3.0
        ),
        guides={"cv_count": 32},
        presets=("dynamics/natural",),
    )


#: of box braids: width of cells, thickness of a plait's strands, length of a plait's turn [m]
CELL, THICK, PLAIT = 0.024, 0.003, 0.026


def braid_lines(head: Head, bases: Roots, cv_count: int) -> np.ndarray:
    """The lines of braids from these roots, (n, cv_count, 3), which fall aside from a parting, and
    back."""
    x, y, z = bases.place.T
    length = 0.225 - 0.03 * ramp(0.02, 0.08, z) + 0.035 * ramp(-0.045, -0.06, y)
    falls = parted(0.0, 0.45)
    # braids at the forehead and on the parting go back first, so that none falls over the eyes
    first = 4.5 * ramp(-0.01, -0.05, y) + 4.0 * ramp(0.016, 0.004, np.abs(x))

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        back = first * ramp(-0.03, 0.03, points[:, 2])
        return unit(falls(points, roots, reached)) + toward(0.0, back, 0.0)

    lines = head.combed(
        bases,
        flow,
        length,
        32,
        lift=0.3,
        follow=0.6,
        hug=on_skull,
        clearance=lambda s: 0.003 + np.minimum(0.25 * s, 0.016),
        over_ears=True,
    )
    return evenly(head.settled(bases, lines, 1.2, over_ears=True, radius_root=0.006), cv_count)


def plaited(line: np.ndarray, strand: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Locks (n, m, 3) along a line (m, 3), in these strands of a plait (n,), 0 to 2.

    Args:
        place: (n, 2) in the strand's own round section, up to 1.
    """
    s = np.linspace(0.0, 1.0, len(line))
    ahead = unit(np.gradient(line, axis=0))
    out = unit(line - np.array([0.0, 0.015, 0.0]))
    across = unit(np.cross(ahead, out))
    out = np.cross(across, ahead)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    turn = 2.0 * np.pi * (length / PLAIT * s + strand[:, None] / 3.0)
    size = THICK * (1.0 - 0.3 * s) * ramp(-0.02, 0.05, s)
    aside = size * (1.25 * np.sin(turn) + 0.75 * place[:, :1])
    height = 0.7 * size * (np.sin(2.0 * turn) + place[:, 1:])
    return line + aside[..., None] * across + height[..., None] * out


@recipe
def box_braids(head: Head) -> Any:
    cells = parted_in_cells(head, CELL)
    roots, count = cells.roots, cells.cell.max() + 1
    sums = np.zeros((count, 3))
    np.add.at(sums, cells.cell, roots.place)
    bases = head.roots_near(sums / np.bincount(cells.cell)[:, None], 3)
    lines = braid_lines(head, bases, 54)
    angle, far = 2.0 * np.pi * roots.random[:, 1], np.sqrt(roots.random[:, 2])
    place = np.stack([far * np.cos(angle), far * np.sin(angle)], axis=1)
    gather = 6
    locks = np.empty((len(roots.place), gather + lines.shape[1], 3))
    for braid, line in enumerate(lines):
        own = cells.cell == braid
        locks[own, gather:] = plaited(line, cells.section[own], place[own])
    # hair leans to the border of its cell, and is then drawn over the skin to its braid
    locks[:, 0] = roots.place
    part = np.linspace(0.0, 1.0, gather)[None, :-1, None]
    locks[:, 1:gather] = (1.0 - part) * cells.border[:, None] + part * locks[:, gather, None]
    reached = np.zeros(len(locks))
    for cv in range(1, gather + 1):
        reached += np.linalg.norm(locks[:, cv] - locks[:, cv - 1], axis=1)
        distance, outward = head.away(locks[:, cv])
        lacking = np.minimum(0.0004 + 0.15 * reached, THICK) - distance
        locks[:, cv] += lacking[:, None] * outward
    return style(
        "Box Braids",
        145,
        head.shapes(
            roots, head.pushed_out(locks, 0.001), (3 * cells.cell + cells.section).astype(np.int32)
        ),
        "black",
        children=children(
            22000,
            length_variation=0.02,
            clump=0.7,
            clump_along=(0.0, 1.0, 1.0, 1.0, 1.0),
            clump_size=40,
            frizz=0.001,
            baby_hair=0.3,
            parting=3.0,
        ),
        presets=("dynamics/natural",),
    )


@recipe
def undercut(head: Head) -> Any:
    roots = head.roots(1900, "scalp")
    _, y, z = roots.place.T
    is_top = z - 0.25 * np.maximum(y - 0.06, 0.0) > 0.062
    # the further back hair grows, the shorter it is: its ends lie on the back of the head
    long = 0.105 - 0.05 * ramp(-0.03, 0.08, y) + 0.022 * (roots.random[:, 0] - 0.5)
    length = np.where(is_top, long, 0.0032)
    sides = head.combed(roots, whorl, length, 16, lift=0.6, clearance=lambda s: 0.3 * s)
    over = swept(-0.045, 0.75)

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        behind = ramp(0.035, 0.085, points[:, 1])[:, None]
        return (1.0 - behind) * unit(over(points, roots, reached)) + behind * [0.0, 0.25, -1.0]

    top = head.combed(
        roots,
        flow,
        length,
        16,
        lift=0.45,
        follow=0.7,
        hug=on_skull,
        clearance=lambda s: 0.002 + 0.2 * np.minimum(s, 0.03),
    )
    locks = np.where(is_top[:, None, None], top, sides)
    return style(
        "Undercut",
        150,
        head.shapes(roots, locks, is_top.astype(np.int32)),
        "brown",
        children=children(
            42000, length_variation=0.2, clump=0.15, clump_size=20, frizz=0.006, parting=0.9
        ),
        presets=("dynamics/stiff",),
    )


def over_lip(place: np.ndarray) -> np.ndarray:
    """Which of these places (n, 3) are on the upper lip."""
    x, y, z = place.T
    return (np.abs(x) < 0.03) & (z > -0.066) & (y < -0.08)


def beard_flow(points: np.ndarray, roots: Roots, _reached: np.ndarray) -> np.ndarray:
    """Down and a little ahead, over the lip to both sides."""
    x, y, _ = roots.place.T
    on_lip = over_lip(roots.place)
    aside = np.where(on_lip, 1.2 * np.sign(x + 1e-9), 3.0 * x)
    ahead = np.where(on_lip, -0.1, -0.35 * ramp(-0.03, -0.09, y))
    return toward(aside, ahead, -0.9)


def face_hair(head: Head, kind: str, **values: Any) -> Any:
    """Brows or lashes, as the built-in head has them, with other values of `FaceHair`."""
    growth = addon_module("groom.face_hair")
    strands = getattr(growth, f"grow_{kind}")(
        head.surface, head.weights[kind], growth.FaceHair(**values)
    )
    return addon_module("strands.rooted_shapes").RootedShapes.of(strands, head.surface)


@recipe
def brows(head: Head) -> Any:
    return style(
        "Brows",
        200,
        face_hair(head, "brows", brow_count=1500, brow_length=0.009, cv_count=8),
        "brown",
        mask="brows",
        children={"method": "none"},
        presets=("dynamics/stiff",),
    )


@recipe
def lashes(head: Head) -> Any:
    return style(
        "Lashes",
        205,
        face_hair(head, "lashes", lash_count=600, upper_lash=0.012, lower_lash=0.006, cv_count=8),
        "black",
        mask="lashes",
        children={"method": "none"},
        presets=("dynamics/stiff",),
    )


@recipe
def stubble(head: Head) -> Any:
    roots = head.roots(900, "beard")
    locks = head.combed(roots, beard_flow, 0.0024, 5, lift=0.5, clearance=lambda s: 0.25 * s)
    return style(
        "Stubble",
        210,
        head.shapes(roots, locks),
        "brown",
        mask="beard",
        children=children(12000, length_variation=0.4, clump=0.0, frizz=0.02, scatter=0.6),
        presets=("dynamics/stiff",),
    )


@recipe
def full_beard(head: Head) -> Any:
    roots = head.roots(1300, "beard")
    _, y, z = roots.place.T
    length = 0.012 + 0.03 * ramp(-0.04, -0.11, z) * ramp(-0.01, -0.07, y)
    length = np.where(over_lip(roots.place), 0.017, length) * (0.8 + 0.3 * roots.random[:, 0])
    locks = head.combed(
        roots, beard_flow, length, 10, lift=0.4, follow=0.6, clearance=lambda s: 0.0005 + 0.25 * s
    )
    return style(
        "Full Beard",
        220,
        head.shapes(roots, locks),
        "brown",
        mask="beard",
        children=children(
            18000, length_variation=0.35, clump=0.4, clump_size=12, frizz=0.03, scatter=0.4
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def moustache(head: Head) -> Any:
    def density(place: np.ndarray) -> np.ndarray:
        return head.weights["beard"] * over_lip(place)

    roots = head.roots(3000, density)
    x = roots.place[:, 0]

    def flow(points: np.ndarray, roots: Roots, reached: np.ndarray) -> np.ndarray:
        side = np.sign(roots.place[:, 0] + 1e-9)
        # down over the lip, then aside, and up again at the ends
        turned = ramp(0.002, 0.016, reached)
        return toward(side * (0.5 + 0.9 * turned), -0.25 + 0.35 * turned, -0.8 + 1.0 * turned)

    length = (0.013 + 0.016 * ramp(0.008, 0.028, np.abs(x))) * (0.8 + 0.2 * roots.random[:, 0])
    locks = head.combed(
        roots, flow, length, 12, lift=0.35, follow=0.7, clearance=lambda s: 0.0005 + 0.18 * s
    )
    return style(
        "Moustache",
        230,
        head.shapes(roots, locks, (x > 0.0).astype(np.int32)),
        "brown",
        mask="beard",
        children={"method": "none"},
        presets=("dynamics/stiff",),
    )


def fur(length: float, lift: float, **values: Any) -> dict[str, Any]:
    """Settings of growth on any mesh; the length is for a mesh of a head's size."""
    return {"method": "normals", "cv_count": 8, "length": length, "lift": lift} | values


@recipe
def short_coat(_head: Head) -> Any:
    return style(
        "Short Coat",
        310,
        None,
        "brown",
        grow=fur(0.011, 0.28, strand_count=4000, length_variation=0.3),
        children=children(
            50000, length_variation=0.35, clump=0.15, clump_size=8, frizz=0.02, scatter=0.8
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def shaggy_coat(_head: Head) -> Any:
    return style(
        "Shaggy Coat",
        320,
        None,
        "grey",
        grow=fur(0.05, 0.07, cv_count=12, strand_count=3000, length_variation=0.4),
        children=children(
            40000, length_variation=0.3, clump=0.8, clump_size=40, frizz=0.06, frizz_length=0.45
        ),
        presets=("dynamics/natural",),
    )
