"""How often cards are drawn in a wrong order, by a simulation of the four passes of Scheuermann
2004.

A pixel is wrong if the four passes, drawing the triangles in the given order with a random colour
for each card, give it another colour than blending all its fragments from the farthest to the
nearest: by more than 1/255 in any channel. So every visible wrong pair counts, and none behind
opaque hair, behind the head, or with a transparent fragment. The fraction is of the pixels that
hair covers.

The passes: opaque pixels with a depth test; then, of fragments that neither these nor the head
hide, back faces, and last front faces, which write their depth, so that farther ones drawn later
are lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from .card_mesh import CardMesh
from .order_views import (
    MIN_ALPHA,
    OPAQUE_ALPHA,
    Fragments,
    SphereView,
    bounding_sphere,
    fragment_alpha,
    rasterized,
    surface_nearness,
    view_directions,
)

#: Colours that differ by more can be distinguished in 8 bits.
MIN_VISIBLE_DIFFERENCE = 1.0 / 255.0
#: Alpha of cards without a texture.
_DEFAULT_ALPHA = 0.5
#: Distance of the eye from the middle of the hair, in radii of the hair.
_EYE_DISTANCE = 5.0


@dataclass(frozen=True)
class VisibleFragments:
    """Visible fragments of the cards in a view, pixel by pixel, the farthest first, without those
    that opaque ones or the head hide. alpha: (fragment_count,), 1 for opaque ones.
    """

    fragments: Fragments
    alpha: Floats


def wrong_fraction(
    mesh: CardMesh,
    head: Surface | None,
    *,
    front: Ints | None = None,
    back: Ints | None = None,
    alpha: Floats | None = None,
    view_count: int = 40,
    size: int = 128,
) -> float:
    """Fraction of the hair's pixels that are wrong, on average over views around the head.

    Args:
        front, back: (triangle_count,) triangles in the order in which front and back faces are
            drawn. Without front: the order of the mesh; without back: the same for both.
        alpha: (height, width) of the cards' texture; None: 0.5 everywhere.
        size: of the views, pixels across; the eye is 5 radii of the hair away.
    """
    front = np.arange(len(mesh.triangles)) if front is None else front
    back = front if back is None else back
    wrong = covered = 0
    for view in check_views(mesh, view_count, size):
        is_wrong = wrong_pixels(mesh, visible_fragments(mesh, head, view, alpha), front, back)
        wrong += int(is_wrong.sum())
        covered += len(is_wrong)
    return wrong / max(covered, 1)


def check_views(mesh: CardMesh, count: int, size: int) -> list[SphereView]:
    """Views around the head, different from those that the order is learnt from."""
    middle, radius = bounding_sphere(mesh)
    turned = view_directions(count, turn=0.5)
    return [SphereView(middle, radius, each, size, _EYE_DISTANCE * radius) for each in turned]


def visible_fragments(
    mesh: CardMesh, head: Surface | None, view: SphereView, alpha: Floats | None = None
) -> VisibleFragments:
    """The visible fragments of a view; alpha, (height, width), is that of the nearest texel."""
    fragments = rasterized(view, mesh.positions, mesh.triangles)
    fragments = fragments[fragments.nearness > surface_nearness(view, head)[fragments.pixel]]
    if alpha is None:
        coverage = np.full(len(fragments.pixel), _DEFAULT_ALPHA, np.float32)
    else:
        coverage = fragment_alpha(mesh, fragments, alpha)
    hidden = np.full(view.size * view.size, -np.inf, np.float32)
    is_opaque = coverage >= OPAQUE_ALPHA
    np.maximum.at(hidden, fragments.pixel[is_opaque], fragments.nearness[is_opaque])
    # of opaque fragments at one depth the first is drawn
    is_seen = (coverage >= MIN_ALPHA) & (fragments.nearness >= hidden[fragments.pixel])
    fragments, coverage = fragments[is_seen], np.where(is_opaque, 1.0, coverage)[is_seen]
    order = np.lexsort((fragments.nearness, fragments.pixel))
    return VisibleFragments(fragments[order], coverage[order])


def wrong_pixels(mesh: CardMesh, visible: VisibleFragments, front: Ints, back: Ints) -> Bools:
    """Which of the pixels that hair covers are wrong, (covered_count,), by pixel."""
    color = np.random.default_rng(0).random((len(mesh.group), 3))[
        mesh.card[visible.fragments.triangle]
    ]
    expected = _blended(
        visible, color, np.arange(len(color)), is_written=np.zeros(len(color), bool)
    )
    is_opaque, is_front = visible.alpha >= 1.0, visible.fragments.is_front
    place = np.where(
        is_front,
        _ranks(front)[visible.fragments.triangle],
        _ranks(back)[visible.fragments.triangle],
    )
    drawn_in = np.where(is_opaque, 0, np.where(is_front, 2, 1))
    place[is_opaque] = -np.arange(is_opaque.sum())
    order = np.lexsort((place, drawn_in, visible.fragments.pixel))
    drawn = _blended(visible, color, order, is_written=is_front & ~is_opaque)
    return (np.abs(drawn - expected) > MIN_VISIBLE_DIFFERENCE).any(axis=1)


def _ranks(order: Ints) -> Ints:
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return place


def _blended(visible: VisibleFragments, color: Floats, order: Ints, is_written: Bools) -> Floats:
    """The colour of each pixel, (covered_count, 3), fragments blended in this order.

    Args:
        order: (fragment_count,), pixel by pixel.
        is_written: (fragment_count,) whether a fragment's depth hides farther ones that come later.
    """
    pixel = visible.fragments.pixel[order]
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    count = np.diff(np.append(starts, len(pixel)))
    blended = np.zeros((len(starts), 3))
    depth = np.full(len(starts), -np.inf)
    for step in range(int(count.max(initial=0))):
        pixels = np.flatnonzero(count > step)
        one = order[starts[pixels] + step]
        is_drawn = visible.fragments.nearness[one] > depth[pixels]
        pixels, one = pixels[is_drawn], one[is_drawn]
        blended[pixels] += visible.alpha[one, None] * (color[one] - blended[pixels])
        hides = is_written[one]
        depth[pixels[hides]] = visible.fragments.nearness[one[hides]]
    return blended
