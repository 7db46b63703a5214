"""Chains of joints that move cards as their guides do, for engines with skinned meshes.

Cards that move alike share a chain (`joint_chains`), a vertex is weighted to two neighbouring
joints of its own chain and two of another one, and joints and weights are fitted to the motion
alternately (`joint_solve`).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import Floats, Ints
from .card_mesh import CardMesh
from .export_settings import CardExportSettings
from .follow import card_lines
from .joint_chains import Chains, card_chains, joint_reach, rest_joints
from .joint_solve import (
    INFLUENCES,
    Skin,
    fit_weights,
    initial_joint_motions,
    refine_joint_motions,
    skinned,
)
from .sort import card_of_vertex

#: Numbers of joints that are tried, the fewest first.
_JOINT_COUNTS = (2, 3, 4, 6, 8, 12, 16)
#: Joints are added while each step reduces the error by at least this fraction.
_MIN_GAIN = 0.03
#: Fraction of the allowed error for the joints; the rest is for the keys that are left out.
FIT_FRACTION = 0.9
#: Numbers of frames that weights, and of vertices that joints are learnt from.
_MAX_SAMPLE_FRAMES = 24
_MAX_SAMPLE_VERTICES = 12_000
_ALTERNATIONS = 3
#: Frames solved at once, and vertices placed at once.
_FRAME_BATCH = 64
VERTEX_BATCH = 4096


@dataclass(frozen=True, eq=False)
class CardTracks:
    """Cards in motion, in their space at rest, which moves with the head.

    levels: at rest [m], the finest first.
    moved_positions: (vertex_count, frame_count, 3) float32 [m] of each level.
    carrier: (frame_count, 4, 4) rigid motion, from that space to the world.
    hair_length: median length of the guides [m], of which errors are fractions.
    root: (3,) middle of the roots at rest [m].
    first_frame: number of the first frame. frame_rate: [1/s].
    """

    levels: tuple[CardMesh, ...]
    moved_positions: tuple[Floats, ...]
    carrier: Floats
    hair_length: float
    root: Floats
    first_frame: int
    frame_rate: float

    @property
    def frame_count(self) -> int:
        return len(self.carrier)

    def sample_frames(self) -> Ints:
        """Indices of the frames from which weights are learnt, evenly chosen, ascending."""
        sample_count = min(self.frame_count, _MAX_SAMPLE_FRAMES)
        return np.linspace(0, self.frame_count - 1, sample_count).round().astype(int)

    def sample_vertices(self, count: int) -> Ints:
        """Indices of this many vertices of the finest level, or of all if there are fewer, chosen
        at random, ascending."""
        vertex_count = len(self.levels[0].positions)
        return np.sort(
            np.random.default_rng(0).permutation(vertex_count)[: min(vertex_count, count)]
        )


@dataclass(frozen=True, eq=False)
class JointRig:
    """Joints and the skins that they move, in the space of `CardTracks`; chain after chain.

    chains, joints: how many chains, and joints in each.
    rest: (chains, joints, 4, 4) rigid [m]; the y axis is along the chain.
    turn, place: (chains, joints, frame_count, 3, 3) and (..., 3) [m], the joints' own.
    reach: (chains, joints) distance of what a joint moves from it [m].
    skins: of each level; a joint's number is chain * joints + number in the chain.
    """

    chains: int
    joints: int
    rest: Floats
    turn: Floats
    place: Floats
    reach: Floats
    skins: tuple[Skin, ...]


@dataclass(frozen=True)
class FitError:
    """Distances of played vertices from simulated ones [m], over all levels and frames: root mean
    square, 99th percentile, and maximum.
    """

    root_mean_square: float
    percentile_99: float
    maximum: float

    @classmethod
    def of(cls, distances: Sequence[Floats]) -> Self:
        """The error of distances (n,) [m], given in parts."""
        every = np.concatenate(distances)
        rms = float(np.sqrt(np.mean(np.square(every, dtype=np.float64))))
        return cls(rms, float(np.quantile(every, 0.99)), float(every.max(initial=0.0)))

    @classmethod
    def of_motion(
        cls, tracks: CardTracks, skins: Sequence[Skin], moves: tuple[Floats, Floats]
    ) -> Self:
        """The error of all levels.

        Args:
            moves: of the joints, see `joint_transforms`.
        """
        distances = []
        for mesh, moved, skin in zip(tracks.levels, tracks.moved_positions, skins, strict=True):
            for begin in range(0, len(moved), VERTEX_BATCH):
                part = slice(begin, begin + VERTEX_BATCH)
                points = mesh.positions[part].astype(np.float64)
                own = Skin(skin.joint[part], skin.weight[part])
                miss = skinned(points, own, *moves) - moved[part]
                distances.append(np.sqrt((miss * miss).sum(axis=-1)).astype(np.float32).ravel())
        return cls.of(distances)


def joint_steps(
    tracks: CardTracks, settings: CardExportSettings
) -> Generator[float, None, JointRig]:
    """The fewest joints that stay under the error; if none do, those with the smallest error.

    Yields the fraction that is done.
    """
    samples = _Samples.of(tracks, settings.chains)
    yield 0.1
    allowed = FIT_FRACTION * settings.joint_error / 100.0 * tracks.hair_length
    best, smallest = None, np.inf
    for count in (each for each in _JOINT_COUNTS if each <= settings.joints):
        fit, error = samples.fitted(count)
        if error > smallest * (1.0 - _MIN_GAIN):
            break
        best, smallest = (count, *fit), error
        if error <= allowed:
            break
        yield 0.1 + 0.4 * count / _JOINT_COUNTS[-1]
    assert best is not None, "two joints are always tried"
    yield 0.5
    return (yield from _fit_all(tracks, samples, *best))


def keyed_error(tracks: CardTracks, rig: JointRig, turn: Floats, place: Floats) -> FitError:
    """The error of the cards with the joints at these places.

    Args:
        turn, place: as in the rig, but possibly with keys left out.
    """
    return FitError.of_motion(tracks, rig.skins, joint_transforms(rig.rest, turn, place))


def joint_transforms(rest: Floats, turn: Floats, place: Floats) -> tuple[Floats, Floats]:
    """Transforms of points at rest by joints: turns (n, frame_count, 3, 3) and shifts
    (n, frame_count, 3); a point moves to turn point + shift.
    """
    shape = turn.shape[2:]
    moves = (turn @ rest[:, :, None, :3, :3].swapaxes(-1, -2)).reshape(-1, *shape)
    shifts = place.reshape(-1, shape[0], 3) - np.einsum(
        "jfab,jb->jfa", moves, rest.reshape(-1, 4, 4)[:, :3, 3]
    )
    return moves, shifts


@dataclass(frozen=True, eq=False)
class _Samples:
    """The data that joints are learnt from: some vertices of the finest level in some frames."""

    lines: Floats
    chains: Chains
    points: Floats
    moved_positions: Floats
    card: Ints
    along: Floats
    vertices: Ints
    frames: Ints

    @classmethod
    def of(cls, tracks: CardTracks, max_chains: int) -> _Samples:
        mesh, moved = tracks.levels[0], tracks.moved_positions[0]
        frames = tracks.sample_frames()
        _, lines = card_lines(mesh)
        shifts = [card_lines(replace(mesh, positions=moved[:, frame]))[1] for frame in frames]
        lines = lines.astype(np.float64)
        chains = card_chains(lines, np.stack(shifts, axis=2).astype(np.float64), max_chains)
        vertices = tracks.sample_vertices(_MAX_SAMPLE_VERTICES)
        return cls(
            lines,
            chains,
            mesh.positions[vertices].astype(np.float64),
            moved[vertices][:, frames].astype(np.float64),
            _card_places(mesh, mesh)[vertices],
            mesh.along[vertices],
            vertices,
            frames,
        )

    def initial_skin(self, card: Ints, along: Floats, joints: int) -> Skin:
        """Each vertex between two joints of its own chain, with weights of 0 for the other
        chain's."""
        place = np.clip(along.astype(np.float64), 0.0, 1.0) * (joints - 1)
        before = np.minimum(place.astype(np.int64), joints - 2)
        own = self.chains.first[card] * joints + before
        other = self.chains.second[card] * joints + before
        fraction = place - before
        weight = np.zeros((len(card), INFLUENCES))
        weight[:, 0], weight[:, 1] = 1.0 - fraction, fraction
        return Skin(np.stack([own, own + 1, other, other + 1], axis=1), weight)

    def fitted(self, joints: int) -> tuple[tuple[Skin, Floats, Floats], float]:
        """The skin of the learnt vertices, the joints' motion, and the error [m]."""
        skin = self.initial_skin(self.card, self.along, joints)
        count = self.chains.count * joints
        turn, shift = initial_joint_motions(self.points, self.moved_positions, skin, count)
        for _ in range(_ALTERNATIONS):
            refine_joint_motions(self.points, self.moved_positions, skin, turn, shift, 2)
            skin = fit_weights(self.points, self.moved_positions, skin, turn, shift)
        refine_joint_motions(self.points, self.moved_positions, skin, turn, shift, 1)
        miss = skinned(self.points, skin, turn, shift) - self.moved_positions
        return (skin, turn, shift), float(np.sqrt((miss * miss).sum(axis=-1).mean()))


