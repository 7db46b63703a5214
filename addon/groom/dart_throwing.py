"""Darts thrown at a surface: which ones are too near to each other, and which one came first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.parallel import even_slices, parallel_map
from ..strands.vectors import dot_rows

#: A thread gets at least this many darts.
_MIN_SAMPLES_PER_THREAD = 4096


@dataclass(frozen=True)
class Samples:
    """triangle: (n,). barycentric: (n, 3). point: (n, 3) [m], from the middle of the surface.
    reach: (n,) the distance to keep, as a factor of the level's radius, 1 where hair is densest.
    key: (n,) uint64, of the random numbers of whatever grows there.
    """

    triangle: Ints
    barycentric: Floats
    point: Floats
    reach: Floats
    key: Ints

    @classmethod
    def none(cls) -> Samples:
        no_key = np.zeros(0, np.uint64)
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), no_key)

    def __len__(self) -> int:
        return len(self.triangle)

    def take(self, chosen: Bools | Ints) -> Samples:
        """The chosen samples, as a mask (n,) or as indices (k,)."""
        index = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        # numpy takes rows in a third of the time in which it indexes them
        return Samples(
            self.triangle.take(index),
            self.barycentric.take(index, axis=0),
            self.point.take(index, axis=0),
            self.reach.take(index),
            self.key.take(index),
        )

    def concatenated(self, other: Samples) -> Samples:
        return Samples(
            np.concatenate([self.triangle, other.triangle]),
            np.concatenate([self.barycentric, other.barycentric]),
            np.concatenate([self.point, other.point]),
            np.concatenate([self.reach, other.reach]),
            np.concatenate([self.key, other.key]),
        )


class SampleCells:
    """Points in a hashed grid (Teschner 2003), each in all cells that its reach touches.

    Points of much longer reach lie in a grid of their own, with longer cells: one grid for each
    octave, all in one table.
    """

    def __init__(self, samples: Samples, radius: float) -> None:
        self._samples, self._radius = samples, radius
        octave = np.ceil(np.log2(samples.reach)).astype(np.int64)
        self._octaves = np.unique(octave)
        size = self._size(octave)
        reach = samples.reach * radius
        buckets = 1 << max(4, int(np.ceil(np.log2(max(1, 8 * len(samples))))))
        self._mask = buckets - 1
        touched = np.empty((8, len(samples)), np.int64)
        lows = [np.floor((axis - reach) / size).astype(np.int64) for axis in samples.point.T]
        highs = [np.floor((axis + reach) / size).astype(np.int64) for axis in samples.point.T]
        for corner in range(8):
            cell = [(lows, highs)[corner >> axis & 1][axis] for axis in range(3)]
            touched[corner] = self._bucket(cell, octave)
        flat = touched.ravel()
        self._entry = np.argsort(flat) % max(1, len(samples))
        # by axes, as numpy is slow at rows of three
        self._place = np.ascontiguousarray(samples.point.T)
        self._entry_place = self._place.take(self._entry, axis=1)
        self._entry_reach = samples.reach.take(self._entry)
        self._start = np.zeros(buckets + 1, np.int64)
        np.cumsum(np.bincount(flat, minlength=buckets), out=self._start[1:])

    def covers(self, samples: Samples) -> Bools:
        """Whether any of the points lies too near to each of these darts, (n,)."""
        parts = even_slices(len(samples), _MIN_SAMPLES_PER_THREAD)
        if len(parts) == 1:
            return self._covers(samples)
        rows = np.arange(len(samples))
        found = parallel_map(lambda some: self._covers(samples.take(rows[some])), parts)
        return np.concatenate(found)

    def _covers(self, samples: Samples) -> Bools:
        covered = np.zeros(len(samples), bool)
        place = np.ascontiguousarray(samples.point.T)
        for octave in self._octaves:
            waiting = np.flatnonzero(~covered)
            here, reach = place.take(waiting, axis=1), samples.reach.take(waiting)
            at, end = self._list(here, octave)
            left = np.flatnonzero(at < end)
            while len(left):
                waiting, at, end = waiting.take(left), at.take(left), end.take(left)
                here, reach = here.take(left, axis=1), reach.take(left)
                is_near = self._near(here, reach, at)
                covered[waiting[is_near]] = True
                at += 1
                left = np.flatnonzero(~is_near & (at < end))
        return covered

    def pairs(self) -> tuple[Ints, Ints]:
        """All (later, earlier) points that are too near to each other, (n,) each."""
        laters, earliers = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        for octave in self._octaves:
            at, end = self._list(self._place, octave)
            one = np.repeat(np.arange(len(self._samples)), end - at)
            first = np.repeat(at - np.cumsum(end - at) + (end - at), end - at)
            entry = first + np.arange(len(one))
            other = self._entry.take(entry)
            here, reach = self._place.take(one, axis=1), self._samples.reach.take(one)
            is_near = (one != other) & self._near(here, reach, entry)
            laters.append(np.maximum(one, other)[is_near])
            earliers.append(np.minimum(one, other)[is_near])
        return np.concatenate(laters), np.concatenate(earliers)

    def _near(self, place: Floats, reach: Floats, entry: Ints) -> Bools:
        """Whether places (3, n) of these reaches are too near to these entries, (n,) each."""
        gap = self._entry_place.take(entry, axis=1)
        gap -= place
        limit = np.minimum(reach, self._entry_reach.take(entry))
        limit *= self._radius
        return np.asarray(dot_rows(gap, gap) < limit * limit)

    def _list(self, place: Floats, octave: int) -> tuple[Ints, Ints]:
        """Start and end of the entries of the cell in which each place (3, n) lies."""
        size = self._size(octave)
        cell = [np.floor(axis / size).astype(np.int64) for axis in place]
        bucket = self._bucket(cell, octave)
        return self._start[bucket], self._start[bucket + 1]

    def _size(self, octave: Ints | int) -> Floats:
        return 2.0 * self._radius * np.exp2(octave)

    def _bucket(self, cell: list[Ints], octave: Ints | int) -> Ints:
        x, y, z = cell
        mixed = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791) ^ (octave * 50331653)
        return (mixed ^ (mixed >> 17)) & self._mask


def accepted_samples(samples: Samples, radius: float) -> Bools:
    """Which darts stay, (n,): those that are not too near to an earlier one that stays."""
    later, earlier = SampleCells(samples, radius).pairs()
    stays = np.zeros(len(samples), bool)
    is_open = np.ones(len(samples), bool)
    while is_open.any():
        is_blocked = np.zeros(len(samples), bool)
        is_blocked[later] = True
        stays |= is_open & ~is_blocked
        is_open &= is_blocked
        is_open[later[stays[earlier]]] = False
        is_pair_open = is_open[later] & is_open[earlier]
        later, earlier = later[is_pair_open], earlier[is_pair_open]
    return stays
