"""Fitted spheres: they stick out no farther than allowed, cover the mesh, and accept bad meshes."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders.sphere_set import SphereSetCollider
from hairloom.addon.dynamics.fitting.holes import close_holes
from hairloom.addon.dynamics.fitting.settings import SphereFitSettings
from hairloom.addon.dynamics.fitting.similarity import fit_similarity
from hairloom.addon.dynamics.fitting.sphere_fit import (
    fit_spheres,
    measured_error,
    medial_balls,
    points_on_union,
)
from hairloom.addon.dynamics.fitting.surface_samples import boundary_of, samples_of
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import ClosestPointSearch


def fitted(surface, count=20, overshoot=0.01):
    settings = SphereFitSettings(sphere_count=count, overshoot=overshoot)
    return fit_spheres(surface, settings)


def both(*surfaces):
    """Several surfaces as one."""
    begin = np.cumsum([0, *(len(each.positions) for each in surfaces)])
    triangles = [each.triangles + first for each, first in zip(surfaces, begin, strict=False)]
    positions = np.concatenate([each.positions for each in surfaces])
    return Surface(positions, np.concatenate(triangles))


def shifted(surface, *way):
    return Surface(surface.positions + np.array(way, np.float32), surface.triangles)


def test_a_ball_needs_one_sphere(kit):
    fit = fitted(kit.icosphere(0.1, 3), count=1, overshoot=0.0)
    np.testing.assert_allclose(fit.centers, 0.0, atol=1e-3)
    np.testing.assert_allclose(fit.radii, 0.1, atol=2e-3)
    assert fit.error.gap_max < 3e-3 and fit.error.outside_max < 1e-4


def test_a_rod_is_covered_along_its_middle(kit):
    """Except at ends and edges, the medial axis of a long square rod is its middle line."""
    fit = fitted(kit.box((0.4, 0.05, 0.05)), count=12)
    assert np.abs(fit.centers[:, 1:]).max() < 0.02
    assert np.ptp(fit.centers[:, 0]) > 0.3


@pytest.mark.parametrize("overshoot", [0.0, 0.01, 0.03])
def test_nothing_sticks_out_farther_than_allowed(kit, overshoot):
    """Measured by the formula of a box as well as by the fit's own error."""
    size = (0.2, 0.12, 0.08)
    fit = fitted(kit.box(size), 20, overshoot)
    beyond = np.abs(fit.centers) + fit.radii[:, None] - np.array(size) / 2.0
    assert beyond.max() < overshoot * 0.2 + 1e-6
    assert fit.error.outside_max <= overshoot * 0.2 + 1e-5


@pytest.mark.slow
def test_more_spheres_leave_smaller_gaps(kit):
    gaps = [fitted(kit.box((0.2, 0.12, 0.08)), count).error.gap_mean for count in (5, 20, 60)]
    assert gaps[0] > 1.5 * gaps[1] > 2.25 * gaps[2]


@pytest.mark.slow
def test_no_other_choice_of_the_same_size_does_better_by_chance(kit):
    """Against many random choices of the same number of medial balls."""
    surface = both(kit.box((0.2, 0.05, 0.05)), shifted(kit.icosphere(0.04, 2), 0.0, 0.0, 0.07))
    fit, boundary = fitted(surface, 10), boundary_of(surface, "mesh")
    samples, search = samples_of(boundary.mesh, 600), ClosestPointSearch(boundary.surface)
    centers, radii = medial_balls(samples, boundary, search, 0.1)
    random, best = np.random.default_rng(0), np.inf
    for _ in range(300):
        some = random.choice(len(radii), 10, replace=False)
        balls = SphereSetCollider(centers[some], radii[some] + 0.01 * 0.2)
        gap = np.maximum(balls.distance(samples.point.T.astype(np.float32))[0], 0.0)
        best = min(best, float((gap**2).mean()))
    own = SphereSetCollider(fit.centers, fit.radii)
    gap = np.maximum(own.distance(samples.point.T.astype(np.float32))[0], 0.0)
    assert (gap**2).mean() < 0.7 * best


