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
    cut,
    resampled,
    shortened,
    smoothstep,
    tangent_to_skin,
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
    radius: float,
    turns: float,
    start: float,
    random_offset: float,
    subdivision: int,
    guide_distance: float = 0.0,
) -> Any:
    """Blender's Curl node.

    Args:
        start: how far along a guide curls begin, 0 to 1.
        random_offset: how much the places of turns vary between guides, 0 to 1.
        subdivision: how often each segment is halved first.
        guide_distance: guides nearer to each other than this curl as one [m].
    """
    inputs = {
        "Radius": radius,
        "Frequency": turns,
        "Subdivision": subdivision,
        "Curl Start": start,
        "Random Offset": random_offset,
        "Guide Distance": guide_distance,
    }
    return "Curl Hair Curves", inputs


def clumped(factor: float, guide_distance: float) -> Any:
    """Blender's Clump node.

    Args:
        factor: how much guides are drawn together, 0 to 1.
        guide_distance: guides nearer to each other than this clump together [m].
    """
    inputs = {
        "Factor": factor,
        "Shape": 0.45,
        "Preserve Length": True,
        "Guide Distance": guide_distance,
    }
    return "Clump Hair Curves", inputs


def vectors(x: Any, y: Any, z: Any) -> np.ndarray:
    """Directions (n, 3) of components that are numbers or (n,)."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=1).astype(float)


def whorl(points: np.ndarray, roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
    """As hair grows: away from the crown, and a little around it."""
    away = tangent_to_skin(roots.position - CROWN, roots)
    return unit(away + 0.3 * np.cross(roots.normal, away))


@recipe
def buzz_cut(head: Head) -> Any:
    roots = head.roots(1200, "scalp")
    length = 0.0045 + 0.0015 * smoothstep(0.0, 0.06, roots.height)
    guides = head.combed(roots, whorl, length, 6, lift=0.65, clearance=lambda s: 0.3 * s)
    return style(
        "Buzz Cut",
        10,
        head.shapes(roots, guides),
        "brown",
        children=children(45000, length_variation=0.25, clump=0.0, frizz=0.01, scatter=0.5),
        presets=("dynamics/stiff",),
    )


@recipe
def crop_fade(head: Head) -> Any:
    roots = head.roots(2000, "scalp")
    _, y, z = roots.position.T
    top = smoothstep(0.056, 0.082, z + 0.012 * smoothstep(0.0, 0.09, y))
    # from stubble at ears and neck, over clipped hair, to hair that is cut with scissors
    faded = z - 0.02 * smoothstep(0.075, 0.02, y)
    short_length = (
        0.0006 + 0.0024 * smoothstep(-0.065, 0.02, faded) + 0.008 * smoothstep(0.005, 0.062, faded)
    )
    bundle = bundles(head, roots, (top > 0.4).astype(int), 420)
    bundle_random = random_per_bundle(bundle)
    top_length = 0.025 + 0.021 * smoothstep(0.05, -0.06, y) + 0.018 * (bundle_random[:, 0] - 0.5)
    length = short_length + top * (top_length - short_length)
    length = length * (0.85 + 0.3 * roots.random[:, 0])
    front = top * smoothstep(0.075, 0.035, y)

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        sideways = 0.35 + 1.3 * (bundle_random[:, 1] - 0.5)
        forward = unit(vectors(sideways, -1.0, 0.25 - 1.0 * smoothstep(0.005, 0.025, arc_length)))
        return (1.0 - front)[:, None] * whorl(points, roots, arc_length) + front[:, None] * forward

    guides = head.combed(
        roots,
        flow,
        length,
        9,
        lift=0.5 + 0.25 * top * bundle_random[:, 2],
        flow_alignment=0.5,
        skin_attraction=skull_attraction,
        clearance=lambda s: (
            0.3 * np.minimum(s, 0.03) * (1.0 - top * (0.2 + 0.5 * bundle_random[:, 3]))
        ),
    )
    guides = np.where((top > 0.4)[:, None, None], in_bundles(guides, bundle, 0.85), guides)
    return style(
        "Crop with Fade",
        20,
        head.shapes(roots, head.pushed_out(guides, 0.0008)),
        "brown",
        children=children(
            50000, length_variation=0.3, clump=0.25, clump_size=8, frizz=0.015, scatter=0.2
        ),
        shading={"melanin": 0.76},
        presets=("dynamics/stiff",),
    )


def skull_attraction(points: np.ndarray) -> np.ndarray:
    """How strongly hair lies on the head; further down it hangs freely."""
    return 1.2 * smoothstep(-0.02, 0.04, points[:, 2])


def swept(parting_x: float, back: float) -> Any:
    """Hair that is combed from a parting to both sides, and back."""

    def flow(points: np.ndarray, roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
        z = points[:, 2]
        side = np.clip((roots.position[:, 0] - parting_x) / parting_width(roots), -1.0, 1.0)
        on_top = smoothstep(0.03, 0.085, z)
        return vectors(
            side * on_top,
            back * on_top + 0.55 * (1 - on_top),
            0.05 - 0.9 * (1 - on_top) * smoothstep(0.09, 0.0, z),
        )

    return flow


def short_at_ears(roots: Roots) -> np.ndarray:
    """A factor of the length: sideburns and hair right above the ears do not cover them."""
    _, y, z = roots.position.T
    above_ear = (
        smoothstep(-0.045, -0.03, y) * smoothstep(0.05, 0.035, y) * smoothstep(0.045, 0.022, z)
    )
    return 1.0 - 0.8 * above_ear


def parting_width(roots: Roots) -> np.ndarray:
    """How wide a parting is: a line at the front that opens towards the crown [m]."""
    return 0.0004 + 0.045 * smoothstep(0.0, 0.07, roots.position[:, 1])


def swept_over(parting_x: float, bundle: np.ndarray) -> Any:
    """Hair that is combed from a parting over the top and back, and down at the sides; the guides
    of a bundle (n,) vary alike."""
    bundle_random = random_per_bundle(bundle)

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        side, behind, y_root = (
            side_of(roots, parting_x),
            smoothstep(0.05, 0.1, y),
            roots.position[:, 1],
        )
        on_top = (
            smoothstep(0.055, 0.095, z)
            * smoothstep(0.075, 0.05, np.abs(x))
            * smoothstep(0.1, 0.07, y)
        )
        over = on_top * (0.9 + 0.5 * (bundle_random[:, 1] - 0.5))
        back = 0.4 + 0.3 * (bundle_random[:, 2] - 0.5) - 0.4 * behind
        back = back + 0.7 * smoothstep(-0.04, -0.08, y_root) + 0.5 * smoothstep(0.0, 0.06, y_root)
        down = (1.0 - on_top) * np.maximum(smoothstep(0.045, 0.07, np.abs(x)), behind)
        return vectors(side * over, back, 0.1 * on_top - 1.2 * down)

    return flow


@recipe
def side_part(head: Head) -> Any:
    parting_x = -0.036
    roots = head.roots(1700, "scalp")
    x, y, z = roots.position.T
    is_over = x > parting_x
    bundle = bundles(head, roots, is_over.astype(int), 260)
    bundle_random = random_per_bundle(bundle)
    top = smoothstep(0.055, 0.095, z) * np.where(is_over, 1.0, 0.3)
    length = 0.006 + 0.008 * smoothstep(-0.075, 0.0, z) + 0.010 * smoothstep(-0.01, 0.07, z)
    shorter = 0.02 * smoothstep(0.02, 0.09, y) + 0.025 * smoothstep(0.0, 0.06, x)
    length = length + top * (0.062 + 0.02 * (bundle_random[:, 0] - 0.5) - shorter)
    length = length * short_at_ears(roots)
    # the wave at the front stands up first
    rise = top * smoothstep(0.0, -0.07, y)
    guides = head.combed(
        roots,
        swept_over(parting_x, bundle),
        length,
        14,
        lift=0.2 + 0.2 * top + 0.25 * rise,
        flow_alignment=0.7,
        skin_attraction=skull_attraction,
        clearance=lambda s: 0.001 + (0.12 + 0.28 * top + 0.15 * rise) * np.minimum(s, 0.03),
    )
    guides = np.where((top > 0.2)[:, None, None], in_bundles(guides, bundle, 0.4), guides)
    return style(
        "Side Part",
        30,
        head.shapes(roots, head.pushed_out(guides, 0.001), is_over.astype(np.int32)),
        "brown",
        children=children(
            36000, length_variation=0.2, clump=0.35, clump_size=16, frizz=0.006, parting=0.9
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def slicked_back(head: Head) -> Any:
    roots = head.roots(1500, "scalp")

    def flow(points: np.ndarray, _roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        # over the ears it goes straight back
        down = (
            -0.05
            - 1.3 * smoothstep(0.04, 0.1, y)
            - 0.5 * smoothstep(0.06, 0.0, z) * smoothstep(0.03, 0.05, y)
        )
        inward = -0.25 * np.sign(x) * smoothstep(0.0, 0.09, y)
        return vectors(inward, 1.0 - 0.75 * smoothstep(0.04, 0.1, y), down)

    length = (0.05 + 0.07 * smoothstep(0.0, 0.08, roots.height)) * short_at_ears(roots)
    guides = head.combed(
        roots,
        flow,
        length,
        16,
        lift=0.25,
        flow_alignment=0.8,
        skin_attraction=lambda p: 1.2 * smoothstep(-0.12, -0.07, p[:, 2]),
        clearance=lambda s: 0.0015 + 0.09 * np.minimum(s, 0.07),
    )
    return style(
        "Slicked Back",
        40,
        head.shapes(roots, guides),
        "black",
        children=children(30000, length_variation=0.25, clump=0.5, clump_size=25, frizz=0.004),
        presets=("dynamics/stiff",),
    )


def side_of(roots: Roots, parting_x: float) -> np.ndarray:
    """To which side of a parting each guide goes, -1 to 1; none goes along the line."""
    offset = roots.position[:, 0] - parting_x
    offset = np.copysign(np.maximum(np.abs(offset), 0.001), offset)
    return np.clip(offset / parting_width(roots), -1.0, 1.0)


def parted(parting_x: float, back: float) -> Any:
    """Hair that falls to both sides of a parting, away from the face."""

    def flow(points: np.ndarray, roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        side = side_of(roots, parting_x)
        on_top = (
            smoothstep(0.05, 0.1, z)
            * smoothstep(0.078, 0.06, np.abs(x))
            * smoothstep(0.115, 0.09, y)
        )
        behind = smoothstep(-0.01, -0.07, y) * smoothstep(-0.16, -0.02, z)
        before_face = smoothstep(0.073, 0.052, np.abs(x)) * smoothstep(-0.03, -0.06, y)
        rear = on_top * smoothstep(0.02, 0.07, roots.position[:, 1])
        return vectors(
            side * (1.1 * on_top + 1.3 * before_face),
            back * on_top + 0.8 * rear + 0.9 * behind,
            -0.25 - 1.4 * (1 - on_top),
        )

    return flow


def side_groups(roots: Roots, parting_x: float) -> np.ndarray:
    """Groups on both sides of a parting: no child lies between them."""
    return (roots.position[:, 0] > parting_x).astype(np.int32)


def parting_groups(
    roots: Roots, parting_x: float, in_front: np.ndarray | bool = False
) -> np.ndarray:
    """Groups on both sides of a parting that ends at the crown, before and behind the shoulders."""
    down_back = (roots.position[:, 1] > 0.055) & ~np.asarray(in_front)
    return np.where(down_back, 4, 2 * side_groups(roots, parting_x) + in_front).astype(np.int32)


def clearance_by_length(
    max_clearance: float, per_length: float = 0.14
) -> Callable[[np.ndarray], np.ndarray]:
    """The distance that hair keeps from the skin: hair from further up lies over the rest."""
    return lambda arc_length: 0.002 + np.minimum(per_length * arc_length, max_clearance)


def layered_clearance(
    roots: Roots, max_clearance: float, full_at: float = 0.08
) -> Callable[[np.ndarray], np.ndarray]:
    """The distance that hair keeps from the skin, in full after a length of `full_at`: hair from
    further up lies over the rest."""
    layer = 0.25 + 0.55 * smoothstep(-0.06, 0.1, roots.height) + 0.2 * roots.random[:, 2]
    return lambda arc_length: 0.002 + max_clearance * layer * np.minimum(arc_length / full_at, 1.0)


def bundles(head: Head, roots: Roots, group: np.ndarray, count: int) -> np.ndarray:
    """The bundle of each guide (n,): hair falls in bundles of adjacent guides.

    Args:
        group: of each guide (n,); groups share no bundle.
        count: of bundles.
    """
    middles = head.roots(count, "scalp", 3).position
    nearest = np.linalg.norm(roots.position[:, None] - middles, axis=2).argmin(axis=1)
    _, bundle = np.unique(group * len(middles) + nearest, return_inverse=True)
    return bundle


def random_per_bundle(bundle: np.ndarray, seed: int = 2) -> np.ndarray:
    """Numbers (n, 4) from 0 to 1 that the guides of a bundle (n,) have in common."""
    return np.random.default_rng(seed).random((bundle.max() + 1, 4))[bundle]


def in_bundles(guides: np.ndarray, bundle: np.ndarray, factor: float) -> np.ndarray:
    """Guides drawn towards the middle of their bundle (n,), more so near their tips.

    Args:
        factor: how much tips are drawn together, 0 to 1.
    """
    sums = np.zeros((bundle.max() + 1, *guides.shape[1:]))
    np.add.at(sums, bundle, guides)
    middle = (sums / np.bincount(bundle)[:, None, None])[bundle]
    pull = factor * smoothstep(0.1, 1.0, np.linspace(0.0, 1.0, guides.shape[1]))
    return guides + pull[None, :, None] * (middle - guides)


@recipe
def bob(head: Head) -> Any:
    roots = head.roots(1600, "scalp")
    falls = parted(-0.022, 0.25)

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        inward = smoothstep(-0.02, -0.08, points[:, 2])[:, None] * unit(points * (1.0, 1.0, 0.0))
        # hair at the forehead goes back first, so that it does not lie on the forehead
        first = smoothstep(-0.02, -0.08, roots.position[:, 1]) * smoothstep(0.06, 0.02, arc_length)
        back = first[:, None] * np.array([0.0, 0.9, 0.8])
        return unit(falls(points, roots, arc_length)) - 0.7 * inward + back

    guides = head.combed(
        roots,
        flow,
        0.30,
        26,
        lift=0.25,
        flow_alignment=0.55,
        skin_attraction=skull_attraction,
        clearance=layered_clearance(roots, 0.016, 0.11),
        over_ears=True,
    )
    ragged = np.repeat(0.012 * roots.random[:, 0], guides.shape[1])
    guides = cut(guides, lambda p: p[:, 2] + 0.1 - ragged + 0.22 * np.minimum(-p[:, 1], 0.06))
    group = parting_groups(roots, -0.022)
    guides = in_bundles(guides, bundles(head, roots, group, 180), 0.25)
    return style(
        "Bob",
        50,
        head.shapes(roots, head.pushed_out(guides, 0.003), group),
        "brown",
        children=children(
            28000, length_variation=0.1, clump=0.5, clump_size=30, frizz=0.004, parting=1.0
        ),
        presets=("dynamics/natural",),
    )


def falls_in_front(roots: Roots) -> np.ndarray:
    """Which guides fall in front of the shoulders instead of behind: adjacent guides alike, with an
    irregular border between both."""
    x, y, z = 55.0 * roots.position.T
    uneven = 0.012 * (np.sin(x + 1.3 * z) + np.sin(0.8 * y - 1.1 * z + 2.0))
    return roots.position[:, 1] + uneven + 0.012 * (roots.random[:, 3] - 0.5) < 0.024


def draped(parting_x: float, in_front: np.ndarray) -> Any:
    """Hair that is parted, falls in towards the neck, and then over the chest if it is `in_front`
    (n,), or else down the back."""
    falls = parted(parting_x, 0.3)

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        low = smoothstep(-0.02, -0.12, z)[:, None]
        # hair from further back lies nearer to the shoulder
        rear = smoothstep(-0.06, 0.02, roots.position[:, 1])
        side = np.where(roots.position[:, 0] > parting_x, 1.0, -1.0)
        front_x = side * (0.045 + 0.03 * roots.random[:, 1] + 0.02 * rear)
        to_x = np.where(in_front, front_x, 0.72 * x)
        to_y = np.where(in_front, 0.05 * rear - 0.065, 0.125)
        aim = vectors(9.0 * (to_x - x), 9.0 * (to_y - y), -1.0)
        return (1.0 - low) * unit(falls(points, roots, arc_length)) + low * unit(aim)

    return flow


def long_guides(
    head: Head,
    roots: Roots,
    in_front: np.ndarray,
    hem: Any,
    parting_x: float = 0.0,
    volume: float = 0.013,
    over: float = 0.1,
) -> Any:
    """Long hair over the shoulders, cut where it comes to this height `hem` (n,) [m]."""
    guides = head.combed(
        roots,
        draped(parting_x, in_front),
        0.42,
        40,
        lift=0.25,
        flow_alignment=0.6,
        skin_attraction=skull_attraction,
        clearance=layered_clearance(roots, volume, over),
        over_ears=True,
    )
    ends = np.repeat(hem, guides.shape[1])
    return resampled(cut(guides, lambda p: p[:, 2] - ends), 30)


def hem_height(roots: Roots, in_front: np.ndarray, height: float, ragged: float) -> np.ndarray:
    """Where guides end: a soft round line, from which single ones hang longer and shorter."""
    line = height - 0.012 * ~in_front + 1.2 * roots.position[:, 0] ** 2
    return line + ragged * (roots.random[:, 0] - 0.35)


@recipe
def long_straight(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    in_front = falls_in_front(roots)
    group = parting_groups(roots, 0.0, in_front)
    guides = long_guides(head, roots, in_front, hem_height(roots, in_front, -0.225, 0.05))
    guides = in_bundles(guides, bundles(head, roots, group, 200), 0.35)
    return style(
        "Long and Straight",
        60,
        head.shapes(roots, head.pushed_out(guides, 0.003), group),
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
    in_front = falls_in_front(roots)
    group = parting_groups(roots, -0.02, in_front)
    bundle = bundles(head, roots, group, 110)
    bundle_random = random_per_bundle(bundle)
    # each bundle ends at its own height, higher if it is from further up
    hem = hem_height(roots, in_front, -0.245, 0.05)
    hem += (0.035 + 0.045 * smoothstep(-0.02, 0.09, roots.height)) * bundle_random[:, 3]
    guides = resampled(long_guides(head, roots, in_front, hem, -0.02, 0.017), 40)
    guides = in_bundles(guides, bundle, 0.72)
    # some bundles lie over others
    low = smoothstep(0.05, -0.07, guides[..., 2])
    over = 0.009 * bundle_random[:, 2, None] * low
    guides = guides + over[..., None] * unit(guides * (1.0, 1.0, 0.0))
    # adjacent bundles wave at about the same heights, but not alike
    x, y, z = 25.0 * roots.position.T
    phase = 0.7 * (np.sin(x + 0.7 * z) + np.sin(1.1 * y - 0.6 * x)) + 4.2 * bundle_random[:, 0]
    phase += 0.5 * (roots.random[:, 2] - 0.5)
    wide = (0.65 + 0.6 * bundle_random[:, 1])[:, None] * low
    guides = waved(guides, 0.0105 * wide, 0.095, phase)
    return style(
        "Long and Wavy",
        70,
        head.shapes(roots, head.pushed_out(guides, 0.003), group),
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
    x, y, z = roots.position.T
    # a triangle, whose point is behind the forehead
    is_fringe = (np.abs(x) < 0.008 - 1.1 * (y + 0.022)) & (z > 0.035)
    in_front = falls_in_front(roots)
    group = np.where(is_fringe, 5, parting_groups(roots, 0.0, in_front))
    # three layers: hair from the top ends further up, most of all around the face
    uneven = np.sin(70.0 * x + 2.0) + np.sin(60.0 * y) + 1.2 * (roots.random[:, 1] - 0.5)
    layer = np.digitize(uneven, (-0.3, 0.6))
    hem = hem_height(roots, in_front, -0.215, 0.035) + 0.045 * layer * smoothstep(-0.01, 0.07, z)
    hem += 0.06 * smoothstep(-0.045, -0.08, y)
    guides = long_guides(head, roots, in_front, hem, 0.0, 0.016)
    outward = unit(guides * (1.0, 1.0, 0.0))
    guides = guides + 0.012 * smoothstep(0.7, 1.0, np.linspace(0.0, 1.0, 30))[:, None] * outward
    fringe = np.flatnonzero(is_fringe)
    fringe_roots = roots.take(fringe)

    def forward_flow(points: np.ndarray, _roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
        return vectors(7.0 * points[:, 0], -1.0 * smoothstep(-0.1, -0.08, points[:, 1]), -0.45)

    front = head.combed(
        fringe_roots,
        forward_flow,
        0.16,
        30,
        lift=0.15,
        flow_alignment=0.6,
        skin_attraction=skull_attraction,
        clearance=layered_clearance(fringe_roots, 0.008),
    )
    ends = np.repeat(0.020 + 0.014 * (fringe_roots.random[:, 0] - 0.5), front.shape[1])
    guides[fringe] = cut(front, lambda p: p[:, 2] - ends + np.minimum(10.0 * p[:, 0] ** 2, 0.02))
    guides = in_bundles(guides, bundles(head, roots, group, 200), 0.45)
    return style(
        "Layered with Fringe",
        80,
        head.shapes(roots, head.pushed_out(guides, 0.003), group),
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
    in_front = falls_in_front(roots)
    # hair from near the crown ends further up, so that ends make a round outline
    hem = hem_height(roots, in_front, -0.175, 0.09) + 0.05 * smoothstep(0.03, 0.1, roots.height)
    guides = resampled(long_guides(head, roots, in_front, hem, -0.03, 0.034, 0.13), 22)
    # guides cross each other
    s = np.linspace(0.0, 1.0, 22)
    turns = 2.0 * np.pi * (s[None, :, None] * 0.9 + roots.random[:, None, 1:])
    guides += 0.014 * smoothstep(0.15, 0.8, s)[:, None] * (np.sin(turns) * (1.0, 1.0, 0.4))
    return style(
        "Curls",
        90,
        head.shapes(roots, head.pushed_out(guides, 0.0125), parting_groups(roots, -0.03, in_front)),
        "brown",
        modifiers=(clumped(0.8, 0.015), curled(0.0075, 8.0, 0.2, 1.0, 2, guide_distance=0.015)),
        children=children(
            18000, method="single", length_variation=0.15, clump=0.7, clump_size=10, frizz=0.004
        ),
        presets=("dynamics/natural",),
    )


@recipe
def coils(head: Head) -> Any:
    roots = head.roots(1200, "scalp")
    _, y, z = roots.position.T
    before_ear = smoothstep(0.065, 0.015, z) * smoothstep(0.005, -0.015, y)
    back = before_ear[:, None] * np.array([0.0, 0.9, 0.3])

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        # each coil wanders by itself, and droops more the further out it is
        wander = 30.0 * arc_length[:, None] + 2.0 * np.pi * roots.random[:, 1:]
        droop = smoothstep(0.01, 0.08, arc_length)[:, None] * np.array([0.0, 0.25, -1.1])
        return unit(points - np.array([0.0, 0.015, 0.0])) + back + droop + 0.2 * np.sin(wander)

    length = (0.075 + 0.045 * roots.random[:, 0]) * (1.0 - 0.6 * before_ear)
    length = length * (
        1.0 - 0.5 * smoothstep(-0.02, -0.075, z) - 0.2 * smoothstep(-0.05, -0.085, y)
    )
    guides = head.combed(
        roots,
        flow,
        length,
        15,
        lift=0.7,
        flow_alignment=0.6,
        clearance=clearance_by_length(0.025, 0.5),
    )
    return style(
        "Coils",
        100,
        head.shapes(roots, head.pushed_out(guides, 0.005), np.arange(len(guides), dtype=np.int32)),
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
    _, y, z = roots.position.T
    before_ear = smoothstep(0.065, 0.015, z) * smoothstep(0.005, -0.015, y)
    back = before_ear[:, None] * np.array([0.0, 0.9, 0.3])

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        # each guide wanders, so that none is a spike
        wander = 40.0 * arc_length[:, None] + 2.0 * np.pi * roots.random[:, 1:]
        return unit(points - np.array([0.0, 0.015, 0.0])) + back + 0.55 * np.sin(wander)

    guides = head.combed(
        roots,
        flow,
        0.12 - 0.095 * before_ear,
        16,
        lift=0.6,
        flow_alignment=0.7,
        clearance=lambda s: 0.6 * s,
    )
    middle = np.array([0.0, 0.022, 0.035])
    # rounder than the head, less deep below its middle; tufts stand out of it and hang back
    tuft = 0.012 * np.sin(90.0 * roots.position).sum(axis=1) + 0.09 * (roots.random[:, 0] - 0.6)

    def relative_radius(p: np.ndarray) -> np.ndarray:
        below = np.where(p[:, 2] < middle[2], 0.118, 0.13)
        axes = np.stack([0 * below + 0.132, 0 * below + 0.136, below], axis=1)
        return np.linalg.norm((p - middle) / axes, axis=1)

    reach = np.repeat(np.maximum(1.0 + tuft, relative_radius(roots.position) + 0.12), 16)
    guides = head.pushed_out(cut(guides, lambda p: reach - relative_radius(p)), 0.005)
    return style(
        "Afro",
        110,
        head.shapes(roots, guides),
        "black",
        modifiers=(curled(0.0036, 13.0, 0.06, 1.0, 3),),
        children=children(
            18000, method="single", length_variation=0.15, clump=0.8, clump_size=7, frizz=0.03
        ),
        presets=("dynamics/stiff",),
    )


KNOT = np.array([0.0, 0.128, 0.045])


def cross_section(roots: Roots, knot: np.ndarray) -> np.ndarray:
    """The position of each guide in the round cross-section of a tail, (n, 2) up to 1: that of its
    root around the knot."""
    offset = roots.position - knot
    angle = np.arctan2(offset[:, 2], offset[:, 0])
    radius = np.sqrt(np.argsort(np.argsort(np.linalg.norm(offset, axis=1))) / len(offset))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def tube(
    line: np.ndarray, radius: np.ndarray, section: np.ndarray, first_axis: np.ndarray
) -> np.ndarray:
    """Paths (n, m, 3) along a line (m, 3), at positions (n, 2) in its cross-section.

    Args:
        first_axis: unit vector that is across the line everywhere, the first axis of the section.
    """
    tangent = unit(np.gradient(line, axis=0))
    second_axis = unit(np.cross(tangent, first_axis))
    return (
        line
        + section[:, :1, None] * radius[None, :, None] * first_axis
        + section[:, 1:, None] * (radius[:, None] * second_axis)[None]
    )


def loose_hairs(head: Head, roots: Roots, cv_count: int) -> np.ndarray:
    """Short fine guides that no tie holds, as at the neck."""

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        wander = 3.0 * np.pi * (roots.random[:, 3] + arc_length / 0.035)
        return vectors(0.6 * np.sin(wander), 0.3 * np.cos(wander), -1.0)

    length = 0.012 + 0.02 * roots.random[:, 0]
    return head.combed(
        roots, flow, length, cv_count, lift=0.25, clearance=lambda s: 0.0005 + 0.12 * s
    )


@recipe
def ponytail(head: Head) -> Any:
    roots = head.roots(1500, "scalp")
    x, _, z = roots.position.T
    section = cross_section(roots, KNOT)
    s = np.linspace(0.0, 1.0, 30)
    # out of the tie, down in an arc, and at the end a little back again
    turn = np.radians(25.0) - np.radians(118.0) * smoothstep(0.0, 0.45, s)
    turn = turn + np.radians(30.0) * smoothstep(0.6, 1.0, s)
    step = 0.30 / (len(s) - 1)
    steps = np.stack([0 * s, np.cos(turn), np.sin(turn)], axis=1) * step
    line = KNOT + np.concatenate([np.zeros((1, 3)), np.cumsum(steps[:-1], axis=0)])
    # it swells after the tie and tapers to a point
    radius = 0.0075 + 0.024 * smoothstep(0.02, 0.4, s) - 0.022 * smoothstep(0.45, 1.0, s)
    tail = tube(line, radius, section, np.array([1.0, 0.0, 0.0]))
    # strands of different lengths, which wave and stray more towards their tips
    phase = 2.0 * np.pi * roots.random[:, None, 1:]
    waves = np.sin(2.0 * np.pi * 1.4 * s[None, :, None] + 0.25 * phase) + 0.6 * np.sin(
        2.0 * np.pi * 2.1 * s[None, :, None] + phase
    )
    tail = tail + 0.0045 * smoothstep(0.1, 0.9, s)[None, :, None] * waves
    tail = shortened(tail, (len(s) - 1) * (1.0 - 0.45 * roots.random[:, 0] ** 1.6))
    # some guides from below the tie are wound around it
    below = np.argsort(np.linalg.norm(roots.position - (KNOT - [0.0, 0.02, 0.03]), axis=1))[:26]
    axis = steps[0] / step
    other = np.cross(axis, [1.0, 0.0, 0.0])
    along = np.linspace(0.0, 1.0, len(s))
    angle = -0.5 * np.pi + 2.0 * np.pi * 2.3 * along
    ring = np.cos(angle)[:, None] * [1.0, 0.0, 0.0] - np.sin(angle)[:, None] * other
    rise = 0.001 + 0.009 * roots.random[below, 2][:, None] + 0.002 * along
    tail[below] = KNOT + rise[..., None] * axis + 0.0105 * ring
    drawn = head.gathered(roots, tail[:, 0], 20)
    guides = resampled(np.concatenate([drawn[:, :-1], tail], axis=1), 40)
    # loose hairs beside the neck would look like an earring from the front
    at_edge = (z < -0.045) & (np.abs(x) < 0.024)
    is_loose = at_edge & (roots.random[:, 3] < 0.07)
    guides[is_loose] = loose_hairs(head, roots.take(np.flatnonzero(is_loose)), 40)
    group = np.zeros(len(guides), np.int32)
    group[below], group[is_loose] = 1, 2
    return style(
        "Ponytail",
        120,
        head.shapes(roots, head.pushed_out(guides), group),
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
    outward = unit(np.array([0.0, 0.9, 0.45]))
    first_axis, second_axis = np.array([1.0, 0.0, 0.0]), unit(np.cross(outward, [1.0, 0.0, 0.0]))
    section = cross_section(roots, knot)
    angle = np.arctan2(section[:, 1], section[:, 0])[:, None]
    radius = np.linalg.norm(section, axis=1)[:, None]
    s = np.linspace(0.0, 1.0, 44)[None]
    wound = angle + 2.0 * np.pi * 1.6 * s
    # around a ring, and around the ring's own core as a rope is twisted
    core = 2.0 * np.pi * (0.9 * s) + 6.0 * radius + angle
    ring = 0.006 + 0.02 * smoothstep(0.0, 0.2, s)
    thickness = (0.004 + 0.014 * smoothstep(0.0, 0.2, s)) * np.sqrt(0.15 + 0.85 * radius)
    ring_distance = ring + thickness * np.cos(core)
    height = 0.012 + thickness * np.sin(core)
    knots = (
        knot
        + ring_distance[..., None]
        * (np.cos(wound)[..., None] * first_axis + np.sin(wound)[..., None] * second_axis)
        + height[..., None] * outward
    )
    drawn = head.gathered(roots, knots[:, 0], 20)
    guides = resampled(np.concatenate([drawn[:, :-1], knots], axis=1), 48)
    return style(
        "Bun",
        130,
        head.shapes(roots, head.pushed_out(guides)),
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
    group = np.digitize(roots.position[:, 0], (-0.028, 0.028))
    cv_count, length = 48, 0.2
    s = np.linspace(0.0, 1.0, cv_count)
    line = knot + np.stack([0 * s, 0.02 * smoothstep(0, 0.2, s) + 0.0 * s, -length * s], axis=1)
    for _ in range(3):  # down the neck and over the back
        distance, outward = head.skin_distance(line)
        line = line + np.maximum(0.024 - distance, 0.0)[:, None] * outward
    phase = 2.0 * np.pi * length / 0.062 * s
    taper = 1.0 - 0.35 * s
    tie_factor = 1.0 - 0.75 * np.exp(-(((s - 0.88) / 0.025) ** 2))
    paths = np.empty((len(roots.position), cv_count, 3))
    for part in range(3):
        of_part = np.flatnonzero(group == part)
        shift = phase + 2.0 * np.pi * part / 3.0
        is_woven = smoothstep(0.0, 0.08, s) * smoothstep(0.9, 0.86, s)
        center = line + (0.0155 * taper * is_woven * np.sin(shift))[:, None] * [1.0, 0.0, 0.0]
        center = center + (0.0085 * taper * is_woven * np.sin(2.0 * shift))[:, None] * [0, 1.0, 0]
        section = cross_section(roots.take(of_part), knot)
        radius = 0.0135 * taper * tie_factor
        paths[of_part] = tube(center, radius, section, np.array([1.0, 0.0, 0.0]))
    drawn = head.gathered(roots, paths[:, 0], 20, 0.005)
    guides = resampled(np.concatenate([drawn[:, :-1], paths], axis=1), 72)
    return style(
        "Braid",
        140,
        head.shapes(roots, head.pushed_out(guides), group.astype(np.int32)),
        "brown",
        children=children(
            24000, length_variation=0.06, clump=0.2, clump_size=40, frizz=0.0012, parting=3.0
        ),
        guides={"cv_count": 32},
        presets=("dynamics/natural",),
    )


#: of box braids: width of cells, thickness of a plait's strands, length of a plait's turn [m]
CELL_WIDTH, PLAIT_THICKNESS, PLAIT_PITCH = 0.024, 0.003, 0.026


def braid_lines(head: Head, bases: Roots, cv_count: int) -> np.ndarray:
    """The lines of braids from these roots, (n, cv_count, 3), which fall aside from a parting, and
    back."""
    x, y, z = bases.position.T
    length = 0.225 - 0.03 * smoothstep(0.02, 0.08, z) + 0.035 * smoothstep(-0.045, -0.06, y)
    falls = parted(0.0, 0.45)
    # braids at the forehead and on the parting go back first, so that none falls over the eyes
    first = 4.5 * smoothstep(-0.01, -0.05, y) + 4.0 * smoothstep(0.016, 0.004, np.abs(x))

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        back = first * smoothstep(-0.03, 0.03, points[:, 2])
        return unit(falls(points, roots, arc_length)) + vectors(0.0, back, 0.0)

    lines = head.combed(
        bases,
        flow,
        length,
        32,
        lift=0.3,
        flow_alignment=0.6,
        skin_attraction=skull_attraction,
        clearance=lambda s: 0.003 + np.minimum(0.25 * s, 0.016),
        over_ears=True,
    )
    return resampled(head.settled(bases, lines, 1.2, over_ears=True, radius_root=0.006), cv_count)


def plaited(line: np.ndarray, strand: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Guides (n, m, 3) along a line (m, 3), in these strands of a plait (n,), 0 to 2.

    Args:
        section: (n, 2) in the strand's own round section, up to 1.
    """
    s = np.linspace(0.0, 1.0, len(line))
    tangent = unit(np.gradient(line, axis=0))
    outward = unit(line - np.array([0.0, 0.015, 0.0]))
    sideways = unit(np.cross(tangent, outward))
    outward = np.cross(sideways, tangent)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    turn = 2.0 * np.pi * (length / PLAIT_PITCH * s + strand[:, None] / 3.0)
    size = PLAIT_THICKNESS * (1.0 - 0.3 * s) * smoothstep(-0.02, 0.05, s)
    offset = size * (1.25 * np.sin(turn) + 0.75 * section[:, :1])
    height = 0.7 * size * (np.sin(2.0 * turn) + section[:, 1:])
    return line + offset[..., None] * sideways + height[..., None] * outward


