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
    BallView,
    Fragments,
    alpha_at,
    fragments,
    nearest,
    sphere_of,
    view_directions,
)

#: Colours that differ by more can be distinguished in 8 bits.
VISIBLE = 1.0 / 255.0
#: Alpha of cards without a texture.
_PLAIN_ALPHA = 0.5
#: Distance of the eye from the middle of the hair, in radii of the hair.
_DISTANCE = 5.0


@dataclass(frozen=True)
class SeenCards:
    """Visible fragments of the cards in a view, pixel by pixel, the farthest first, without those
    that opaque ones or the head hide. alpha: (fragment_count,), 1 for opaque ones.
    """

    met: Fragments
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
    for view in views_of(mesh, view_count, size):
        is_wrong = wrong_pixels(mesh, seen_cards(mesh, head, view, alpha), front, back)
        wrong += int(is_wrong.sum())
        covered += len(is_wrong)
    return wrong / max(covered, 1)


def views_of(mesh: CardMesh, count: int, size: int) -> list[BallView]:
    """Views around the head, different from those that the order is learnt from."""
    middle, radius = sphere_of(mesh)
    turned = view_directions(count, turn=0.5)
    return [BallView(middle, radius, each, size, _DISTANCE * radius) for each in turned]


def seen_cards(
    mesh: CardMesh, head: Surface | None, view: BallView, alpha: Floats | None = None
) -> SeenCards:
    """The visible fragments of a view; alpha is that of the nearest texel."""
    met = fragments(view, mesh.positions, mesh.triangles)
    met = met[met.near > nearest(view, head)[met.pixel]]
    if alpha is None:
        covers = np.full(len(met.pixel), _PLAIN_ALPHA, np.float32)
    else:
        covers = alpha_at(mesh, met, alpha)
    hidden = np.full(view.size * view.size, -np.inf, np.float32)
    is_opaque = covers >= OPAQUE_ALPHA
    np.maximum.at(hidden, met.pixel[is_opaque], met.near[is_opaque])
    # of opaque fragments at one depth the first is drawn
    is_seen = (covers >= MIN_ALPHA) & (met.near >= hidden[met.pixel])
    met, covers = met[is_seen], np.where(is_opaque, 1.0, covers)[is_seen]
    order = np.lexsort((met.near, met.pixel))
    return SeenCards(met[order], covers[order])


def wrong_pixels(mesh: CardMesh, seen: SeenCards, front: Ints, back: Ints) -> Bools:
    """Which of the pixels that hair covers are wrong, (covered_count,), by pixel."""
    color = np.random.default_rng(0).random((len(mesh.group), 3))[mesh.card[seen.met.triangle]]
    right = _blended(seen, color, np.arange(len(color)), is_written=np.zeros(len(color), bool))
    is_opaque, is_front = seen.alpha >= 1.0, seen.met.is_front
    place = np.where(is_front, _places(front)[seen.met.triangle], _places(back)[seen.met.triangle])
    drawn_in = np.where(is_opaque, 0, np.where(is_front, 2, 1))
    place[is_opaque] = -np.arange(is_opaque.sum())
    order = np.lexsort((place, drawn_in, seen.met.pixel))
    drawn = _blended(seen, color, order, is_written=is_front & ~is_opaque)
    return (np.abs(drawn - right) > VISIBLE).any(axis=1)


def _places(order: Ints) -> Ints:
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return place


def _blended(seen: SeenCards, color: Floats, order: Ints, is_written: Bools) -> Floats:
    """The colour of each pixel, (covered_count, 3), fragments blended in this order.

    Args:
        order: (fragment_count,), pixel by pixel.
        is_written: (fragment_count,) whether a fragment's depth hides farther ones that come later.
    """
    pixel = seen.met.pixel[order]
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    count = np.diff(np.append(starts, len(pixel)))
    blended = np.zeros((len(starts), 3))
    depth = np.full(len(starts), -np.inf)
    for step in range(int(count.max(initial=0))):
        pixels = np.flatnonzero(count > step)
        one = order[starts[pixels] + step]
        is_drawn = seen.met.near[one] > depth[pixels]
        pixels, one = pixels[is_drawn], one[is_drawn]
        blended[pixels] += seen.alpha[one, None] * (color[one] - blended[pixels])
        hides = is_written[one]
        depth[pixels[hides]] = seen.met.near[one[hides]]
    return blended