def _fit_all(
    tracks: CardTracks, samples: _Samples, joints: int, skin: Skin, turn: Floats, shift: Floats
) -> Generator[float, None, JointRig]:
    """The learnt joints in all frames and for all vertices."""
    chains, frame_count = samples.chains.count, tracks.frame_count
    turns = np.empty((chains * joints, frame_count, 3, 3))
    shifts = np.empty((chains * joints, frame_count, 3))
    for begin in range(0, frame_count, _FRAME_BATCH):
        part = slice(begin, begin + _FRAME_BATCH)
        moved = tracks.moved_positions[0][samples.vertices, part].astype(np.float64)
        block = initial_joint_motions(samples.points, moved, skin, chains * joints)
        refine_joint_motions(samples.points, moved, skin, *block, rounds=3)
        turns[:, part], shifts[:, part] = block
        yield 0.5 + 0.3 * min(begin + _FRAME_BATCH, frame_count) / frame_count
    skins = []
    for mesh, now in zip(tracks.levels, tracks.moved_positions, strict=True):
        skins.append(_level_skin(mesh, now, tracks.levels[0], samples, joints, turn, shift))
        yield 0.8 + 0.1 * len(skins) / len(tracks.levels)
    rest = rest_joints(samples.lines, samples.chains, joints)
    flat: Floats = rest.reshape(-1, 4, 4)
    place = np.einsum("jfab,jb->jfa", turns, flat[:, :3, 3])
    shape = (chains, joints, frame_count)
    return JointRig(
        chains,
        joints,
        rest,
        (turns @ flat[:, None, :3, :3]).reshape(*shape, 3, 3),
        (place + shifts).reshape(*shape, 3),
        joint_reach(tracks.levels[0].positions, skins[0], rest),
        tuple(skins),
    )


def _level_skin(
    mesh: CardMesh,
    moved: Floats,
    finest: CardMesh,
    samples: _Samples,
    joints: int,
    turn: Floats,
    shift: Floats,
) -> Skin:
    """The weights of all vertices of a level, heaviest first."""
    card = _card_places(mesh, finest)
    parts = []
    for begin in range(0, len(moved), VERTEX_BATCH):
        part = slice(begin, begin + VERTEX_BATCH)
        first = samples.initial_skin(card[part], mesh.along[part], joints)
        points = mesh.positions[part].astype(np.float64)
        shifts = moved[part][:, samples.frames].astype(np.float64)
        parts.append(fit_weights(points, shifts, first, turn, shift))
    return Skin.joined(parts)


def _card_places(mesh: CardMesh, finest: CardMesh) -> Ints:
    """For each vertex, the index of its card among those of the finest level."""
    return np.searchsorted(np.unique(finest.card), card_of_vertex(mesh))


def joint_names(chains: int, joints: int) -> Sequence[str]:
    """Such as chain_03_joint_02, chain after chain."""
    width = max(2, len(str(chains - 1)))
    return [
        f"chain_{chain:0{width}}_joint_{joint:02}"
        for chain in range(chains)
        for joint in range(joints)
    ]
