"""Guides, motions and meshes that the dynamics tests share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from hairloom.addon.dynamics.clearance import GuideClearance, guide_clearance, max_clearance
from hairloom.addon.dynamics.colliders import Collider, PosedCollider
from hairloom.addon.dynamics.force_fields import NO_FIELDS, ForceFields
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.held import HeldCvs
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.dynamics.step import advance
from hairloom.addon.strands import Surface

EARTH = np.array([0.0, 0.0, -9.81])
#: Only inertia, gravity and lengths.
LIMP = {
    "style_root": 0.0,
    "style_tip": 0.0,
    "bend": 0.0,
    "damping": 0.0,
    "style_damping": 0.0,
    "sag_compensation": 0.0,
}


def rotation(axis: int, angle: float) -> np.ndarray:
    """(4, 4) turn about a world axis through the origin [rad]."""
    matrix = np.eye(4)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    matrix[one, one] = matrix[other, other] = np.cos(angle)
    matrix[other, one], matrix[one, other] = np.sin(angle), -np.sin(angle)
    return matrix


def translation(*way: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = way
    return matrix


def moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)


def straight(
    guide_count: int, cv_count: int, length: float = 0.2, direction: Any = (0.0, 0.0, -1.0)
) -> np.ndarray:
    """Guides side by side along x, (guide_count, cv_count, 3)."""
    along = np.linspace(0.0, length, cv_count)[:, None] * np.asarray(direction)
    roots = np.arange(guide_count)[:, None, None] * np.array([0.01, 0.0, 0.0])
    return (roots + along).astype(np.float32)


def curly(guide_count: int, cv_count: int, length: float = 0.2, seed: int = 3) -> np.ndarray:
    """Guides that grow outwards from a dome, each with its own waves, in uneven segments."""
    rng = np.random.default_rng(seed)
    out = rng.normal([0.0, 0.0, 1.5], 1.0, (guide_count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    share = np.linspace(0.0, 1.0, cv_count) ** 1.2
    grid = out[:, None] * (0.1 + length * share[:, None])
    phase = rng.uniform(0.0, 6.0, (guide_count, 1, 3))
    waves = np.sin(share[:, None] * rng.uniform(3.0, 9.0, (guide_count, 1, 3)) + phase)
    return (grid + 0.02 * share[:, None] * waves).astype(np.float32)


def tips(is_held: Any, cv_count: int) -> np.ndarray:
    """A mask of the tips of guides, for `Scene.held`; is_held: (guide_count,)."""
    held = np.zeros((len(is_held), cv_count), bool)
    held[:, -1] = is_held
    return held


def tied(is_held: Any, cv_count: int, *first: int) -> np.ndarray:
    """A mask of guides tied between each CV in `first` and the next one, for `Scene.held`."""
    held = np.zeros((len(is_held), cv_count), bool)
    for cv in first:
        held[is_held, cv : cv + 2] = True
    return held


def icosphere(radius: float, subdivisions: int = 4) -> Surface:
    """A ball of equal triangles that face outwards."""
    golden = (1.0 + 5.0**0.5) / 2.0
    corners = np.array(
        [
            [-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
            [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
            [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1],
        ]
    )  # fmt: skip
    faces = np.array(
        [
            [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11],
            [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
            [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
            [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
        ]
    )  # fmt: skip
    triangles = corners[faces]
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = a + b, b + c, c + a
        parts = [(a, ab / 2, ca / 2), (b, bc / 2, ab / 2), (c, ca / 2, bc / 2)]
        parts.append((ab / 2, bc / 2, ca / 2))
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    points = triangles.reshape(-1, 3)
    points = points / np.linalg.norm(points, axis=1, keepdims=True) * radius
    return Surface(points.astype(np.float32), np.arange(len(points)).reshape(-1, 3))


def box(size: tuple[float, float, float]) -> Surface:
    """A box around the origin whose triangles face outwards."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Surface((corners * size).astype(np.float32), np.array(triangles))


