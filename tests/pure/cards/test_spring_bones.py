"""Spring bones: all steps of the specification, bone by bone, and the search for known values."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon.cards import spring_chains
from hairloom.addon.cards.joints import CardTracks
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.spring_bones import (
    STEP_RATE,
    SpringChains,
    SpringColliders,
    SpringValues,
    resampled_to_frames,
    resampled_to_steps,
    rotations_towards,
    simulate_springs,
    with_bone_lengths,
)
from hairloom.addon.cards.spring_chains import Candidate, fewest_joints, spring_steps
from hairloom.addon.cards.spring_fit import spring_fit
from hairloom.addon.cards.steps import result_of

STEPS = 60
NO_BALLS = SpringColliders.spheres(np.empty((0, 3)), np.empty(0))


def shaken(steps: int = STEPS) -> np.ndarray:
    """A head that turns about Z and moves to and fro, (steps, 4, 4)."""
    angle = 0.5 * np.sin(np.arange(steps) * 0.2)
    head = np.tile(np.eye(4), (steps, 1, 1))
    head[:, 0, 0] = head[:, 1, 1] = np.cos(angle)
    head[:, 1, 0], head[:, 0, 1] = np.sin(angle), -np.sin(angle)
    head[:, 0, 3] = 0.05 * np.sin(np.arange(steps) * 0.3)
    return head


def made_chains(count: int = 3, joints: int = 4, balls: SpringColliders = NO_BALLS) -> SpringChains:
    """Chains that hang outwards, each a little bent."""
    random = np.random.default_rng(4)
    ways = random.normal(size=(count, joints, 3)) * 0.3 + [0.5, 0.0, -1.0]
    ways *= 0.04 / np.linalg.norm(ways, axis=-1, keepdims=True)
    places = np.cumsum(ways, axis=1) + [0.1, 0.0, 0.0]
    rest = np.tile(np.eye(4), (count, joints, 1, 1))
    rest[..., :3, 3] = places
    directions = np.concatenate([np.diff(places, axis=1), ways[:, -1:]], axis=1)
    y = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    x = np.cross(y, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    rest[..., :3, :3] = np.stack([x, y, np.cross(x, y)], axis=-1)
    return SpringChains(rest, balls, np.ones((count, len(balls.radius)), bool))


def made_values(chains: SpringChains) -> SpringValues:
    shape = chains.lengths.shape
    random = np.random.default_rng(5)
    return SpringValues(
        random.uniform(0.1, 1.0, shape),
        random.uniform(0.05, 0.5, shape),
        random.uniform(0.0, 0.3, shape),
        np.full(shape, 0.004),
    )


def least_turn(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The smallest rotation from `one` to `other`, by axis and angle: another form of Rodrigues'
    formula."""
    axis = np.cross(one, other)
    sine, cosine = np.linalg.norm(axis), one @ other
    if sine < 1e-12:
        return np.eye(3)
    x, y, z = axis / sine
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + sine * k + (1 - cosine) * k @ k


def by_the_book(chain: SpringChains, values: SpringValues, head: np.ndarray) -> np.ndarray:
    """The specification's pseudocode for one chain, bone by bone, in world space."""
    rest = chain.rest[0]
    first = head[0] @ rest
    current, before = list(first[1:, :3, 3]), list(first[1:, :3, 3])
    found = []
    for matrix in head:
        parent, origin = matrix[:3, :3], (matrix @ rest[0])[:3, 3]
        line = [origin]
        for bone in range(len(rest) - 1):
            up = rest[bone - 1, :3, :3] if bone else np.eye(3)
            local = up.T @ rest[bone, :3, :3]
            axis, length = np.array([0.0, 1.0, 0.0]), chain.lengths[0, bone]
            tail = current[bone] + (current[bone] - before[bone]) * (1 - values.drag[0, bone])
            tail = tail + parent @ local @ axis * values.stiffness[0, bone] / STEP_RATE
            tail = tail + np.array([0, 0, -1]) * values.gravity[0, bone] / STEP_RATE
            tail = origin + (tail - origin) / np.linalg.norm(tail - origin) * length
            for center, radius in zip(chain.colliders.center, chain.colliders.radius, strict=True):
                way = tail - (matrix[:3, :3] @ center + matrix[:3, 3])
                miss = np.linalg.norm(way) - radius - values.hit_radius[0, bone]
                if miss < 0:
                    tail = tail - way / np.linalg.norm(way) * miss
                    tail = origin + (tail - origin) / np.linalg.norm(tail - origin) * length
            before[bone], current[bone] = current[bone], tail
            to = (parent @ local).T @ (tail - origin) / length
            parent = parent @ local @ least_turn(axis, to)
            origin = tail
            line.append(tail)
        found.append([matrix[:3, :3].T @ (place - matrix[:3, 3]) for place in line])
    return np.array(found)


