"""Fragments against rays through each pixel, and pairs against plain loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.order_check import visible_fragments
from hairloom.addon.cards.order_pairs import (
    MIN_WEIGHT,
    concatenated_pairs,
    fragment_pairs,
    pairs_by_view,
)
from hairloom.addon.cards.order_views import (
    Fragments,
    SphereView,
    bounding_sphere,
    rasterized,
    sorted_far_to_near,
    surface_nearness,
    view_directions,
)
from hairloom.addon.cards.sort import dangling_groups, section_of_groups
from hairloom.addon.strands import Surface


def loose_triangles(count: int = 12, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    points = random.uniform(-0.9, 0.9, (3 * count, 3))
    return points, np.arange(3 * count).reshape(-1, 3)


def as_cards(points: np.ndarray, triangles: np.ndarray) -> CardMesh:
    ones = np.ones(len(points))
    return CardMesh(
        positions=points,
        triangles=triangles,
        uv=np.zeros((len(points), 2)),
        normal=points,
        tangent=points,
        occlusion=ones,
        card=np.arange(len(triangles)),
        along=ones,
    )


def hits(
    view: SphereView, corners: np.ndarray
) -> dict[tuple[int, int], tuple[float, bool, np.ndarray]]:
    """(pixel, triangle) -> depth towards the eye, whether it is a front face, and barycentric
    coordinates, from a ray through each pixel's centre and each triangle's plane.
    """
    right = np.cross([0.0, 1.0e-3, 1.0], view.direction)
    right /= np.linalg.norm(right)
    up = np.cross(view.direction, right)
    eye = view.middle + view.direction * view.distance
    found = {}
    for pixel in range(view.size**2):
        row, column = divmod(pixel, view.size)
        x, y = ((np.array([column, row]) + 0.5) / view.size * 2.0 - 1.0) * view.radius
        if np.isinf(view.distance):
            start, way = view.middle + x * right + y * up, -view.direction
        else:  # the sphere touches the picture's border
            x, y = (each / np.sqrt(1.0 - (view.radius / view.distance) ** 2) for each in (x, y))
            start, way = eye, view.middle + x * right + y * up - eye
        for number, (a, b, c) in enumerate(corners):
            system = np.stack([b - a, c - a, -way], axis=1)
            if abs(np.linalg.det(system)) < 1e-12:
                continue
            second, third, far = np.linalg.solve(system, start - a)
            if second >= 0.0 and third >= 0.0 and second + third <= 1.0:
                shares = np.array([1.0 - second - third, second, third])
                is_front = np.dot(np.cross(b - a, c - a), way) < 0.0
                found[pixel, number] = (-far, is_front, shares)
    return found


@pytest.mark.parametrize("distance", [np.inf, 4.0])
def test_fragments_are_where_rays_meet_triangles(distance: float) -> None:
    points, triangles = loose_triangles()
    direction = np.array([0.48, -0.6, 0.64])
    view = SphereView(np.array([0.1, 0.0, -0.1]), 1.6, direction, 28, distance)
    met = rasterized(view, points, triangles)
    truth = hits(view, points[triangles])
    assert len(truth) > 150
    found = {}
    for index in range(len(met.pixel)):
        shares = np.array([0.0, met.second[index], met.third[index]])
        shares[0] = 1.0 - shares.sum()
        key = int(met.pixel[index]), int(met.triangle[index])
        found[key] = met.nearness[index], met.is_front[index], shares
    assert len(set(truth) ^ set(found)) <= 2  # rounding at edges
    for key in set(truth) & set(found):
        assert found[key][1] == truth[key][1]
        np.testing.assert_allclose(found[key][2], truth[key][2], atol=2e-4)
    sorted_met = sorted_far_to_near(met)
    for pixel in range(view.size**2):
        own = sorted_met.triangle[sorted_met.pixel == pixel].tolist()
        depths = [truth[pixel, number][0] for number in own if (pixel, number) in truth]
        assert depths == sorted(depths)


def test_triangles_behind_the_eye_give_no_fragments() -> None:
    points, triangles = loose_triangles(4)
    view = SphereView(np.zeros(3), 1.0, np.array([0.0, -1.0, 0.0]), 16, 2.0)
    assert len(rasterized(view, points, triangles).pixel)
    for shift in (-4.0, -9.0):
        assert not len(rasterized(view, points + [0.0, shift, 0.0], triangles).pixel)
    reaching_past = np.array([[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.4, -3.0, 0.5]])
    assert not len(rasterized(view, reaching_past, np.array([[0, 1, 2]])).pixel)
    assert not len(rasterized(view, points[:0], triangles[:0]).pixel)
    assert (surface_nearness(view, None) == -np.inf).all()


def test_directions_are_spread_over_the_elevations_of_views() -> None:
    directions = view_directions(400)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    elevation = np.degrees(np.arcsin(directions[:, 2]))
    assert -20.0 <= elevation.min() < -19.0
    assert 64.0 < elevation.max() <= 65.0
    quarter = np.degrees(np.arctan2(directions[:, 1], directions[:, 0])) // 90.0
    assert (np.unique(quarter, return_counts=True)[1] == 100).all()


def test_pairs_are_those_of_a_double_loop() -> None:
    random = np.random.default_rng(4)
    count = 400
    pixel = np.sort(random.integers(0, 60, count))
    met = Fragments(
        pixel,
        random.integers(0, 50, count),
        random.random(count),
        random.random(count) < 0.7,
        np.zeros(count),
        np.zeros(count),
    )
    covers = random.uniform(0.05, 0.95, count)
    expected = []
    for one in range(count):
        for two in range(one + 1, count):
            if pixel[one] == pixel[two]:
                others = [at for at in range(one + 1, count) if pixel[at] == pixel[one]]
                through = np.prod([1.0 - covers[at] for at in others if at != two])
                weight = covers[one] * covers[two] * through
                facing = int(met.is_front[one]) if met.is_front[one] == met.is_front[two] else 2
                if weight >= MIN_WEIGHT:
                    expected.append((met.triangle[one], met.triangle[two], weight, facing))
    pairs = fragment_pairs(met, covers)
    found = list(zip(pairs.farther, pairs.nearer, pairs.weight / 1000, pairs.facing, strict=True))
    assert len(found) == len(expected) > 300
    np.testing.assert_allclose(sorted(found), sorted(expected), atol=6e-4)


def test_a_view_from_behind_is_the_view_from_the_front_turned_over() -> None:
    """Against two separate renderings. Normally both views are made from the same fragments."""
    points, triangles = loose_triangles(20, seed=2)
    points *= 0.5
    ball = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]) * 0.2
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    mesh, head = as_cards(points, triangles), Surface(ball, np.array(faces))
    random = np.random.default_rng(5)
    mesh = replace(mesh, uv=random.random((len(points), 2)))
    alpha = random.choice([0.0, 0.3, 0.6, 1.0], (6, 6))
    expected = []
    for direction in view_directions(5):
        for sign in (1.0, -1.0):
            if sign * direction[2] < np.sin(np.radians(-20.0)):
                continue
            view = SphereView(*bounding_sphere(mesh), sign * direction, 32)
            seen = visible_fragments(mesh, head, view, alpha)
            is_blended = seen.alpha < 1.0
            pairs = fragment_pairs(seen.fragments[is_blended], seen.alpha[is_blended])
            expected += zip(pairs.farther, pairs.nearer, pairs.weight, pairs.facing, strict=True)
    pairs = concatenated_pairs(list(pairs_by_view(mesh, head, 5, 32, alpha)))
    found = list(zip(pairs.farther, pairs.nearer, pairs.weight, pairs.facing, strict=True))
    missed = sum(abs(found.count(pair) - expected.count(pair)) for pair in set(found + expected))
    assert len(expected) > 400
    assert missed <= 0.01 * len(expected)  # pixels at an edge


def test_only_a_group_far_beyond_all_others_dangles() -> None:
    random = np.random.default_rng(0)
    group = np.repeat([4, 2, 9, 5], 50)
    near = random.uniform(0.0, 0.05, 200)
    assert dangling_groups(group, near) == []
    assert dangling_groups(np.zeros(200, int), near) == []
    assert dangling_groups(group[:0], near[:0]) == []
    tails = near + 0.1 * (group == 9) + 0.2 * (group == 2)
    assert dangling_groups(group, tails) == [9, 2]
    np.testing.assert_array_equal(section_of_groups(group, [9, 2]), np.repeat([0, 2, 1, 0], 50))