def test_the_same_mesh_gives_the_same_spheres(kit):
    one, other = (fitted(kit.box((0.2, 0.12, 0.08))) for _ in range(2))
    np.testing.assert_array_equal(one.centers, other.centers)
    np.testing.assert_array_equal(one.radii, other.radii)


def test_fewer_spheres_where_no_more_would_help(kit):
    assert len(fitted(kit.icosphere(0.1, 2), count=50, overshoot=0.1).radii) < 5


def test_a_thin_shape_is_fitted_too(kit):
    """A plate of 2 mm: thinner than the cells of any distance field of its size."""
    fit = fitted(kit.box((0.2, 0.2, 0.002)), 60, 0.03)
    assert fit.error.outside_max < 0.03 * 0.2 + 1e-5
    assert fit.error.gap_mean < 0.01
    assert np.abs(fit.centers[:, 2]).max() < 0.001


def test_scaled_tenfold_everything_is_ten_times_as_large(kit):
    surface = kit.box((0.2, 0.12, 0.08))
    small, large = fitted(surface), fitted(Surface(surface.positions * 10.0, surface.triangles))
    np.testing.assert_allclose(large.radii, small.radii * 10.0, rtol=1e-3)
    np.testing.assert_allclose(large.centers, small.centers * 10.0, atol=2e-3)


def test_a_hole_lets_no_sphere_out(kit):
    """A ball that is cut off below, as a bust is at the neck: spheres must not bulge out of the
    hole."""
    ball = kit.icosphere(0.1, 3)
    above = ball.corners[:, :, 2].mean(axis=1) > -0.05
    fit = fitted(Surface(ball.positions, ball.triangles[above]), 10)
    assert (fit.centers[:, 2] - fit.radii).min() > -0.06


@pytest.mark.slow
def test_parts_within_parts_do_no_harm(kit):
    """An eye with its own surface within a head."""
    head, eye = kit.icosphere(0.1, 3), shifted(kit.icosphere(0.03, 2), 0.05, 0.0, 0.0)
    fit = fitted(both(head, eye), 1, 0.0)
    np.testing.assert_allclose(fit.radii, 0.1, atol=2e-3)


def test_flipped_faces_do_no_harm(kit):
    surface = kit.box((0.2, 0.12, 0.08))
    turned = Surface(surface.positions, surface.triangles[:, ::-1])
    np.testing.assert_allclose(fitted(turned).radii.sum(), fitted(surface).radii.sum(), rtol=0.1)


def test_the_error_is_what_geometry_says(kit):
    """Spheres of 9 and of 12 cm for a ball of 10 cm have errors of 1 cm inside and 2 cm outside."""
    boundary = boundary_of(kit.icosphere(0.1, 4), "ball")
    search = ClosestPointSearch(boundary.surface)
    origin = np.zeros((1, 3), np.float32)
    small = measured_error(origin, np.array([0.09], np.float32), boundary, search)
    assert (small.gap_mean, small.gap_max) == pytest.approx((0.01, 0.01), abs=2e-4)
    assert (small.outside_mean, small.outside_max) == (0.0, 0.0)
    large = measured_error(origin, np.array([0.12], np.float32), boundary, search)
    assert (large.gap_mean, large.gap_max) == (0.0, 0.0)
    assert (large.outside_mean, large.outside_max) == pytest.approx((0.02, 0.02), abs=3e-4)


def test_the_outside_of_a_set_has_no_place_within_a_ball():
    balls = SphereSetCollider(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), np.array([0.1, 0.08]))
    places = points_on_union(balls)
    gap = np.linalg.norm(places[:, None] - balls.centers, axis=2) - balls.radii
    assert np.abs(gap.min(axis=1)).max() < 1e-5


@pytest.mark.parametrize(
    ("positions", "triangles", "message"),
    [
        (np.zeros((3, 3)), np.zeros((0, 3), int), "no faces"),
        (np.zeros((3, 3)), np.array([[0, 1, 2]]), "no area"),
        (np.eye(3), np.array([[0, 1, 2]]), "no volume"),
    ],
)
def test_a_mesh_without_volume_is_named(positions, triangles, message):
    with pytest.raises(HairloomError, match=message) as caught:
        fit_spheres(
            Surface(positions.astype(np.float32), triangles), SphereFitSettings(), place="Scarf"
        )
    assert caught.value.place == "Scarf"


