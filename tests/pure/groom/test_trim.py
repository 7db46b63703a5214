"""Trim: strands are cut where they leave a shape, against formulas and brute force."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.trim import Plane, plane_of_flat_mesh, trim_strands
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.crossings import first_crossings

DOWN = np.array([0.0, 0.0, -1.0])


def straight(roots: Floats, way: Floats, counts: Floats | int = 9) -> StrandSet:
    """Straight strands from these roots along `way`, with spacing that grows towards the tip."""
    number = np.broadcast_to(counts, len(roots))
    parts = [np.linspace(0.0, 1.0, count) ** 1.5 for count in number]
    points = [root + part[:, None] * w for root, part, w in zip(roots, parts, way, strict=True)]
    offsets = np.concatenate([[0], np.cumsum(number)])
    radius = np.concatenate([1.0e-4 * (1.0 - 0.5 * part) for part in parts])
    return StrandSet(np.concatenate(points), offsets, radius, np.zeros(len(roots)))


def box(half: float, low: float = 0.0) -> Surface:
    """A closed box around the origin."""
    sign = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Surface(sign * half + low, np.array(triangles))


def test_straight_hair_ends_on_the_plane_and_keeps_its_points() -> None:
    random = np.random.default_rng(3)
    roots = random.uniform(-0.1, 0.1, (50, 3)) + [0.0, 0.0, 0.3]
    way = random.uniform(-0.1, 0.1, (50, 3)) + [0.0, 0.0, -0.3]
    counts = random.integers(2, 12, 50)
    strands = straight(roots, way, counts)
    normal = np.array([0.1, -0.2, 1.0]) / np.linalg.norm([0.1, -0.2, 1.0])
    plane = Plane(np.array([0.0, 0.0, 0.12]), normal)
    cut = trim_strands(strands, [plane])
    part = ((plane.origin - roots) @ normal) / (way @ normal)
    is_cut = part < 1.0
    assert (cut.is_trimmed == is_cut).all()
    assert 5 < is_cut.sum() < 50
    assert not cut.is_outside.any()
    expected = np.concatenate(
        [
            root + (min(p, 1.0) * np.linspace(0.0, 1.0, count) ** 1.5)[:, None] * w
            for root, p, count, w in zip(roots, part, counts, way, strict=True)
        ]
    )
    assert np.abs(cut.points - expected).max() < 2e-7
    kept = np.repeat(~is_cut, counts)
    assert (cut.points[kept] == strands.points[kept]).all()


def test_a_curve_keeps_its_shape_up_to_the_cut() -> None:
    """A half circle, cut by a plane at a third: all points stay on the circle."""
    angle = np.linspace(0.0, np.pi, 25)
    circle = 0.2 * np.stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)
    strands = StrandSet(circle, np.array([0, 25]), np.full(25, 1e-4), np.zeros(1))
    at = 0.2 * (1.0 - np.cos(np.pi / 3.0))
    cut = trim_strands(strands, [Plane(np.array([at, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))])
    away = np.linalg.norm(cut.points - [0.2, 0.0, 0.0], axis=1) - 0.2
    # polylines through its points are off by 4e-4, as is the first segment of drawn curves
    assert np.abs(away).max() < 3e-4
    assert np.abs(away[4:]).max() < 1e-5
    assert cut.points[-1, 0] == pytest.approx(at, abs=1e-7)
    turned = np.arctan2(cut.points[:, 2], 0.2 - cut.points[:, 0])
    assert np.abs(turned - np.linspace(0.0, np.pi / 3.0, 25)).max() < 1e-3


def test_the_side_of_a_plane_with_most_roots_is_its_inside() -> None:
    roots = np.array([[0.0, 0.0, 0.2], [0.1, 0.0, 0.2], [0.0, 0.0, 0.05]])
    way = np.array([[0.0, 0.0, -0.2], [0.0, 0.0, -0.05], [0.0, 0.0, 0.2]])
    for normal in (DOWN, -DOWN):
        cut = trim_strands(straight(roots, way), [Plane(np.array([0.0, 0.0, 0.1]), normal)])
        assert cut.is_trimmed.tolist() == [True, False, False]
        assert cut.is_outside.tolist() == [False, False, True]


def test_of_two_shapes_the_first_that_is_left_cuts() -> None:
    roots, way = np.array([[0.0, 0.0, 0.2]]), np.array([[0.0, 0.0, -0.2]])
    planes = [Plane(np.array([0.0, 0.0, z]), -DOWN) for z in (0.05, 0.1)]
    for order in (planes, planes[::-1]):
        tip = trim_strands(straight(roots, way), order).points[-1]
        assert np.abs(tip - [0.0, 0.0, 0.1]).max() < 1e-7


def test_a_flat_mesh_cuts_as_far_as_it_reaches() -> None:
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    sheet = Surface(corners * 0.1, np.array([[0, 1, 2], [0, 2, 3]]))
    plane = plane_of_flat_mesh(sheet)
    assert plane is not None
    # one passes along the diagonal that both triangles have, and one beside the sheet
    roots = np.array([[0.02, 0.02, 0.1], [0.3, 0.0, 0.1], [-0.05, 0.09, 0.1]])
    cut = trim_strands(straight(roots, np.tile([0.0, 0.0, -0.2], (3, 1))), [plane])
    assert cut.is_trimmed.tolist() == [True, False, True]
    assert np.abs(cut.points.reshape(3, 9, 3)[[0, 2], -1, 2]).max() < 1e-7
    assert plane_of_flat_mesh(box(0.1)) is None


def test_first_crossings_are_those_of_brute_force() -> None:
    random = np.random.default_rng(5)
    places = random.uniform(-1.0, 1.0, (300, 3))
    triangles = random.integers(0, 300, (20, 3))
    surface = Surface(places, triangles)
    lines = np.cumsum(random.normal(0.0, 0.08, (400, 12, 3)), axis=1).astype(np.float32)
    lines += random.uniform(-1.0, 1.0, (400, 1, 3)).astype(np.float32)
    found = first_crossings(lines, surface)
    corners = surface.corners.astype(np.float64)
    expected = np.full(len(lines), np.inf)
    edge = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    for line, points in enumerate(lines.astype(np.float64)):
        for number in range(11):
            way = points[number + 1] - points[number]
            # Moeller and Trumbore 1997
            p = np.cross(way, edge[1])
            det = np.einsum("ij,ij->i", edge[0], p)
            with np.errstate(divide="ignore", invalid="ignore"):
                s = points[number] - corners[:, 0]
                u = np.einsum("ij,ij->i", s, p) / det
                q = np.cross(s, edge[0])
                v = (q @ way) / det
                t = np.einsum("ij,ij->i", edge[1], q) / det
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
            if hit.any():
                expected[line] = number + t[hit].min()
                break
    assert (np.isfinite(found) == np.isfinite(expected)).all()
    assert 50 < np.isfinite(found).sum() < 350
    both = np.isfinite(found)
    assert np.abs(found[both] - expected[both]).max() < 1e-6


def test_a_root_on_the_surface_is_no_crossing() -> None:
    ground = box(0.1)
    lines = np.array([[[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]], [[0.0, 0.0, 0.1], [0.0, 0.0, -0.4]]])
    assert np.isinf(first_crossings(lines[:1], ground)).all()
    assert first_crossings(lines[1:], ground)[0] == pytest.approx(0.4)
