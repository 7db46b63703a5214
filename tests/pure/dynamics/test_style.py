"""Frames that do not twist, and hair that returns to its style."""

import numpy as np
import pytest

from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import rows_of, start
from hairloom.addon.dynamics.step import advance
from hairloom.addon.dynamics.style import restore_style, segment_frames, style_system
from hairloom.addon.strands.frames import transported_normals


def frames_of(state):
    """Tangents and normals (3, cv_count - 1, guide_count) of guides in their style."""
    position, guide = state.position, np.arange(state.guide_count)
    twist = position[:, state.rest.shape.twist_cv, guide] - position[:, 0]
    return segment_frames(np.diff(position, axis=1), twist)


def test_frames_are_the_transported_normals(kit):
    """Against the frames of `strands/`, which use Rodrigues' formula."""
    tangent, normal = frames_of(start(kit.curly(30, 16)))
    expected = transported_normals(tangent.transpose(2, 1, 0), normal[:, 0].T)
    np.testing.assert_allclose(normal.transpose(2, 1, 0), expected, atol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=0), 1.0, atol=1e-5)


def test_curvature_turns_with_the_root(kit):
    """A rigidly moved guide is at rest, whatever the turn."""
    grid = kit.curly(30, 16)
    turn = kit.rotation(0, 1.1) @ kit.rotation(2, 2.3)
    state = start(grid)
    carried = rows_of(kit.moved(turn, grid), "test")
    position = carried.copy()
    settings = DynamicsSettings(bend=20.0)
    band = style_system(settings, 16, 1 / 240)
    restore_style(position, carried, state.rest.shape, band)
    np.testing.assert_allclose(position, carried, atol=2e-6)


def test_bend_alone_brings_curls_back_without_place(kit):
    """Straightened hair curls up again by bend stiffness alone, without a pull to its place."""
    grid = kit.curly(10, 16)
    state = start(grid)
    straightened = grid[:, :1] + (grid[:, 1:2] - grid[:, :1]) * np.arange(16)[:, None]
    position = rows_of(straightened.astype(np.float32), "test")
    carried = rows_of(grid, "test")
    band = style_system(DynamicsSettings(style_root=0, style_tip=0, bend=10), 16, 1 / 240)

    def shape_error():
        second = np.diff(position, n=2, axis=1) - np.diff(carried, n=2, axis=1)
        return np.abs(second).max()

    before = shape_error()
    for _ in range(60):
        position[:, :2] = carried[:, :2]
        restore_style(position, carried, state.rest.shape, band)
    assert shape_error() < 0.02 * before


def test_solve_is_the_minimum(kit):
    """Without bend stiffness, the result is a weighted mean of a CV's position and its style's."""
    state = start(kit.curly(5, 8))
    settings = DynamicsSettings(style_root=3.0, style_tip=1.0, bend=0.0)
    dt = 1 / 60
    position = state.position + np.float32(0.01)
    restore_style(
        position, state.position, state.rest.shape,
        style_system(settings, 8, dt),
    )  # fmt: skip
    frequency = 3.0 - 2.0 * np.arange(2, 8) / 7
    pull = (2 * np.pi * frequency * dt) ** 2
    expected = state.position[:, 2:] + 0.01 / (1.0 + pull)[:, None]
    np.testing.assert_allclose(position[:, 2:], expected, atol=1e-6)


def test_straight_guides_have_no_twist_to_lose(kit):
    state = start(kit.straight(4, 10))
    tangent, normal = frames_of(state)
    assert np.isfinite(normal).all()
    np.testing.assert_allclose(tangent[2], -1.0, atol=1e-6)
    np.testing.assert_allclose(state.rest.shape.curvature, 0.0, atol=1e-6)


def zigzag(guide_count: int, angle: float) -> np.ndarray:
    """Guides of 16 CVs, 1.5 cm apart, whose segments turn by this angle [rad] to and fro."""
    way = np.where(np.arange(15) % 2, angle / 2, -angle / 2)
    random = np.random.default_rng(3).normal(0.0, 0.3, (guide_count, 15)) * angle
    around = np.random.default_rng(4).uniform(0.0, 2 * np.pi, (guide_count, 1))
    tilt = way + random
    segment = np.stack(
        [np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), -np.cos(tilt)], axis=-1
    )
    start_at_zero = np.concatenate([np.zeros((guide_count, 1, 3)), np.cumsum(segment, 1)], axis=1)
    return (0.015 * start_at_zero).astype(np.float32)


@pytest.mark.alike
@pytest.mark.parametrize("degrees", [10, 30, 60, 80])
def test_shaken_hair_comes_to_rest_however_kinked(degrees: float) -> None:
    """A regression: kinks whose rest curvature turned with the strand drove themselves and never
    came to rest."""
    grid = zigzag(60, np.radians(degrees))
    state, settings = start(grid), DynamicsSettings()
    gravity = np.array([0.0, 0.0, -9.81])
    before = grid
    for frame in range(1, 61):
        now = grid + np.float32([0.03 * np.sin(0.105 * frame), 0.0, 0.0])
        state = advance(state, Drive(before, now, (), gravity), settings, 1 / 60)
        before = now
    for _ in range(180):
        last = state.grid
        state = advance(state, Drive(before, before, (), gravity), settings, 1 / 60)
    assert np.abs(state.grid - last).max() < 5e-4
    assert np.linalg.norm(state.grid - before, axis=-1).max() < 0.01