@pytest.mark.slow
def test_the_head_of_sintel(shared_data: Path):
    """60 spheres for a bust with an open neck: mean errors of less than 2 mm, more at ears and
    hems."""
    surface = _read_obj(shared_data / "sintel" / "sintel.obj")
    fit = fitted(surface, 60)
    assert fit.error.gap_mean < 0.002 and fit.error.outside_mean < 0.002
    assert fit.error.outside_max < 0.0044 and fit.error.gap_max < 0.02


def _read_obj(path: Path) -> Surface:
    positions, triangles = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            positions.append([float(value) for value in line.split()[1:4]])
        elif line.startswith("f "):
            corner = [int(part.split("/")[0]) - 1 for part in line.split()[1:]]
            triangles += [(corner[0], b, c) for b, c in pairwise(corner[1:])]
    return Surface(np.array(positions, np.float32), np.array(triangles))


# --- holes


def test_a_closed_mesh_has_no_holes(kit):
    """Also if each of its triangles has its own vertices, as after splitting UV seams."""
    for surface in (kit.icosphere(0.1, 2), kit.box((1.0, 1.0, 1.0))):
        closed, fans = close_holes(surface)
        assert closed is surface and not len(fans)


def test_two_holes_are_closed_each_by_its_own_fan(kit):
    ball = kit.icosphere(0.1, 3)
    height = ball.corners[:, :, 2].mean(axis=1)
    closed, fans = close_holes(Surface(ball.positions, ball.triangles[np.abs(height) < 0.06]))
    assert len(closed.positions) == len(ball.positions) + 2
    again, more = close_holes(closed)
    assert again is closed and not len(more)
    # closed and correctly oriented: the volume of a slab of a ball, by the divergence theorem
    a, b, c = np.moveaxis(closed.corners.astype(np.float64), 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    exact = np.pi * (0.1**2 * 0.12 - 2.0 * 0.06**3 / 3.0)
    assert volume == pytest.approx(exact, rel=0.05)
    assert len(fans) > 20


# --- where points have moved


def test_a_similarity_is_found_again(kit):
    points = np.random.default_rng(2).normal(size=(50, 3))
    matrix = kit.translation(1.0, -2.0, 3.0) @ kit.rotation(1, 2.0) @ kit.rotation(0, -0.4)
    matrix = matrix @ np.diag([1.7, 1.7, 1.7, 1.0])
    fit = fit_similarity(points, points @ matrix[:3, :3].T + matrix[:3, 3])
    np.testing.assert_allclose(fit.matrix, matrix, atol=1e-12)
    assert fit.error < 1e-12 and fit.scale == pytest.approx(1.7)


def test_flat_points_tell_too_and_are_never_mirrored(kit):
    flat = np.random.default_rng(3).normal(size=(20, 3)) * [1.0, 1.0, 0.0]
    turn = kit.rotation(0, 2.5)
    fit = fit_similarity(flat, flat @ turn[:3, :3].T)
    np.testing.assert_allclose(fit.matrix, turn, atol=1e-12)
    mirrored = fit_similarity(flat + [0, 0, 1], (flat + [0, 0, 1]) * [1, -1, 1])
    assert np.linalg.det(mirrored.matrix[:3, :3]) > 0.0


def test_the_error_is_the_root_mean_square():
    corners = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    bent = corners + np.array([[0, 0, 0.1], [0, 0, 0.1], [0, 0, -0.1], [0, 0, -0.1]])
    assert fit_similarity(corners, bent).error == pytest.approx(0.1)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.eye(3)[:2],
        np.ones((5, 3)),
        np.arange(5.0)[:, None] * [1.0, 2.0, 3.0],
        np.full((5, 3), np.nan),
    ],
    ids=["none", "two", "one place", "line", "nan"],
)
def test_points_that_fix_no_similarity_give_none(points):
    assert fit_similarity(points, points) is None