@pytest.mark.parametrize("ball_count", [0, 2])
def test_steps_are_those_of_the_specification(ball_count: int) -> None:
    balls = SpringColliders.spheres(np.array([[0.1, 0.02, -0.03], [0.13, -0.03,
    -0.07]])[:ball_count],
                     np.array([0.03, 0.025])[:ball_count])  # fmt: skip
    chains, head = made_chains(balls=balls), shaken()
    values = made_values(chains)
    found = simulate_springs(chains, values, head)
    for number in range(len(chains.rest)):
        own = chains.select(np.array([number]))
        names = ("stiffness", "drag", "gravity", "hit_radius")
        own_values = SpringValues(*(getattr(values, name)[number][None] for name in names))
        np.testing.assert_allclose(found[:, number], by_the_book(own, own_values, head), atol=1e-9)


def test_a_capsule_equals_the_spheres_along_it() -> None:
    ends = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    capsule = SpringColliders(ends[:1], ends[1:], np.array([0.02]))
    many = SpringColliders.spheres(np.linspace(ends[0], ends[1], 2001), np.full(2001, 0.02))
    points = np.random.default_rng(0).uniform(-0.1, 0.2, (50, 3))
    nearest = many.nearest(points)[1].min(axis=-1)
    np.testing.assert_allclose(capsule.nearest(points)[1][:, 0], nearest, atol=1e-6)


def test_a_head_at_rest_leaves_chains_at_rest_and_gravity_draws_them_down() -> None:
    chains, still = made_chains(), np.tile(np.eye(4), (STEPS, 1, 1))
    values = made_values(chains)
    places = simulate_springs(chains, replace(values, gravity=np.zeros_like(values.gravity)), still)
    np.testing.assert_allclose(places[-1], chains.rest[..., :3, 3], atol=1e-12)
    drawn = simulate_springs(chains, values, still)[-1]
    assert (drawn[:, -1, 2] < chains.rest[:, -1, 2, 3]).all()


def test_bones_keep_their_lengths_and_point_at_the_next_joint() -> None:
    chains = made_chains()
    places = simulate_springs(chains, made_values(chains), shaken())
    ways = np.diff(places, axis=2)
    lengths = np.linalg.norm(ways, axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(chains.lengths, lengths.shape))
    turns = rotations_towards(chains.rest, places)
    np.testing.assert_allclose(turns[:, :, :-1, :, 1], ways / lengths[..., None], atol=1e-9)
    np.testing.assert_allclose(with_bone_lengths(chains.rest, places), places, atol=1e-12)


def test_frames_and_steps_are_the_same_times() -> None:
    head = shaken(31)
    steps = resampled_to_steps(head, 30.0)
    assert len(steps) == 61
    np.testing.assert_allclose(steps[::2], head, atol=1e-9)
    np.testing.assert_allclose(resampled_to_frames(steps, 31, 30.0), head, atol=1e-9)


