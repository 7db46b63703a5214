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
from .joint_chains import Chains, card_chains, middle_lines, turned_to
from .joint_solve import INFLUENCES, Skin, best_weights, skinned
from .joints import VERTICES_AT_ONCE, CardTracks, FitError, joint_moves
from .sort import card_of_vertex
from .spring_bones import (
    Balls,
    SpringChains,
    SpringValues,
    at_frames,
    chained,
    sprung,
    stepped,
    turns_to,
)
from .spring_fit import spring_fit

#: Numbers of joints in a chain and of chains that are tried, ascending.
_JOINTS = (2, 3, 4, 5, 7)
_CHAINS = (1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128)
#: Fraction by which an error may exceed the smallest one to save joints; and the difference of
#: errors that is not visible, as a fraction of the hair's length.
_WORTH, _UNSEEN = 0.03, 1.0e-4
#: Vertices that skins are learnt from.
_LEARNT_VERTICES = 4000
#: Maximum hit radius of a bone, as a fraction of its length.
_HIT_FRACTION = 0.1
#: Depth in a ball up to which a bone's tail may lie at rest and still collide with it, as a
#: fraction of the bone's length.
_NEAR = 1.0e-3


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
class _Choice:
    """Chains of cards and their joints. places: (frame_count, chains, joints, 3) as simulated."""

    groups: Chains
    rest: Floats
    places: Floats
    joints: int


@dataclass(frozen=True)
class Tried[Choice]:
    """A choice, its number of joints, and its error against the simulation [m]."""

    joints: int
    error: float
    choice: Choice


