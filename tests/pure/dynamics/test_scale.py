"""Motion does not depend on scale: hair and cloth a thousand times smaller or larger move alike."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.cloth.settings import FinSettings
from hairloom.addon.dynamics.cloth.state import start_cloth
from hairloom.addon.dynamics.cloth.step import advance_cloth
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.colliders.distance_field import DistanceField
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.settings import DynamicsSettings

#: powers of two, so that rounding is the same and there are no differences that could grow
FACTORS = (2.0**-10, 2.0**10)
LENGTH = 0.2
#: tolerance, as a fraction of the hair's length
ROUNDED = 1e-4


def larger(matrix: np.ndarray, factor: float) -> np.ndarray:
    """The same motion for objects that are larger by a factor."""
    scaled = matrix.copy()
    scaled[:3, 3] *= factor
    return scaled


@pytest.mark.parametrize("collider", few_in_commits(["mesh", "ball"]))
@pytest.mark.parametrize("solver", few_in_commits(["direct", "relaxation"]))
def test_hair_moves_the_same_at_any_size(kit, shake, collider, solver):
    """With gravity scaled alike, on a shaking head; half of the hair starts inside a ball or
    box."""

    def ends(factor: float) -> np.ndarray:
        grid = kit.curly(40, 12, LENGTH) * np.float32(factor)
        grid[:, :, 2] -= 0.06 * factor  # half of them start inside
        if collider == "ball":
            solid = SphereCollider((0.0, 0.0, 0.0), 0.12 * factor)
        else:
            solid = DistanceField.from_surface(
                kit.box((0.2 * factor,) * 3), DynamicsSettings(collider_resolution=16)
            )
        scene = kit.Scene(
            grid,
            DynamicsSettings(length_solver=solver),
            lambda time: larger(shake(time), factor),
            on_head=(solid,),
            gravity=kit.EARTH * factor,
            bowed=True,
        )
        return np.array([state.grid for state in scene.play(0.25)]) / factor

    one = ends(1.0)
    assert np.abs(one[-1] - one[0]).max() > 0.05
    # at an edge rounding decides which point of a segment is the deepest
    rounded = ROUNDED if collider == "ball" else 20.0 * ROUNDED
    for factor in FACTORS:
        assert np.abs(ends(factor) - one).max() < rounded * LENGTH


def test_cloth_moves_the_same_at_any_size():
    across, down = np.meshgrid(np.linspace(-0.5, 0.5, 12), np.linspace(0.0, -1.0, 12))
    points = np.stack([across, np.zeros_like(across), down], axis=-1).reshape(-1, 3)
    corner = (np.arange(11)[:, None] * 12 + np.arange(11)).ravel()
    triangles = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 12], axis=1),
            np.stack([corner + 1, corner + 13, corner + 12], axis=1),
        ]
    )
    pin = np.where(np.arange(144) < 12, 1.0, 0.0)

    def end(factor: float) -> np.ndarray:
        state = start_cloth(points * factor, triangles, pin)
        ball = SphereCollider((0.0, -0.25 * factor, -0.5 * factor), 0.2 * factor)
        settings = FinSettings()
        for frame in range(10):
            ways = [np.eye(4), np.eye(4)]
            ways[0][1, 3], ways[1][1, 3] = 0.01 * factor * frame, 0.01 * factor * (frame + 1)
            drive = Drive(
                points * factor,
                points * factor,
                (PosedCollider(ball, *ways),),
                np.array([0.0, 0.0, -9.81 * factor]),
            )
            state = advance_cloth(state, drive, settings, 1.0 / 60.0)
        return state.position / factor

    one = end(1.0)
    assert np.abs(one.T - points).max() > 0.02
    for factor in FACTORS:
        assert np.abs(end(factor) - one).max() < ROUNDED
