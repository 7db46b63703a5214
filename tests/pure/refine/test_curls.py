"""Strands of curled guides that are stretched: thinner coils of the same length."""

import numpy as np
import pytest

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.refine.curls import (
    EXTENSION_GAIN,
    EXTENSION_TOLERANCE,
    change_by_extension,
    visible_extension,
)
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet

LENGTH, RADIUS, TURNS, POINTS = 0.2, 0.006, 15, 400
STILL = Pose(None, np.eye(4))


def coils(count: int = 3, straight: int = 0) -> Rig:
    """Coils side by side along -Z, each a guide; the last `straight` ones are straight."""
    along = np.linspace(0.0, 1.0, POINTS)
    angle = 2.0 * np.pi * TURNS * along
    radius = np.where(np.arange(count)[:, None] < count - straight, RADIUS, 0.0)
    radius = radius * np.minimum(1.0, 30.0 * along)
    grid = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), -LENGTH * along + 0.0 * radius], axis=-1
    )
    grid[..., 0] += 0.03 * np.arange(count)[:, None]
    offsets, width = np.arange(count + 1) * POINTS, np.full(count * POINTS, 4e-5)
    strands = StrandSet(grid.reshape(-1, 3), offsets, width, np.zeros(count))
    return rig_flow.prepare(strands, None, GuideSettings(guide_count=count), place="coils")


def on_its_axis(rig: Rig) -> Rig:
    """A rig with exactly straight guides."""
    line = rig.guide_grid.copy()
    line[..., :2] = line[:, :1, :2]
    return Rig(rig.strands, None, rig.guides, line, rig.weights, None)


def drawn(rig: Rig, factor: float) -> np.ndarray:
    """Guides stretched by a factor, all segments but the first."""
    guides = rig.guide_grid.astype(np.float64)
    way = np.diff(guides, axis=1)
    way[:, 1:] *= factor
    return np.concatenate([guides[:, :1], guides[:, :1] + way.cumsum(axis=1)], axis=1).astype(
        np.float32
    )


def segments(rig: Rig, points: np.ndarray) -> np.ndarray:
    grid = points.reshape(rig.strands.strand_count, -1, 3).astype(np.float64)
    return np.linalg.norm(np.diff(grid, axis=1), axis=2)