def random_settings(random: np.random.Generator, **fixed: Any) -> DynamicsSettings:
    """Random values from the hard ranges, half of them at an end of the range; `fixed` ones as
    given."""
    values: dict[str, Any] = {}
    for parameter in DynamicsSettings.parameters():
        if parameter.kind == "toggle":
            values[parameter.name] = bool(random.integers(2))
        elif parameter.kind == "choice":
            values[parameter.name] = random.choice([name for name, _, _ in parameter.choices])
        elif parameter.kind == "mask":
            continue
        else:
            low, high = parameter.hard_range

            def one(parameter=parameter, low=low, high=high):
                default = parameter.default if parameter.kind != "curve" else parameter.default[0]
                return float(random.choice([low, high, random.uniform(low, high), default]))

            if parameter.kind == "curve":
                values[parameter.name] = tuple(one() for _ in parameter.default)
            else:
                values[parameter.name] = round(one()) if parameter.kind == "integer" else one()
    values["substep_rate"] = min(values["substep_rate"], 300.0)  # for the test's own time
    values["relaxations"] = min(values["relaxations"], 32)
    values["length_iterations"] = min(values["length_iterations"], 16)
    return DynamicsSettings(**values | fixed)


@dataclass
class Scene:
    """Guides on a head that moves by matrices, with colliders that move with it or stand still.

    held: (guide_count, cv_count) mask of CVs that move with the head too, or None.
    room: (guide_count, cv_count - 1) how far segments of curls can stretch, or None.
    painted: factors of settings at each guide, or None.
    is_combed: whether colliders push guides no farther away than they are at rest.
    bowed: whether trajectories within a frame are smooth, as `motion_flow` makes them.
    """

    grid: np.ndarray
    settings: DynamicsSettings
    motion: Callable[[float], np.ndarray] = lambda time: np.eye(4)
    on_head: tuple[Collider, ...] = ()
    standing: tuple[Collider, ...] = ()
    gravity: np.ndarray = field(default_factory=lambda: EARTH)
    advance: Callable[..., DynamicsState] = advance
    held: Any = None
    bowed: bool = False
    force_fields: ForceFields = NO_FIELDS
    room: Any = None
    painted: Any = None
    is_combed: bool = False

    def start(self) -> DynamicsState:
        return start(moved(self.motion(0.0), self.grid), self.room)

    def colliders(self, before: float, now: float) -> tuple[PosedCollider, ...]:
        matrices = self.motion(before), self.motion(now)
        still = np.eye(4)
        earlier = self.motion(2 * before - now) if self.bowed else None
        return tuple(PosedCollider(one, *matrices, earlier) for one in self.on_head) + tuple(
            PosedCollider(one, still, still) for one in self.standing
        )

    def drive(self, before: float, now: float) -> Drive:
        targets = [moved(self.motion(t), self.grid) for t in (2 * before - now, before, now)]
        earlier = targets[0] if self.bowed else None
        colliders = self.colliders(before, now)
        held = None if self.held is None else HeldCvs(np.asarray(self.held, bool))
        return Drive(
            *targets[1:],
            colliders,
            self.gravity,
            earlier,
            self.force_fields,
            held=held,
            clearance=self.clearance if self.is_combed else None,
            painted=self.painted,
        )

    @property
    def clearance(self) -> GuideClearance:
        begun = moved(self.motion(0.0), self.grid)
        length = np.linalg.norm(np.diff(begun, axis=1), axis=2).sum(axis=1)
        reach = max_clearance(self.settings, float(np.median(length)))
        return guide_clearance(begun, self.colliders(0.0, 0.0), reach)

    def play(self, seconds: float, fps: float = 60.0) -> list[DynamicsState]:
        """The states at all frames, the start first."""
        states = [self.start()]
        for frame in range(round(seconds * fps)):
            drive = self.drive(frame / fps, (frame + 1) / fps)
            states.append(self.advance(states[-1], drive, self.settings, 1.0 / fps))
        return states


class Kit:
    """Everything above by name, since test files cannot import each other."""

    EARTH = EARTH
    LIMP = LIMP
    Scene = Scene
    rotation = staticmethod(rotation)
    translation = staticmethod(translation)
    moved = staticmethod(moved)
    straight = staticmethod(straight)
    tips = staticmethod(tips)
    tied = staticmethod(tied)
    curly = staticmethod(curly)
    icosphere = staticmethod(icosphere)
    box = staticmethod(box)
    random_settings = staticmethod(random_settings)


@pytest.fixture(scope="session")
def kit() -> type[Kit]:
    return Kit


@pytest.fixture(scope="session")
def shake() -> Callable[[float], np.ndarray]:
    """A head that shakes by 25 degrees about z and 5 cm along x, once a second, with a smooth
    beginning."""

    def matrix(time: float) -> np.ndarray:
        begun = np.sin(np.pi * min(time, 0.5)) ** 2
        swing = begun * np.sin(2.0 * np.pi * time)
        return translation(0.05 * swing, 0.0, 0.0) @ rotation(2, np.radians(25.0) * swing)

    return matrix
