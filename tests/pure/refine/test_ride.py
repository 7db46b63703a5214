"""Riding on guides: against explicit rotation matrices, and exact where possible."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import Floats, Ints
from hairloom.addon.groom.weights import GuideWeights
from hairloom.addon.refine.ride import SMALL, Riders, guide_turns, ride
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.center_lines import center_lines

SPACING = 0.015  # [m], between CVs


def walks(count: int, cv_count: int, seed: int, straying: float = 0.4) -> Floats:
    """Strands that bend at random, (count, cv_count, 3) float32."""
    random = np.random.default_rng(seed)
    steps = np.array([0.0, 0.0, -1.0]) + straying * random.normal(size=(count, cv_count - 1, 3))
    steps = steps.cumsum(axis=1)
    steps *= SPACING / np.linalg.norm(steps, axis=2, keepdims=True)
    roots = random.normal(scale=0.1, size=(count, 1, 3))
    return np.concatenate([roots, roots + steps.cumsum(axis=1)], axis=1).astype(np.float32)


def random_weights(strand_count: int, guide_count: int) -> GuideWeights:
    random = np.random.default_rng(1)
    guide = random.integers(guide_count, size=(strand_count, 3)).astype(np.int32)
    return GuideWeights(guide, random.dirichlet([1, 1, 1], strand_count).astype(np.float32))


def on_one_guide(guide: Ints) -> GuideWeights:
    guide = np.asarray(guide, np.int32)
    weight = np.tile(np.float32([1.0, 0.0, 0.0]), (len(guide), 1))
    return GuideWeights(np.repeat(guide[:, None], 3, axis=1), weight)


def set_of(points: Floats, offsets: Ints) -> StrandSet:
    return StrandSet(points, offsets, np.zeros(len(points)), np.zeros(len(offsets) - 1))


def rode(rest: Floats, weights: GuideWeights, guides: Floats, now: Floats) -> Floats:
    """`ride` for strands with the same number of CVs, (strand_count, cv_count, 3)."""
    offsets = np.arange(len(rest) + 1) * rest.shape[1]
    riders = Riders.of(set_of(rest.reshape(-1, 3), offsets), guides, weights)
    return ride(rest.reshape(-1, 3), riders, guides, now).reshape(rest.shape)


def lengths(grid: Floats) -> Floats:
    return np.linalg.norm(np.diff(grid.astype(np.float64), axis=1), axis=2)


def turning(one: Any, other: Any) -> Floats:
    """The smallest rotation from one vector to another, as a matrix."""
    one, other = one / np.linalg.norm(one), other / np.linalg.norm(other)
    cross, cosine = np.cross(one, other), one @ other
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1.0 + cosine)


def quaternion(matrix: Any) -> Floats:
    """The quaternion of a rotation by less than half a turn."""
    real = 0.5 * np.sqrt(1.0 + np.trace(matrix))
    axis = [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    return np.array([*(np.array(axis) / (4.0 * real)), real])


def rotation(q: Any) -> Floats:
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def one_by_one(rest: Floats, weights: GuideWeights, guides: Floats, now: Floats) -> Floats:
    """The same as `rode` in plain loops, with rotation matrices in double precision."""
    rest, guides, now = (each.astype(np.float64) for each in (rest, guides, now))
    turns = np.empty((len(guides), guides.shape[1] - 1, 3, 3))
    for guide in range(len(guides)):
        turn = np.eye(3)
        for segment in range(guides.shape[1] - 1):
            was, way = (np.diff(each[guide], axis=0)[segment] for each in (guides, now))
            turn = turning(turn @ was, way) @ turn
            turns[guide, segment] = turn
    ridden = rest.copy()
    for strand, guide_of, weight_of in zip(ridden, weights.guide, weights.weight, strict=True):
        edges = np.diff(strand, axis=0)
        line = center_lines(set_of(strand, np.array([0, len(strand)])), guides.shape[1])
        reach = line.lengths()[0] / np.linalg.norm(edges, axis=1).sum()
        strand[0] += weight_of @ (now - guides)[guide_of, 0]
        reached = 0.0
        for segment, edge in enumerate(edges):
            middle = reached + 0.5 * np.linalg.norm(edge)
            blend = np.zeros(4)
            for guide, weight in zip(guide_of, weight_of, strict=True):
                count = turns.shape[1]
                length = np.linalg.norm(np.diff(guides[guide], axis=0), axis=1).sum()
                place = np.clip(middle * reach / length * count - 0.5, 0.0, count - 1)
                before = min(int(place), count - 2)
                near, far = (quaternion(turns[guide, before + side]) for side in (0, 1))
                blend += weight * (near + (place - before) * (far - near))
            strand[segment + 1] = strand[segment] + rotation(blend) @ edge
            reached += np.linalg.norm(edge)
    return ridden


@pytest.mark.parametrize(("strand_count", "cv_count"), [(1, 2), (40, 9), (30, 40)])
def test_agrees_with_the_rotations_one_by_one(strand_count: int, cv_count: int) -> None:
    guides = walks(8, 7, 2)
    now = walks(8, 7, 3)
    rest, weights = walks(strand_count, cv_count, 4), random_weights(strand_count, 8)
    ridden = rode(rest, weights, guides, now)
    assert ridden.dtype == np.float32
    assert ridden == pytest.approx(one_by_one(rest, weights, guides, now), abs=2e-6)


def test_small_turns_need_no_look_at_their_signs(monkeypatch: pytest.MonkeyPatch) -> None:
    """For small turns, the shortcut without sign checks gives the same bits."""
    guides, rest = walks(9, 16, 2), walks(60, 16, 3)
    now = guides + np.linspace(0.0, 0.03, 16)[:, None] * np.float32([1.0, 0.5, 0.2])
    weights = random_weights(60, 9)
    assert (guide_turns(guides, now)[3] > SMALL).all()
    short = rode(rest, weights, guides, now)
    monkeypatch.setattr("hairloom.addon.refine.ride.SMALL", 2.0)
    np.testing.assert_array_equal(short, rode(rest, weights, guides, now))
    np.testing.assert_allclose(short, one_by_one(rest, weights, guides, now), atol=2e-6)


def test_guides_at_rest_leave_every_bit() -> None:
    guides, rest, weights = walks(20, 7, 2), walks(1000, 12, 3), random_weights(1000, 20)
    ridden = rode(rest, weights, guides, guides)
    assert (ridden == rest).all()
    ridden += 1.0
    assert (rest == walks(1000, 12, 3)).all(), "the result is no view of the input"


def test_straight_guides_that_turn_as_one_turn_their_strands_as_one() -> None:
    guides, rest, weights = (
        walks(20, 16, 2, straying=0.0),
        walks(500, 30, 3),
        random_weights(500, 20),
    )
    turn = turning(np.array([0.0, 0.0, -1.0]), np.array([0.3, -0.8, 0.4]))
    now = (guides - guides[:, :1]) @ turn.T + guides[:, :1]
    expected = (rest - rest[:, :1]) @ turn.T + rest[:, :1]
    error = np.abs(rode(rest, weights, guides, now) - expected).max()
    assert error < 1e-5 * lengths(rest).sum(axis=1).min()


def test_strands_go_with_guides_that_leave_their_roots() -> None:
    guides, rest, weights = walks(20, 7, 2), walks(300, 12, 3), random_weights(300, 20)
    shift = np.random.default_rng(4).normal(size=(20, 1, 3)).astype(np.float32)
    expected = rest + np.einsum("nk,nkcj->ncj", weights.weight, shift[weights.guide])
    assert rode(rest, weights, guides, guides + shift) == pytest.approx(expected, abs=1e-4)


def test_every_segment_keeps_its_length_however_wildly_guides_move() -> None:
    guides, rest, weights = walks(20, 16, 2), walks(500, 30, 3), random_weights(500, 20)
    now = guides + np.random.default_rng(5).normal(scale=0.05, size=guides.shape)
    now[:, 0] = guides[:, 0]
    ridden = rode(rest, weights, guides, now)
    assert np.abs(ridden - rest).max() > 0.1
    assert lengths(ridden) == pytest.approx(lengths(rest), abs=2e-7)
    assert (ridden[:, 0] == rest[:, 0]).all()


def test_a_strand_that_is_a_guide_goes_where_the_guide_goes() -> None:
    guides, now = walks(20, 16, 2), walks(20, 16, 3)
    now += guides[:, :1] - now[:, :1]
    ridden = rode(guides, on_one_guide(np.arange(20)), guides, now)
    assert ridden == pytest.approx(now, abs=1e-6)


def coil(turns: int, cv_count: int, length: float = 0.2, radius: float = 0.008) -> Floats:
    """A coil of this many turns along -z, (cv_count, 3) float32."""
    along = np.linspace(0.0, 1.0, cv_count)
    angle = 2.0 * np.pi * turns * along
    places = [radius * np.cos(angle), radius * np.sin(angle), -length * along]
    return np.stack(places, axis=1).astype(np.float32)


def test_a_coil_stays_this_coil_on_a_guide_that_bends_to_an_arc() -> None:
    """Its windings keep their distance from the guide and the coil its length."""
    strand, bend = coil(20, 400), 0.2 / (np.pi / 2)
    coils = set_of(strand, np.array([0, 400]))
    line = center_lines(coils, 16).grid
    angle, away = -line[..., 2] / bend, bend - line[..., 0]
    places = [bend - away * np.cos(angle), line[..., 1], -away * np.sin(angle)]
    ridden = ride(
        strand, Riders.of(coils, line, on_one_guide([0])), line, np.stack(places, axis=-1)
    )
    assert lengths(ridden[None]).sum() == pytest.approx(lengths(strand[None]).sum(), rel=1e-6)
    # from the middle of the arc's circle, the windings reach as far in as out
    radius = np.hypot(np.hypot(ridden[:, 0] - bend, ridden[:, 2]) - bend, ridden[:, 1])
    assert radius == pytest.approx(0.008, rel=0.06)
    assert ridden[-1, 2] == pytest.approx(-bend, abs=0.01)


def test_guides_that_fold_back_turn_nothing_further_than_themselves() -> None:
    straight = np.zeros((1, 16, 3), np.float32)
    straight[0, :, 2] = -SPACING * np.arange(16)
    rest = walks(1, 60, 3, straying=0.1)
    for slip in (0.0, 1e-7, 1e-4):
        now = straight.copy()
        now[0, 8:, 2] = straight[0, 7, 2] + SPACING * np.arange(1, 9)
        now[0, 8:, 0] = slip
        ridden = rode(rest, on_one_guide([0]), straight, now)
        assert np.isfinite(ridden).all()
        assert lengths(ridden) == pytest.approx(lengths(rest), abs=2e-7)
        before, after = (np.diff(each[0], axis=0) / SPACING for each in (rest, ridden))
        cosine = (before * after).sum(axis=1) / (lengths(rest)[0] / SPACING) ** 2
        assert (cosine[:7] > 0.999).all(), "what hangs above the fold stays"


def test_rests_that_fold_back_are_no_reason_to_turn() -> None:
    guides = walks(1, 16, 2)
    guides[0, 8:] = guides[0, 7] - (guides[0, 8:] - guides[0, 7])
    turns = guide_turns(guides, guides + np.float32([0.0, 0.0, 1.0]))
    assert np.abs(turns[:3]).max() < 2e-5


def test_points_that_coincide_stay_finite() -> None:
    guides, rest = walks(3, 8, 2), walks(9, 12, 3)
    guides[0, 3:] = guides[0, 3:4]
    guides[1] = guides[1, :1]
    rest[0, 5] = rest[0, 4]
    rest[1] = rest[1, :1]
    now = walks(3, 8, 4)
    now[2, 2] = now[2, 1]
    ridden = rode(rest, random_weights(9, 3), guides, now)
    assert np.isfinite(ridden).all()
    assert lengths(ridden) == pytest.approx(lengths(rest), abs=2e-7)


def test_guides_that_turn_against_each_other_by_half_a_turn() -> None:
    """Their mean is no rotation at all."""
    guides = np.repeat(walks(1, 8, 2), 2, axis=0)
    now = guides.copy()
    for guide, axis in enumerate(([1.0, 0.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 1.0])):
        arms = (guides[guide] - guides[guide, 0]) @ rotation(np.array(axis)).T
        now[guide] = arms + guides[guide, 0]
    weights = GuideWeights(np.int32([[0, 1, 1]]), np.float32([[0.5, 0.5, 0.0]]))
    ridden = rode(walks(1, 12, 3), weights, guides, now)
    assert np.isfinite(ridden).all()


def test_guides_that_came_to_one_direction_from_two_sides_agree() -> None:
    """One has turned by 200 degrees, the other by -160, which is the same rotation. Another strand
    rides on a guide at rest."""
    straight = walks(3, 16, 2, straying=0.0)
    now = straight.copy()
    for guide, end in enumerate((200.0, -160.0)):
        angle = np.radians(end) * np.arange(1, 16) / 15.0
        steps = SPACING * np.stack([np.sin(angle), 0.0 * angle, -np.cos(angle)], axis=1)
        now[guide, 1:] = now[guide, 0] + steps.cumsum(axis=0)
    guide, weight = [[2, 2, 2], [0, 1, 1]], [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0]]
    weights = GuideWeights(np.int32(guide), np.float32(weight))
    ridden = rode(straight[[2, 0]], weights, straight, now)
    assert np.diff(ridden[1], axis=0)[-1] == pytest.approx(np.diff(now[0], axis=0)[-1], abs=1e-5)
    assert np.array_equal(ridden[0], straight[2])


@pytest.mark.parametrize("strand_count", [0, 1, 700, 2500])
def test_strands_of_any_number_of_points(strand_count: int) -> None:
    """Each strand rides as it does alone."""
    guides, now = walks(20, 9, 2), walks(20, 9, 3)
    weights = random_weights(strand_count, 20)
    counts = np.random.default_rng(6).integers(2, 30, strand_count)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    strands = [walk[:count] for walk, count in zip(walks(strand_count, 30, 4), counts, strict=True)]
    points = np.concatenate([np.zeros((0, 3), np.float32), *strands])
    ridden = ride(points, Riders.of(set_of(points, offsets), guides, weights), guides, now)
    assert ridden.shape == points.shape
    for strand in range(0, strand_count, 37):
        own_weights = GuideWeights(
            weights.guide[strand : strand + 1], weights.weight[strand : strand + 1]
        )
        alone = rode(strands[strand][None], own_weights, guides, now)[0]
        assert ridden[offsets[strand] : offsets[strand + 1]] == pytest.approx(alone, abs=1e-6)


def test_riding_takes_little_more_memory_than_its_result() -> None:
    """Memory beyond the result is below 4 MB for any number of strands."""
    guides = walks(20, 7, 2)
    for strand_count in (20_000, 60_000):
        rest = walks(strand_count, 7, 3).reshape(-1, 3)
        offsets = np.arange(strand_count + 1) * 7
        riders = Riders.of(set_of(rest, offsets), guides, random_weights(strand_count, 20))
        tracemalloc.start()
        size = ride(rest, riders, guides, guides).nbytes
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < size + 4_000_000
