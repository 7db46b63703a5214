"""Where joints are at rest, and how far what hangs on them reaches."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .joint_chains import Chains
from .joint_solve import Skin


def rest_joints(lines: Floats, chains: Chains, joints: int) -> Floats:
    """Along the middle of a chain's cards, with y towards the tip, (chains, joints, 4, 4).

    Args:
        lines: (n, row_count, 3) places along each card, root to tip [m].
    """
    count = chains.count
    members = np.bincount(chains.own, minlength=count)[:, None, None]
    middle = np.zeros((count, *lines.shape[1:]))
    np.add.at(middle, chains.own, lines)
    middle /= members
    at = np.linspace(0.0, middle.shape[1] - 1.0, joints)
    before = np.minimum(at.astype(int), middle.shape[1] - 2)
    share = (at - before)[:, None]
    rest = np.tile(np.eye(4), (count, joints, 1, 1))
    rest[..., :3, 3] = middle[:, before] * (1.0 - share) + middle[:, before + 1] * share
    rest[..., :3, :3] = _turned_to(np.gradient(rest[..., :3, 3], axis=1))
    return rest


def _turned_to(way: Floats) -> Floats:
    """The least turns (..., 3, 3) that take y to these ways; Rodrigues' formula."""
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    y = np.array([0.0, 1.0, 0.0])
    unit = np.where(length > 1.0e-9, way / np.maximum(length, 1.0e-9), y)
    axis, cosine = np.cross(y, unit), unit[..., 1]
    cross = np.zeros((*way.shape, 3))
    cross[..., 0, 1], cross[..., 1, 0] = -axis[..., 2], axis[..., 2]
    cross[..., 0, 2], cross[..., 2, 0] = axis[..., 1], -axis[..., 1]
    cross[..., 1, 2], cross[..., 2, 1] = -axis[..., 0], axis[..., 0]
    share = 1.0 / np.maximum(1.0 + cosine, 1.0e-6)
    turns = np.eye(3) + cross + cross @ cross * share[..., None, None]
    turns[cosine < -1.0 + 1.0e-6] = np.diag([1.0, -1.0, -1.0])
    return turns


def reach_of(points: Floats, skin: Skin, rest: Floats) -> Floats:
    """Root mean square distance of what hangs on each joint from it, (chains, joints) [m]."""
    places = rest.reshape(-1, 4, 4)[:, :3, 3]
    square = np.square(points[:, None] - places[skin.joint]).sum(axis=-1)
    whole = np.bincount(skin.joint.ravel(), skin.weight.ravel(), len(places))
    sums = np.bincount(skin.joint.ravel(), (skin.weight * square).ravel(), len(places))
    reach = np.sqrt(sums / np.maximum(whole, 1.0e-9))
    return reach.reshape(rest.shape[:2])
