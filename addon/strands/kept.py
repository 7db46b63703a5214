"""What was found or made last, so that only what is other now is found or made again.

An artist combs or paints a part of the hair, and the rest is as it was. What is kept is compared
bit for bit and used only where the answer is the same to the last bit, so that nobody can tell it
from one that was made from nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from .nearest import nearest_points
from .side_by_side import even_parts, side_by_side

#: What the numbers of a row are multiplied by to find it: odd, so that rows that differ in one
#: number alone never look alike.
_FACTORS = np.random.default_rng(7).integers(0, 1 << 63, 1 << 13, np.uint64) * 2 + 1

#: A thread has at least this many rows to make something of.
_OF_THREAD = 2048

type Rows = tuple[Any, ...]


class Kept:
    """Each thing by its name, as it was made last.

    Args:
        forgets: whether nothing is kept.
    """

    def __init__(self, *, forgets: bool = False) -> None:
        self._forgets = forgets
        self._rows: dict[str, _MadeRows] = {}
        self._nearest: dict[str, _Nearest] = {}

    def rows(
        self, name: str, fixed: tuple[Any, ...], rows: Rows, make: Callable[[Ints], Rows]
    ) -> Rows:
        """What `make` makes of all rows, by asking it for those alone that are new: others may have
        been anywhere among the last ones.

        Args:
            fixed: all else that it depends on, which is compared.
            rows: arrays (n, ...) of which each row of the answer depends on the same row alone.
            make: arrays (k, ...) of some rows (k,), which are not to be changed afterwards; is
                called from several threads.
        """
        if self._forgets:
            return _made(make, np.arange(len(rows[0])))
        bits = np.concatenate([_bits(each) for each in rows], axis=1)
        last = self._rows.get(name)
        if last is None or last.fixed != fixed or last.bits.shape[1] != bits.shape[1]:
            made = _made(make, np.arange(len(bits)))
        else:
            made = last.made_of(bits, make)
        self._rows[name] = _MadeRows(fixed, bits, made)
        return made

    def nearest(self, name: str, places: Floats, among: Floats, count: int) -> tuple[Ints, Floats]:
        """`nearest_points`, by asking for places alone whose nearest points may be others now."""
        if self._forgets:
            return nearest_points(places, among, count)
        last = self._nearest.get(name)
        if last is not None and count == last.count <= min(len(among), len(last.among)):
            index, distance = last.again(places, among)
        else:
            index, distance = nearest_points(places, among, count)
        self._nearest[name] = _Nearest(places, among, count, index, distance)
        return index.copy(), distance.copy()


#: Keeps nothing.
NOTHING_KEPT = Kept(forgets=True)


@dataclass(frozen=True, eq=False)
class _MadeRows:
    """bits: (n, width) uint32, all of the rows. made: arrays (n, ...) of these."""

    fixed: tuple[Any, ...]
    bits: Ints
    made: Rows

    def made_of(self, bits: Ints, make: Callable[[Ints], Rows]) -> Rows:
        """What was made of these rows, and what is made now of those that are new."""
        found = _found(bits, self.bits)
        missing = np.flatnonzero(found < 0)
        if not len(missing) and np.array_equal(found, np.arange(len(self.bits))):
            return self.made
        result = tuple(each[found] for each in self.made)
        if len(missing):
            for whole, part in zip(result, _made(make, missing), strict=True):
                whole[missing] = part
        return result


@dataclass(frozen=True, eq=False)
class _Nearest:
    """What was asked for, and the answer."""

    places: Floats
    among: Floats
    count: int
    index: Ints
    distance: Floats

    def again(self, places: Floats, among: Floats) -> tuple[Ints, Floats]:
        """The answer for these: asked for again where a place or one of its nearest points is new
        or gone, and where a new point is as near as these."""
        place, point = _found(_bits(places), _bits(self.places)), _back(among, self.among)
        if point is None:
            return nearest_points(places, among, self.count)
        index, distance = point[self.index[place]], self.distance[place]
        stale = (place < 0) | (index < 0).any(axis=1)
        is_new = np.ones(len(among), bool)
        is_new[point[point >= 0]] = False
        rest = np.flatnonzero(~stale)
        if is_new.any() and len(rest):
            reach, some = distance[rest, -1:], places[rest]
            low, high = among[is_new].min(axis=0), among[is_new].max(axis=0)
            rest = rest[((some >= low - reach) & (some <= high + reach)).all(axis=1)]
            _, gap = nearest_points(places[rest], among[is_new], 1)
            stale[rest] = gap[:, 0] <= distance[rest, -1]
        index[stale], distance[stale] = nearest_points(places[stale], among, self.count)
        return index, distance


def _made(make: Callable[[Ints], Rows], rows: Ints) -> Rows:
    """What is made of these rows, in several threads."""
    parts = side_by_side(lambda some: make(rows[some]), even_parts(len(rows), _OF_THREAD))
    if len(parts) == 1:
        return parts[0]
    return tuple(np.concatenate(each) for each in zip(*parts, strict=True))


def same_rows(rows: Any, among: Any) -> Ints:
    """Where rows (n, ...) are among others (m, ...), bit by bit, (n,); -1: nowhere."""
    return _found(_bits(rows), _bits(among))


def _back(among: Floats, before: Floats) -> Ints | None:
    """Which of the points (n, 3) each of those before (m, 3) is, (m,); -1: none. None where points
    coincide, or have changed their order, so that of two as near as each other the other counts."""
    found = _found(_bits(among), _bits(before))
    known = np.flatnonzero(found >= 0)
    if (np.diff(found[known]) <= 0).any():
        return None
    back = np.full(len(before), -1)
    back[found[known]] = known
    return back


def _found(bits: Ints, among: Ints) -> Ints:
    """Where rows (n, width) are among others (m, width), (n,); -1: nowhere."""
    found = np.full(len(bits), -1)
    if bits.shape == among.shape:
        is_same = (bits == among).all(axis=1)
        found[is_same] = np.flatnonzero(is_same)
    left = np.flatnonzero(found < 0)
    if len(left) and len(among):
        factors = _FACTORS[: bits.shape[1]]
        codes = among @ factors
        order = np.argsort(codes, kind="stable")
        place = np.searchsorted(codes[order], bits[left] @ factors)
        maybe = order[np.minimum(place, len(order) - 1)]
        is_same = (bits[left] == among[maybe]).all(axis=1)
        found[left[is_same]] = maybe[is_same]
    return found


def _bits(values: Any) -> Ints:
    """Of an array (n, ...), (n, width) uint32."""
    rows = np.ascontiguousarray(values)
    bits: Ints = rows.reshape(len(rows), math.prod(rows.shape[1:])).view(np.uint32)
    return bits
