"""A skeleton that springs move: few chains, whose first joints move with the head.

Cards that move alike share a chain, as with baked joints (`joint_chains`), but bones only rotate: a
vertex is weighted to two neighbouring bones of its own chain, one of another chain, and the head.
There are as many joints as improve the result.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from .card_mesh import CardMesh
from .follow import card_lines
from .joint_chains import Chains, card_chains, chain_lines, rotations_from_y
from .joint_solve import INFLUENCES, Skin, fit_weights, skinned
from .joints import VERTEX_BATCH, CardTracks, FitError, joint_transforms
from .sort import card_of_vertex
from .spring_bones import (
    SpringChains,
    SpringColliders,
    SpringValues,
    resampled_to_frames,
    resampled_to_steps,
    rotations_towards,
    simulate_springs,
    with_bone_lengths,
)
from .spring_fit import spring_fit

#: Numbers of joints in a chain and of chains that are tried, ascending.
_JOINT_COUNTS = (2, 3, 4, 5, 7)
_CHAIN_COUNTS = (1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128)
#: Fraction by which an error may exceed the smallest one to save joints; and the difference of
#: errors that is not visible, as a fraction of the hair's length.
_TOLERANCE, _INVISIBLE_ERROR = 0.03, 1.0e-4
#: Vertices that skins are learnt from.
_MAX_SAMPLE_VERTICES = 4000
#: Maximum hit radius of a bone, as a fraction of its length.
_HIT_FRACTION = 0.1
#: Depth in a ball up to which a bone's tail may lie at rest and still collide with it, as a
#: fraction of the bone's length.
_MAX_REST_DEPTH = 1.0e-3


@dataclass(frozen=True, eq=False)
class SpringRig:
    """Chains, their spring parameters and their skins, in the space of `CardTracks`.

    skins: of each level; a joint's number is chain * joints + number in the chain, and the root,
        which moves with the head, comes after them.
    joint_error: root mean square distance of each chain's joints from the simulation [m].
    error: of all vertices moved by springs, against the simulation.
    """

    chains: SpringChains
    values: SpringValues
    skins: tuple[Skin, ...]
    joint_error: Floats
    error: FitError


@dataclass(frozen=True, eq=False)
class _Skeleton:
    """Chains of cards and their joints. places: (frame_count, chains, joints, 3) as simulated."""

    chains: Chains
    rest: Floats
    places: Floats
    joints: int


@dataclass(frozen=True)
class Candidate[Skeleton]:
    """A choice, its number of joints, and its error against the simulation [m]."""

    joints: int
    error: float
    skeleton: Skeleton


def spring_steps(
    tracks: CardTracks, max_joints: int, colliders: SpringColliders
) -> Generator[float, None, SpringRig]:
    """The fewest joints that move the cards nearly as well as `max_joints` would.

    Args:
        max_joints: maximum number of joints, including the root that carries all chains.
        colliders: which chains keep out of.

    Yields the fraction that is done.
    """
    samples = _Samples.of(tracks)
    yield 0.1
    candidates: list[Candidate[_Skeleton]] = []
    for number, joints in enumerate(each for each in _JOINT_COUNTS if each < max_joints):
        counts = {min(count, (max_joints - 1) // joints) for count in _CHAIN_COUNTS}
        for count in sorted(counts):
            skeleton = samples.skeleton(count, joints)
            candidates.append(Candidate(count * joints, samples.error(skeleton), skeleton))
            yield 0.1 + 0.3 * (number + count / max(counts)) / len(_JOINT_COUNTS)
    best = fewest_joints(candidates, _INVISIBLE_ERROR * tracks.hair_length)
    chains, hit_radius = _with_colliders(best.rest, colliders)
    fit = spring_fit(chains, best.places, tracks.carrier, tracks.frame_rate, hit_radius)
    found = yield from _part_of_progress(fit, 0.4, 0.9)
    steps = resampled_to_steps(tracks.carrier, tracks.frame_rate)
    moved = resampled_to_frames(
        simulate_springs(chains, found.values, steps), tracks.frame_count, tracks.frame_rate
    )
    skins = tuple(samples.skin(mesh, now, best, moved) for mesh, now in samples.levels)
    miss = spring_error(tracks, chains.rest, moved, skins)
    yield 1.0
    return SpringRig(chains, found.values, skins, found.error, miss)


def fewest_joints[Skeleton](
    candidates: Sequence[Candidate[Skeleton]], tolerance: float
) -> Skeleton:
    """Of all choices the one with the fewest joints whose error is nearly the smallest, even if
    more joints did not help at some steps in between.

    Args:
        tolerance: errors that differ by less count as equal [m].
    """
    smallest = min(each.error for each in candidates)
    enough = [
        each for each in candidates if each.error <= smallest * (1.0 + _TOLERANCE) + tolerance
    ]
    return min(enough, key=lambda each: (each.joints, each.error)).skeleton


def spring_error(
    tracks: CardTracks, rest: Floats, places: Floats, skins: tuple[Skin, ...]
) -> FitError:
    """The error of the cards against the simulation with joints in these places.

    Args:
        places: (frame_count, chains, joints, 3) [m].
    """
    return FitError.of_motion(tracks, skins, _joint_transforms(rest, places))


def _joint_transforms(rest: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Transforms of all joints, and of the root, which stays."""
    turns = rotations_towards(rest, places).transpose(1, 2, 0, 3, 4)
    turn, shift = joint_transforms(rest, turns, places.transpose(1, 2, 0, 3))
    still: Floats = np.tile(np.eye(3), (1, len(places), 1, 1))
    return np.concatenate([turn, still]), np.concatenate([shift, np.zeros_like(shift[:1])])


