"""What acts on the guides in a frame, checked and made ready: once for all, and block by block."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from .colliders import PosedCollider
from .constraints import PINNED
from .contacts import cv_radius
from .forces import best_rotation, carried_share, felt_gravity, sampled
from .settings import DynamicsSettings
from .state import DynamicsState, Rest, as_rows, checked_grid
from .style import StyleBand, style_band
from .way import at
from .wind import Air, air_of


@dataclass(frozen=True)
class Drive:
    """What acts on the guides during one frame.

    target_before, target_now: (guide_count, cv_count, 3) world [m], the style carried by the head
        at the frame's begin and end.
    colliders: with their way during the frame.
    gravity: (3,) world [m/s^2].
    target_bow: (guide_count, cv_count, 3) [m], how the way between them is bent, see `way.bow`;
        None: straight.
    scene_wind: (3,) world [m/s], in addition to that of the settings.
    """

    target_before: Floats
    target_now: Floats
    colliders: tuple[PosedCollider, ...]
    gravity: Floats
    target_bow: Floats | None = None
    scene_wind: Floats = field(default_factory=lambda: np.zeros(3))


def check_drive(state: DynamicsState, drive: Drive) -> None:
    """Raises:
    HairloomError: a drive that does not fit the state or is not finite.
    """
    targets = [drive.target_before, drive.target_now]
    if drive.target_bow is not None:
        targets.append(drive.target_bow)
    for target in targets:
        guide_count, cv_count = checked_grid(target, "style").shape[:2]
        if (guide_count, cv_count) != (state.guide_count, state.cv_count):
            raise HairloomError(
                f"the style has {guide_count} guides of {cv_count} CVs, "
                f"the simulation {state.guide_count} of {state.cv_count}",
                place="dynamics",
                remedy="Start the simulation again",
            )
    for name, vector in (("gravity", drive.gravity), ("wind", drive.scene_wind)):
        if np.shape(vector) != (3,) or not np.isfinite(vector).all():
            raise HairloomError(
                f"{name} is not three finite numbers",
                place="dynamics",
                remedy=f"Check the scene's {name}",
            )


@dataclass(frozen=True)
class Frame:
    """What is the same for all guides during a frame."""

    drive: Drive
    settings: DynamicsSettings
    dt: float
    duration: float
    time: float  # [s] of the first substep, on the clock of the gusts
    time_left: float
    turn: Floats
    matrix: StyleBand
    air: Air | None

    @classmethod
    def of(
        cls,
        state: DynamicsState,
        drive: Drive,
        settings: DynamicsSettings,
        duration: float,
        dt: float,
    ) -> Frame:
        turn: Floats = np.eye(3)
        if state.guide_count:
            ends, guides = [0, PINNED - 1, state.cv_count - 1], sampled(state.guide_count)
            both = (drive.target_before, drive.target_now)
            before, now = (np.asarray(grid)[guides][:, ends] for grid in both)
            turn = best_rotation(state.rest.position[:, ends, guides], as_rows((before + now) / 2))
        matrix = style_band(settings, state.cv_count, dt)
        air = air_of(settings, drive.scene_wind)
        return cls(drive, settings, dt, duration, state.time, state.time_left, turn, matrix, air)

    @property
    def carried_share(self) -> float:
        """Share of the style's way in the frame that each CV gets in a substep."""
        return carried_share(self.settings, self.dt) * self.dt / self.duration

    def span(self, number: int) -> tuple[float, float]:
        """Begin and end of a substep as shares of the frame."""
        begin = (number * self.dt - self.time_left) / self.duration
        return begin, begin + self.dt / self.duration

    def air_way(self, roots: Floats, number: int) -> Floats | None:
        """What the air at the roots (3, n) goes in a substep [m]; None when it stands still."""
        if self.air is None:
            return None
        return self.air.at(roots, self.time + number * self.dt) * np.float32(self.dt)


@dataclass(frozen=True)
class Block:
    """Some guides made ready for a frame, rows (3, cv_count, n) world [m].

    impulse, impulse_bow: what gravity and the moving style add to each CV in a substep, and how
        that changes while the way of the style bends.
    radius: (free CVs * n,) [m], the distance that each free CV keeps from colliders.
    """

    position: Floats
    previous: Floats
    rest: Rest
    style_before: Floats
    style_way: Floats
    style_bow: Floats | None
    impulse: Floats
    impulse_bow: Floats | None
    radius: Floats

    @classmethod
    def of(cls, state: DynamicsState, frame: Frame, guides: slice) -> Block:
        drive, settings, dt = frame.drive, frame.settings, frame.dt
        before = as_rows(drive.target_before[guides])
        way = as_rows(drive.target_now[guides]) - before
        bow = None if drive.target_bow is None else as_rows(drive.target_bow[guides])
        middle = before + way * np.float32(0.5)
        impulse = way * np.float32(frame.carried_share)
        impulse += felt_gravity(drive.gravity, settings, frame.turn, middle) * np.float32(dt * dt)
        position, previous = state.position[:, :, guides].copy(), state.previous[:, :, guides]
        if state.substep and state.substep != dt:
            previous = position - (position - previous) * np.float32(dt / state.substep)
        return cls(
            position,
            previous.copy(),
            state.rest.part(guides),
            before,
            way,
            bow,
            impulse,
            None if bow is None else bow * np.float32(frame.carried_share),
            np.repeat(cv_radius(settings, state.cv_count), before.shape[2]),
        )

    def style_at(self, moment: float) -> Floats:
        return at(self.style_before, self.style_way, self.style_bow, moment)

    def impulse_at(self, span: tuple[float, float]) -> Floats:
        """[m] that gravity and the moving style add to each CV in a substep; not to be written."""
        if self.impulse_bow is None:
            return self.impulse
        return self.impulse + self.impulse_bow * np.float32(span[0] + span[1] - 1.0)
