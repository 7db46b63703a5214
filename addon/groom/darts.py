"""Darts thrown at a surface: which ones are too near to each other, and which one came first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class Darts:
    """triangle: (n,). barycentric: (n, 3). point: (n, 3) [m], from the middle of the surface.
    reach: (n,) the distance to keep, as a factor of the level's radius, 1 where hair is densest.
    """

    triangle: Ints
    barycentric: Floats
    point: Floats
    reach: Floats

    @classmethod
    def none(cls) -> Darts:
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))

    def __len__(self) -> int:
        return len(self.triangle)

    def take(self, chosen: Bools | Ints) -> Darts:
        return Darts(
            self.triangle[chosen], self.barycentric[chosen], self.point[chosen], self.reach[chosen]
        )

    def and_also(self, other: Darts) -> Darts:
        return Darts(
            np.concatenate([self.triangle, other.triangle]),
            np.concatenate([self.barycentric, other.barycentric]),
            np.concatenate([self.point, other.point]),
            np.concatenate([self.reach, other.reach]),
        )


class DartCells:
    """Points in a hashed grid (Teschner 2003), each in all cells that its reach touches.

    Points of much longer reach lie in a grid of their own, with longer cells: one grid for each
    octave, all in one table.
    """

    def __init__(self, darts: Darts, radius: float) -> None:
        self._darts, self._radius = darts, radius
        octave = np.ceil(np.log2(darts.reach)).astype(np.int64)
        self._octaves = np.unique(octave)
        size = self._size(octave)
        reach = darts.reach * radius
        buckets = 1 << max(4, int(np.ceil(np.log2(max(1, 8 * len(darts))))))
        self._mask = buckets - 1
        touched = np.empty((8, len(darts)), np.int64)
        lows = [np.floor((axis - reach) / size).astype(np.int64) for axis in darts.point.T]
        highs = [np.floor((axis + reach) / size).astype(np.int64) for axis in darts.point.T]
        for corner in range(8):
            cell = [(lows, highs)[corner >> axis & 1][axis] for axis in range(3)]
            touched[corner] = self._bucket(cell, octave)
        flat = touched.ravel()
        self._entry = np.argsort(flat) % max(1, len(darts))
        self._start = np.zeros(buckets + 1, np.int64)
        np.cumsum(np.bincount(flat, minlength=buckets), out=self._start[1:])

    def covers(self, darts: Darts) -> Bools:
        """Whether a point lies too near to each of the darts, (n,)."""
        covered = np.zeros(len(darts), bool)
        for octave in self._octaves:
            waiting = np.flatnonzero(~covered)
            at, end = self._list(darts.point[waiting], octave)
            while len(waiting):
                is_left = at < end
                waiting, at, end = waiting[is_left], at[is_left], end[is_left]
                is_near = self._near(darts, waiting, self._entry[at])
                covered[waiting[is_near]] = True
                waiting, at, end = waiting[~is_near], at[~is_near] + 1, end[~is_near]
        return covered

    def pairs(self) -> tuple[Ints, Ints]:
        """All (later, earlier) points that are too near to each other, (n,) each."""
        laters, earliers = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        for octave in self._octaves:
            at, end = self._list(self._darts.point, octave)
            one = np.repeat(np.arange(len(self._darts)), end - at)
            first = np.repeat(at - np.cumsum(end - at) + (end - at), end - at)
            other = self._entry[first + np.arange(len(one))]
            is_near = (one != other) & self._near(self._darts, one, other)
            laters.append(np.maximum(one, other)[is_near])
            earliers.append(np.minimum(one, other)[is_near])
        return np.concatenate(laters), np.concatenate(earliers)

    def _near(self, darts: Darts, one: Ints, own: Ints) -> Bools:
        gap = darts.point[one] - self._darts.point[own]
        reach = np.minimum(darts.reach[one], self._darts.reach[own]) * self._radius
        return np.einsum("ij,ij->i", gap, gap) < reach * reach

    def _list(self, point: Floats, octave: int) -> tuple[Ints, Ints]:
        """Begin and end of the entries of the cell in which each point lies."""
        size = self._size(octave)
        cell = [np.floor(axis / size).astype(np.int64) for axis in point.T]
        bucket = self._bucket(cell, octave)
        return self._start[bucket], self._start[bucket + 1]

    def _size(self, octave: Ints | int) -> Floats:
        return 2.0 * self._radius * np.exp2(octave)

    def _bucket(self, cell: list[Ints], octave: Ints | int) -> Ints:
        x, y, z = cell
        mixed = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791) ^ (octave * 50331653)
        return (mixed ^ (mixed >> 17)) & self._mask


def first_come(darts: Darts, radius: float) -> Bools:
    """Which darts stay, (n,): those that are not too near to an earlier one that stays."""
    later, earlier = DartCells(darts, radius).pairs()
    stays = np.zeros(len(darts), bool)
    is_open = np.ones(len(darts), bool)
    while is_open.any():
        waits = np.zeros(len(darts), bool)
        waits[later] = True
        stays |= is_open & ~waits
        is_open &= waits
        is_open[later[stays[earlier]]] = False
        is_pair_open = is_open[later] & is_open[earlier]
        later, earlier = later[is_pair_open], earlier[is_pair_open]
    return stays
