"""Array types for annotations; arrays and what holds them that are the same; rows of pieces that
follow each other; sums and means of rows by number.

Shapes, units, dtype and space are said where an array is born.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Floats = NDArray[np.floating[Any]]
type Ints = NDArray[np.integer[Any]]
type Bools = NDArray[np.bool_]


def are_same(one: Floats | Ints | None, other: Floats | Ints | None) -> bool:
    """Whether two arrays are equal, with NaN in the same places, or both missing."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other, equal_nan=True)


def same_content(one: Any, other: Any) -> bool:
    """Whether the same comes of both, to the last bit: of arrays, and of data classes, tuples and
    mappings that hold them. What a data class has found of itself does not count."""
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
    """Where each piece begins, (n,), of pieces of this many rows that follow each other."""
    return np.cumsum(counts) - counts


def number_in_piece(counts: Ints) -> Ints:
    """The number of each row in its piece, (row_count,), see `piece_starts`."""
    numbers: Ints = np.arange(counts.sum()) - np.repeat(piece_starts(counts), counts)
    return numbers


def sums_by(number: Ints, rows: Floats, count: int = 0) -> Floats:
    """The sum of the rows (n,) or (n, k) of each number, (count,) or (count, k) float64;
    `count` is at least one more than the largest number."""
    if rows.ndim == 1:
        return np.bincount(number, rows, count)
    return np.stack([np.bincount(number, column, count) for column in rows.T], axis=1)


def means_by(number: Ints, rows: Floats, count: int) -> Floats:
    """The same of their means; 0 where no row has the number."""
    times = np.maximum(np.bincount(number, minlength=count), 1)
    means: Floats = sums_by(number, rows, count) / times.reshape(-1, *(1,) * (rows.ndim - 1))
    return means
