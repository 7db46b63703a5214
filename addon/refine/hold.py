"""Strands that follow their guides are moved to where ties and surfaces hold them.

A guide is held exactly, but a strand between guides passes its tie a little off its own place. So,
from root to tip, each hold moves the two points beside it to their places, as the dynamics does.
The points from the root, or from the previous hold, up to there move by a linearly growing
displacement, those beyond the hold as a whole. The former segments then get back their lengths with
both ends fixed (FABRIK; Aristidou and Lasenby 2011). A hold that is out of reach moves the strand
only as far as its length allows.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..arrays import Bools, Floats, Ints, number_in_piece
from ..strands.strand_set import ROOT_POINTS

#: Number of sweeps back and forth that restore a strand's lengths.
SWEEPS = 4
#: A strand that is off its hold by less than this fraction of its length is not moved.
MIN_HOLD_ERROR = 1.0e-5
_TINY = 1.0e-12


class Holds(Protocol):
    """See `groom.holds.Holds`."""

    @property
    def strand(self) -> Ints: ...

    @property
    def place(self) -> Floats: ...

    @property
    def anchor(self) -> Ints: ...


def hold_strands(
    points: Floats, rest: Floats, offsets: Ints, holds: Holds, anchors: Floats
) -> None:
    """Move strands (point_count, 3) world [m] to where they are held, in place.

    Args:
        rest: the same at rest, with the lengths to keep.
        offsets: (strand_count + 1,), strand s is points offsets[s]:offsets[s + 1].
        holds: sorted by strand, and from root to tip within each.
        anchors: (anchor_count, 4, 4), from world at rest to world now, all finite.
    """
    counts = np.diff(offsets)
    begins = np.flatnonzero(np.diff(holds.strand, prepend=-1))
    order = number_in_piece(np.diff(begins, append=len(holds.strand)))
    before = np.full(len(counts), ROOT_POINTS - 1, np.int64)  # the last point that is held so far
    for number in range(int(order.max(initial=-1)) + 1):
        of_order = np.flatnonzero(order == number)
        for count in np.unique(counts[holds.strand[of_order]]).tolist():
            one = of_order[counts[holds.strand[of_order]] == count]
            strand, first = holds.strand[one], holds.place[one].astype(np.int64)
            index = offsets[strand, None] + np.arange(count)
            some, some_rest = points[index].astype(np.float64), rest[index].astype(np.float64)
            matrix = anchors[holds.anchor[one]]
            points[index] = _held(some, some_rest, before[strand], first, matrix)
            before[strand] = np.minimum(first + 1, count - 1)


def _held(some: Floats, rest: Floats, before: Ints, first: Ints, matrix: Floats) -> Floats:
    """Strands (n, cv_count, 3) moved to one hold each, which holds their points `first` and the
    next one."""
    cv, after = np.arange(some.shape[1]), np.minimum(first + 1, some.shape[1] - 1)
    length = np.linalg.norm(np.diff(rest, axis=1), axis=2)
    here, there = _point(some, first), _point(some, after)
    target, beyond = (_moved(matrix, _point(rest, index)) for index in (first, after))
    error = np.maximum(
        np.linalg.norm(target - here, axis=1), np.linalg.norm(beyond - there, axis=1)
    )
    is_off = error > MIN_HOLD_ERROR * length.sum(axis=1)

    is_between = (cv[:-1] >= before[:, None]) & (cv[:-1] < first[:, None])
    reach, start = np.where(is_between, length, 0.0).sum(axis=1), _point(some, before)
    span = target - start
    span *= np.minimum(reach / np.maximum(np.linalg.norm(span, axis=1), _TINY), 1.0)[:, None]
    direction = beyond - target
    size = np.linalg.norm(_point(rest, after) - _point(rest, first), axis=1)
    direction *= (size / np.maximum(np.linalg.norm(direction, axis=1), _TINY))[:, None]

    part = np.clip((cv - before[:, None]) / np.maximum(first - before, 1)[:, None], 0.0, 1.0)
    shift = part[..., None] * (start + span - here)[:, None]
    shift_beyond = (start + span + direction - there)[:, None]
    shift = np.where((cv > first[:, None])[..., None], shift_beyond, shift)
    some = some + np.where(is_off[:, None, None], shift, 0.0)
    for _ in range(SWEEPS):
        _sweep(some, length, before, first, is_off)
    return some


def _sweep(some: Floats, length: Floats, before: Ints, first: Ints, is_off: Bools) -> None:
    """One sweep from each hold towards the root and back, in place."""
    cvs = range(1, some.shape[1] - 1)
    for step in (-1, 1):
        for cv in cvs[::step]:
            beside, wanted = some[:, cv - step], length[:, cv if step < 0 else cv - 1]
            segment = some[:, cv] - beside
            scale = wanted / np.maximum(np.linalg.norm(segment, axis=1), _TINY)
            is_moved = is_off & (cv > before) & (cv < first)
            np.copyto(some[:, cv], beside + segment * scale[:, None], where=is_moved[:, None])


def _point(grid: Floats, cv: Ints) -> Floats:
    return grid[np.arange(len(grid)), cv]


def _moved(matrix: Floats, points: Floats) -> Floats:
    moved: Floats = np.einsum("nij,nj->ni", matrix[:, :3, :3].astype(np.float64), points)
    return moved + matrix[:, :3, 3]
