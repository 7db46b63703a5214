"""Strands moved to the places that hold them: the GPU against numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.groom.holds import anchors_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.groom.ties import Holders, Tie, TipSurface
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet, Surface

pytestmark = pytest.mark.usefixtures("gpu_context")


@pytest.fixture(scope="module")
def rig() -> Rig:
    """120 strands of 0.2 m; two balls hold some of them, a sheet holds some tips."""
    random = np.random.default_rng(3)
    direction = random.normal([0.0, 0.0, 0.4], 0.4, (120, 12, 3)) * 0.02
    points = random.normal(0.0, 0.02, (120, 1, 3)) + direction.cumsum(axis=1)
    strands = StrandSet(
        points.reshape(-1, 3),
        np.arange(121) * 12,
        np.full(120 * 12, 4e-5),
        np.zeros(120, np.int32),
    )
    balls = [np.diag([0.02, 0.02, 0.02, 1.0]), np.diag([0.03, 0.03, 0.03, 1.0])]
    balls[0][2, 3], balls[1][2, 3] = 0.03, 0.07
    ties = tuple(Tie(f"Ball {number}", shape, True) for number, shape in enumerate(balls))
    corners = np.array([[-1.0, -1.0, 0.1], [1.0, -1.0, 0.1], [0.0, 1.0, 0.1]])
    sheet = TipSurface("Sheet", Surface(corners, np.array([[0, 1, 2]])))
    settings = GuideSettings(guide_count=20, cv_count=12, tip_distance=0.1)
    rig = rig_flow.prepare(strands, None, settings, place="hair", holders=Holders(ties, sheet))
    assert rig.holds is not None
    strand, count = np.unique(rig.holds.strand, return_counts=True)
    assert 30 < len(strand) < 110
    assert count.max() > 1
    return rig


def pose_of(rig: Rig, seed: int) -> Pose:
    random = np.random.default_rng(seed)
    matrices = np.stack([np.eye(4)] * 2)
    matrices[:, :3, :3] += random.normal(0.0, 0.1, (2, 3, 3))
    matrices[:, :3, 3] = random.normal(0.0, 0.02, (2, 3))
    assert rig.holds is not None and rig.holds.surface is not None
    sheet = rig.holds.surface.positions + random.normal(0.0, 0.02, (3, 3))
    matrix = np.eye(4)
    matrix[:3, 3] = 0.01
    return Pose(None, matrix, anchors_of(rig.holds, matrices, sheet.astype(np.float32)))


def test_equals_numpy(rig: Rig) -> None:
    from hairloom.addon.render.ride_pass import RidePass

    ride = RidePass(rig.strands, rig.root_holds, rig.guides, rig.guide_grid, rig.riders, rig.holds)
    for seed in range(3):
        pose = pose_of(rig, seed)
        if seed == 2:  # a removed tie holds nothing
            gone = pose.anchors.copy()
            gone[0] = np.nan
            pose = replace(pose, anchors=gone)
        guides = motion_flow.style_of_guides(rig, pose)
        expected = motion_flow.strands_at(rig, pose, guides)
        free = motion_flow.strands_at(rig, replace(pose, anchors=None), guides)
        assert np.abs(expected - free).max() > 1e-3
        ride.ride(pose.head_positions, pose.matrix, guides, pose.anchors)
        np.testing.assert_allclose(ride.read(), expected, atol=2e-6)
    ride.carry(None, np.eye(4), anchors_of(rig.holds, np.stack([np.eye(4)] * 2), None))
    np.testing.assert_array_equal(ride.read(), rig.strands.points)
    ride.release()
    ride.ride(pose.head_positions, pose.matrix, guides, pose.anchors)
    np.testing.assert_allclose(ride.read(), expected, atol=2e-6)


def test_strands_of_any_point_counts(rig: Rig) -> None:
    """The pass alone, on strands of 4 to 40 points that are packed into rows."""
    from hairloom.addon.groom.ties import find_holds
    from hairloom.addon.refine.hold import hold_strands
    from hairloom.addon.render.hold_pass import HoldPass
    from hairloom.addon.render.strand_layout import StrandLayout
    from hairloom.addon.render.textures import texture_from, texture_to_array

    random = np.random.default_rng(8)
    counts = random.integers(4, 41, 90)
    lines = [random.normal([0, 0, 0.5], 0.3, (count, 3)).cumsum(axis=0) for count in counts]
    points = np.concatenate([0.2 * line / len(line) for line in lines]).astype(np.float32)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    radius = np.full(len(points), 1e-4)
    strands = StrandSet(points, offsets, radius, np.zeros(90, np.int32))
    shapes = np.diag([0.03, 0.03, 0.03, 1.0])[None].repeat(2, axis=0)
    shapes[:, 2, 3] = 0.03, 0.08
    ties = tuple(Tie(str(number), shape, True) for number, shape in enumerate(shapes))
    holds = find_holds(strands, Holders(ties))
    assert holds is not None and len(holds.strand) > 40
    matrices = np.stack([np.eye(4)] * 2)
    matrices[:, :3, 3] = random.normal(0.0, 0.01, (2, 3))
    anchors = anchors_of(holds, matrices, None)
    expected = points.copy()
    hold_strands(expected, points, strands.offsets, holds, anchors)
    layout = StrandLayout(strands.offsets)
    texels = layout.pixels(np.column_stack([points, radius]))
    rest, now = (texture_from(texels, "RGBA32F") for _ in range(2))
    HoldPass(holds, layout).hold(now, rest, anchors)
    found = layout.values(texture_to_array(now))
    assert np.abs(expected - points).max() > 0.005
    np.testing.assert_allclose(found[:, :3], expected, atol=2e-6)
    np.testing.assert_array_equal(found[:, 3], radius.astype(np.float32))
