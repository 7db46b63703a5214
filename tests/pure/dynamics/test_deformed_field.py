"""The distance field of a mesh that has changed its shape, against the mesh itself."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.dynamics.colliders.deformed_field import DeformedField
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point

SETTINGS = DynamicsSettings(collider_resolution=24)


def rod(kit):
    """A ball stretched to a rod of 40 cm along x."""
    ball = kit.icosphere(0.06, 3)
    positions = ball.positions.copy()
    positions[:, 0] += (
        np.sign(positions[:, 0]) * 0.14 * np.minimum(np.abs(positions[:, 0]) / 0.02, 1)
    )
    return Surface(positions, ball.triangles)


def bent(positions):
    """The half at positive x bent up in an arc, out of the bounding box of the rod at rest."""
    angle = 4.0 * np.maximum(positions[:, 0], 0.0)
    x, z = positions[:, 0], positions[:, 2]
    over = np.maximum(x, 0.0) > 0.0
    result = positions.copy()
    result[over, 0] = ((0.25 - z) * np.sin(angle))[over]
    result[over, 2] = (0.25 - (0.25 - z) * np.cos(angle))[over]
    return result


@pytest.mark.parametrize("is_turned", [False, True])
def test_an_arm_that_bends(kit, is_turned):
    """Near the surface as exact as a new field of the bent mesh, and everywhere of the right sign;
    also if all faces look inwards."""
    surface = rod(kit)
    if is_turned:
        surface = Surface(surface.positions, surface.triangles[:, ::-1])
    field = DistanceField.from_surface(surface, SETTINGS)
    now = Surface(bent(surface.positions), surface.triangles)
    found = DeformedField(field, surface).at(now.positions)
    random = np.random.default_rng(5)
    low, high = now.positions.min(axis=0), now.positions.max(axis=0)
    points = random.uniform(low, high, (3000, 3)).astype(np.float32)
    exact = closest_point(points, now).distance
    exact[np.abs(winding_number(points, now)) > 0.5] *= -1.0
    distance, _ = found.distance(np.ascontiguousarray(points.T))
    rigid, _ = field.distance(np.ascontiguousarray(points.T))
    near = np.abs(exact) < field.cell
    assert near.sum() > 200
    assert np.abs(distance - exact)[near].max() < 0.3 * field.cell
    assert np.abs(rigid - exact)[near].max() > 2.0 * field.cell
    clear = np.abs(exact) > 0.3 * field.cell
    np.testing.assert_array_equal(distance[clear] < 0.0, exact[clear] < 0.0)
    assert (np.abs(distance) < np.abs(exact) + 0.5 * field.cell).all()


def test_only_what_moves_is_made_anew(kit):
    surface = rod(kit)
    field = DistanceField.from_surface(surface, SETTINGS)
    mesh = DeformedField(field, surface)
    assert mesh.at(surface.positions + np.float32(1e-5)) is field
    now = surface.positions.copy()
    tip = now[:, 0] > 0.15
    now[tip, 1] += 0.01
    found = mesh.at(now)
    assert found.values.shape == field.values.shape
    x = field.low[0] + field.cell * np.arange(field.values.shape[0])
    np.testing.assert_array_equal(found.values[x < 0.05], field.values[x < 0.05])
    assert np.abs(found.values - field.values).max() > 0.005