@dataclass(frozen=True, eq=False)
class _Samples:
    """The lines of cards in all frames, and some vertices of the finest level in some frames."""

    tracks: CardTracks
    lines: Floats
    moved_lines: Floats
    vertices: Ints
    frames: Ints

    @classmethod
    def of(cls, tracks: CardTracks) -> _Samples:
        mesh, moved = tracks.levels[0], tracks.moved_positions[0]
        _, lines = card_lines(mesh)
        every = [
            card_lines(replace(mesh, positions=moved[:, frame]))[1]
            for frame in range(tracks.frame_count)
        ]
        frames, vertices = tracks.sample_frames(), tracks.sample_vertices(_MAX_SAMPLE_VERTICES)
        moved_lines = np.stack(every, axis=2).astype(np.float64)
        return cls(tracks, lines.astype(np.float64), moved_lines, vertices, frames)

    @property
    def levels(self) -> list[tuple[CardMesh, Floats]]:
        return list(zip(self.tracks.levels, self.tracks.moved_positions, strict=True))

    def skeleton(self, count: int, joints: int) -> _Skeleton:
        chains = card_chains(self.lines, self.moved_lines[:, :, self.frames], count)
        places = chain_lines(self.lines, chains, joints)
        rest = np.tile(np.eye(4), (*places.shape[:2], 1, 1))
        rest[..., :3, 3] = places
        directions = np.diff(places, axis=1)
        rest[..., :3, :3] = rotations_from_y(
            np.concatenate([directions, directions[:, -1:]], axis=1)
        )
        moved = chain_lines(self.moved_lines, chains, joints).transpose(2, 0, 1, 3)
        return _Skeleton(chains, rest, moved, joints)

    def error(self, skeleton: _Skeleton) -> float:
        """Root mean square error of the learnt vertices with joints at their simulated places
        [m]."""
        mesh, moved = self.levels[0]
        points = mesh.positions[self.vertices].astype(np.float64)
        targets = moved[self.vertices][:, self.frames].astype(np.float64)
        moves = _joint_transforms(
            skeleton.rest, with_bone_lengths(skeleton.rest, skeleton.places[self.frames])
        )
        skin = fit_weights(
            points, targets, self._initial_skin(mesh, self.vertices, skeleton), *moves
        )
        miss = skinned(points, skin, *moves) - targets
        return float(np.sqrt((miss * miss).sum(axis=-1).mean()))

    def skin(self, mesh: CardMesh, moved: Floats, skeleton: _Skeleton, places: Floats) -> Skin:
        """The weights of all vertices of a level with joints in these places, heaviest first."""
        moves = _joint_transforms(skeleton.rest, places[self.frames])
        parts = []
        for begin in range(0, len(moved), VERTEX_BATCH):
            part = np.arange(begin, min(begin + VERTEX_BATCH, len(moved)))
            points = mesh.positions[part].astype(np.float64)
            targets = moved[part][:, self.frames].astype(np.float64)
            parts.append(
                fit_weights(points, targets, self._initial_skin(mesh, part, skeleton), *moves)
            )
        return Skin.joined(parts)

    def _initial_skin(self, mesh: CardMesh, vertices: Ints, skeleton: _Skeleton) -> Skin:
        """Each vertex weighted to its bone and a little to the nearer neighbour."""
        used = np.unique(self.tracks.levels[0].card)
        card = np.searchsorted(used, card_of_vertex(mesh)[vertices])
        bones = skeleton.joints - 1
        at = np.clip(mesh.along[vertices].astype(np.float64), 0.0, 1.0) * bones
        bone = np.minimum(at.astype(np.int64), bones - 1)
        fraction = at - bone
        beside = np.where(fraction < 0.5, bone - 1, bone + 1)
        is_end = (beside < 0) | (beside >= bones)
        beside = np.clip(np.where(is_end, 2 * bone - beside, beside), 0, bones - 1)
        own, other = skeleton.chains.first[card], skeleton.chains.second[card]
        weight = np.zeros((len(card), INFLUENCES))
        weight[:, 1] = np.where(is_end, 0.0, np.abs(fraction - 0.5))
        weight[:, 0] = 1.0 - weight[:, 1]
        root = np.full(len(card), skeleton.chains.count * skeleton.joints)
        own, other = own * skeleton.joints, other * skeleton.joints
        return Skin(np.stack([own + bone, own + beside, other + bone, root], axis=1), weight)


def _with_colliders(rest: Floats, colliders: SpringColliders) -> tuple[SpringChains, Floats]:
    """The chains with the balls that each keeps out of, those that it is outside of at rest, and
    the hit radius of each bone, (chains, bones) [m]: at most its distance at rest.
    """
    tails = rest[:, 1:, :3, 3]
    lengths = np.linalg.norm(np.diff(rest[..., :3, 3], axis=1), axis=-1)
    distance = colliders.nearest(tails)[1] + _MAX_REST_DEPTH * lengths[..., None]
    collides = (
        (distance > 0.0).all(axis=1) if len(colliders.radius) else np.zeros((len(rest), 0), bool)
    )
    free = np.where(collides[:, None], distance, np.inf).min(axis=2, initial=np.inf)
    radius = np.clip(
        np.minimum(free - 2.0 * _MAX_REST_DEPTH * lengths, _HIT_FRACTION * lengths), 0.0, None
    )
    return SpringChains(rest, colliders, collides), radius


def _part_of_progress[Result](
    steps: Generator[float, None, Result], begin: float, end: float
) -> Generator[float, None, Result]:
    try:
        while True:
            yield begin + (end - begin) * next(steps)
    except StopIteration as stop:
        result: Result = stop.value
        return result