def spring_steps(tracks: CardTracks, most: int, balls: Balls) -> Generator[float, None, SpringRig]:
    """The fewest joints that move the cards nearly as well as `most` would.

    Args:
        most: maximum number of joints, including the root that carries all chains.
        balls: which chains keep out of.

    Yields the fraction that is done.
    """
    learnt = _Learnt.of(tracks)
    yield 0.1
    tried: list[Tried[_Choice]] = []
    for number, joints in enumerate(each for each in _JOINTS if each < most):
        counts = {min(count, (most - 1) // joints) for count in _CHAINS}
        for count in sorted(counts):
            choice = learnt.choice(count, joints)
            tried.append(Tried(count * joints, learnt.error(choice), choice))
            yield 0.1 + 0.3 * (number + count / max(counts)) / len(_JOINTS)
    best = fewest_joints(tried, _UNSEEN * tracks.hair_length)
    chains, hit_radius = _colliding(best.rest, balls)
    fit = spring_fit(chains, best.places, tracks.carrier, tracks.frame_rate, hit_radius)
    found = yield from _part(fit, 0.4, 0.9)
    steps = stepped(tracks.carrier, tracks.frame_rate)
    moved = at_frames(sprung(chains, found.values, steps), tracks.frame_count, tracks.frame_rate)
    skins = tuple(learnt.skin(mesh, now, best, moved) for mesh, now in learnt.levels)
    miss = spring_error(tracks, chains.rest, moved, skins)
    yield 1.0
    return SpringRig(chains, found.values, skins, found.error, miss)


def fewest_joints[Choice](tried: Sequence[Tried[Choice]], unseen: float) -> Choice:
    """Of all choices the one with the fewest joints whose error is nearly the smallest, even if
    more joints did not help at some steps in between.

    Args:
        unseen: errors that differ by less count as equal [m].
    """
    least = min(each.error for each in tried)
    enough = [each for each in tried if each.error <= least * (1.0 + _WORTH) + unseen]
    return min(enough, key=lambda each: (each.joints, each.error)).choice


def spring_error(
    tracks: CardTracks, rest: Floats, places: Floats, skins: tuple[Skin, ...]
) -> FitError:
    """The error of the cards against the simulation with joints in these places.

    Args:
        places: (frame_count, chains, joints, 3) [m].
    """
    return FitError.played(tracks, skins, _moves(rest, places))


def _moves(rest: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Transforms of all joints, and of the root, which stays."""
    turns = turns_to(rest, places).transpose(1, 2, 0, 3, 4)
    turn, shift = joint_moves(rest, turns, places.transpose(1, 2, 0, 3))
    still: Floats = np.tile(np.eye(3), (1, len(places), 1, 1))
    return np.concatenate([turn, still]), np.concatenate([shift, np.zeros_like(shift[:1])])


@dataclass(frozen=True, eq=False)
class _Learnt:
    """The lines of cards in all frames, and some vertices of the finest level in some frames."""

    tracks: CardTracks
    lines: Floats
    moved_lines: Floats
    picked: Ints
    frames: Ints

    @classmethod
    def of(cls, tracks: CardTracks) -> _Learnt:
        mesh, moved = tracks.levels[0], tracks.moved[0]
        _, lines = card_lines(mesh)
        every = [
            card_lines(replace(mesh, positions=moved[:, frame]))[1]
            for frame in range(tracks.frame_count)
        ]
        frames, picked = tracks.some_frames(), tracks.some_vertices(_LEARNT_VERTICES)
        moved_lines = np.stack(every, axis=2).astype(np.float64)
        return cls(tracks, lines.astype(np.float64), moved_lines, picked, frames)

    @property
    def levels(self) -> list[tuple[CardMesh, Floats]]:
        return list(zip(self.tracks.levels, self.tracks.moved, strict=True))

    def choice(self, count: int, joints: int) -> _Choice:
        groups = card_chains(self.lines, self.moved_lines[:, :, self.frames], count)
        places = middle_lines(self.lines, groups, joints)
        rest = np.tile(np.eye(4), (*places.shape[:2], 1, 1))
        rest[..., :3, 3] = places
        directions = np.diff(places, axis=1)
        rest[..., :3, :3] = turned_to(np.concatenate([directions, directions[:, -1:]], axis=1))
        moved = middle_lines(self.moved_lines, groups, joints).transpose(2, 0, 1, 3)
        return _Choice(groups, rest, moved, joints)

    def error(self, choice: _Choice) -> float:
        """Root mean square error of the learnt vertices with joints at their simulated places
        [m]."""
        mesh, moved = self.levels[0]
        points = mesh.positions[self.picked].astype(np.float64)
        targets = moved[self.picked][:, self.frames].astype(np.float64)
        moves = _moves(choice.rest, chained(choice.rest, choice.places[self.frames]))
        skin = best_weights(points, targets, self._first(mesh, self.picked, choice), *moves)
        miss = skinned(points, skin, *moves) - targets
        return float(np.sqrt((miss * miss).sum(axis=-1).mean()))

    def skin(self, mesh: CardMesh, moved: Floats, choice: _Choice, places: Floats) -> Skin:
        """The weights of all vertices of a level with joints in these places, heaviest first."""
        moves = _moves(choice.rest, places[self.frames])
        parts = []
        for begin in range(0, len(moved), VERTICES_AT_ONCE):
            part = np.arange(begin, min(begin + VERTICES_AT_ONCE, len(moved)))
            points = mesh.positions[part].astype(np.float64)
            targets = moved[part][:, self.frames].astype(np.float64)
            parts.append(best_weights(points, targets, self._first(mesh, part, choice), *moves))
        return Skin.joined(parts)

    def _first(self, mesh: CardMesh, vertices: Ints, choice: _Choice) -> Skin:
        """Each vertex weighted to its bone and a little to the nearer neighbour."""
        used = np.unique(self.tracks.levels[0].card)
        card = np.searchsorted(used, card_of_vertex(mesh)[vertices])
        bones = choice.joints - 1
        at = np.clip(mesh.along[vertices].astype(np.float64), 0.0, 1.0) * bones
        bone = np.minimum(at.astype(np.int64), bones - 1)
        fraction = at - bone
        beside = np.where(fraction < 0.5, bone - 1, bone + 1)
        is_end = (beside < 0) | (beside >= bones)
        beside = np.clip(np.where(is_end, 2 * bone - beside, beside), 0, bones - 1)
        own, other = choice.groups.own[card], choice.groups.other[card]
        weight = np.zeros((len(card), INFLUENCES))
        weight[:, 1] = np.where(is_end, 0.0, np.abs(fraction - 0.5))
        weight[:, 0] = 1.0 - weight[:, 1]
        root = np.full(len(card), choice.groups.count * choice.joints)
        own, other = own * choice.joints, other * choice.joints
        return Skin(np.stack([own + bone, own + beside, other + bone, root], axis=1), weight)


def _colliding(rest: Floats, balls: Balls) -> tuple[SpringChains, Floats]:
    """The chains with the balls that each keeps out of, those that it is outside of at rest, and
    the hit radius of each bone, (chains, bones) [m]: at most its distance at rest.
    """
    tails = rest[:, 1:, :3, 3]
    lengths = np.linalg.norm(np.diff(rest[..., :3, 3], axis=1), axis=-1)
    distance = balls.nearest(tails)[1] + _NEAR * lengths[..., None]
    hits = (distance > 0.0).all(axis=1) if len(balls.radius) else np.zeros((len(rest), 0), bool)
    free = np.where(hits[:, None], distance, np.inf).min(axis=2, initial=np.inf)
    radius = np.clip(np.minimum(free - 2.0 * _NEAR * lengths, _HIT_FRACTION * lengths), 0.0, None)
    return SpringChains(rest, balls, hits), radius


def _part[Result](
    steps: Generator[float, None, Result], begin: float, end: float
) -> Generator[float, None, Result]:
    try:
        while True:
            yield begin + (end - begin) * next(steps)
    except StopIteration as stop:
        result: Result = stop.value
        return result
