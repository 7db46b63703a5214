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
    MIN_ALPHA,
    MIN_ELEVATION,
    OPAQUE_ALPHA,
    Fragments,
    SphereView,
    bounding_sphere,
    downsampled_alpha,
    fragment_alpha,
    rasterized,
    sorted_far_to_near,
    view_directions,
)

#: Alpha of cards without a texture. More would show too few layers, less would show layers that
#: hardly count.
DEFAULT_ALPHA = 0.4
#: A pair that changes its pixel's colour by less than this fraction is left out.
MIN_WEIGHT = 0.004
#: Weights are whole numbers, so that their sums do not depend on the order of adding.
_WEIGHT_UNIT = 1000
#: Views at work at the same time; numpy lets other threads run most of the time.
_THREADS = min(4, os.cpu_count() or 1)


@dataclass(frozen=True)
class FragmentPairs:
    """Pairs of fragments in one pixel.

    farther, nearer: (pair_count,) triangles, the farther one and the nearer one.
    weight: (pair_count,) int32, how much their order changes the colour of the pixel.
    facing: (pair_count,) int8, 0 two back faces, 1 two front faces, 2 one of each.
    """

    farther: Ints
    nearer: Ints
    weight: Ints
    facing: Ints

    def __getitem__(self, chosen: Bools) -> FragmentPairs:
        return FragmentPairs(*(getattr(self, name)[chosen] for name in _FIELDS))


_FIELDS = ("farther", "nearer", "weight", "facing")


def pairs_by_view(
    mesh: CardMesh, head: Surface | None, view_count: int, size: int, alpha: Floats | None = None
) -> Iterator[FragmentPairs]:
    """The pairs in each of many parallel views around the head, `size` pixels across.

    Args:
        alpha: (height, width) of the cards' texture; None: DEFAULT_ALPHA everywhere.
    """
    if alpha is not None:
        _, radius = bounding_sphere(mesh)
        alpha = downsampled_alpha(alpha, mesh, 2.0 * radius / size)

    def seen(direction: Floats) -> FragmentPairs:
        both_directions = _from_both_sides(mesh, head, direction, size, alpha)
        return concatenated_pairs([fragment_pairs(met, covers) for met, covers in both_directions])

    # few at a time: ending the work, or Blender, waits for the views that have begun
    with ThreadPoolExecutor(_THREADS) as threads:
        running: deque[Future[FragmentPairs]] = deque()
        for direction in view_directions(view_count):
            running.append(threads.submit(seen, direction))
            if len(running) > _THREADS:
                yield running.popleft().result()
        while running:
            yield running.popleft().result()


def concatenated_pairs(found: Sequence[FragmentPairs]) -> FragmentPairs:
    """The pairs of some views in one, of at least one."""
    return FragmentPairs(
        *(np.concatenate([getattr(one, name) for one in found]) for name in _FIELDS)
    )


def _from_both_sides(
    mesh: CardMesh, head: Surface | None, direction: Floats, size: int, alpha: Floats | None
) -> Iterator[tuple[Fragments, Floats]]:
    """The fragments seen from this direction and, unless too far below, from the opposite one; and
    their alpha.

    Parallel views from opposite sides have the same fragments in opposite order.
    """
    view = SphereView(*bounding_sphere(mesh), direction, size)
    fragments = sorted_far_to_near(rasterized(view, mesh.positions, mesh.triangles))
    if alpha is None:
        coverage = np.full(len(fragments.pixel), DEFAULT_ALPHA)
    else:
        coverage = fragment_alpha(mesh, fragments, alpha)
    is_opaque = coverage >= OPAQUE_ALPHA
    body = None if head is None else rasterized(view, head.positions, head.triangles)
    for sign in (1.0, -1.0):
        if sign * direction[2] < np.sin(np.radians(MIN_ELEVATION)):
            continue
        # opaque pixels have their own pass, which hides what lies behind them
        limit = np.full(size * size, -np.inf, np.float32)
        near = np.float32(sign) * fragments.nearness
        np.maximum.at(limit, fragments.pixel[is_opaque], near[is_opaque])
        if body is not None:
            np.maximum.at(limit, body.pixel, np.float32(sign) * body.nearness)
        is_seen = (near > limit[fragments.pixel]) & (coverage >= MIN_ALPHA) & ~is_opaque
        seen, fraction = fragments[is_seen], coverage[is_seen]
        if sign > 0.0:
            yield seen, fraction
        else:
            back = seen[np.arange(len(seen.pixel))[::-1]]
            turned = replace(back, nearness=-back.nearness, is_front=~back.is_front)
            yield turned, fraction[::-1]


def fragment_pairs(fragments: Fragments, alpha: Floats) -> FragmentPairs:
    """All pairs of fragments that share a pixel, down to MIN_WEIGHT.

    Exchanging two fragments changes the pixel by the difference of their colours times both alphas
    and the transmittance of all other fragments before the farther one.

    Args:
        fragments: pixel by pixel, the farthest first.
        alpha: (fragment_count,) below 1.
    """
    count = len(fragments.pixel)
    is_last = np.ones(count, bool)
    is_last[:-1] = fragments.pixel[1:] != fragments.pixel[:-1]
    ends = np.flatnonzero(is_last)
    in_front = np.repeat(ends, np.diff(ends, prepend=-1)) - np.arange(count)
    # logarithm of the transmittance of all fragments before each
    through = np.log1p(-alpha.astype(np.float64)).cumsum()
    through = np.repeat(through[ends], np.diff(ends, prepend=-1)) - through
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for steps in range(1, int(in_front.max(initial=0)) + 1):
        farther = np.flatnonzero(in_front >= steps)
        nearer = farther + steps
        others = np.exp(through[farther]) / (1.0 - alpha[nearer])
        weight = alpha[farther] * alpha[nearer] * others
        matters = weight >= MIN_WEIGHT
        found.append((farther[matters], nearer[matters], weight[matters]))
    farther, nearer, weight = (np.concatenate(each) for each in zip(*found, strict=True))
    facing = np.where(
        fragments.is_front[farther] == fragments.is_front[nearer], fragments.is_front[farther], 2
    )
    return FragmentPairs(
        fragments.triangle[farther].astype(np.int32),
        fragments.triangle[nearer].astype(np.int32),
        np.rint(_WEIGHT_UNIT * weight).astype(np.int32),
        facing.astype(np.int8),
    )
