"""Strands led out of colliders: distances to known solids, lengths, and unaffected strands."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon import motion_flow
from hairloom.addon.dynamics.colliders import (
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.weights import GuideWeights
from hairloom.addon.motion_flow import FrameInput
from hairloom.addon.refine.lead_out import (
    NO_DEFLECTIONS,
    RETURN_RATE,
    TOLERANCE,
    CarryPoints,
    LedOut,
    clearance_at,
    lead_out,
)
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.arc_length import segment_lengths

KEPT = 0.001
BALL = SphereCollider((0.0, 0.0, 0.0), 0.1)


def still(collider: Collider, *shift: float) -> tuple[PosedCollider, ...]:
    matrix = np.eye(4)
    matrix[:3, 3] = shift or (0.0, 0.0, 0.0)
    return (PosedCollider(collider, matrix, matrix),)


def at(places: np.ndarray) -> CarryPoints:
    """A `CarryPoints` that returns these places for all points."""
    return lambda index, strands: places[index]


def lines(begin: np.ndarray, end: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Straight strands from `begin` (n, 3) to `end` (n, 3) with these point counts, and their
    offsets."""
    points = [
        one + np.linspace(0.0, 1.0, count)[:, None] * (other - one)
        for one, other, count in zip(begin, end, counts, strict=True)
    ]
    return np.concatenate(points).astype(np.float32), np.concatenate([[0], np.cumsum(counts)])


@pytest.fixture
def across() -> tuple[np.ndarray, np.ndarray]:
    """400 strands of 4 to 40 points, 0.3 m long; about half of them go through the ball."""
    random = np.random.default_rng(4)
    begin = random.normal(size=(400, 3))
    begin *= 0.13 / np.linalg.norm(begin, axis=1, keepdims=True)
    way = random.normal(size=(400, 3)) - 8.0 * begin
    way *= 0.3 / np.linalg.norm(way, axis=1, keepdims=True)
    return lines(begin, begin + way, random.integers(4, 41, 400))


def test_strands_go_around_a_ball_and_keep_their_segments(across) -> None:
    points, offsets = across
    colliders = still(BALL)
    clearance = clearance_at(points + 10.0, offsets, colliders, KEPT)
    assert (clearance.points[offsets[:-1]] == -np.inf).all()
    now = points.copy()
    led, _ = lead_out(now, at(points), offsets, colliders, clearance)
    depth = np.linalg.norm(points, axis=1) - 0.1
    were_near = np.minimum.reduceat(depth, offsets[:-1]) < KEPT * (1.0 - TOLERANCE)
    np.testing.assert_array_equal(led, np.flatnonzero(were_near))
    assert 100 < len(led) < 350
    assert np.linalg.norm(now, axis=1).min() > 0.1 + KEPT * (1.0 - TOLERANCE) - 1.0e-7
    np.testing.assert_allclose(
        segment_lengths(now, offsets), segment_lengths(points, offsets), atol=1e-7
    )
    counts = np.diff(offsets)
    kept = np.repeat(~were_near, counts)
    np.testing.assert_array_equal(now[kept], points[kept])
    np.testing.assert_array_equal(now[offsets[:-1]], points[offsets[:-1]])


def test_what_comes_after_goes_along_in_its_shape() -> None:
    """Only the second point of the strand is too near; the rest moves along in its shape."""
    points = np.array([[0, 0, 0.102], [0.05, 0, 0.08], [0.1, 0.02, 0.1], [0.12, 0, 0.15]])
    points = points.astype(np.float32)
    now, offsets = points.copy(), np.array([0, 4])
    clearance = clearance_at(points + 1, offsets, still(BALL), KEPT)
    led, _ = lead_out(now, at(points), offsets, still(BALL), clearance)
    assert led.tolist() == [0]
    np.testing.assert_allclose(np.diff(now[1:], axis=0), np.diff(points[1:], axis=0), atol=1e-7)
    assert np.linalg.norm(now[1]) >= 0.1 + KEPT * (1.0 - TOLERANCE)


