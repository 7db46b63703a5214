"""Seeded runs that try to break the dynamics: any settings, any guides, wild heads and colliders.

Every value is drawn from its whole hard range, and often from one of its ends. Only the substep
rate and the number of relaxations are limited, since a run would otherwise take minutes. Nothing
here needs Blender, so that tests can use it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from hairloom.addon.dynamics.force_fields import (
    FALLOFFS,
    KINDS,
    NO_FIELDS,
    Falloff,
    ForceField,
    ForceFields,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.held import HeldCvs
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.springs import max_extension_fraction
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.params import Parameter

CV_COUNTS = (2, 3, 4, 8, 16, 24)
FRAME_RATES = (12.0, 24.0, 30.0, 60.0, 120.0)
#: Settings that are not drawn, besides masks: those that no step reads, and those that are drawn
#: separately, so that each seed keeps its run.
_NOT_DRAWN = {"device", "collider_resolution", "curl_stretch", "curl_bounce"} | {
    "animated_style",
    "influence",
}
#: Most sweeps over segments in a second of simulation; with more, a run takes minutes.
_SWEEPS = 60_000
#: Shortest length at rest that lengths are compared with [m].
_NO_LENGTH = 1.0e-4


@dataclass(frozen=True)
class Way:
    """The motion of an object over time: swaying, turning, pulsing, with one jump at most.

    sway, phase: (3,) [m], [rad]. rate: (3,) [1/s]. axis: (3,) unit. turn: [1/s]. scale: (3,).
    pulse: fraction of the scale. jump_at: [s]. jump: (3,) [m].
    """

    place: np.ndarray
    sway: np.ndarray
    rate: np.ndarray
    phase: np.ndarray
    axis: np.ndarray
    turn: float
    scale: np.ndarray
    pulse: float
    jump_at: float
    jump: np.ndarray

    def matrix(self, time: float) -> np.ndarray:
        """Object to world (4, 4) at a time [s]."""
        matrix = np.eye(4)
        swing = np.sin(2.0 * np.pi * self.rate * time + self.phase)
        matrix[:3, :3] = _turned(self.axis, 2.0 * np.pi * self.turn * time)
        matrix[:3, :3] *= self.scale * (1.0 + self.pulse * np.sin(6.0 * time))
        matrix[:3, 3] = self.place + self.sway * swing + (time >= self.jump_at) * self.jump
        return matrix


@dataclass(frozen=True)
class RandomRun:
    """Guides (guide_count, cv_count, 3) at rest on a head, the room of their curls (see `start`),
    and everything that acts on them."""

    grid: np.ndarray
    settings: DynamicsSettings
    head: Way
    colliders: tuple[tuple[Collider, Way], ...]
    gravity: np.ndarray
    force_fields: ForceFields
    fps: float
    is_bent: bool
    held: HeldCvs | None
    room: np.ndarray | None = None

    def begin(self) -> DynamicsState:
        """The guides in the head's first pose."""
        return start(_moved(self.head.matrix(0.0), self.grid), self.room)

    def drives(self, seconds: float) -> Iterator[Drive]:
        """A drive for each frame."""
        times = np.arange(round(seconds * self.fps) + 1) / self.fps
        for number in range(1, len(times)):
            moments = times[max(number - 2, 0) : number + 1].tolist()
            targets = [_moved(self.head.matrix(time), self.grid) for time in moments]
            earlier = targets[0] if self.is_bent and len(targets) == 3 else None
            colliders = tuple(self._posed(one, way, moments) for one, way in self.colliders)
            before, now = targets[-2:]
            yield Drive(
                before, now, colliders, self.gravity, earlier, self.force_fields, held=self.held
            )

    def _posed(self, collider: Collider, way: Way, moments: list[float]) -> PosedCollider:
        matrices = [way.matrix(time) for time in moments]
        earlier = matrices[0] if self.is_bent and len(matrices) == 3 else None
        return PosedCollider(collider, matrices[-2], matrices[-1], earlier)


@dataclass(frozen=True)
class Reach:
    """The largest distance of a CV from its root, as a fraction of the rest length between them,
    which includes what curls give. straight: in a straight line. along: along the strand.
    is_finite: all numbers are finite.
    """

    straight: float
    along: float
    is_finite: bool


def reach_of(state: DynamicsState, settings: DynamicsSettings | None = None) -> Reach:
    """The worst of all CVs of a state; without settings, curls give nothing."""
    position = state.position.astype(np.float64)
    if not np.isfinite(position).all() or not np.isfinite(state.previous).all():
        return Reach(np.inf, np.inf, False)
    longest = state.rest.length.astype(np.float64)
    if state.rest.curl_slack is not None and settings is not None:
        longest *= 1.0 + max_extension_fraction(settings) * state.rest.curl_slack
    rest = np.cumsum(longest, axis=0)
    straight = np.linalg.norm(position[:, 1:] - position[:, :1], axis=0)
    along = np.cumsum(np.linalg.norm(np.diff(position, axis=1), axis=0), axis=0)
    allowed = np.maximum(rest, _NO_LENGTH)
    max_ratios = [float((distance / allowed).max(initial=0.0)) for distance in (straight, along)]
    return Reach(max_ratios[0], max_ratios[1], True)


