"""Joints that move cards: each part against an analytic motion or brute force."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.cards.joint_chains import card_chains
from hairloom.addon.cards.joint_keys import (
    chain_keys,
    interpolate_keys,
    quaternions,
    reduce_keys,
    rotation_matrices,
    slerp,
)
from hairloom.addon.cards.joint_solve import Skin, fit_rigid_motions, fit_weights, skinned
from hairloom.addon.cards.joints import (
    CardTracks,
    JointRig,
    joint_names,
    joint_steps,
    keyed_error,
)
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.steps import result_of

FRAMES = 30


def turn_about(axis: int, angle: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) about an axis by angles (...)."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((*np.shape(angle), 3, 3))
    turn[..., axis, axis] = 1.0
    turn[..., one, one] = turn[..., two, two] = np.cos(angle)
    turn[..., two, one], turn[..., one, two] = np.sin(angle), -np.sin(angle)
    return turn


def random_turns(count: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    turns = [turn_about(axis, random.uniform(-np.pi, np.pi, count)) for axis in range(3)]
    return turns[0] @ turns[1] @ turns[2]


def test_a_rigid_motion_is_found() -> None:
    random = np.random.default_rng(1)
    points, turn, way = random.normal(size=(9, 3)), random_turns(5), random.normal(size=(5, 3))
    targets = np.einsum("fab,nb->nfa", turn, points) + way
    still = np.tile(np.eye(3), (5, 1, 1))
    found = fit_rigid_motions(points, targets, random.uniform(0.1, 1.0, 9), still)
    np.testing.assert_allclose(found[0], turn, atol=2e-3)  # a weak pull towards the earlier turn
    again = fit_rigid_motions(points, targets, np.ones(9), found[0])
    np.testing.assert_allclose(again[0], turn, atol=1e-6)
    np.testing.assert_allclose(again[1], way, atol=1e-6)


def test_points_in_a_line_do_not_spin() -> None:
    """The turn about the line, which the points leave open, stays as before; no turn mirrors."""
    points = np.linspace(0.0, 1.0, 5)[:, None] * [1.0, 0.0, 0.0]
    before = turn_about(0, np.array([0.4]))
    turn, _ = fit_rigid_motions(points, points[:, None], np.ones(5), before)
    np.testing.assert_allclose(turn, before, atol=1e-3)
    np.testing.assert_allclose(np.linalg.det(turn), 1.0)


def joints_at_random(count: int, frames: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    turn = random_turns(count * frames, seed).reshape(count, frames, 3, 3)
    return turn, random.normal(size=(count, frames, 3))


def test_skinning_is_the_sum_of_its_joints() -> None:
    turn, way = joints_at_random(6, 4, 2)
    random = np.random.default_rng(3)
    points, joint = random.normal(size=(7, 3)), random.integers(0, 6, (7, 4))
    weight = random.dirichlet(np.ones(4), 7)
    found = skinned(points, Skin(joint, weight), turn, way)
    for n, f in itertools.product(range(7), range(4)):
        each = [turn[j, f] @ points[n] + way[j, f] for j in joint[n]]
        np.testing.assert_allclose(found[n, f], weight[n] @ each, atol=1e-12)


def test_weights_are_the_best_on_a_fine_grid() -> None:
    """Brute force: no mixture of weights on a fine grid has a smaller error."""
    turn, way = joints_at_random(4, 6, 4)
    random = np.random.default_rng(5)
    points, targets = random.normal(size=(20, 3)), random.normal(size=(20, 6, 3))
    joint = np.tile(np.arange(4), (20, 1))
    even = Skin(joint, np.full((20, 4), 0.25))
    found = fit_weights(points, targets, even, turn, way)
    np.testing.assert_allclose(found.weight.sum(axis=1), 1.0)
    assert found.weight.min() >= 0.0
    assert (found.weight == 0.0).any()

    def cost(weight: np.ndarray) -> np.ndarray:
        miss = skinned(points, Skin(joint, weight), turn, way) - targets
        return (miss * miss).sum(axis=(1, 2))

    steps = 16
    grid = [g for g in itertools.product(range(steps + 1), repeat=4) if sum(g) == steps]
    least = np.min([cost(np.tile(np.array(g) / steps, (20, 1))) for g in grid], axis=0)
    assert (cost(found.weight) <= least * 1.001).all()


def test_cards_that_move_alike_share_a_chain() -> None:
    """Three kinds of motion give three chains, wherever the cards lie."""
    random = np.random.default_rng(6)
    kind = random.integers(0, 3, 60)
    places = random.uniform(-0.1, 0.1, (60, 4, 3))
    sway = np.sin(np.linspace(0.0, 6.0, 12))[:, None] * np.eye(3)[kind][:, None, None]
    moved = places[:, :, None] + 0.1 * sway
    chains = card_chains(places, moved, 3)
    assert chains.count == 3
    assert len(set(zip(kind.tolist(), chains.first.tolist(), strict=True))) == 3
    assert (chains.second != chains.first).all()
    assert card_chains(places[:2], moved[:2], 64).count <= 2


def curtain(count: int = 24) -> CardMesh:
    """Straight cards of 10 cm that hang beside each other."""
    across = np.linspace(-0.1, 0.1, count)
    guides = np.zeros((count, 16, 3), np.float32)
    guides[:, :, 0] = across[:, None]
    guides[:, :, 2] = -np.linspace(0.0, 0.1, 16)
    normals = np.tile([0.0, -1.0, 0.0], (count, 1))
    return build_cards(guides, normals.astype(np.float32), CardSettings())


def tracks_of(mesh: CardMesh, moved: np.ndarray) -> CardTracks:
    carrier = np.tile(np.eye(4), (moved.shape[1], 1, 1))
    moved = moved.astype(np.float32)
    return CardTracks((mesh,), (moved,), carrier, 0.1, np.zeros(3), 0, 30.0)


def bent(mesh: CardMesh, curl: float) -> np.ndarray:
    """Each card bent to an arc whose angle oscillates, (vertex_count, FRAMES, 3)."""
    length = -mesh.positions[:, 2, None].astype(np.float64)
    angle = curl * np.sin(np.linspace(0.0, 2.0 * np.pi, FRAMES)) / 0.1 * length
    radius = length / np.where(np.abs(angle) > 1e-6, angle, 1.0)
    is_bent = np.abs(angle) > 1e-6
    moved = np.repeat(mesh.positions[:, None].astype(np.float64), FRAMES, axis=1)
    moved[..., 1] += np.where(is_bent, radius * (1.0 - np.cos(angle)), 0.0)
    moved[..., 2] = -np.where(is_bent, radius * np.sin(angle), length)
    return moved


def fitted(tracks: CardTracks, **choices: Any) -> JointRig:
    return result_of(joint_steps(tracks, CardExportSettings(**choices)))


def test_rigid_cards_are_exact_with_the_fewest_joints() -> None:
    mesh = curtain()
    turn = turn_about(0, 0.5 * np.sin(np.linspace(0.0, 6.0, FRAMES)))
    tracks = tracks_of(mesh, np.einsum("fab,nb->nfa", turn, mesh.positions))
    rig = fitted(tracks, chains=3)
    assert rig.joints == 2
    assert keyed_error(tracks, rig, rig.turn, rig.place).maximum < 1e-5


def test_stronger_bends_get_more_joints_and_stay_under_the_error() -> None:
    counts = []
    for curl in (0.1, 1.5, 3.0):
        mesh = curtain()
        tracks = tracks_of(mesh, bent(mesh, curl))
        rig = fitted(tracks, chains=2, joint_error=0.3)
        counts.append(rig.joints)
        assert keyed_error(tracks, rig, rig.turn, rig.place).root_mean_square < 0.003 * 0.1
    assert counts == sorted(counts)
    assert counts[0] == 2 < counts[-1] <= 16


def test_the_error_agrees_with_skinning_by_hand() -> None:
    """From the rest matrices and the joints, as an engine does it."""
    mesh = curtain(6)
    tracks = tracks_of(mesh, bent(mesh, 2.0))
    rig = fitted(tracks, chains=2, joints=3, joint_error=0.01)
    assert (rig.chains, rig.joints) == (2, 3)
    joints = np.zeros((rig.chains * rig.joints, FRAMES, 4, 4))
    joints[..., :3, :3] = rig.turn.reshape(-1, FRAMES, 3, 3)
    joints[..., :3, 3] = rig.place.reshape(-1, FRAMES, 3)
    joints[..., 3, 3] = 1.0
    moves = joints @ np.linalg.inv(rig.rest.reshape(-1, 4, 4))[:, None]
    (skin,) = rig.skins
    np.testing.assert_allclose(skin.weight.sum(axis=1), 1.0)
    points = np.concatenate([mesh.positions, np.ones((len(mesh.positions), 1))], axis=1)
    misses = []
    for number, point in enumerate(points):
        mixed = np.einsum("k,kfab->fab", skin.weight[number], moves[skin.joint[number]])
        misses.append((mixed @ point)[:, :3] - tracks.moved_positions[0][number])
    error = keyed_error(tracks, rig, rig.turn, rig.place)
    distance = np.linalg.norm(misses, axis=-1)
    assert error.root_mean_square == pytest.approx(np.sqrt((distance**2).mean()), rel=1e-4)
    assert error.maximum == pytest.approx(distance.max(), rel=1e-4)


def test_joints_lie_along_their_chain_at_rest() -> None:
    mesh = curtain()
    rig = fitted(tracks_of(mesh, bent(mesh, 2.0)), chains=4, joints=4, joint_error=0.01)
    height = rig.rest[..., 2, 3]
    np.testing.assert_allclose(height[:, 0], 0.0, atol=1e-6)
    assert (np.diff(height, axis=1) < -0.02).all()
    assert height.min() > -0.1
    np.testing.assert_allclose(
        rig.rest[..., :3, 1], np.tile([0.0, 0.0, -1.0], (4, 4, 1)), atol=0.02
    )
    assert joint_names(rig.chains, rig.joints)[:5] == [
        "chain_00_joint_00",
        "chain_00_joint_01",
        "chain_00_joint_02",
        "chain_00_joint_03",
        "chain_01_joint_00",
    ]


def test_quaternions_and_matrices_agree() -> None:
    turns = np.concatenate([random_turns(200), turn_about(1, np.array([np.pi, 0.0, -np.pi]))])
    quaternion = quaternions(turns)
    np.testing.assert_allclose(np.linalg.norm(quaternion, axis=-1), 1.0)
    np.testing.assert_allclose(rotation_matrices(quaternion), turns, atol=1e-12)
    about_z = quaternions(turn_about(2, np.array(0.6)))
    np.testing.assert_allclose(about_z * np.sign(about_z[3]), [0, 0, np.sin(0.3), np.cos(0.3)])


def test_slerp_turns_evenly_along_the_shorter_arc() -> None:
    share = np.linspace(0.0, 1.0, 7)
    ends = quaternions(turn_about(2, np.array([0.2, 1.4])))
    for sign in (1.0, -1.0):
        between = slerp(ends[:1], sign * ends[1:], share[:, None])
        np.testing.assert_allclose(
            rotation_matrices(between), turn_about(2, 0.2 + 1.2 * share), atol=1e-9
        )


def test_an_even_motion_needs_two_keys_and_a_still_one_needs_one() -> None:
    frames = np.arange(FRAMES)
    turn = np.stack([turn_about(2, 0.05 * frames), turn_about(2, 0.05 * frames)])
    place = np.stack([0.01 * frames[:, None] * [1.0, 0.0, 0.0]] * 2)
    keys = reduce_keys(turn, place, np.ones(2), 1e-6)
    assert keys.frames.tolist() == [0, FRAMES - 1]
    still = reduce_keys(
        np.tile(np.eye(3), (2, FRAMES, 1, 1)), np.zeros((2, FRAMES, 3)), np.ones(2), 0
    )
    assert still.frames.tolist() == [0]
    for each, (turned, placed) in (
        (keys, (turn, place)),
        (still, (turn * 0 + np.eye(3), place * 0)),
    ):
        found = interpolate_keys(each, FRAMES)
        np.testing.assert_allclose(found[0], turned, atol=1e-9)
        np.testing.assert_allclose(found[1], placed, atol=1e-9)


@pytest.mark.parametrize("near", [3e-3, 1e-3, 0.0])
def test_reduced_keys_stay_within_the_tolerance(near: float) -> None:
    """Between the remaining keys the error stays below `near`, along a whole chain of joints."""
    time = np.linspace(0.0, 6.0, 60)
    turn = np.stack([turn_about(0, np.sin(time + 0.3 * joint)) for joint in range(4)])
    place = 0.02 * np.cumsum(turn[..., 1], axis=0)
    reach = np.full(4, 0.03)
    keys = reduce_keys(turn, place, reach, near)
    turned, placed = interpolate_keys(keys, 60)
    tip = np.array([0.0, 0.03, 0.0])
    miss = np.linalg.norm(turned @ tip + placed - turn @ tip - place, axis=-1)
    assert miss.max() <= near + 1e-12
    assert (len(keys.frames) == 60) == (near == 0.0)
    steps = (keys.rotation[:, 1:] * keys.rotation[:, :-1]).sum(axis=-1)
    assert steps.min() > 0.0  # engines that ignore the signs of quaternions do not spin


def test_all_chains_have_keys() -> None:
    mesh = curtain()
    tracks = tracks_of(mesh, bent(mesh, 2.0))
    rig = fitted(tracks, chains=3, joints=4)
    keys = result_of(chain_keys(rig, 1e-4))
    assert len(keys) == rig.chains
    turn, place = zip(*(interpolate_keys(each, FRAMES) for each in keys), strict=True)
    kept = keyed_error(tracks, rig, np.stack(turn), np.stack(place))
    whole = keyed_error(tracks, rig, rig.turn, rig.place)
    assert abs(kept.root_mean_square - whole.root_mean_square) < 1e-4
