"""Roots and colliders of a head that turns within a frame move on arcs at constant speed."""

import math

import numpy as np
import pytest

from hairloom.addon.dynamics.cloth.carried import pinned_path
from hairloom.addon.dynamics.cloth.state import start_cloth
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.rigid_path import (
    RigidMotion,
    motion_of,
    rotation_matrix,
    rotation_vector,
    twist_of,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance

PIVOT = np.array([0.02, -0.05, -0.15])


def turned_about(kit, axis, angle):
    """A rotation about an axis through the neck."""
    return kit.translation(*PIVOT) @ kit.rotation(axis, angle) @ kit.translation(*-PIVOT)


def on_arc(kit, axis, degrees, moment):
    return turned_about(kit, axis, math.radians(degrees) * moment)


@pytest.mark.parametrize("earlier", [False, True])
@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("degrees", [10.0, 90.0, 170.0])
def test_roots_stay_on_the_arc(kit, axis, degrees, earlier):
    """During an even turn about the neck, each point of the style is on its circle at any
    moment."""
    grid = kit.curly(40, 6)
    targets = [kit.moved(on_arc(kit, axis, degrees, s), grid) for s in (-1.0, 0.0, 1.0)]
    drive = Drive(*targets[1:], (), kit.EARTH, targets[0] if earlier else None)
    for moment in np.linspace(0.0, 1.0, 9):
        expected = kit.moved(on_arc(kit, axis, degrees, moment), grid)
        np.testing.assert_allclose(drive.target_at(moment), expected, atol=2e-6)


def test_the_simulation_pins_roots_on_the_arc(kit):
    """90 degrees in a frame of one substep, and of one and a half; a chord would be over 2 cm
    off."""
    grid = kit.curly(40, 6)
    targets = [kit.moved(on_arc(kit, 2, 90.0, s), grid) for s in (0.0, 1.0)]
    state = start(grid)
    part = 1.0 / 30.0
    drive = Drive(*targets, (), kit.EARTH)
    found = advance(state, drive, DynamicsSettings(substep_rate=30.0), part)
    np.testing.assert_allclose(found.grid[:, :2], targets[1][:, :2], atol=1e-6)
    halfway = advance(state, drive, DynamicsSettings(substep_rate=45.0), part)
    expected = kit.moved(on_arc(kit, 2, 90.0, 1.0 / (45.0 * part)), grid)
    np.testing.assert_allclose(halfway.grid[:, :2], expected[:, :2], atol=2e-6)
    chord = targets[0] + (targets[1] - targets[0]) / (45.0 * part)
    assert np.abs(chord - expected)[:, :2].max() > 0.02


@pytest.mark.parametrize("earlier", [False, True])
def test_colliders_stay_on_the_arc(kit, earlier):
    """A matrix with scale and shear keeps its shape along the arc."""
    shape = np.diag([1.0, 2.0, 0.5, 1.0]) @ kit.translation(0.3, 0.0, 0.1)
    shape[0, 1] = 0.2
    before, now, since = (on_arc(kit, 1, 90.0, s) @ shape for s in (0.0, 1.0, -1.0))
    ball = SphereCollider((0, 0, 0), 0.1)
    posed = PosedCollider(ball, before, now, since if earlier else None)
    moments = np.linspace(0.0, 1.0, 5)
    found = posed.matrix_at(moments[:, None, None])
    for moment, matrix in zip(moments, found, strict=True):
        np.testing.assert_allclose(matrix, on_arc(kit, 1, 90.0, moment) @ shape, atol=1e-12)
    np.testing.assert_array_equal(posed.matrix_at(1.0 / 4.0), found[1])


def test_pinned_cloth_stays_on_the_arc(kit):
    points = np.random.default_rng(3).normal(size=(30, 3)).astype(np.float32)
    triangles = np.arange(30).reshape(-1, 3)
    fabric = start_cloth(points, triangles, np.ones(30)).fabric
    before, now = (kit.moved(on_arc(kit, 0, 90.0, s), points) for s in (0.0, 1.0))
    path = pinned_path(fabric, Drive(before, now, (), kit.EARTH), np.zeros((3, 1)))
    expected = kit.moved(on_arc(kit, 0, 90.0, 0.5), points)
    np.testing.assert_allclose(path.at(0.5).T, expected, atol=3e-6)


def test_what_does_not_turn_goes_as_before(kit):
    """Without a turn there are no arcs, and results are the same bit for bit."""
    grid = kit.curly(40, 6)
    shifted = [kit.moved(kit.translation(0.1 * k * k, 0.0, 0.02), grid) for k in range(3)]
    drive = Drive(*shifted[1:], (), kit.EARTH, shifted[0])
    assert drive.style_carrier is None
    still = np.eye(4)
    posed = PosedCollider(SphereCollider((0, 0, 0), 0.1), still, kit.translation(1.0, 0.0, 0.0))
    np.testing.assert_array_equal(posed.matrix_at(0.25), kit.translation(0.25, 0.0, 0.0))


def test_an_uneven_turn_goes_through_all_three_places(kit):
    """A turn about one axis that slows down: angles lie on the parabola through all three."""
    grid, angles = kit.curly(40, 6), (-0.9, 0.0, 0.5)
    targets = [kit.moved(turned_about(kit, 2, angle), grid) for angle in angles]
    drive = Drive(*targets[1:], (), kit.EARTH, targets[0])
    for moment in (0.0, 0.3, 1.0):
        angle = 0.5 * moment + (0.5 - 0.9) / 2.0 * moment * (moment - 1.0)
        expected = kit.moved(turned_about(kit, 2, angle), grid)
        np.testing.assert_allclose(drive.target_at(moment), expected, atol=2e-6)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.3, 2.0, 3.1, math.pi])
def test_twists_come_back(angle):
    axis = np.array([1.0, -2.0, 2.0]) / 3.0
    rotation = rotation_matrix(axis * angle)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.abs(rotation_vector(rotation)), np.abs(axis * angle), atol=1e-7)
    motion = RigidMotion(rotation, np.array([0.4, -0.1, 0.2]))
    again = motion_of(twist_of(motion))
    np.testing.assert_allclose(again.rotation, motion.rotation, atol=1e-12)
    np.testing.assert_allclose(again.shift, motion.shift, atol=1e-12)


def test_every_axis_is_found():
    """The axes make each component of the quaternion the largest once."""
    for axis in (*np.eye(3), *-np.eye(3), np.array([0.6, 0.0, 0.8])):
        for angle in (0.01, 2.0, 3.1):
            np.testing.assert_allclose(
                rotation_vector(rotation_matrix(axis * angle)), axis * angle, atol=1e-12
            )
