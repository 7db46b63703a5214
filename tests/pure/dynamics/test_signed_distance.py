"""Distances to posed colliders, against formulas and the mesh itself."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.dynamics.settings import DynamicsSettings


def posed(collider, matrix=None):
    now = np.eye(4) if matrix is None else matrix
    return PosedCollider(collider, np.eye(4), now)


def test_a_ball_is_where_the_frame_ends(kit):
    points = np.random.default_rng(1).normal(0.0, 0.3, (200, 3))
    matrix = kit.translation(0.1, -0.2, 0.3) @ np.diag([2.0, 2.0, 2.0, 1.0])
    distance, outward = signed_distance(points, [posed(SphereCollider((0, 0, 0), 0.1), matrix)])
    away = points - [0.1, -0.2, 0.3]
    expected = np.linalg.norm(away, axis=1) - 0.2
    assert expected.min() < 0.0
    np.testing.assert_allclose(distance, expected, atol=1e-6)
    np.testing.assert_allclose(
        outward, away / np.linalg.norm(away, axis=1, keepdims=True), atol=1e-5
    )


def test_the_nearest_of_all_kinds_counts(kit):
    """Also for points inside several colliders, and with a limited reach."""
    rod = CapsuleCollider((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.05)
    balls = SphereSetCollider(((0.1, 0.02, 0.0), (0.2, 0.0, 0.1)), (0.07, 0.03))
    field = DistanceField.from_surface(kit.icosphere(0.08, 3), DynamicsSettings())
    moved = kit.translation(-0.1, 0.05, 0.02) @ kit.rotation(1, 0.4)
    colliders = [posed(rod), posed(balls, kit.rotation(2, 0.3)), posed(field, moved)]
    points = np.random.default_rng(2).normal(0.0, 0.12, (500, 3))
    alone = np.array([signed_distance(points, [one])[0] for one in colliders])
    assert ((alone < 0.0).sum(axis=0) > 1).sum() > 5
    distance, outward = signed_distance(points, colliders)
    np.testing.assert_array_equal(distance, alone.min(axis=0))
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0, atol=1e-5)
    within, near_outward = signed_distance(points, colliders, 0.03)
    np.testing.assert_array_equal(within, np.minimum(distance, np.float32(0.03)))
    near = distance < 0.03
    assert 0 < near.sum() < len(points)
    np.testing.assert_array_equal(near_outward[near], outward[near])
    assert not near_outward[~near].any()


def test_a_step_outwards_leads_onto_a_mesh(kit):
    field = DistanceField.from_surface(kit.icosphere(0.1, 4), DynamicsSettings())
    points = np.random.default_rng(3).normal(0.0, 0.06, (300, 3))
    distance, outward = signed_distance(points, [posed(field)])
    led = points - distance[:, None] * outward
    near = np.abs(distance) < 0.02
    np.testing.assert_allclose(np.linalg.norm(led[near], axis=1), 0.1, atol=5e-4)


@pytest.mark.parametrize("count", [0, 5])
def test_nothing_is_far_away(count):
    points = np.ones((count, 3))
    distance, outward = signed_distance(points, [])
    assert np.isposinf(distance).all()
    assert not outward.any()
    ball = posed(SphereCollider((0, 0, 0), 0.1))
    assert signed_distance(points, [ball])[0].shape == (count,)


def test_where_two_sides_are_as_near_the_distance_has_a_bound() -> None:
    """In the middle of a plate the sampled distance has no gradient."""
    axis = np.linspace(-0.2, 0.2, 41)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    plate = DistanceField(np.abs(nodes[..., 2]) - 0.05, nodes[0, 0, 0], axis[1] - axis[0])
    random = np.random.default_rng(2)
    points = random.uniform(-0.1, 0.1, (400, 3)) * [1.0, 1.0, 0.04]
    for scale in (1.0, 3.0):
        distance, _ = signed_distance(points * scale, [posed(plate, np.diag([scale] * 3 + [1.0]))])
        expected = scale * (np.abs(points[:, 2]) - 0.05)
        assert np.all(np.abs(distance - expected) <= 0.11 * scale)
        assert distance.min() > -0.11 * scale
