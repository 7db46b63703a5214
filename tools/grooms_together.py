"""Grooms of guides that are simulated together, for tests and benchmarks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.neighbours import (
    AdvancingGroom,
    FrameSteps,
    KnownNeighbours,
    LinearMotion,
    NeighbourStyle,
    advance_together,
    hair_length_of_guides,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.dynamics.step import advance_in_steps

EARTH = np.array([0.0, 0.0, -9.81])


class Groom:
    """Guides in motion.

    Args:
        grid: at rest, (guide_count, cv_count, 3) [m]. settings: None: the groom is not simulated.
        state: to start from; None: rest.
        make_pass: makes a DynamicsPass from a state; None: numpy.
        gravity: as a multiple of the earth's.
    """

    def __init__(
        self,
        grid: np.ndarray,
        settings: DynamicsSettings | None,
        *,
        state: DynamicsState | None = None,
        make_pass: Callable[[DynamicsState], Any] | None = None,
        gravity: float = 1.0,
    ) -> None:
        self.grid = self.style = grid
        self.settings, self.known = settings, KnownNeighbours()
        self.gravity = EARTH * gravity
        self._state = start(grid) if state is None else state
        self.hair = hair_length_of_guides(grid, np.ones(len(grid)))
        self._pass = None if make_pass is None else make_pass(self._state)

    @property
    def state(self) -> DynamicsState:
        return self._state if self._pass is None else self._pass.read()

    def wait(self) -> None:
        """Wait until the GPU has finished the frame, and its guides are read back."""
        if self._pass is not None:
            self._pass.read()

    def advancing_groom(
        self, number: int, target: np.ndarray, duration: float, neighbours: frozenset[int]
    ) -> AdvancingGroom:
        style = NeighbourStyle(partial(getattr, self, "style"), self.hair, self.grid)
        motion = LinearMotion(self.style, partial(np.asarray, target))
        frame_steps = (
            None if self.settings is None else self._steps(self.settings, target, duration)
        )
        return AdvancingGroom(number, style, motion, frame_steps, neighbours, self.known)

    def _steps(
        self, settings: DynamicsSettings, target: np.ndarray, duration: float
    ) -> FrameSteps[None]:
        drive = Drive(self.style, target, (), self.gravity)
        if self._pass is None:
            self._state = yield from advance_in_steps(self._state, drive, settings, duration)
        else:
            yield from self._pass.steps(drive, settings, duration)


def play_frame(
    grooms: Sequence[Groom],
    targets: Sequence[np.ndarray],
    duration: float,
    neighbours: Sequence[frozenset[int]] | None = None,
) -> None:
    """Simulate a frame, in which the grooms' styles move to these targets.

    Args:
        neighbours: for each groom, the numbers of the grooms that it feels; None: all others.
    """
    numbers = frozenset(range(len(grooms)))
    neighbours = neighbours or [numbers - {number} for number in numbers]
    advancing = [
        groom.advancing_groom(number, target, duration, neighbours[number])
        for number, (groom, target) in enumerate(zip(grooms, targets, strict=True))
    ]
    advance_together(advancing)
    for groom, groom_step, target in zip(grooms, advancing, targets, strict=True):
        if groom_step.error is not None:
            raise groom_step.error
        groom.known, groom.style = groom_step.known, target