def test_what_was_inside_may_stay_as_deep_and_no_deeper(across) -> None:
    points, offsets = across
    colliders = still(BALL)
    clearance = clearance_at(points, offsets, colliders, KEPT)
    now = points.copy()
    assert not len(lead_out(now, at(points), offsets, colliders, clearance)[0])
    np.testing.assert_array_equal(now, points)
    moved = still(BALL, 0.02, 0.0, 0.0)
    led, _ = lead_out(now, at(points), offsets, moved, clearance)
    assert len(led)
    shortfall = clearance.points - signed_distance(now, moved, KEPT)[0]
    assert shortfall.max() <= TOLERANCE * KEPT + 1e-7


def test_what_was_inside_comes_out_as_it_moves_away() -> None:
    """A strand 2 mm deep at rest that swings aside by 1.5 mm, and by 20 mm."""
    points = np.array([[0, 0, 0.1], [0, 0.01, 0.0975], [0, 0.02, 0.096]], np.float32)
    offsets, colliders = np.array([0, 3]), still(BALL)
    clearance = clearance_at(points, offsets, colliders, KEPT)
    assert clearance.points[1] == pytest.approx(-0.00199, abs=1e-4)
    for aside in (0.0015, 0.02):
        now = points + np.array([[0.0, 0.0, 0.0], [aside, 0.0, 0.0], [aside, 0.0, 0.0]])
        now = now.astype(np.float32)
        lead_out(now, at(points), offsets, colliders, clearance)
        away = np.linalg.norm(now - points, axis=1)[1:]
        distance = np.linalg.norm(now, axis=1)[1:] - 0.1
        required = np.minimum(clearance.points[1:] + aside, KEPT)
        assert (distance > required - 2.0 * TOLERANCE * KEPT).all(), (away, distance)