def test_known_spring_values_are_recovered() -> None:
    """The motion is the same. The values themselves are not compared, since others give the same
    motion."""
    chains, head = made_chains(count=2, joints=3), shaken()
    shape = chains.lengths.shape
    known = SpringValues(
        np.full(shape, 0.3), np.full(shape, 0.1), np.full(shape, 0.05), np.zeros(shape)
    )
    targets = simulate_springs(chains, known, head)
    fit = result_of(spring_fit(chains, targets, head, STEP_RATE, known.hit_radius))
    moved = np.linalg.norm(targets - targets[0], axis=-1).max()
    assert moved > 0.02
    assert fit.error.max() < 0.03 * moved


def moving_cards(swing: float) -> CardTracks:
    """Cards side by side that swing together by this angle."""
    places = np.linspace(0.0, 0.2, 12)
    guides = np.zeros((12, 9, 3))
    guides[..., 0] = places[:, None]
    guides[..., 2] = -np.linspace(0.0, 0.15, 9)
    out = np.tile(np.float32([0.0, -1.0, 0.0]), (12, 1))
    mesh = build_cards(guides.astype(np.float32), out, CardSettings())
    head = shaken(31)
    angle = swing * np.sin(np.arange(31) * 0.4)
    moved = np.repeat(mesh.positions[:, None], 31, axis=1)
    y, z = mesh.positions[:, 1, None], mesh.positions[:, 2, None]
    moved[..., 1] = np.cos(angle) * y - np.sin(angle) * z
    moved[..., 2] = np.sin(angle) * y + np.cos(angle) * z
    return CardTracks(
        (mesh,), (moved.astype(np.float32),), head, 0.15, guides[:, 0].mean(axis=0), 0, STEP_RATE
    )


@pytest.mark.parametrize(
    ("errors", "best"),
    [
        ({3: 6.0, 5: 5.9, 9: 6.1, 119: 1.6}, 119),  # a step without gain does not end the search
        ({3: 6.0, 9: 1.61, 119: 1.6}, 9),
        ({3: 1e-9, 9: 0.0}, 3),
        ({3: 2.0, 9: 1.0, 119: 3.0}, 9),
    ],
)
def test_the_fewest_joints_that_do_are_chosen(errors: dict[int, float], best: int) -> None:
    tried = [Candidate(joints, error, joints) for joints, error in errors.items()]
    assert fewest_joints(tried, 1e-6) == best


def test_hair_that_swings_as_one_needs_one_chain() -> None:
    rig = result_of(spring_steps(moving_cards(0.4), 120, NO_BALLS))
    assert rig.chains.rest.shape[0] == 1


def test_no_candidate_has_more_joints_than_the_maximum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The root joint that carries all chains counts as well."""

    def most(tried: list[Candidate[Any]], unseen: float) -> Any:
        return max(tried, key=lambda each: each.joints).skeleton

    monkeypatch.setattr(spring_chains, "fewest_joints", most)
    rest = result_of(spring_steps(moving_cards(0.4), 5, NO_BALLS)).chains.rest
    assert 1 + rest.shape[0] * rest.shape[1] == 5


def test_cards_at_rest_stay_where_they_are() -> None:
    rig = result_of(spring_steps(moving_cards(0.0), 120, NO_BALLS))
    assert rig.error.maximum < 1e-3


def test_chains_ignore_colliders_that_they_touch_at_rest() -> None:
    tracks = moving_cards(0.2)
    within = SpringColliders.spheres(
        np.array([[0.1, 0.0, -0.15], [0.1, -0.5, 0.0]]), np.array([0.08, 0.1])
    )
    rig = result_of(spring_steps(tracks, 30, within))
    tails = rig.chains.rest[:, 1:, :3, 3]
    distance = within.nearest(tails)[1]
    near = 1e-3 * rig.chains.lengths[..., None]
    assert (rig.chains.collides == (distance > -near).all(axis=1)).all()
    assert rig.chains.collides[:, 1].all() and not rig.chains.collides[:, 0].all()