@recipe
def box_braids(head: Head) -> Any:
    cells = parted_in_cells(head, CELL_WIDTH)
    roots, count = cells.roots, cells.cell.max() + 1
    sums = np.zeros((count, 3))
    np.add.at(sums, cells.cell, roots.position)
    bases = head.roots_near(sums / np.bincount(cells.cell)[:, None], 3)
    lines = braid_lines(head, bases, 54)
    angle, radius = 2.0 * np.pi * roots.random[:, 1], np.sqrt(roots.random[:, 2])
    section = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    gather = 6
    guides = np.empty((len(roots.position), gather + lines.shape[1], 3))
    for braid, line in enumerate(lines):
        bundle_random = cells.cell == braid
        guides[bundle_random, gather:] = plaited(
            line, cells.section[bundle_random], section[bundle_random]
        )
    # hair leans to the border of its cell, and is then drawn over the skin to its braid
    guides[:, 0] = roots.position
    fraction = np.linspace(0.0, 1.0, gather)[None, :-1, None]
    guides[:, 1:gather] = (1.0 - fraction) * cells.border[:, None] + fraction * guides[
        :, gather, None
    ]
    arc_length = np.zeros(len(guides))
    for cv in range(1, gather + 1):
        arc_length += np.linalg.norm(guides[:, cv] - guides[:, cv - 1], axis=1)
        distance, outward = head.skin_distance(guides[:, cv])
        shortfall = np.minimum(0.0004 + 0.15 * arc_length, PLAIT_THICKNESS) - distance
        guides[:, cv] += shortfall[:, None] * outward
    return style(
        "Box Braids",
        145,
        head.shapes(
            roots, head.pushed_out(guides, 0.001), (3 * cells.cell + cells.section).astype(np.int32)
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
    _, y, z = roots.position.T
    is_top = z - 0.25 * np.maximum(y - 0.06, 0.0) > 0.062
    # the further back hair grows, the shorter it is: its ends lie on the back of the head
    long_length = 0.105 - 0.05 * smoothstep(-0.03, 0.08, y) + 0.022 * (roots.random[:, 0] - 0.5)
    length = np.where(is_top, long_length, 0.0032)
    shaved = head.combed(roots, whorl, length, 16, lift=0.6, clearance=lambda s: 0.3 * s)
    over = swept(-0.045, 0.75)

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        behind = smoothstep(0.035, 0.085, points[:, 1])[:, None]
        return (1.0 - behind) * unit(over(points, roots, arc_length)) + behind * [0.0, 0.25, -1.0]

    top = head.combed(
        roots,
        flow,
        length,
        16,
        lift=0.45,
        flow_alignment=0.7,
        skin_attraction=skull_attraction,
        clearance=lambda s: 0.002 + 0.2 * np.minimum(s, 0.03),
    )
    guides = np.where(is_top[:, None, None], top, shaved)
    return style(
        "Undercut",
        150,
        head.shapes(roots, guides, is_top.astype(np.int32)),
        "brown",
        children=children(
            42000, length_variation=0.2, clump=0.15, clump_size=20, frizz=0.006, parting=0.9
        ),
        presets=("dynamics/stiff",),
    )


def is_on_upper_lip(positions: np.ndarray) -> np.ndarray:
    """Which of these positions (n, 3) are on the upper lip."""
    x, y, z = positions.T
    return (np.abs(x) < 0.03) & (z > -0.066) & (y < -0.08)


def beard_flow(points: np.ndarray, roots: Roots, _arc_length: np.ndarray) -> np.ndarray:
    """Down and a little ahead, over the lip to both sides."""
    x, y, _ = roots.position.T
    on_lip = is_on_upper_lip(roots.position)
    sideways = np.where(on_lip, 1.2 * np.sign(x + 1e-9), 3.0 * x)
    forward = np.where(on_lip, -0.1, -0.35 * smoothstep(-0.03, -0.09, y))
    return vectors(sideways, forward, -0.9)


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
    guides = head.combed(roots, beard_flow, 0.0024, 5, lift=0.5, clearance=lambda s: 0.25 * s)
    return style(
        "Stubble",
        210,
        head.shapes(roots, guides),
        "brown",
        mask="beard",
        children=children(12000, length_variation=0.4, clump=0.0, frizz=0.02, scatter=0.6),
        presets=("dynamics/stiff",),
    )


@recipe
def full_beard(head: Head) -> Any:
    roots = head.roots(1300, "beard")
    _, y, z = roots.position.T
    length = 0.012 + 0.03 * smoothstep(-0.04, -0.11, z) * smoothstep(-0.01, -0.07, y)
    length = np.where(is_on_upper_lip(roots.position), 0.017, length) * (
        0.8 + 0.3 * roots.random[:, 0]
    )
    guides = head.combed(
        roots,
        beard_flow,
        length,
        10,
        lift=0.4,
        flow_alignment=0.6,
        clearance=lambda s: 0.0005 + 0.25 * s,
    )
    return style(
        "Full Beard",
        220,
        head.shapes(roots, guides),
        "brown",
        mask="beard",
        children=children(
            18000, length_variation=0.35, clump=0.4, clump_size=12, frizz=0.03, scatter=0.4
        ),
        presets=("dynamics/stiff",),
    )


@recipe
def moustache(head: Head) -> Any:
    def density(positions: np.ndarray) -> np.ndarray:
        return head.weights["beard"] * is_on_upper_lip(positions)

    roots = head.roots(3000, density)
    x = roots.position[:, 0]

    def flow(points: np.ndarray, roots: Roots, arc_length: np.ndarray) -> np.ndarray:
        side = np.sign(roots.position[:, 0] + 1e-9)
        # down over the lip, then aside, and up again at the ends
        turn = smoothstep(0.002, 0.016, arc_length)
        return vectors(side * (0.5 + 0.9 * turn), -0.25 + 0.35 * turn, -0.8 + 1.0 * turn)

    length = (0.013 + 0.016 * smoothstep(0.008, 0.028, np.abs(x))) * (
        0.8 + 0.2 * roots.random[:, 0]
    )
    guides = head.combed(
        roots,
        flow,
        length,
        12,
        lift=0.35,
        flow_alignment=0.7,
        clearance=lambda s: 0.0005 + 0.18 * s,
    )
    return style(
        "Moustache",
        230,
        head.shapes(roots, guides, (x > 0.0).astype(np.int32)),
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