def test_a_fold_from_which_no_segment_leads_out() -> None:
    """In a bowl of balls, a strand that dives in is led out past its rim."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    rings = [
        np.stack([r * np.cos(angle), r * np.sin(angle), np.full(24, height)], axis=1)
        for r, height in ((0.012, 0.0), (0.02, 0.012), (0.022, 0.024), (0.02, 0.034))
    ]
    centers = np.concatenate([*rings, [[0.0, 0.0, -0.004]]])
    bowl = SphereSetCollider(centers, np.full(len(centers), 0.0085))
    random = np.random.default_rng(6)
    begin = random.uniform(-0.008, 0.008, (60, 3)) + [0.0, 0.0, 0.07]
    end = random.uniform(-0.02, 0.02, (60, 3)) + [0.0, 0.0, -0.1]
    points, offsets = lines(begin, end, np.full(60, 9))
    colliders = still(bowl)
    clearance = clearance_at(points + 1.0, offsets, colliders, KEPT)
    now = points.copy()
    led, _ = lead_out(now, at(points), offsets, colliders, clearance)
    assert len(led) > 40
    distance = signed_distance(now, colliders, KEPT)[0]
    assert distance.min() > KEPT * (1.0 - 2.0 * TOLERANCE)
    np.testing.assert_allclose(
        segment_lengths(now, offsets), segment_lengths(points, offsets), atol=1e-7
    )


def test_strands_without_length_and_of_two_points_stay_finite() -> None:
    points = np.zeros((9, 3), np.float32)
    points[2:5] = [[0, 0, 0.11], [0, 0, 0.11], [0, 0, 0.02]]
    offsets = np.array([0, 2, 5, 9])
    now = points.copy()
    clearance = clearance_at(points + 1.0, offsets, still(BALL), KEPT)
    lead_out(now, at(points), offsets, still(BALL), clearance)
    assert np.isfinite(now).all()
    np.testing.assert_allclose(
        segment_lengths(now, offsets), segment_lengths(points, offsets), atol=1e-7
    )
    none = np.zeros((0, 3), np.float32)
    clearance = clearance_at(none, np.array([0]), still(BALL), KEPT)
    assert not len(lead_out(none, at(none), np.array([0]), still(BALL), clearance)[0])


def test_led_strands_are_put_where_they_were(across) -> None:
    points, offsets = across
    led = LedOut.of(np.array([3, 90]), points, offsets)
    assert led.fits(offsets)
    there = np.zeros_like(points)
    led.put(there, offsets)
    is_one = np.isin(np.repeat(np.arange(400), np.diff(offsets)), [3, 90])
    np.testing.assert_array_equal(there[is_one], points[is_one])
    assert not there[~is_one].any()
    for strands, count in (([400], 4), ([-1], 4), ([3], 1)):
        assert not LedOut(np.array(strands), points[:count]).fits(offsets)


def test_a_strand_between_guides_that_part_goes_around() -> None:
    """A ball rises between two guides; the strand halfway between them would pass through it."""
    along = np.linspace(0.0, 0.3, 16)
    grid = np.zeros((3, 16, 3))
    grid[..., 1] = -along
    grid[:, :, 0] = np.array([-0.02, 0.0, 0.02])[:, None]
    strands = StrandSet(
        grid.reshape(-1, 3), np.arange(4) * 16, np.full(48, 4e-5), np.zeros(3, np.int32)
    )
    lines, guides = strands.grid, np.array([0, 2])
    fractions = np.array([[1.0, 0.0, 0.0], [0.5, 0.0, 0.5], [0.0, 0.0, 1.0]])
    weights = GuideWeights(np.array([[0, 0, 1]] * 3), fractions)
    rig = Rig(strands, None, guides, lines[guides], weights, None)
    motion = motion_flow.begin(rig, rig.rest_pose)
    before = np.eye(4)
    before[:3, 3] = 0.0, -0.2, -0.25
    settings = DynamicsSettings()
    for _ in range(30):
        now = before.copy()
        now[2, 3] += 0.01
        posed = (PosedCollider(BALL, before, now),)
        pose = Pose(None, np.eye(4))
        motion = motion_flow.advance(
            rig, motion, FrameInput(pose, posed, settings, np.zeros(3), 1.0 / 30.0)
        )
        before = now
        points = motion_flow.strands_and_led(rig, motion)[0]
        depth = 0.1 - np.linalg.norm(points - now[:3, 3], axis=1)
        assert depth.max() < 1e-6
        np.testing.assert_allclose(
            segment_lengths(points, strands.offsets),
            segment_lengths(strands.points, strands.offsets),
            atol=1e-6,
        )
    led = motion_flow.strands_and_led(rig, motion)[1]
    unled = motion_flow.strands_at(rig, motion.pose, motion.guides)
    assert (0.1 - np.linalg.norm(unled - now[:3, 3], axis=1)).max() > 0.005
    baked = motion_flow.strands_at(rig, motion.pose, motion.guides, led)
    np.testing.assert_array_equal(baked, points)


def test_hair_beside_a_sheet_that_its_grid_makes_thicker_stays_on_its_side() -> None:
    """A turned sheet of 3 mm in cells of 9 mm: its distance field has hair 2 mm beside it
    inside."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    half = np.array([0.06, 0.0015, 0.06])
    sine, cosine = np.sin(0.3), np.cos(0.3)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    settings = DynamicsSettings(collider_resolution=13)
    sheet = Surface((corners * half @ turn.T).astype(np.float32), np.array(triangles))
    colliders = still(DistanceField.from_surface(sheet, settings))
    begin, end = np.array([[-0.03, 0.013, -0.03]]), np.array([[0.04, 0.0025, 0.04]])
    carried, offsets = lines(np.tile(begin, (8, 1)), np.tile(end, (8, 1)), np.full(8, 16))
    # further to the other side from strand to strand, by up to 6 mm at their tips
    aside = np.linspace(0.0, 0.006, 8)[:, None] * np.linspace(0.0, 1.0, 16)
    ridden = carried - aside.reshape(-1, 1) * np.array([0.0, 1.0, 0.0])
    carried, ridden = ((points @ turn.T).astype(np.float32) for points in (carried, ridden))
    clearance = clearance_at(carried, offsets, colliders, KEPT)
    assert (clearance.held > 8).all()
    now = ridden.copy()
    led, _ = lead_out(now, at(carried), offsets, colliders, clearance)
    assert (ridden @ turn)[:, 1].min() < -0.003
    assert (now @ turn)[:, 1].min() > half[1]
    assert len(led) == 8
    expected = segment_lengths(ridden, offsets)
    for strand, last in enumerate(clearance.held):
        held = slice(offsets[strand], offsets[strand] + last + 1)
        np.testing.assert_allclose(now[held], carried[held], atol=KEPT * TOLERANCE)
        expected[held] = segment_lengths(carried, offsets)[held]
    np.testing.assert_allclose(segment_lengths(now, offsets), expected, atol=1e-7)


