"""An animated style equals the style that a rebuild from its frame's curves gives, in any pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_wig import GUIDES, sheet, wig_strands

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.dynamics.painted import PaintedGuides
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.motion_flow import FrameInput
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet
from hairloom.addon.style_flow import curves_at_rest, rig_with_style

GRAVITY = np.array([0.0, 0.0, -9.81])
CHILDREN = ChildrenSettings(method="multi", strand_count=2000, clump=0.6, frizz=0.02)


def rig_of(strands: StrandSet, children: ChildrenSettings | None = CHILDREN) -> Rig:
    return rig_flow.prepare(
        strands, sheet(), GUIDES, place="a wig", children=children, is_animated=True
    )


def bowed(strands: StrandSet, far: float, longer: float = 1.0) -> StrandSet:
    """Strands scaled by `longer` and bent along y: by `far` [m] at the tip, and quadratically."""
    grid = strands.grid.copy()
    along = np.linspace(0.0, 1.0, grid.shape[1])[:, None]
    grid = grid[:, :1] + (grid - grid[:, :1]) * longer + along**2 * np.array([0.0, far, 0.0])
    return strands.with_points(grid.reshape(-1, 3))


def turned(angle: float = 0.7) -> np.ndarray:
    matrix = np.eye(4)
    matrix[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = 0.3, -0.2, 0.1
    return matrix


def pose_of(rig: Rig, matrix: np.ndarray) -> Pose:
    assert rig.head is not None
    positions = rig.head.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return Pose(positions.astype(np.float32), matrix)


@pytest.mark.parametrize("moved_by", ["object", "surface"])
def test_it_is_what_a_rebuild_makes(moved_by: str) -> None:
    """Against a full rebuild: the hair's object moves with the surface, or stands still while nodes
    carry the curves with the surface."""
    rig, now = rig_of(wig_strands()), bowed(wig_strands(), 0.04, 1.3)
    matrix = turned()
    back = np.linalg.inv(matrix) if moved_by == "object" else np.eye(4)
    found = rig_with_style(
        rig, curves_at_rest(rig, now.transformed(matrix), pose_of(rig, matrix), back)
    )
    whole = rig_of(now, None)
    own = whole.strands.point_count
    np.testing.assert_allclose(found.strands.points[:own], whole.strands.points, atol=1e-6)
    np.testing.assert_allclose(found.guide_grid, whole.guide_grid, atol=1e-6)


def test_children_bow_as_all_curves_around_them_do() -> None:
    plain = {"clump": 0.0, "frizz": 0.0, "length_variation": 0.0, "baby_hair": 0.0}
    rig = rig_of(wig_strands(), ChildrenSettings(method="multi", strand_count=500, **plain))
    found = rig_with_style(rig, bowed(wig_strands(), 0.04)).strands.grid
    along = np.linspace(0.0, 1.0, found.shape[1])[:, None]
    expected = rig.strands.grid + along**2 * np.array([0.0, 0.04, 0.0])
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_hair_moves_in_its_object_though_its_surface_goes_elsewhere() -> None:
    rig, now = rig_of(wig_strands(), None), bowed(wig_strands(), 0.04)
    found = rig_with_style(rig, curves_at_rest(rig, now, pose_of(rig, turned()), np.eye(4)))
    np.testing.assert_array_equal(found.strands.points, now.points)


def test_children_of_a_bake_ride_on_the_guides_of_the_frame() -> None:
    rig, now = rig_of(wig_strands()), bowed(wig_strands(), 0.04)
    whole = rig_with_style(rig, now).strands.points
    found = rig_with_style(replace(rig, grown_children=None), now).strands.points
    away, moved = (np.linalg.norm(found - each, axis=1) for each in (whole, rig.strands.points))
    assert away.mean() < 0.25 * moved.mean(), "not clumped and frizzed again"


def test_hair_comes_to_rest_in_another_style_as_if_it_had_begun_there() -> None:
    rig, settings = rig_of(wig_strands(), None), DynamicsSettings(style_damping=20.0)
    now = rig_with_style(rig, bowed(wig_strands(), 0.04, 1.3))
    other = motion_flow.with_style(now, motion_flow.begin(rig, rig.rest_pose))
    there = motion_flow.begin(now, rig.rest_pose)
    for _ in range(48):
        other, there = (
            motion_flow.advance(
                now,
                motion,
                FrameInput(rig.rest_pose, (), settings, GRAVITY, 1.0 / 24.0),
            )
            for motion in (other, there)
        )
    assert np.abs(other.guides - there.guides).max() < 1e-4
    lengths = np.linalg.norm(np.diff(other.guides, axis=1), axis=2)
    expected = np.linalg.norm(np.diff(now.guide_grid, axis=1), axis=2)
    np.testing.assert_allclose(lengths, expected, rtol=0.002)


def test_nothing_of_it_is_simulated_at_0_and_all_of_it_at_1() -> None:
    rig = rig_of(wig_strands(), None)
    matrix, count = turned(0.2), len(rig.guides)
    fractions = np.where(np.arange(count) % 2 == 0, 0.0, 1.0).astype(np.float32)
    begun, pose = motion_flow.begin(rig, rig.rest_pose), pose_of(rig, matrix)

    def shown(simulated: np.ndarray | None) -> np.ndarray:
        painted = None if simulated is None else PaintedGuides({"influence": simulated[None]})
        motion = motion_flow.advance(
            rig,
            begun,
            FrameInput(pose, (), DynamicsSettings(), GRAVITY, 0.04, painted=painted),
        )
        return motion.guides

    some, free, style = shown(fractions), shown(None), motion_flow.style_of_guides(rig, pose)
    np.testing.assert_array_equal(some[1::2], free[1::2])
    np.testing.assert_array_equal(some[::2], style[::2])
    assert np.abs(free - style).max() > 0.01
