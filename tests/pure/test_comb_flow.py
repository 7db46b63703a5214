"""The quick update of hair under a comb brush equals a full rebuild from the combed curves."""

from __future__ import annotations

import numpy as np
import pytest
from small_wig import GUIDES, sheet, turn_strands, wig_strands

from hairloom.addon import rig_flow
from hairloom.addon.comb_flow import combed_rig
from hairloom.addon.groom.child_clumps import Clumps
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.strands import StrandSet

COMBED = np.array([3, 17, 40])


def rig_of(strands: StrandSet, settings: ChildrenSettings) -> rig_flow.Rig:
    return rig_flow.prepare(strands, sheet(), GUIDES, place="a wig", children=settings)


@pytest.mark.alike
@pytest.mark.parametrize("method", ["none", "multi", "single"])
@pytest.mark.parametrize("clump", [0.0, 0.8])
def test_it_is_what_a_rebuild_makes(method: str, clump: float) -> None:
    """Against a full rebuild. The turn is small, so that each strand keeps its guides; the children
    are so many that clumps have several levels."""
    settings = ChildrenSettings(method=method, strand_count=5000, clump=clump, frizz=0.02)
    before, after = wig_strands(), turn_strands(wig_strands(), COMBED, 0.05)
    rig, whole = rig_of(before, settings), rig_of(after, settings)
    now = combed_rig(rig, after.take(COMBED), COMBED)
    np.testing.assert_array_equal(now.strands.offsets, whole.strands.offsets)
    np.testing.assert_allclose(now.strands.points, whole.strands.points, atol=2e-6)
    np.testing.assert_allclose(now.guide_grid, whole.guide_grid, atol=1e-7)
    moved = np.abs(now.strands.points - rig.strands.points).max(axis=1) > 0.0
    assert 0 < moved.sum() < 0.6 * len(moved), "what nothing touched stays, bit for bit"
    assert np.abs(whole.strands.points - rig.strands.points).max() > 1e-3


def test_one_stroke_after_another_and_back_leaves_nothing() -> None:
    settings = ChildrenSettings(method="multi", strand_count=5000)
    before = wig_strands()
    first, second = (
        turn_strands(before, COMBED, 0.3),
        turn_strands(turn_strands(before, COMBED, 0.3), COMBED + 1, 0.2),
    )
    rig = rig_of(before, settings)
    now = combed_rig(
        combed_rig(rig, first.take(COMBED), COMBED), second.take(COMBED + 1), COMBED + 1
    )
    both = np.union1d(COMBED, COMBED + 1)
    at_once = combed_rig(rig, second.take(both), both)
    np.testing.assert_array_equal(now.strands.points, at_once.strands.points)
    back = combed_rig(now, before.take(both), both)
    np.testing.assert_allclose(back.strands.points, rig.strands.points, atol=1e-7)


def test_curves_of_other_point_counts_keep_those_of_the_rig() -> None:
    """A curl that a brush has straightened keeps the number of points that it had in the rig."""
    strands = wig_strands()
    angle = np.linspace(0.0, 30.0, 200)
    coil = np.stack([0.01 * np.cos(angle) - 0.01, 0.01 * np.sin(angle), 0.003 * angle], axis=1)
    points = np.concatenate([strands.points, coil.astype(np.float32)])
    offsets = np.append(strands.offsets, strands.offsets[-1] + 200)
    mixed = StrandSet(points, offsets, np.full(len(points), 1e-4), np.zeros(61))
    rig = rig_flow.prepare(mixed, sheet(), GUIDES, place="a wig")
    straight = StrandSet(
        np.linspace(coil[0], coil[-1], 200), [0, 200], np.full(200, 1e-4), np.zeros(1)
    )
    now = combed_rig(rig, straight, np.array([60]))
    np.testing.assert_array_equal(now.strands.offsets, rig.strands.offsets)
    shape = now.strands.points[now.strands.offsets[60] :]
    count = len(shape)
    assert 20 < count < 200
    np.testing.assert_allclose(shape, np.linspace(coil[0], coil[-1], count), atol=1e-6)


def test_clumps_know_whom_a_strand_draws() -> None:
    """1 draws 3, 0 draws 1: 3 depends on all three."""
    clumps = Clumps(np.array([0, 0, 2, 1]), np.array([0.0, 0.5, 0.0, 0.5]))
    np.testing.assert_array_equal(clumps.with_middles(np.array([3])), [0, 1, 3])
    touched = clumps.with_members(np.array([True, False, False, False]))
    np.testing.assert_array_equal(touched, [True, True, False, True])