def test_a_strand_that_nothing_leads_out_is_as_its_root_carries_it() -> None:
    """It rides into a shell of balls that encloses its root."""
    random = np.random.default_rng(3)
    centers = random.normal(size=(400, 3))
    centers *= 0.05 / np.linalg.norm(centers, axis=1, keepdims=True)
    shell = still(SphereSetCollider(centers, np.full(400, 0.02)))
    carried, offsets = lines(np.zeros((1, 3)), np.array([[0.02, 0.0, 0.0]]), np.array([6]))
    clearance = clearance_at(carried, offsets, shell, KEPT)
    longer = carried * np.float32(12.5)  # each point of it is in the shell
    now = longer.copy()
    assert lead_out(now, at(carried), offsets, shell, clearance)[0].tolist() == [0]
    np.testing.assert_array_equal(now, carried)


def dives(tilt: float) -> np.ndarray:
    """A strand straight down into the ball from above, with a slight tilt along x."""
    along = np.linspace(0.0, 0.15, 12)[:, None]
    return (np.array([0.0, 0.0, 0.12]) + along * [tilt, 0.0, -1.0]).astype(np.float32)


def test_a_strand_that_could_go_either_way_goes_where_it_went_before() -> None:
    offsets, rest, colliders = np.array([0, 12]), dives(0.0), still(BALL)
    clearance = clearance_at(rest + 1.0, offsets, colliders, KEPT)

    def led(tilts: list[float], *, remembers: bool) -> np.ndarray:
        """The tip in each frame."""
        tips, deflections = [], NO_DEFLECTIONS
        for tilt in tilts:
            now = dives(tilt)
            left = deflections.decayed(1.0 / 60.0, offsets) if remembers else NO_DEFLECTIONS
            _, deflections = lead_out(now, at(rest), offsets, colliders, clearance, left)
            assert np.linalg.norm(now, axis=1).min() > 0.1 + KEPT * (1.0 - 2.0 * TOLERANCE)
            np.testing.assert_allclose(
                segment_lengths(now, offsets), segment_lengths(dives(tilt), offsets), atol=1e-7
            )
            tips.append(now[-1])
        return np.array(tips)

    wobbles = [0.1, -0.1] * 4
    assert np.linalg.norm(np.diff(led(wobbles, remembers=False), axis=0), axis=1).min() > 0.1
    tips = led(wobbles, remembers=True)
    assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() < 0.045
    np.testing.assert_array_equal(led(wobbles, remembers=True), tips)
    # where it clearly goes to the other side, it follows
    there = led([0.1, *np.linspace(0.0, -0.6, 20), *[-0.6] * 20], remembers=True)[-1]
    np.testing.assert_allclose(there, led([-0.6], remembers=False)[0], atol=0.004)


def test_what_nothing_leads_out_any_more_turns_back_steadily() -> None:
    offsets, rest = np.array([0, 12]), dives(0.02)
    clearance = clearance_at(rest + 1.0, offsets, still(BALL), KEPT)
    now, frame, gone = rest.copy(), 1.0 / 60.0, still(BALL, 9.0, 0.0, 0.0)
    strands, deflections = lead_out(now, at(rest), offsets, still(BALL), clearance)
    assert strands.tolist() == deflections.strands.tolist() == [0]
    before, frames = now, 0
    while len(deflections.strands):
        now = rest.copy()
        _, deflections = lead_out(
            now, at(rest), offsets, gone, clearance, deflections.decayed(frame, offsets)
        )
        turned = (
            np.linalg.norm(np.diff(now - before, axis=0), axis=1)
            / segment_lengths(rest, offsets)[1:]
        )
        assert turned.max() < 1.3 * RETURN_RATE * frame
        np.testing.assert_allclose(
            segment_lengths(now, offsets), segment_lengths(rest, offsets), atol=1e-7
        )
        before, frames = now, frames + 1
    assert 2 <= frames <= np.ceil(2.0 / (RETURN_RATE * frame)) + 1
    np.testing.assert_allclose(now, rest, atol=1e-6)
    now = rest.copy()
    lead_out(now, at(rest), offsets, gone, clearance)
    np.testing.assert_array_equal(now, rest)