def promises_length(settings: DynamicsSettings) -> bool:
    """Whether these settings keep lengths; relaxation alone does not."""
    return settings.length_solver == "direct" or settings.long_range


def random_run(seed: int, guide_count: int = 12) -> RandomRun:
    """The run of this seed; always the same."""
    random = np.random.default_rng(seed)
    cv_count = int(random.choice(CV_COUNTS))
    settings = _settings(random, cv_count)
    solids = tuple(
        (_solid(random), _way(random, is_head=False)) for _ in range(random.integers(0, 5))
    )
    held = None
    if cv_count >= 4 and random.random() < 0.2:
        is_held = np.zeros((guide_count, cv_count), bool)
        is_held[:, -1] = random.random(guide_count) < 0.5
        ties = np.random.default_rng(seed)  # a separate generator, so that each seed keeps its run
        first = ties.integers(0, cv_count - 1, guide_count)
        is_tied = ties.random(guide_count) < 0.3
        for step in (0, 1):
            is_held[is_tied, first[is_tied] + step] = True
        held = HeldCvs(is_held)
    curls = np.random.default_rng((seed, 1))
    room = None
    if curls.random() < 0.5:
        room = curls.uniform(-1.0, curls.choice([2.0, 20.0]), (guide_count, cv_count - 1))
        room = np.maximum(room, 0.0)
        stretch = float(curls.choice([0.01, 0.25, 1.0]))
        bounce = float(curls.choice([0.1, 2.0, 50.0]))
        settings = replace(settings, curl_stretch=stretch, curl_bounce=bounce)
    return RandomRun(
        grid=_guides(random, guide_count, cv_count),
        settings=settings,
        head=_way(random, is_head=True),
        colliders=solids,
        gravity=random.normal(size=3) * random.choice([0.0, 9.81, 100.0]),
        force_fields=_fields(random),
        fps=float(random.choice(FRAME_RATES)),
        is_bent=bool(random.random() < 0.7),
        held=held,
        room=room,
    )


def _fields(random: np.random.Generator) -> ForceFields:
    """No fields, or some of any kind, a few of them much too strong."""
    fields = []
    for _ in range(random.choice([0, 0, 1, 4])):
        axis = random.normal(size=3)
        fields.append(
            ForceField(
                str(random.choice(KINDS)),
                center=tuple(random.normal(0.0, 0.3, 3).tolist()),
                axis=tuple((axis / np.linalg.norm(axis)).tolist()),
                strength=float(random.normal() * random.choice([3.0, 100.0, 1.0e6])),
                shape=str(random.choice(("point", "line", "plane"))),
                damping=float(random.choice([0.0, 1.0, 1.0e6])),
                size=float(random.choice([0.0, 0.1])),
                flow=float(random.choice([0.0, 1.0, -10.0])),
                across_fraction=float(random.choice([0.0, 1.0])),
                falloff=str(random.choice(FALLOFFS)),
                side=int(random.integers(-1, 2)),
                distance=Falloff(float(random.choice([0.0, 2.0, 10.0])), 0.0),
                radial=Falloff(float(random.choice([0.0, 0.3])), 0.1, 90.0),
                is_inverse_square=bool(random.random() < 0.5),
            )
        )
    return ForceFields(tuple(fields), random.permutation(256))


def shaken(guide_count: int) -> RandomRun:
    """Not random: default settings in gusts, on a ball that sways like a shaken head."""
    random = np.random.default_rng(0)
    still = np.zeros(3)
    head = Way(
        place=still,
        sway=np.array([0.3, 0.1, 0.05]),
        rate=np.array([1.0, 1.7, 0.6]),
        phase=still,
        axis=np.array([0.0, 0.0, 1.0]),
        turn=0.1,
        scale=np.ones(3),
        pulse=0.0,
        jump_at=np.inf,
        jump=still,
    )
    return RandomRun(
        grid=_curls(random, random.uniform(0.1, 0.3, (guide_count, 1, 1)), 16, 0.1),
        settings=DynamicsSettings(wind_speed=3.0, gusts=0.5),
        head=head,
        colliders=((SphereCollider(still, 0.1), head),),
        gravity=np.array([0.0, 0.0, -9.81]),
        force_fields=NO_FIELDS,
        fps=60.0,
        is_bent=True,
        held=None,
    )


