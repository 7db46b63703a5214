"""Where hair grows: in proportion to area and density, evenly spaced, on top and back of a head."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.scalp import find_cranium, sample_roots, scalp_density
from hairloom.addon.strands import Surface


def test_roots_are_uniform_by_area(egg: Surface) -> None:
    """The number of roots on a patch is in proportion to its area, within binomial bounds."""
    count = 20_000
    triangle, weights = sample_roots(egg, count, None, np.random.default_rng(1))
    corners = egg.corners.astype(np.float64)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    for axis in range(3):
        is_patch = corners.mean(axis=1)[:, axis] > 0.03
        share = area[is_patch].sum() / area.sum()
        spread = np.sqrt(count * share * (1.0 - share))
        assert abs(is_patch[triangle].sum() - count * share) < 4.0 * spread
    assert weights.min() >= 0.0
    assert weights.sum(axis=1) == pytest.approx(np.ones(count))
    assert weights.mean(axis=0) == pytest.approx([1 / 3] * 3, abs=0.01)


def test_roots_follow_the_density(egg: Surface) -> None:
    """Mean height of the roots against the integral of density x height, triangle by triangle."""
    density = 1.2 + np.sin(30.0 * egg.positions[:, 2]).astype(np.float64)
    triangle, weights = sample_roots(egg, 20_000, density, np.random.default_rng(2))
    height = np.einsum("nk,nk->n", weights, egg.corners[triangle][..., 2])

    corners, on_corner = egg.corners.astype(np.float64), density[egg.triangles]
    z = corners[..., 2]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    # integral of two linear functions over a triangle: area / 12 (sum d_i z_i + sum d_i sum z_j)
    product = (on_corner * z).sum(axis=1) + on_corner.sum(axis=1) * z.sum(axis=1)
    expected = (area * product).sum() / 12.0 / (area * on_corner.sum(axis=1)).sum() * 3.0
    assert expected > 0.02
    assert height.mean() == pytest.approx(expected, abs=0.001)


def test_roots_keep_their_distance_better_than_chance(egg: Surface) -> None:
    """Fewer close pairs than in white noise of the same number."""

    def nearest(points: np.ndarray) -> np.ndarray:
        squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
        np.fill_diagonal(squared, np.inf)
        return np.sqrt(squared.min(axis=1))

    random = np.random.default_rng(3)
    triangle, weights = sample_roots(egg, 600, None, random)
    roots = np.einsum("nk,nkj->nj", weights, egg.corners[triangle])
    white = random.normal(size=(600, 3))
    white *= 0.1 / np.linalg.norm(white, axis=1, keepdims=True)
    assert np.median(nearest(roots)) > 1.1 * np.median(nearest(white))


def test_no_area_to_grow_on_is_reported(egg: Surface) -> None:
    flat = Surface(np.zeros((3, 3)), [[0, 1, 2]])
    no_faces = Surface(np.zeros((3, 3)), np.zeros((0, 3)))
    nowhere = np.zeros(len(egg.positions))
    for surface, density in ((flat, None), (no_faces, None), (egg, nowhere)):
        with pytest.raises(HairloomError, match="no area"):
            sample_roots(surface, 10, density, np.random.default_rng(4))


def test_cranium_of_an_egg_is_as_deep_as_the_egg(egg: Surface) -> None:
    cranium = find_cranium(egg.positions)
    assert cranium.half_depth == pytest.approx(0.1, abs=1e-6)
    assert cranium.center == pytest.approx([0.0, 0.0, 0.02], abs=1e-6)


def test_shoulders_do_not_move_the_cranium(egg: Surface) -> None:
    """A wide and deep box below the egg does not change the cranium."""
    shoulders = np.array(
        [[x, y, z] for x in (-0.3, 0.3) for y in (-0.15, 0.2) for z in (-0.5, -0.2)]
    )
    bust = np.concatenate([egg.positions, shoulders])
    assert find_cranium(bust).half_depth == pytest.approx(0.1, abs=1e-6)


def test_hair_grows_on_top_and_back_not_on_the_face(egg: Surface) -> None:
    density = scalp_density(egg)
    x, y, z = egg.positions.T / np.array([0.08, 0.1, 0.12])[:, None]
    assert density.min() >= 0.0
    assert density.max() <= 1.0
    assert density[z > 0.9].min() > 0.5
    assert density[(y > 0.8) & (abs(z) < 0.3)].min() > 0.5
    assert density[(y < -0.5) & (z < 0.3)].max() == 0.0
    assert density[z < -0.9].max() == 0.0
    side = abs(x) > 0.1  # the egg is symmetric, and so is its hair
    mirrored = Surface(egg.positions * [-1, 1, 1], egg.triangles[:, ::-1])
    assert scalp_density(mirrored)[side] == pytest.approx(density[side], abs=1e-5)


def test_density_goes_with_the_head_and_survives_a_plane(egg: Surface) -> None:
    matrix = np.diag([3.0, 3.0, 3.0, 1.0])
    matrix[:3, 3] = (1.0, -2.0, 5.0)
    assert scalp_density(egg.transformed(matrix)) == pytest.approx(scalp_density(egg), abs=1e-3)
    plane = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert np.isfinite(scalp_density(plane)).all()
    assert scalp_density(Surface(np.zeros((0, 3)), np.zeros((0, 3)))).shape == (0,)
