"""When two objects that hold arrays count as equal to the last bit, and rows of pieces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import (
    all_equal,
    pieces_of_rows,
    rows_of_pieces,
    rows_of_ranges,
    same_content,
)
from hairloom.addon.strands import Surface


@dataclass(frozen=True, eq=False)
class Held:
    array: Any
    name: str = ""


CORNERS = np.eye(3, dtype=np.float32)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.array([0.0, np.nan]), np.array([0.0, np.nan])),
        (np.zeros((0, 3)), np.zeros((0, 3))),
        (np.arange(6)[::2], np.array([0, 2, 4])),
        (Held(CORNERS, "a"), Held(CORNERS.copy(), "a")),
        ((1, Held(None)), (1, Held(None))),
        ({"a": CORNERS}, {"a": CORNERS.copy()}),
    ],
)
def test_it_is_the_same(one: Any, other: Any) -> None:
    assert same_content(one, other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.array([0.0]), np.array([-0.0])),
        (CORNERS, CORNERS.astype(np.float64)),
        (CORNERS, CORNERS.ravel()),
        (CORNERS, None),
        (Held(CORNERS, "a"), Held(CORNERS, "b")),
        (Held(CORNERS), Held(2.0 * CORNERS)),
        ((1,), (1, 2)),
        ({"a": 1}, {"b": 1}),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
    ],
)
def test_it_is_not_the_same(one: Any, other: Any) -> None:
    assert not same_content(one, other)


def test_lists_are_equal_if_all_their_values_are() -> None:
    """Arrays of any shape and type, numbers, texts and None."""
    values = [CORNERS, 1, "a", None]
    assert all_equal(values, (CORNERS.astype(np.float64), 1, "a", None))
    assert not all_equal(values, values[:3])
    for other in ([CORNERS[:2], 1, "a", None], [CORNERS, 1, "b", None], [CORNERS, 1, "a", CORNERS]):
        assert not all_equal(values, other)


def test_what_was_found_of_it_does_not_count() -> None:
    one, other = (Surface(CORNERS, np.array([[0, 1, 2]])) for _ in range(2))
    one.vertex_normals()
    assert same_content(one, other) and same_content(other, one)


def test_rows_of_pieces_follow_each_other() -> None:
    """In any order, several times, and without any for a piece without rows."""
    offsets = np.array([0, 3, 3, 5, 9], np.int32)
    assert rows_of_pieces(np.array([3, 0, 1, 0]), offsets).tolist() == [5, 6, 7, 8, *[0, 1, 2] * 2]
    assert rows_of_pieces(np.zeros(0, np.int64), offsets).tolist() == []
    assert rows_of_ranges(np.array([4, 2]), np.array([2, 3])).tolist() == [4, 5, 2, 3, 4]
    assert pieces_of_rows(np.array([0, 2, 3, 8]), offsets).tolist() == [0, 0, 2, 3]
