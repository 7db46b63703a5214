"""Rigid joints and their weights from moving points: the two halves of skinning decomposition.

Le and Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012: with fixed weights, each
joint's best rigid motion has a closed form; with fixed motion, each point's best weights are found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from ..arrays import Floats, Ints

#: Number of joints that move one vertex, as usual in engines.
INFLUENCES = 4
#: Weight of the previous rotation in a fit, as a fraction of that of the points: points in a line
#: do not determine the rotation about it.
_ROTATION_PRIOR = 1.0e-4
#: The same for weights.
_WEIGHT_PRIOR = 1.0e-4
#: Lengths [m] and weights below this count as 0.
_MIN_SIZE = 1.0e-9


@dataclass(frozen=True, eq=False)
class Skin:
    """joint, weight: (n, INFLUENCES) of each point; weights are not negative and add up to 1."""

    joint: Ints
    weight: Floats

    @classmethod
    def joined(cls, parts: Sequence[Skin]) -> Skin:
        """All parts, one after the other, with the heaviest joint of each point first."""
        joint = np.concatenate([each.joint for each in parts])
        weight = np.concatenate([each.weight for each in parts])
        order = np.argsort(-weight, axis=1, kind="stable")
        return cls(np.take_along_axis(joint, order, 1), np.take_along_axis(weight, order, 1))


def fit_rigid_motions(
    points: Floats, targets: Floats, weight: Floats, before: Floats
) -> tuple[Floats, Floats]:
    """The rigid motion that brings weighted points nearest to targets, in each frame.

    Kabsch 1976. Where points do not determine the rotation, the previous one is kept.

    Args:
        points: (n, 3). targets: (n, frame_count, 3). weight: (n,).
        before: (frame_count, 3, 3) previous rotations.

    Returns:
        Turns (frame_count, 3, 3) and shifts (frame_count, 3): target = turn point + shift.
    """
    total = max(float(weight.sum()), _MIN_SIZE)
    center, goal = weight @ points / total, np.tensordot(weight, targets, 1) / total
    arms = points - center
    spread = np.tensordot(arms * weight[:, None], targets, (0, 0)).transpose(1, 2, 0)
    size = float((weight * (arms * arms).sum(axis=1)).sum())
    left, _, right = np.linalg.svd(spread + (size * _ROTATION_PRIOR + _MIN_SIZE**2) * before)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    turn = left @ right
    return turn, goal - turn @ center


def moved_rigidly(points: Floats, turn: Floats, shift: Floats) -> Floats:
    """Points (n, 3) in each frame of a rigid motion, (n, frame_count, 3)."""
    flat = points @ turn.reshape(-1, 3).T + shift.reshape(-1)
    return flat.reshape(len(points), -1, 3)


def skinned(points: Floats, skin: Skin, turn: Floats, shift: Floats) -> Floats:
    """Points (n, 3) moved by their joints, (n, frame_count, 3): linear blend skinning.

    Args:
        turn, shift: (joint_count, frame_count, 3, 3) and (joint_count, frame_count, 3).
    """
    result = np.zeros((len(points), *shift.shape[1:]), shift.dtype)
    for joint in range(len(turn)):
        for column in range(INFLUENCES):
            own = np.flatnonzero((skin.joint[:, column] == joint) & (skin.weight[:, column] > 0.0))
            if len(own):
                fraction = skin.weight[own, column, None, None]
                result[own] += fraction * moved_rigidly(points[own], turn[joint], shift[joint])
    return result


def initial_joint_motions(
    points: Floats, targets: Floats, skin: Skin, count: int
) -> tuple[Floats, Floats]:
    """`turn` and `shift` of each joint, as if it alone moved all points that it has a weight in."""
    still = np.tile(np.eye(3), (targets.shape[1], 1, 1))
    turn, shift = np.tile(still, (count, 1, 1, 1)), np.zeros((count, *targets.shape[1:]))
    for joint in range(count):
        fraction = np.where(skin.joint == joint, skin.weight, 0.0).sum(axis=1)
        own = np.flatnonzero(fraction > 0.0)
        if len(own):
            turn[joint], shift[joint] = fit_rigid_motions(
                points[own], targets[own], fraction[own], still
            )
    return turn, shift


def refine_joint_motions(
    points: Floats, targets: Floats, skin: Skin, turn: Floats, shift: Floats, rounds: int
) -> None:
    """Improve `turn` and `shift` in place, joint by joint, against the residual of the others
    (eq. 8).

    Args:
        targets: (n, frame_count, 3).
        turn, shift: as of `skinned`.
    """
    residual = targets - skinned(points, skin, turn, shift)
    count = len(turn)
    members = [np.flatnonzero((skin.joint == joint).any(axis=1)) for joint in range(count)]
    for _ in range(rounds):
        for joint, own in enumerate(members):
            fraction = np.where(skin.joint[own] == joint, skin.weight[own], 0.0).sum(axis=1)
            own, fraction = own[fraction > 0.0], fraction[fraction > 0.0]
            if not len(own):
                continue
            before = moved_rigidly(points[own], turn[joint], shift[joint])
            goal = before + residual[own] / np.maximum(fraction, 1.0e-3)[:, None, None]
            fit = fit_rigid_motions(points[own], goal, fraction * fraction, turn[joint])
            after = moved_rigidly(points[own], *fit)
            residual[own] += fraction[:, None, None] * (before - after)
            turn[joint], shift[joint] = fit


def fit_weights(
    points: Floats, targets: Floats, initial: Skin, turn: Floats, shift: Floats
) -> Skin:
    """The weights of the same joints that bring points nearest to targets (eq. 5).

    Every subset of the joints is tried, which finds the best weights that are not negative, not
    just a local optimum.

    Args:
        targets: (n, frame_count, 3).
        initial: the weights to keep where the motion does not determine them.
    """
    residuals = np.stack(
        [
            _moved_by_joints(points, initial.joint[:, column], turn, shift) - targets
            for column in range(INFLUENCES)
        ],
        axis=1,
    ).reshape(len(points), INFLUENCES, -1)
    gram = residuals @ residuals.transpose(
        0, 2, 1
    )  # of the residuals: weights of sum 1 blend these too
    scale = np.trace(gram, axis1=1, axis2=2) * _WEIGHT_PRIOR + _MIN_SIZE**2
    gram = gram + scale[:, None, None] * np.eye(INFLUENCES)
    pull = scale[:, None] * initial.weight
    best, weight = np.full(len(points), np.inf), initial.weight.astype(np.float64)
    for size in range(1, INFLUENCES + 1):
        for chosen in combinations(range(INFLUENCES), size):
            found = _weights_of_sum_one(gram[:, chosen][:, :, chosen], pull[:, chosen])
            trial = np.zeros((len(points), INFLUENCES))
            trial[:, chosen] = found
            cost = np.einsum("ni,nij,nj->n", trial, gram, trial) - 2.0 * (trial * pull).sum(axis=1)
            is_better = (found >= 0.0).all(axis=1) & (cost < best)
            best[is_better], weight[is_better] = cost[is_better], trial[is_better]
    return Skin(initial.joint, weight)


def _moved_by_joints(points: Floats, joint: Ints, turn: Floats, shift: Floats) -> Floats:
    """Each point moved by a joint of its own, (n, frame_count, 3)."""
    result = np.empty((len(points), *shift.shape[1:]))
    order = np.argsort(joint, kind="stable")
    ends = np.searchsorted(joint[order], np.arange(len(turn) + 1))
    for number, (begin, end) in enumerate(pairwise(ends)):
        own = order[begin:end]
        if len(own):
            result[own] = moved_rigidly(points[own], turn[number], shift[number])
    return result


def _weights_of_sum_one(gram: Floats, pull: Floats) -> Floats:
    """w that minimises w G w / 2 - p w under sum 1, (n, k), by a Lagrange multiplier."""
    count, size = pull.shape
    both = np.stack([np.ones((count, size)), pull], axis=2)
    ones, free = np.moveaxis(np.linalg.solve(gram, both), 2, 0)
    over = (free.sum(axis=1) - 1.0) / ones.sum(axis=1)
    return free - over[:, None] * ones
