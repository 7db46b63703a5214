"""Points on Bezier curves, NURBS and polygons against closed forms. tests/blender/test_curves.py
compares them with Blender's conversion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairloom.addon.arrays import Floats
from hairloom.addon.strands.curve_types import (
    CurveShapes,
    CurveType,
    EvaluatedCurves,
    KnotMode,
    evaluate_curves,
)


def shapes_of(
    points: Floats, kind: CurveType, order: int = 4, knots: KnotMode = KnotMode.ENDPOINT
) -> CurveShapes:
    """The shape of a single curve with these control points."""
    one = np.ones(1, np.int32)
    weight = np.ones(len(points), np.float32)
    return CurveShapes(kind * one, 12 * one, order * one, knots * one, weight, points, points)


def drawn(points: Floats, shapes: CurveShapes) -> EvaluatedCurves:
    return evaluate_curves(np.float32(points), np.array([0, len(points)]), shapes)


def test_a_quarter_of_a_circle_is_a_quarter_of_a_circle() -> None:
    """As NURBS of order 3 whose middle point has the weight cos(45 degrees)."""
    points = np.float32([[1, 0, 0], [1, 1, 0], [0, 1, 0]])
    shapes = shapes_of(points, CurveType.NURBS, order=3)
    found = drawn(points, replace(shapes, weight=np.float32([1.0, np.sqrt(0.5), 1.0])))
    np.testing.assert_allclose(np.linalg.norm(found.points, axis=1), 1.0, atol=1e-6)
    np.testing.assert_array_equal(found.points[[0, -1]], points[[0, -1]])


def test_nurbs_with_knots_of_bezier_curves_are_bezier_curves() -> None:
    points = np.random.default_rng(1).normal(size=(7, 3)).astype(np.float32)
    nurbs = drawn(points, shapes_of(points, CurveType.NURBS, 4, KnotMode.ENDPOINT_BEZIER))
    ends = points[::3]
    left, right = ends.copy(), ends.copy()
    right[:-1], left[1:] = points[1::3], points[2::3]
    shapes = replace(shapes_of(ends, CurveType.BEZIER), left=left, right=right)
    np.testing.assert_allclose(nurbs.points, drawn(ends, shapes).points, atol=1e-5)


def test_values_go_along_with_the_points() -> None:
    points = np.linspace(0.0, 1.0, 5)[:, None] * np.float32([0.0, 0.0, 1.0])
    handle = np.float32([0.0, 0.0, 1.0 / 12.0])  # a straight Bezier curve at constant speed
    for kind in CurveType:
        shapes = shapes_of(points, kind, order=3)
        found = drawn(points, replace(shapes, left=points - handle, right=points + handle))
        np.testing.assert_allclose(found.of(points), found.points, atol=1e-6)
        assert found.of(points[:, 2]).shape == (len(found.points),)


def test_polygons_of_hair_stay_as_they_are_and_corners_stay_corners() -> None:
    turn = np.linspace(0.0, 1.0, 16)
    bent = np.stack([np.sin(turn), 0.0 * turn, np.cos(turn)], axis=1)
    assert len(drawn(bent, shapes_of(bent, CurveType.POLY)).points) == 16
    corner = np.float32([[0, 0, 0], [0, 0, 1], [1, 0, 1]])
    assert len(drawn(corner, shapes_of(corner, CurveType.POLY)).points) > 16


def test_curves_without_points_stay_without() -> None:
    one = np.array([1, 2, 3], np.int32)
    points = np.zeros((1, 3), np.float32)
    shapes = CurveShapes(one, one, 4 + one, 0 * one, np.ones(1), points, points)
    found = evaluate_curves(points, np.array([0, 0, 1, 1]), shapes)
    assert found.offsets.tolist() == [0, 0, 1, 1]
