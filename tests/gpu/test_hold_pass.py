"""Strands brought to where they are held: the GPU against the pipeline's numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import pipeline
from hairloom.addon.groom.holds import anchors_of
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.groom.ties import Holders, Tie, TipSurface
from hairloom.addon.pipeline import Pose, Rig
from hairloom.addon.strands import StrandSet, Surface

pytestmark = pytest.mark.usefixtures("gpu_context")


@pytest.fixture(scope="module")
def rig() -> Rig:
    """120 strands of 0.2 m; two balls hold some of them, a sheet some tips."""
    random = np.random.default_rng(3)
    way = random.normal([0.0, 0.0, 0.4], 0.4, (120, 12, 3)) * 0.02
    points = random.normal(0.0, 0.02, (120, 1, 3)) + way.cumsum(axis=1)
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
    rig = pipeline.prepare(strands, None, settings, place="hair", holders=Holders(ties, sheet))
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

    ride = RidePass(rig.strands, rig.head, rig.guides, rig.guide_grid, rig.weights, rig.holds)
    for seed in range(3):
        pose = pose_of(rig, seed)
        if seed == 2:  # a tie that is gone holds nothing
            gone = pose.anchors.copy()
            gone[0] = np.nan
            pose = replace(pose, anchors=gone)
        guides = pipeline.style_of_guides(rig, pose)
        expected = pipeline.strands_at(rig, pose, guides)
        free = pipeline.strands_at(rig, replace(pose, anchors=None), guides)
        assert np.abs(expected - free).max() > 1e-3
        ride.ride(pose.head_positions, pose.matrix, guides, pose.anchors)
        np.testing.assert_allclose(ride.read(), expected, atol=2e-6)
    ride.carry(None, np.eye(4), anchors_of(rig.holds, np.stack([np.eye(4)] * 2), None))
    np.testing.assert_array_equal(ride.read(), rig.strands.grid)
    ride.release()
    ride.ride(pose.head_positions, pose.matrix, guides, pose.anchors)
    np.testing.assert_allclose(ride.read(), expected, atol=2e-6)
