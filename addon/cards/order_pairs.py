"""Which triangle of the cards lies behind which, over many views, and how much it matters."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from .card_mesh import CardMesh
from .order_views import (
    LOWEST,
    Fragments,
    View,
    far_to_near,
    fragments,
    sphere_of,
    view_directions,
)

#: What a card is taken to cover, since its texture may change after it was sorted. More would see
#: too few of the layers, less those that hardly show.
OPACITY = 0.4
#: A pair that changes its pixel's colour by less than this share is left out.
LEAST_WEIGHT = 0.02
#: Weights are whole numbers, so that their sums do not hang on the order of adding.
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
    mesh: CardMesh, head: Surface | None, view_count: int, size: int
) -> Iterator[Pairs]:
    """What each of many parallel views around the head sees, `size` pixels across."""

    def seen(direction: Floats) -> Pairs:
        return all_pairs([pairs_of(met) for met in _both_ways(mesh, head, direction, size)])

    with ThreadPoolExecutor(_THREADS) as threads:
        yield from threads.map(seen, view_directions(view_count))


def all_pairs(found: Sequence[Pairs]) -> Pairs:
    """Those of some views together, one at least."""
    return Pairs(*(np.concatenate([getattr(one, name) for one in found]) for name in _NAMES))


def _both_ways(
    mesh: CardMesh, head: Surface | None, direction: Floats, size: int
) -> Iterator[Fragments]:
    """What is seen from there and, unless that is from too far below, from the opposite side.

    Parallel views from opposite sides have the same fragments in opposite order.
    """
    view = View(*sphere_of(mesh), direction, size)
    met = far_to_near(fragments(view, mesh.positions, mesh.triangles))
    body = None if head is None else fragments(view, head.positions, head.triangles)
    for sign in (1.0, -1.0):
        if sign * direction[2] < np.sin(np.radians(LOWEST)):
            continue
        limit = np.full(size * size, -np.inf, np.float32)
        if body is not None:
            np.maximum.at(limit, body.pixel, np.float32(sign) * body.near)
        seen = met[np.float32(sign) * met.near > limit[met.pixel]]
        if sign > 0.0:
            yield seen
        else:
            back = seen[np.arange(len(seen.pixel))[::-1]]
            yield Fragments(
                back.pixel, back.triangle, -back.near, ~back.is_front, back.second, back.third
            )


def pairs_of(met: Fragments) -> Pairs:
    """All pairs of fragments that share a pixel, as far in as it matters.

    With n fragments before the nearer one and m between them, exchanging the two changes the colour
    by opacity^2 (1 - opacity)^(n + m) times the difference of theirs.

    Args:
        met: those of a pixel one after the other, the farthest first.
    """
    count = len(met.pixel)
    is_last = np.ones(count, bool)
    is_last[:-1] = met.pixel[1:] != met.pixel[:-1]
    ends = np.flatnonzero(is_last)
    in_front = np.repeat(ends, np.diff(ends, prepend=-1)) - np.arange(count)
    between = np.arange(int(in_front.max(initial=0)))
    weight_of = np.append(0.0, OPACITY**2 * (1.0 - OPACITY) ** between)
    is_seen = (in_front > 0) & (weight_of >= LEAST_WEIGHT)[in_front]
    behind, depth = np.flatnonzero(is_seen), in_front[is_seen]
    apart = range(1, int(depth.max(initial=0)) + 1)
    steps = [np.stack([behind[depth >= far], behind[depth >= far] + far]) for far in apart]
    behind, before = np.concatenate([np.zeros((2, 0), np.int64), *steps], axis=1)
    facing = np.where(met.is_front[behind] == met.is_front[before], met.is_front[behind], 2)
    return Pairs(
        met.triangle[behind].astype(np.int32),
        met.triangle[before].astype(np.int32),
        np.rint(_UNIT * weight_of[in_front[behind]]).astype(np.int32),
        facing.astype(np.int8),
    )
