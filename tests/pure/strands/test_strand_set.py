"""`StrandSet`: invalid input, and its ragged arithmetic against plain loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import StrandSet

COUNTS = [2, 5, 3, 9, 2]


def ragged(**changes: Any) -> StrandSet:
    random = np.random.default_rng(1)
    offsets = np.concatenate([[0], np.cumsum(COUNTS)])
    values: dict[str, Any] = {
        "points": random.normal(size=(offsets[-1], 3)),
        "offsets": offsets,
        "radius": random.uniform(1e-5, 1e-4, offsets[-1]),
        "group": np.array([0, 0, 1, 1, 2]),
        "root_uv": random.random((len(COUNTS), 2)),
        "root_triangle": np.arange(len(COUNTS)),
        "root_barycentric": random.dirichlet([1, 1, 1], len(COUNTS)),
    }
    return StrandSet(**(values | changes))


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"points": np.zeros((20, 3))}, r"points has shape \(20, 3\) instead of \(21, 3\)"),
        ({"radius": np.zeros(3)}, "radius has shape"),
        ({"group": np.zeros(6)}, "group has shape"),
        ({"root_uv": np.zeros((5, 3))}, "root_uv has shape"),
        ({"root_barycentric": None}, "given together"),
        ({"offsets": np.array([1, 3])}, "must be a list that starts with 0"),
        ({"offsets": np.array([0, 2, 7, 10, 20, 21])}, "fewer than two points"),
        ({"points": np.full((21, 3), np.nan)}, "not finite"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], problem: str) -> None:
    with pytest.raises(HairloomError, match=problem):
        ragged(**changes)


def test_lengths_agree_with_loops() -> None:
    strands = ragged()
    lengths = [
        np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in strands.iter_strands()
    ]
    assert strands.lengths() == pytest.approx(lengths, rel=1e-6)
    assert strands.roots == pytest.approx(
        np.array([points[0] for points in strands.iter_strands()])
    )


def test_take_keeps_everything_that_belongs_to_a_strand() -> None:
    strands, chosen = ragged(), np.array([3, 0, 3])
    taken = strands.take(chosen)
    all_points, all_radii = (
        list(strands.iter_strands()),
        np.split(strands.radius, strands.offsets[1:-1]),
    )
    for points, strand in zip(taken.iter_strands(), chosen, strict=True):
        assert (points == all_points[strand]).all()
    assert (taken.radius == np.concatenate([all_radii[strand] for strand in chosen])).all()
    for name in ("group", "root_uv", "root_triangle", "root_barycentric"):
        assert (getattr(taken, name) == getattr(strands, name)[chosen]).all()


def test_arrays_cannot_be_changed_behind_the_check() -> None:
    with pytest.raises(ValueError, match="read-only"):
        ragged().points[0, 0] = np.nan


def test_transformed_scales_radii_by_the_cube_root_of_the_volume() -> None:
    matrix = np.diag([2.0, 4.0, 8.0, 1.0])
    matrix[:3, 3] = (1.0, 2.0, 3.0)
    strands, moved = ragged(), ragged().transformed(matrix)
    assert moved.points == pytest.approx(strands.points * [2, 4, 8] + [1, 2, 3], abs=1e-5)
    assert moved.radius == pytest.approx(strands.radius * 4.0)


def test_only_uniform_strands_have_a_grid() -> None:
    with pytest.raises(HairloomError, match="resample"):
        _ = ragged().grid
    pair = ragged().take(np.array([0, 4]))
    assert pair.grid.shape == (2, 2, 3)
    assert (pair.grid[1] == list(ragged().iter_strands())[4]).all()


def test_no_strands_at_all() -> None:
    none = ragged().take(np.zeros(0, np.int64))
    assert none.strand_count == none.point_count == 0
    assert none.is_uniform
    assert none.grid.shape[0] == 0
    assert none.roots.shape == (0, 3)
    assert none.lengths().shape == (0,)
    assert (np.array(none.bounds()) == 0).all()
    assert none.transformed(np.eye(4)).strand_count == 0
