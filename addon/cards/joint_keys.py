"""Keys of joints: rotations as quaternions and translations relative to parents, without
superfluous keys.

A chain's joints share their keys. Between two keys engines interpolate rotations by slerp
(Shoemake 1985) and translations linearly; a key is left out where that comes near enough.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from .joints import JointRig

#: Quaternions nearer to each other than this (their dot product) are interpolated linearly.
_MAX_SLERP_COSINE = 1.0 - 1.0e-9


@dataclass(frozen=True, eq=False)
class ChainKeys:
    """Keys of a chain.

    frames: (key_count,) counted from 0.
    rotation: (joints, key_count, 4) unit quaternions x, y, z, w; translation: (joints, key_count,
        3) [m]; each joint in the space of the one before, the first in that of the rig.
    """

    frames: Ints
    rotation: Floats
    translation: Floats


def chain_keys(rig: JointRig, tolerance: float) -> Generator[float, None, tuple[ChainKeys, ...]]:
    """The keys of all chains; yields the fraction of them that is done.

    Args:
        tolerance: maximum distance of a joint, and of what it moves, from its path between two keys
            [m].
    """
    keys = []
    for chain in range(rig.chains):
        keys.append(reduce_keys(rig.turn[chain], rig.place[chain], rig.reach[chain], tolerance))
        yield (chain + 1) / rig.chains
    return tuple(keys)


def reduce_keys(turn: Floats, place: Floats, reach: Floats, tolerance: float) -> ChainKeys:
    """The keys of one chain.

    Args:
        turn, place: (joints, frame_count, 3, 3) and (joints, frame_count, 3) [m].
        reach: (joints,) [m]: distance from a joint at which its rotation matters.
    """
    frame_count = turn.shape[1]
    rotation, translation = _relative_to_parents(turn, place)
    key_frames = np.unique([0, frame_count - 1])
    while len(key_frames) < frame_count:
        keys = ChainKeys(key_frames, rotation[:, key_frames], translation[:, key_frames])
        turned, placed = interpolate_keys(keys, frame_count)
        miss = np.linalg.norm(placed - place, axis=-1)
        angle = np.linalg.norm(turned - turn, axis=(-2, -1)) / np.sqrt(2.0)
        errors = (miss + angle * reach[:, None]).max(axis=0)
        if errors.max() <= tolerance:
            break
        # the worst frame of each stretch between two keys
        stretch = np.searchsorted(key_frames, np.arange(frame_count), side="right")
        order = np.lexsort((-errors, stretch))
        first = np.unique(stretch[order], return_index=True)[1]
        worst_frames = order[first]
        key_frames = np.union1d(key_frames, worst_frames[errors[worst_frames] > tolerance])
    return _without_still_keys(
        ChainKeys(key_frames, rotation[:, key_frames], translation[:, key_frames])
    )


def interpolate_keys(keys: ChainKeys, frame_count: int) -> tuple[Floats, Floats]:
    """Where the keys put the joints in every frame: turns (joints, frame_count, 3, 3) and places
    (joints, frame_count, 3), as `reduce_keys` takes them.
    """
    frames = np.clip(np.arange(frame_count), keys.frames[0], keys.frames[-1])
    after = np.searchsorted(keys.frames, frames).clip(1 if len(keys.frames) > 1 else 0)
    before = np.maximum(after - 1, 0)
    length = np.maximum(keys.frames[after] - keys.frames[before], 1)
    fraction = ((frames - keys.frames[before]) / length)[:, None]
    one, other = keys.translation[:, before], keys.translation[:, after]
    place = one + (other - one) * fraction
    turn = rotation_matrices(slerp(keys.rotation[:, before], keys.rotation[:, after], fraction))
    for joint in range(1, len(turn)):
        place[joint] = np.einsum("fab,fb->fa", turn[joint - 1], place[joint]) + place[joint - 1]
        turn[joint] = turn[joint - 1] @ turn[joint]
    return turn, place


def quaternions(turn: Floats) -> Floats:
    """Rotations (..., 3, 3) as unit quaternions x, y, z, w (..., 4), by the largest of the four
    components (Shepperd 1978).
    """
    trace = np.trace(turn, axis1=-2, axis2=-1)
    diagonal = np.diagonal(turn, axis1=-2, axis2=-1)
    # four times the outer product of the quaternion with itself
    outer = np.empty((*turn.shape[:-2], 4, 4))
    for axis in range(3):
        outer[..., axis, axis] = 1.0 - trace + 2.0 * diagonal[..., axis]
        one, two = (axis + 1) % 3, (axis + 2) % 3
        outer[..., one, two] = outer[..., two, one] = turn[..., one, two] + turn[..., two, one]
        outer[..., axis, 3] = outer[..., 3, axis] = turn[..., two, one] - turn[..., one, two]
    outer[..., 3, 3] = 1.0 + trace
    largest = np.diagonal(outer, axis1=-2, axis2=-1).argmax(axis=-1)
    row = np.take_along_axis(outer, largest[..., None, None], axis=-2)[..., 0, :]
    unit: Floats = row / np.linalg.norm(row, axis=-1, keepdims=True)
    return unit


def rotation_matrices(quaternion: Floats) -> Floats:
    """Unit quaternions x, y, z, w (..., 4) as turns (..., 3, 3)."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def slerp(one: Floats, other: Floats, fraction: Floats) -> Floats:
    """Spherical interpolation from one unit quaternion to another, the shorter way round,
    (..., 4)."""
    cosine = (one * other).sum(axis=-1, keepdims=True)
    other = np.where(cosine < 0.0, -other, other)
    cosine = np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(np.minimum(cosine, _MAX_SLERP_COSINE))
    is_near = cosine > _MAX_SLERP_COSINE
    sine = np.sin(angle)
    first = np.where(is_near, 1.0 - fraction, np.sin((1.0 - fraction) * angle) / sine)
    second = np.where(is_near, fraction, np.sin(fraction * angle) / sine)
    mixed = one * first + other * second
    unit: Floats = mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
    return unit


def relative_to_parent(parent: Floats, own: Floats) -> Floats:
    """Rigid matrices (..., 4, 4) relative to those of parents."""
    result: Floats = np.linalg.inv(parent) @ own
    return result


def _relative_to_parents(turn: Floats, place: Floats) -> tuple[Floats, Floats]:
    """Quaternions that go the shorter way from frame to frame, and translations, in parents'
    spaces."""
    turned, moved = turn.copy(), place.copy()
    back = turn[:-1].swapaxes(-1, -2)
    turned[1:] = back @ turn[1:]
    moved[1:] = np.einsum("jfab,jfb->jfa", back, place[1:] - place[:-1])
    rotation = quaternions(turned)
    flips = np.sign((rotation[:, 1:] * rotation[:, :-1]).sum(axis=-1))
    flips[flips == 0.0] = 1.0
    rotation[:, 1:] *= np.cumprod(flips, axis=1)[..., None]
    return rotation, moved


def _without_still_keys(keys: ChainKeys) -> ChainKeys:
    """A single key for joints that do not move."""
    if len(keys.frames) == 2 and all(
        np.array_equal(each[:, 0], each[:, 1]) for each in (keys.rotation, keys.translation)
    ):
        return ChainKeys(keys.frames[:1], keys.rotation[:, :1], keys.translation[:, :1])
    return keys
