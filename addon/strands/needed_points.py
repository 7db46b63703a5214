"""Each strand gets as many points as it needs to keep its shape."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints, rows_of_ranges
from .arc_length import arc_lengths, length_fractions_from, typical_length
from .resample import positions_at, resample
from .result_cache import NO_CACHE, ResultCache
from .strand_set import StrandSet

#: Maximum number of points of a strand: with 410, 20 turns of a coil lose MAX_LENGTH_LOSS.
MAX_POINTS = 512
#: Fraction of its length that a strand may lose.
MAX_LENGTH_LOSS = 0.005
#: Fraction of the hair's median length that a strand may deviate by: 0.2 mm for 25 cm.
MAX_DEVIATION = 8.0e-4
#: Approximate ratio between successive counts that are tried.
_STEP = 1.25
#: Points tested at once, so that they stay in the cache.
_CHUNK = 100_000


def with_all_points(strands: StrandSet, min_points: int) -> StrandSet:
    """The same strands with all of their points, which they may need once they move.

    A strand of fewer than `min_points` points gets more in between; one of more than MAX_POINTS is
    resampled to that many.
    """
    own = strands.point_counts
    return with_points(strands, np.clip(own, min_points, MAX_POINTS), own > MAX_POINTS)


def with_needed_points(
    strands: StrandSet, min_points: int, cache: ResultCache = NO_CACHE
) -> StrandSet:
    """The same strands with no more points than their shapes need, and at least `min_points` each.

    A strand is resampled evenly to as few points as it takes to lose at most MAX_LENGTH_LOSS of its
    length and to deviate by at most MAX_DEVIATION of the median length of all. If that is no fewer
    than it has, it keeps its own points; with fewer than `min_points` of them it gets more in
    between.

    Args:
        cache: results of the last call, used if all strands have the same point count.
    """
    own = strands.point_counts
    if not strands.strand_count or (own == min_points).all():
        return strands
    max_deviation = MAX_DEVIATION * typical_length(strands.lengths())

    def of(some: Ints) -> tuple[Ints, Bools]:
        return _point_counts(strands.take(some), min_points, max_deviation)

    if strands.is_uniform:
        needed, is_even = cache.rows("points", (min_points, max_deviation), (strands.grid,), of)
    else:
        needed, is_even = _point_counts(strands, min_points, max_deviation)
    return with_points(strands, needed, is_even)


def with_points(strands: StrandSet, counts: Ints, is_even: Bools) -> StrandSet:
    """The same strands with these point counts, (strand_count,): resampled evenly where `is_even`,
    elsewhere their own points and more in between."""
    if np.array_equal(counts, strands.point_counts) and not is_even.any():
        return strands
    offsets = np.concatenate([[0], np.cumsum(counts)])
    points = np.empty((offsets[-1], 3), np.float32)
    radius = np.empty(offsets[-1], np.float32)
    color = None if strands.color is None else np.empty_like(points)
    for count in np.unique(counts).tolist():
        for are_even in (False, True):
            chosen = np.flatnonzero((counts == count) & (is_even == are_even))
            if len(chosen):
                some = strands.take(chosen)
                part = resample(some, count) if are_even else _refined(some, count)
                rows = offsets[chosen, None] + np.arange(count)
                points[rows], radius[rows] = part.grid, part.radius.reshape(-1, count)
                if color is not None:
                    color[rows] = part.color_grid
    return replace(strands, points=points, offsets=offsets, radius=radius, color=color)


def _point_counts(strands: StrandSet, min_points: int, max_deviation: float) -> tuple[Ints, Bools]:
    """How many points each strand gets, and whether evenly, (strand_count,) each.

    A strand tries the lowest count first, which is enough for most; then the next one below its
    own; then it bisects between what was too few and what was enough.
    """
    own = strands.point_counts
    along = arc_lengths(strands.points, strands.offsets)
    counts = np.array(_trial_counts(min_points))
    # range of the counts that each strand has left to try; `last` stands for its own points
    low = np.zeros(len(own), np.int64)
    last = np.where(own == min_points, 0, np.maximum(counts.searchsorted(own), 1))
    high = last.copy()
    trial = np.zeros(len(own), np.int64)
    while (left := np.flatnonzero(low < high)).size:
        for number in np.unique(trial[left]).tolist():
            some = left[trial[left] == number]
            is_sufficient = _are_sufficient(
                strands, along, some, int(counts[number]), max_deviation
            )
            high[some[is_sufficient]] = number
            low[some[~is_sufficient]] = number + 1
        # curls need about as many as they have: if the count below is too few, no other is tried
        is_first = (low == 1) & (high == last) & (trial == 0)
        trial = np.where(is_first, high - 1, (low + high) // 2)
    is_even = low < last
    clipped = np.clip(own, min_points, MAX_POINTS)
    needed = np.where(is_even, counts[np.minimum(low, len(counts) - 1)], clipped)
    return needed, is_even | (own > MAX_POINTS)


def _are_sufficient(
    strands: StrandSet, along: Floats, some: Ints, count: int, max_deviation: float
) -> Bools:
    """Whether `count` even points keep the shape of each of some strands, (n,)."""
    size = max(_CHUNK // max(int(strands.point_counts[some].max()), count), 1)
    parts = [some[start : start + size] for start in range(0, len(some), size)]
    found = [_Lines.of(strands, along, part).are_sufficient(count, max_deviation) for part in parts]
    return np.concatenate(found)


def _trial_counts(min_points: int) -> list[int]:
    counts, count = [], float(min_points)
    while count < MAX_POINTS:
        counts.append(round(count))
        count *= _STEP
    return counts


@dataclass(frozen=True)
class _Lines:
    """Some strands.

    axes: (3, point_count) [m], the points. along: (point_count,) [m], see `arc_length.arc_lengths`.
    offsets: (strand_count + 1,).
    """

    axes: Floats
    along: Floats
    offsets: Ints

    @classmethod
    def of(cls, strands: StrandSet, along: Floats, some: Ints) -> _Lines:
        offsets, points = _rows(strands.offsets, some)
        # one row per axis: numpy is slow on rows of three
        axes = np.ascontiguousarray(strands.points.take(points, axis=0).T)
        return cls(axes, along.take(points), offsets)

    def take(self, some: Ints) -> _Lines:
        offsets, points = _rows(self.offsets, some)
        return _Lines(self.axes.take(points, axis=1), self.along.take(points), offsets)

    def are_sufficient(self, count: int, max_deviation: float) -> Bools:
        """Whether `count` even points keep the shape of each strand, (strand_count,)."""
        length = self.along[self.offsets[1:] - 1]
        left, weight = positions_at(self.along, self.offsets, count)
        before = 1.0 - weight
        even = [axis.take(left) * before + axis.take(left + 1) * weight for axis in self.axes]
        steps = (np.diff(axis.astype(np.float64), axis=1) for axis in even)
        total = np.sqrt(sum(step * step for step in steps)).sum(axis=1)
        is_sufficient = np.asarray(total >= (1.0 - MAX_LENGTH_LOSS) * length)
        long = np.flatnonzero(is_sufficient)  # the others fail anyway
        if len(long):
            lines = self if len(long) == len(length) else self.take(long)
            deviation = lines._max_squared_deviation([axis[long] for axis in even])
            is_sufficient[long] = deviation <= max_deviation * max_deviation
        return is_sufficient

    def _max_squared_deviation(self, even: list[Floats]) -> Floats:
        """The largest squared distance of each strand's points from the line through the even ones,
        (strand_count,).

        Args:
            even: x, y and z of the even points, (strand_count, count) each.
        """
        count = even[0].shape[1]
        # measured to the place at the same fraction, which is no nearer than the closest place
        place = length_fractions_from(self.along, self.offsets)
        place *= count - 1
        before = np.minimum(place.astype(np.int64), count - 2)
        part = place
        part -= before
        before += np.repeat(np.arange(len(even[0])) * count, np.diff(self.offsets))
        away = np.zeros(len(place))
        for axis, own in zip(even, self.axes, strict=True):
            line = axis.ravel()
            near = line.take(before).astype(np.float64)
            before += 1
            gap = line.take(before) - near
            before -= 1
            gap *= part
            gap += near
            gap -= own
            gap *= gap
            away += gap
        return np.maximum.reduceat(away, self.offsets[:-1])


def _rows(offsets: Ints, some: Ints) -> tuple[Ints, Ints]:
    """The offsets of some of the strands on their own, and the indices of their points."""
    counts = np.diff(offsets)[some]
    own = np.concatenate([[0], np.cumsum(counts)])
    return own, rows_of_ranges(offsets[:-1][some], counts)


def _refined(strands: StrandSet, count: int) -> StrandSet:
    """The strands with `count` points: their own and more in between, most in long segments."""
    if (strands.point_counts == count).all():
        return strands
    left = np.empty((strands.strand_count, count), np.int64)
    weight = np.empty((strands.strand_count, count))
    own = strands.point_counts
    for number in np.unique(own).tolist():
        some = np.flatnonzero(own == number)
        points = strands.take(some).grid.astype(np.float64)
        pieces = _pieces(np.linalg.norm(np.diff(points, axis=1), axis=2), count - 1)
        begin = np.cumsum(pieces, axis=1) - pieces
        segment = (np.arange(count)[:, None] >= begin[:, None]).sum(axis=2) - 1
        inside = np.arange(count) - np.take_along_axis(begin, segment, axis=1)
        weight[some] = inside / np.take_along_axis(pieces, segment, axis=1)
        left[some] = strands.offsets[some, None] + segment
    part = weight[..., None].astype(np.float32)

    def between(values: Floats) -> Floats:
        near, far = values[left], values[left + 1]
        mixed: Floats = np.where(part == 1.0, far, near + (far - near) * part)
        return mixed.reshape(-1, values.shape[1])

    return replace(
        strands,
        points=between(strands.points),
        offsets=np.arange(strands.strand_count + 1) * count,
        radius=between(strands.radius[:, None])[:, 0],
        color=None if strands.color is None else between(strands.color),
    )


def _pieces(length: Floats, count: int) -> Ints:
    """How many of `count` pieces each segment gets, (n, segments): by length, at least one each."""
    segments = length.shape[1]
    ideal = length / np.maximum(length.sum(axis=1, keepdims=True), 1.0e-30) * (count - segments)
    pieces = ideal.astype(np.int64)
    spare = count - segments - pieces.sum(axis=1)
    rank = np.argsort(np.argsort(pieces - ideal, axis=1, kind="stable"), axis=1, kind="stable")
    return pieces + 1 + (rank < spare[:, None])