def radius_of(rig: Rig, points: np.ndarray) -> float:
    """The radius of the first coil's middle turns, as the mean distance from its axis."""
    grid = points[: rig.strands.point_counts[0]].astype(np.float64)
    some = grid[len(grid) // 4 : -len(grid) // 4, :2]
    return float(np.linalg.norm(some - some.mean(axis=0), axis=1).mean())


@pytest.mark.parametrize("factor", [0.8, 1.3, 1.8])
def test_a_coil_that_is_drawn_out_gets_as_thin_as_its_length_says(factor: float) -> None:
    """A helix of arc length s over height h has the radius sqrt(s^2 - h^2) / (2 pi n)."""
    rig = on_its_axis(coils())
    found = motion_flow.strands_at(rig, STILL, drawn(rig, factor))
    rest = segments(rig, rig.strands.points)
    np.testing.assert_allclose(segments(rig, found), rest, rtol=5e-5)
    around = 2.0 * np.pi * TURNS
    arc = np.hypot(LENGTH, around * RADIUS)
    expected = np.sqrt(arc**2 - (factor * LENGTH) ** 2) / around
    assert radius_of(rig, found) == pytest.approx(expected, rel=0.01)
    tip = found.reshape(3, -1, 3)[:, -1, 2]
    np.testing.assert_allclose(tip, drawn(rig, factor)[:, -1, 2], atol=0.02 * LENGTH)


def test_turned_and_drawn_out_is_drawn_out_and_turned() -> None:
    rig, angle = on_its_axis(coils()), 1.1
    turn = np.array(
        [
            [np.cos(angle), 0.0, np.sin(angle)],
            [0.0, 1.0, 0.0],
            [-np.sin(angle), 0.0, np.cos(angle)],
        ]
    )
    guides = drawn(rig, 1.4)
    roots = rig.guide_grid[:, :1].astype(np.float64)
    turned = ((guides - roots) @ turn.T + roots).astype(np.float32)
    found = motion_flow.strands_at(rig, STILL, turned).reshape(3, -1, 3)
    plain = motion_flow.strands_at(rig, STILL, guides).reshape(3, -1, 3)
    expected = (plain - plain[:, :1]) @ turn.T + plain[:, :1]
    np.testing.assert_allclose(found, expected, atol=1e-5 * LENGTH)


def test_guides_that_are_off_by_what_their_solver_may_be_change_no_bit() -> None:
    rig = coils()
    rest = motion_flow.strands_at(rig, STILL, rig.guide_grid)
    np.testing.assert_array_equal(rest, rig.strands.points)
    straight = on_its_axis(rig)
    assert straight.curl_slack is not None
    off = motion_flow.strands_at(straight, STILL, drawn(straight, 1.0 + 0.9 * EXTENSION_TOLERANCE))
    np.testing.assert_array_equal(off, rig.strands.points)
    beyond = motion_flow.strands_at(
        straight, STILL, drawn(straight, 1.0 + 4.0 * EXTENSION_TOLERANCE)
    )
    assert np.abs(beyond - rig.strands.points).max() > 3.0 * EXTENSION_TOLERANCE * LENGTH


def test_straight_hair_beside_curls_never_stretches() -> None:
    rig = coils(4, straight=2)
    assert rig.curl_slack is not None
    is_straight = rig.guides >= 2
    assert not rig.curl_slack[is_straight].any() and rig.curl_slack[~is_straight, 1:].min() > 1.0
    found, first = motion_flow.strands_at(rig, STILL, drawn(rig, 1.5)), rig.strands.offsets[2]
    np.testing.assert_array_equal(found[first:], rig.strands.points[first:])
    assert np.abs(found[:first] - rig.strands.points[:first]).max() > 0.3 * LENGTH


def test_straight_hair_alone_has_no_room() -> None:
    rig = coils(2, straight=2)
    assert rig.curl_slack is None and rig.riders.can_extend is None


def test_what_is_seen_is_continuous_and_then_all() -> None:
    extension = np.linspace(-0.3, 0.3, 10_001)
    found = visible_extension(extension)
    assert (found[np.abs(extension) <= EXTENSION_TOLERANCE] == 0.0).all()
    is_all = np.abs(extension) > 3.1 * EXTENSION_TOLERANCE
    np.testing.assert_array_equal(found[is_all], extension[is_all])
    assert (np.diff(found) >= 0.0).all()
    assert np.diff(found).max() <= EXTENSION_GAIN * np.diff(extension).max() * 1.001


def test_straight_hair_among_curls_stays_straight_however_short_these_get() -> None:
    """It leans by a hundredth; if it were compressed like a curl, it would zigzag."""
    lean = np.float32([[0.01, -0.01], [0.0, 0.0], [1.0, 1.0]])
    for extension in (-0.3, 0.4):
        axis = np.float32([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [extension, extension]])
        assert np.abs(change_by_extension(lean, axis)).max() < 0.011


def test_any_segment_keeps_its_length_and_nothing_is_not_finite() -> None:
    random = np.random.default_rng(3)
    segment = random.normal(size=(3, 4000)).astype(np.float32)
    axis = random.normal(size=(4, 4000)).astype(np.float32) * 2.0
    segment[:, :50], axis[:, 25:75] = 0.0, 0.0
    axis[:3, 75:90] = 0.0  # a guide without a direction
    axis[:3, 90:120] = segment[:, 90:120]  # along the guide
    change = change_by_extension(segment, axis)
    assert np.isfinite(change).all()
    before, after = (np.linalg.norm(one, axis=0) for one in (segment, segment + change))
    np.testing.assert_allclose(after, before, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(change[:, 90:120], 0.0, atol=1e-6)
    assert np.abs(change[:, 200:]).max() > 0.5
