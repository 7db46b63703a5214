"""Which triangle of the cards lies behind which, over many views, and how much it matters."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from .card_mesh import CardMesh
from .order_views import (
    LOWEST,
    MIN_ALPHA,
    OPAQUE_ALPHA,
    BallView,
    Fragments,
    alpha_at,
    far_to_near,
    fragments,
    seen_from_afar,
    sphere_of,
    view_directions,
)

#: Alpha of cards without a texture. More would show too few layers, less would show layers that
#: hardly count.
OPACITY = 0.4
#: A pair that changes its pixel's colour by less than this fraction is left out.
MIN_WEIGHT = 0.004
#: Weights are whole numbers, so that their sums do not depend on the order of adding.
_UNIT = 1000
#: Views at work at the same time; numpy lets other threads run most of the time.
_THREADS = min(4, os.cpu_count() or 1)


@dataclass(frozen=True)
class Pairs:
    """Pairs of fragments in one pixel.

    behind, before: (pair_count,) triangles, the farther one and the nearer one.
    weight: (pair_count,) int32, how much their order changes the colour of the pixel.
    facing: (pair_count,) int8, 0 two back faces, 1 two front faces, 2 one of each.
    """

    behind: Ints
    before: Ints
    weight: Ints
    facing: Ints

    def __getitem__(self, chosen: Bools) -> Pairs:
        return Pairs(*(getattr(self, name)[chosen] for name in _NAMES))


_NAMES = ("behind", "before", "weight", "facing")


def pairs_by_view(
    mesh: CardMesh, head: Surface | None, view_count: int, size: int, alpha: Floats | None = None
) -> Iterator[Pairs]:
    """The pairs in each of many parallel views around the head, `size` pixels across.

    Args:
        alpha: (height, width) of the cards' texture; None: OPACITY everywhere.
    """
    if alpha is not None:
        _, radius = sphere_of(mesh)
        alpha = seen_from_afar(alpha, mesh, 2.0 * radius / size)

    def seen(direction: Floats) -> Pairs:
        both_directions = _both_directions(mesh, head, direction, size, alpha)
        return all_pairs([pairs_of(met, covers) for met, covers in both_directions])

    # few at a time: ending the work, or Blender, waits for the views that have begun
    with ThreadPoolExecutor(_THREADS) as threads:
        begun: deque[Future[Pairs]] = deque()
        for direction in view_directions(view_count):
            begun.append(threads.submit(seen, direction))
            if len(begun) > _THREADS:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()


def all_pairs(found: Sequence[Pairs]) -> Pairs:
    """The pairs of some views in one, of at least one."""
    return Pairs(*(np.concatenate([getattr(one, name) for one in found]) for name in _NAMES))


def _both_directions(
    mesh: CardMesh, head: Surface | None, direction: Floats, size: int, alpha: Floats | None
) -> Iterator[tuple[Fragments, Floats]]:
    """The fragments seen from this direction and, unless too far below, from the opposite one; and
    their alpha.

    Parallel views from opposite sides have the same fragments in opposite order.
    """
    view = BallView(*sphere_of(mesh), direction, size)
    met = far_to_near(fragments(view, mesh.positions, mesh.triangles))
    if alpha is None:
        covers = np.full(len(met.pixel), OPACITY)
    else:
        covers = alpha_at(mesh, met, alpha)
    is_opaque = covers >= OPAQUE_ALPHA
    body = None if head is None else fragments(view, head.positions, head.triangles)
    for sign in (1.0, -1.0):
        if sign * direction[2] < np.sin(np.radians(LOWEST)):
            continue
        # opaque pixels have their own pass, which hides what lies behind them
        limit = np.full(size * size, -np.inf, np.float32)
        near = np.float32(sign) * met.near
        np.maximum.at(limit, met.pixel[is_opaque], near[is_opaque])
        if body is not None:
            np.maximum.at(limit, body.pixel, np.float32(sign) * body.near)
        is_seen = (near > limit[met.pixel]) & (covers >= MIN_ALPHA) & ~is_opaque
        seen, fraction = met[is_seen], covers[is_seen]
        if sign > 0.0:
            yield seen, fraction
        else:
            back = seen[np.arange(len(seen.pixel))[::-1]]
            turned = replace(back, near=-back.near, is_front=~back.is_front)
            yield turned, fraction[::-1]


def pairs_of(met: Fragments, covers: Floats) -> Pairs:
    """All pairs of fragments that share a pixel, down to MIN_WEIGHT.

    Exchanging two fragments changes the pixel by the difference of their colours times both alphas
    and the transmittance of all other fragments before the farther one.

    Args:
        met: pixel by pixel, the farthest first.
        covers: (fragment_count,) below 1.
    """
    count = len(met.pixel)
    is_last = np.ones(count, bool)
    is_last[:-1] = met.pixel[1:] != met.pixel[:-1]
    ends = np.flatnonzero(is_last)
    in_front = np.repeat(ends, np.diff(ends, prepend=-1)) - np.arange(count)
    # logarithm of the transmittance of all fragments before each
    through = np.log1p(-covers.astype(np.float64)).cumsum()
    through = np.repeat(through[ends], np.diff(ends, prepend=-1)) - through
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for apart in range(1, int(in_front.max(initial=0)) + 1):
        behind = np.flatnonzero(in_front >= apart)
        before = behind + apart
        others = np.exp(through[behind]) / (1.0 - covers[before])
        weight = covers[behind] * covers[before] * others
        matters = weight >= MIN_WEIGHT
        found.append((behind[matters], before[matters], weight[matters]))
    behind, before, weight = (np.concatenate(each) for each in zip(*found, strict=True))
    facing = np.where(met.is_front[behind] == met.is_front[before], met.is_front[behind], 2)
    return Pairs(
        met.triangle[behind].astype(np.int32),
        met.triangle[before].astype(np.int32),
        np.rint(_UNIT * weight).astype(np.int32),
        facing.astype(np.int8),
    )
