"""The frames in which lights draw all meshes of a scene."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import Cone, Light
from hairloom.addon.shading.volume.light_frame import Ball
from hairloom.addon.shading.volume.mesh_frames import ball_of_casters, extent_of, mesh_frames
from hairloom.addon.strands import Surface

WHITE = (1.0, 1.0, 1.0)
BALL = Ball(np.array([0.5, 0.0, 1.0]), 2.0)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
PANEL = Panel((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), 0.1, 0.1)


def in_ball(count: int = 3000) -> np.ndarray:
    random = np.random.default_rng(1)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return BALL.center + BALL.radius * directions * random.random((count, 1)) ** (1.0 / 3.0)


@pytest.mark.parametrize(
    ("light", "count"),
    [
        (Light.sun((0.1, 0.2, -1.0), WHITE, 1.0), 1),
        (Light.point((0.0, 0.0, 8.0), WHITE, 1.0), 1),
        (Light.point((0.5, 0.3, 1.0), WHITE, 1.0), 6),
        (Light.area((0.5, 0.3, 1.0), WHITE, 1.0, PANEL), 5),
        (Light.spot((0.0, 0.0, 8.0), WHITE, 1.0, Cone(AXES, 3.1, 0.0)), 1),
        (Light.spot((0.0, 0.0, 1.0), WHITE, 1.0, Cone(AXES, 3.1, 0.0)), 5),
    ],
)
def test_all_that_a_light_shines_on_is_in_a_frame(light: Light, count: int) -> None:
    frames = mesh_frames(light, BALL)
    assert len(frames) == count
    points = in_ball()
    if light.kind in ("area", "spot") and count > 1:
        points = points[points[:, 2] < light.vector[2] - 0.02]
    is_held = np.zeros(len(points), bool)
    for frame in frames:
        place, depth = frame.places(points)
        is_inside = ((place >= 0.0) & (place <= 1.0)).all(axis=1)
        is_held |= is_inside
        assert depth[is_inside].min() >= 0.0 and depth[is_inside].max() <= 1.0
    assert is_held.all()


def test_a_spot_has_its_own_cone() -> None:
    """Its cone is narrower than the meshes, and is scaled with its object."""
    spot = Light.spot((0.5, 0.0, 4.0), WHITE, 1.0, Cone(AXES, 0.4, 0.0))
    (frame,) = mesh_frames(spot, BALL)
    rim = np.array([[0.5 + 3.0 * np.tan(0.2), 0.0, 1.0]])
    np.testing.assert_allclose(frame.places(rim)[0], [[1.0, 0.5]], atol=1e-9)
    squeezed = Cone(((0.5, 0.0, 0.0), AXES[1], AXES[2]), 0.4, 0.0)  # its object is twice as wide
    (frame,) = mesh_frames(Light.spot((0.5, 0.0, 4.0), WHITE, 1.0, squeezed), BALL)
    rim = np.array([[0.5 + 6.0 * np.tan(0.2), 0.0, 1.0]])
    np.testing.assert_allclose(frame.places(rim)[0], [[1.0, 0.5]], atol=1e-9)


def test_a_lamp_beside_everything_has_no_more_sides_than_see_it() -> None:
    lamp = Light.point((0.5, 0.0, 1.0 + 2.2), WHITE, 1.0)
    assert 1 < len(mesh_frames(lamp, BALL)) < 6
    is_off = Light("sun", (0.0, 0.0, 1.0), WHITE, casts_shadow=False)
    assert mesh_frames(is_off, BALL) == ()


def turned(positions: np.ndarray) -> Surface:
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    return Surface((positions @ turn).astype(np.float32), np.array([[0, 1, 2]], np.int32))


def test_the_largest_flat_mesh_does_not_count() -> None:
    random = np.random.default_rng(3)
    plane = np.insert(random.uniform(-50.0, 50.0, (300, 2)), 2, 3.0, axis=1)
    lump = random.uniform(-1.0, 1.0, (300, 3))
    bent = plane.copy()
    bent[200, 2] += 0.5
    ground, small, rough = turned(plane), turned(0.01 * plane), turned(bent)
    assert extent_of(ground).is_flat and extent_of(small).is_flat
    assert not extent_of(rough).is_flat and not extent_of(turned(lump)).is_flat
    ball = ball_of_casters([extent_of(ground), extent_of(turned(lump)), extent_of(small)])
    assert ball is not None and ball.radius < 4.0
    ball = ball_of_casters([extent_of(rough), extent_of(turned(lump))])
    assert ball is not None and ball.radius > 50.0
    assert ball_of_casters([extent_of(ground)]) is None
    assert ball_of_casters([]) is None