def _settings(random: np.random.Generator, cv_count: int) -> DynamicsSettings:
    drawn = {
        parameter.name: _drawn(parameter, random)
        for parameter in DynamicsSettings.parameters()
        if parameter.kind != "mask" and parameter.name not in _NOT_DRAWN
    }
    rate = 2000.0 if random.random() < 0.01 else 30.0 * 10.0 ** random.random()
    sweeps = round(_SWEEPS / (rate * cv_count * (drawn["contact_passes"] + 2)))
    drawn |= {"substep_rate": rate, "relaxations": max(1, min(drawn["relaxations"], sweeps))}
    return DynamicsSettings(**drawn)


def _drawn(parameter: Parameter, random: np.random.Generator) -> Any:
    if parameter.kind == "toggle":
        return bool(random.random() < 0.5)
    if parameter.kind == "choice":
        return str(random.choice([name for name, _, _ in parameter.choices]))
    assert parameter.hard_range is not None
    low, high = parameter.hard_range
    if parameter.kind == "curve":
        ends = random.choice([low, high], 5)
        return tuple(np.where(random.random(5) < 0.5, ends, random.uniform(low, high, 5)))
    small = max(low, 1.0e-4 * high) if low >= 0.0 else low
    spread = small * (high / small) ** random.random() if low >= 0.0 else parameter.default
    options = [parameter.default, parameter.default, low, high, random.uniform(low, high), spread]
    value = options[random.integers(len(options))]
    return round(value) if parameter.kind == "integer" else float(np.clip(value, low, high))


def _guides(random: np.random.Generator, count: int, cv_count: int) -> np.ndarray:
    """Curly or straight, 1 cm to 2 m long; one folds back, one has no length, one none in its outer
    half."""
    length = 0.01 * 200.0 ** random.random((count, 1, 1))
    grid = _curls(random, length, cv_count, float(random.choice([0.0, 0.2])))
    if cv_count > 3:
        grid[0, cv_count // 2 :] = grid[0, cv_count // 2 : cv_count // 2 + 1]
        grid[1, 3] = grid[1, 1]  # folds back
    grid[2] = grid[2, :1]
    return grid


def _curls(
    random: np.random.Generator, length: np.ndarray, cv_count: int, wave: float
) -> np.ndarray:
    """Guides outwards from a ball of 0.1 m, waved by a fraction of length (count, 1, 1) [m]."""
    outward = random.normal(size=(len(length), 1, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    fraction = np.linspace(0.0, 1.0, cv_count)[:, None] ** random.choice([1.0, 1.5])
    waves = fraction * np.sin(fraction * random.uniform(2.0, 12.0, (len(length), 1, 3)))
    return (outward * (0.1 + length * fraction) + waves * wave * length).astype(np.float32)


def _way(random: np.random.Generator, *, is_head: bool) -> Way:
    """A head keeps its size, as hair does not grow with it."""
    scale = np.ones(3)
    if not is_head and random.random() < 0.6:
        scale = 0.2 * 15.0 ** random.random(3)
        scale[0] *= random.choice([1.0, 1.0, 1.0, -1.0])  # mirrored
    axis = random.normal(size=3)
    return Way(
        place=np.zeros(3) if is_head else random.normal(0.0, 0.15, 3),
        sway=random.normal(size=3) * random.choice([0.0, 0.05, 0.5]),
        rate=random.uniform(0.0, 5.0, 3),
        phase=random.uniform(0.0, 2.0 * np.pi, 3),
        axis=axis / np.linalg.norm(axis),
        turn=random.uniform(-3.0, 3.0) * random.choice([0.0, 0.3, 1.0]),
        scale=scale,
        pulse=0.0 if is_head else float(random.choice([0.0, 0.3])),
        jump_at=random.uniform(0.0, 2.0) if random.random() < 0.1 else np.inf,
        jump=random.normal(size=3),
    )


def _solid(random: np.random.Generator) -> Collider:
    size = 0.02 * 10.0 ** random.random()
    kind = random.integers(4)
    if kind == 0:
        return SphereCollider(random.normal(0.0, 0.05, 3), size)
    if kind == 1:
        start, end = random.normal(0.0, 0.15, (2, 3)) * random.choice([0.0, 1.0])
        return CapsuleCollider(start, end, size)
    if kind == 2:
        count = int(random.integers(1, 30))
        return SphereSetCollider(random.normal(0.0, 0.1, (count, 3)), size * random.random(count))
    return _mesh(int(random.integers(2)))


@lru_cache(maxsize=2)
def _mesh(which: int) -> DistanceField:
    """The distance field of a box with sharp edges, or of a torus, sampled coarsely."""
    low, cell, nodes = -0.25, 0.02, 26
    axis = low + cell * np.arange(nodes)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    if which:
        away = np.linalg.norm(points[..., :2], axis=-1) - 0.14
        return DistanceField(np.hypot(away, points[..., 2]) - 0.05, np.full(3, low), cell)
    beyond = np.abs(points) - np.array([0.15, 0.1, 0.12])
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return DistanceField(outside + np.minimum(beyond.max(axis=-1), 0.0), np.full(3, low), cell)


def _turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula, (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
