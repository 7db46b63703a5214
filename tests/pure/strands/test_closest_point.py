"""Closest points against Ericson's region tests, a box in closed form, and broken triangles."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import ClosestPointSearch, closest_point
from hairloom.addon.strands.triangle_distance import TriangleForms

pytestmark = pytest.mark.portable

BOX_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
BOX_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
BOX = Surface(BOX_CORNERS, [q[:3] for q in BOX_QUADS] + [(q[0], q[2], q[3]) for q in BOX_QUADS])


def ericson(p: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """ClosestPtPointTriangle of Real-Time Collision Detection, section 5.1.5, for one point."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = ab @ ap, ac @ ap
    if d1 <= 0 and d2 <= 0:
        return a
    bp = p - b
    d3, d4 = ab @ bp, ac @ bp
    if d3 >= 0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return a + ab * d1 / (d1 - d3)
    cp = p - c
    d5, d6 = ab @ cp, ac @ cp
    if d6 >= 0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return a + ac * d2 / (d2 - d6)
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        return b + (c - b) * (d4 - d3) / ((d4 - d3) + (d5 - d6))
    return a + (ab * vb + ac * vc) / (va + vb + vc)


@pytest.mark.parametrize("triangle_count", [1, 2, 3, 5, 37, 300])
def test_soup_of_triangles_agrees_with_ericson(triangle_count: int) -> None:
    random = np.random.default_rng(triangle_count)
    corners = random.uniform(-1, 1, (triangle_count, 1, 3)) + random.normal(
        0, 0.2, (triangle_count, 3, 3)
    )
    surface = Surface(corners.reshape(-1, 3), np.arange(triangle_count * 3).reshape(-1, 3))
    points = random.uniform(-2, 2, (60, 3))
    found = closest_point(points, surface)
    exact = surface.corners.astype(np.float64)
    for index, point in enumerate(points):
        candidates = np.array([ericson(point, *triangle) for triangle in exact])
        distance = np.linalg.norm(candidates - point, axis=1)
        assert found.distance[index] == pytest.approx(distance.min(), abs=1e-12)
        assert found.point[index] == pytest.approx(candidates[distance.argmin()], abs=1e-9)
        assert found.triangle[index] == distance.argmin()


def test_box_in_closed_form_inside_and_outside() -> None:
    points = np.random.default_rng(2).uniform(-1, 2, (5000, 3))
    outside = np.linalg.norm(points - np.clip(points, 0, 1), axis=1)
    inside = np.minimum(points, 1 - points).min(axis=1)
    expected = np.where(outside > 0, outside, inside)
    assert closest_point(points, BOX).distance == pytest.approx(expected, abs=1e-12)


def test_barycentric_coordinates_give_the_point_and_are_inside() -> None:
    points = np.random.default_rng(3).uniform(-1, 2, (500, 3))
    found = closest_point(points, BOX)
    corners = BOX.corners[found.triangle]
    again = np.einsum("nk,nkj->nj", found.barycentric, corners)
    assert again == pytest.approx(found.point, abs=1e-12)
    assert found.barycentric.min() >= -1e-15
    assert found.barycentric.sum(axis=1) == pytest.approx(1.0)


def test_points_on_the_surface_have_distance_zero() -> None:
    random = np.random.default_rng(4)
    weights = random.dirichlet([1, 1, 1], 12)
    points = np.einsum("tk,tkj->tj", weights, BOX.corners.astype(np.float64))
    assert closest_point(points, BOX).distance.max() < 1e-15


def test_degenerate_triangles_act_as_the_segment_or_point_that_they_are() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]], float)
    surface = Surface(positions, [[0, 1, 2], [0, 0, 2], [0, 2, 2], [2, 0, 1], [3, 3, 3]])
    points = np.random.default_rng(5).uniform(-1, 6, (400, 3))
    on_segment = np.stack([np.clip(points[:, 0], 0, 2), 0 * points[:, 0], 0 * points[:, 0]], axis=1)
    to_segment = np.linalg.norm(points - on_segment, axis=1)
    to_point = np.linalg.norm(points - positions[3], axis=1)
    found = closest_point(points, surface)
    assert found.distance == pytest.approx(np.minimum(to_segment, to_point), abs=1e-12)
    assert np.isfinite(found.barycentric).all()


