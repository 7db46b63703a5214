"""Array types for annotations, comparison of arrays and their containers, rows of pieces stored end
to end, sums and means of rows grouped by number.

Of pieces stored end to end, such as strands, piece p is rows offsets[p]:offsets[p + 1].

Shape, unit, dtype and space of an array are documented where it is created.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Floats = NDArray[np.floating[Any]]
type Ints = NDArray[np.integer[Any]]
type Bools = NDArray[np.bool_]


def are_same(one: Floats | Ints | None, other: Floats | Ints | None) -> bool:
    """Whether two arrays of any shape are equal, with NaN in the same places, or both missing."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other, equal_nan=True)


def all_equal(some: Sequence[Any], others: Sequence[Any]) -> bool:
    """Whether two lists of values are equal: arrays of any shape, numbers, texts or None."""
    return len(some) == len(others) and all(map(np.array_equal, some, others))


def same_content(one: Any, other: Any) -> bool:
    """Whether two values are the same, bit for bit: arrays, or data classes, tuples and mappings
    that hold them. Of data classes only fields are compared, not cached properties."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        shape = one.shape == other.shape and one.dtype == other.dtype
        return shape and bool(np.array_equal(_bits(one), _bits(other)))
    if isinstance(one, Mapping):
        return list(one) == list(other) and all(same_content(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same_content, one, other))
    if is_dataclass(one):
        names = (each.name for each in fields(one))
        return all(same_content(getattr(one, name), getattr(other, name)) for name in names)
    return bool(one == other)


def _bits(array: Any) -> Ints:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8)


def piece_starts(counts: Ints) -> Ints:
    """The first row of each piece, (n,), for pieces of `counts` rows stored end to end."""
    return np.cumsum(counts) - counts


def number_in_piece(counts: Ints) -> Ints:
    """The index of each row within its piece, (row_count,), see `piece_starts`."""
    numbers: Ints = np.arange(counts.sum()) - np.repeat(piece_starts(counts), counts)
    return numbers


def rows_of_ranges(first: Ints, counts: Ints) -> Ints:
    """The rows of ranges, (n,), one range after the other, (row_count,): `counts` rows each, from
    `first` on."""
    rows: Ints = np.arange(counts.sum()) + np.repeat(first - piece_starts(counts), counts)
    return rows


def rows_of_pieces(pieces: Ints, offsets: Ints) -> Ints:
    """The rows of some pieces, indices (n,), one piece after the other, (row_count,)."""
    return rows_of_ranges(offsets[:-1][pieces], np.diff(offsets)[pieces])


def pieces_of_rows(rows: Ints, offsets: Ints) -> Ints:
    """The piece that each row is in, shaped as `rows`."""
    return np.searchsorted(offsets, rows, side="right") - 1


def sums_by(number: Ints, rows: Floats, count: int = 0) -> Floats:
    """The sums of rows, (n,) or (n, k), of equal number: (count,) or (count, k) float64; `count` is
    at least the largest number plus one, which is the default."""
    if rows.ndim == 1:
        return np.bincount(number, rows, count)
    return np.stack([np.bincount(number, column, count) for column in rows.T], axis=1)


def means_by(number: Ints, rows: Floats, count: int) -> Floats:
    """The means of rows of equal number, shaped as `sums_by`; 0 where no row has the number."""
    times = np.maximum(np.bincount(number, minlength=count), 1)
    means: Floats = sums_by(number, rows, count) / times.reshape(-1, *(1,) * (rows.ndim - 1))
    return means
