"""A cache of the last results, so that only what has changed is computed again.

An artist combs or paints a part of the hair, and the rest does not change. Inputs are compared bit
for bit, and a cached result is used only if it equals a new one to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from .nearest import nearest_points
from .parallel import even_slices, parallel_map

#: Factors of the hash of a row: odd, so that rows that differ in a single number have different
#: hashes.
_FACTORS = np.random.default_rng(7).integers(0, 1 << 63, 1 << 13, np.uint64) * 2 + 1

#: Minimum number of rows per thread.
_MIN_ROWS_PER_THREAD = 2048

type Rows = tuple[Any, ...]


class ResultCache:
    """The last result of each named computation.

    Args:
        is_disabled: whether every result is computed from scratch and none is stored.
    """

    def __init__(self, *, is_disabled: bool = False) -> None:
        self._is_disabled = is_disabled
        self._rows: dict[str, _LastRows] = {}
        self._nearest: dict[str, _LastNearest] = {}

    def rows(
        self, name: str, fixed: tuple[Any, ...], rows: Rows, make: Callable[[Ints], Rows]
    ) -> Rows:
        """The result of `make` for all rows, which is called only for new rows.

        A row is found again wherever it was among the last ones.

        Args:
            fixed: everything else that the result depends on, compared with the last call's.
            rows: input arrays (n, ...); beside `fixed`, row i of the result depends only on row i
                of these.
            make: returns arrays (k, ...) for row indices (k,); called from several threads. Its
                result must not be changed afterwards.
        """
        if self._is_disabled:
            return _compute(make, np.arange(len(rows[0])))
        bits = np.concatenate([_bits(each) for each in rows], axis=1)
        last = self._rows.get(name)
        if last is None or last.fixed != fixed or last.bits.shape[1] != bits.shape[1]:
            result = _compute(make, np.arange(len(bits)))
        else:
            result = last.rows_for(bits, make)
        self._rows[name] = _LastRows(fixed, bits, result)
        return result

    def nearest(self, name: str, places: Floats, others: Floats, count: int) -> tuple[Ints, Floats]:
        """`nearest_points` of places (n, 3) among others (m, 3), searched only for the places whose
        nearest points may have changed.
        """
        if self._is_disabled:
            return nearest_points(places, others, count)
        last = self._nearest.get(name)
        if last is not None and count == last.count <= min(len(others), len(last.others)):
            index, distance = last.updated(places, others)
        else:
            index, distance = nearest_points(places, others, count)
        self._nearest[name] = _LastNearest(places, others, count, index, distance)
        return index.copy(), distance.copy()


NO_CACHE = ResultCache(is_disabled=True)


@dataclass(frozen=True, eq=False)
class _LastRows:
    """The last call of `ResultCache.rows`.

    fixed: see there. bits: (n, width) uint32, the input rows. result: arrays (n, ...).
    """

    fixed: tuple[Any, ...]
    bits: Ints
    result: Rows

    def rows_for(self, bits: Ints, make: Callable[[Ints], Rows]) -> Rows:
        """The result for these rows: cached for those of the last call, computed for new ones."""
        found = _row_indices(bits, self.bits)
        missing = np.flatnonzero(found < 0)
        if not len(missing) and np.array_equal(found, np.arange(len(self.bits))):
            return self.result
        result = tuple(each[found] for each in self.result)
        if len(missing):
            for whole, part in zip(result, _compute(make, missing), strict=True):
                whole[missing] = part
        return result


@dataclass(frozen=True, eq=False)
class _LastNearest:
    """The last call of `ResultCache.nearest`, and its result."""

    places: Floats
    others: Floats
    count: int
    index: Ints
    distance: Floats

    def updated(self, places: Floats, others: Floats) -> tuple[Ints, Floats]:
        """The result for these places and points. A place is searched again if it is new, if one of
        its nearest points is gone, or if a new point is at least as near as the last of them."""
        place, point = (
            _row_indices(_bits(places), _bits(self.places)),
            _indices_of_earlier(others, self.others),
        )
        if point is None:
            return nearest_points(places, others, self.count)
        index, distance = point[self.index[place]], self.distance[place]
        stale = (place < 0) | (index < 0).any(axis=1)
        is_new = np.ones(len(others), bool)
        is_new[point[point >= 0]] = False
        rest = np.flatnonzero(~stale)
        if is_new.any() and len(rest):
            reach, some = distance[rest, -1:], places[rest]
            low, high = others[is_new].min(axis=0), others[is_new].max(axis=0)
            rest = rest[((some >= low - reach) & (some <= high + reach)).all(axis=1)]
            _, gap = nearest_points(places[rest], others[is_new], 1)
            stale[rest] = gap[:, 0] <= distance[rest, -1]
        index[stale], distance[stale] = nearest_points(places[stale], others, self.count)
        return index, distance


def _compute(make: Callable[[Ints], Rows], rows: Ints) -> Rows:
    """The result of `make` for these rows, computed in several threads."""
    parts = parallel_map(
        lambda some: make(rows[some]), even_slices(len(rows), _MIN_ROWS_PER_THREAD)
    )
    if len(parts) == 1:
        return parts[0]
    return tuple(np.concatenate(each) for each in zip(*parts, strict=True))


def find_rows(rows: Any, others: Any) -> Ints:
    """The index of each row (n, ...) among others (m, ...), compared bit by bit, (n,); -1: none."""
    return _row_indices(_bits(rows), _bits(others))


def _indices_of_earlier(others: Floats, before: Floats) -> Ints | None:
    """The index among the points (n, 3) of each earlier point (m, 3), (m,); -1: none.

    None if points coincide or have changed their order: then ties between equally near points may
    be resolved differently.
    """
    found = _row_indices(_bits(others), _bits(before))
    existing = np.flatnonzero(found >= 0)
    if (np.diff(found[existing]) <= 0).any():
        return None
    index = np.full(len(before), -1)
    index[found[existing]] = existing
    return index


def _row_indices(bits: Ints, others: Ints) -> Ints:
    """The index of each row (n, width) among others (m, width), (n,); -1: none."""
    found = np.full(len(bits), -1)
    if bits.shape == others.shape:
        is_same = (bits == others).all(axis=1)
        found[is_same] = np.flatnonzero(is_same)
    left = np.flatnonzero(found < 0)
    if len(left) and len(others):
        factors = _FACTORS[: bits.shape[1]]
        codes = others @ factors
        order = np.argsort(codes, kind="stable")
        place = np.searchsorted(codes[order], bits[left] @ factors)
        candidate = order[np.minimum(place, len(order) - 1)]
        is_same = (bits[left] == others[candidate]).all(axis=1)
        found[left[is_same]] = candidate[is_same]
    return found


def _bits(values: Any) -> Ints:
    """The bits of an array (n, ...) as rows (n, width) uint32."""
    rows = np.ascontiguousarray(values)
    bits: Ints = rows.reshape(len(rows), math.prod(rows.shape[1:])).view(np.uint32)
    return bits