def test_sliver_is_answered_to_within_its_width() -> None:
    surface = Surface([[0, 0, 0], [1, 0, 0], [0.5, 1e-7, 0]], [[0, 1, 2]])
    points = np.random.default_rng(6).uniform(-0.2, 1.2, (200, 3))
    nearest = np.stack([np.clip(points[:, 0], 0, 1), 0 * points[:, 0], 0 * points[:, 0]], axis=1)
    expected = np.linalg.norm(points - nearest, axis=1)
    assert closest_point(points, surface).distance == pytest.approx(expected, abs=2e-7)


def test_middle_of_a_sphere_is_equally_far_from_everything() -> None:
    """All triangles are candidates, the widest possible search, beyond the limit of pairs."""
    around, up = np.meshgrid(np.linspace(0, 2 * np.pi, 129)[:-1], np.linspace(0, np.pi, 65))
    positions = np.stack(
        [np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1
    ).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(64), np.arange(128), indexing="ij")
    a, b = row * 128 + column, row * 128 + (column + 1) % 128
    triangles = np.concatenate([np.stack([a, a + 128, b], -1), np.stack([b, a + 128, b + 128], -1)])
    surface = Surface(positions, triangles.reshape(-1, 3))
    points = np.random.default_rng(7).normal(0, 1e-9, (600, 3))
    distance = closest_point(points, surface).distance
    assert distance.max() < 1.0
    assert distance.min() > 0.998


def test_far_from_the_origin_loses_only_what_float32_positions_lose() -> None:
    points = np.random.default_rng(8).uniform(-1, 2, (100, 3))
    near = closest_point(points, BOX).distance
    moved = Surface(BOX.positions + 1024.0, BOX.triangles)
    assert closest_point(points + 1024.0, moved).distance == pytest.approx(near, abs=1e-9)


def test_reach_keeps_near_answers_and_tells_far_ones_apart() -> None:
    points = np.random.default_rng(9).uniform(-1, 2, (2000, 3))
    search = ClosestPointSearch(BOX)
    exact, short = search.closest(points), search.closest(points, reach=0.25)
    is_near = exact.distance <= 0.25
    assert 0 < is_near.sum() < len(points)
    assert short.distance[is_near] == pytest.approx(exact.distance[is_near], abs=1e-15)
    assert short.distance[~is_near].min() > 0.25


@pytest.mark.alike
@pytest.mark.parametrize(("spread", "shift"), [(0.01, 0.0), (0.2, 0.0), (0.02, 3.0), (3.0, 0.0)])
@pytest.mark.parametrize("reach", [np.inf, 0.3])
def test_points_that_lie_together_agree_with_all_triangles(
    spread: float, shift: float, reach: float
) -> None:
    """Against all triangles: clusters of points near and far from a soup of triangles of all
    sizes."""
    random = np.random.default_rng(11)
    sizes = random.uniform(0.01, 0.4, (300, 1, 1))
    corners = random.uniform(-1, 1, (300, 1, 3)) + sizes * random.normal(size=(300, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    middles = random.uniform(-1, 1, (12, 1, 3)) + shift
    points = (middles + spread * random.normal(size=(12, 80, 3))).reshape(-1, 3)
    found = ClosestPointSearch(surface).closest(points, reach)
    every = TriangleForms(surface.corners.astype(np.float64))
    brute = np.sqrt(
        [every.squared_distance(np.tile(point, (300, 1)), np.arange(300)) for point in points]
    )
    is_near = brute.min(axis=1) <= reach
    assert found.distance[is_near] == pytest.approx(brute.min(axis=1)[is_near], abs=1e-12)
    assert (found.triangle == brute.argmin(axis=1))[is_near].all()
    assert (found.distance[~is_near] > reach).all()


def test_a_cluster_in_the_middle_of_a_ball_finds_the_nearest_of_all_its_triangles() -> None:
    """So many triangles may be the nearest one that the search goes point by point."""
    random = np.random.default_rng(12)
    directions = random.normal(size=(4000, 1, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    corners = directions + 0.01 * random.normal(size=(4000, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(12000).reshape(-1, 3))
    points = 0.01 * random.normal(size=(200, 3))
    every = TriangleForms(surface.corners.astype(np.float64))
    brute = [every.squared_distance(np.tile(p, (4000, 1)), np.arange(4000)).min() for p in points]
    assert closest_point(points, surface).distance == pytest.approx(np.sqrt(brute), abs=1e-12)


def test_no_points_and_no_triangles() -> None:
    assert len(closest_point(np.zeros((0, 3)), BOX).distance) == 0
    with pytest.raises(HairloomError, match="no faces"):
        closest_point(np.zeros((1, 3)), Surface(np.zeros((3, 3)), np.zeros((0, 3))))
