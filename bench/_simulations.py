"""The two fast implementations of the step behind one interface, for benchmarks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Protocol

import gpu

from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState
from hairloom.addon.dynamics.step import advance
from hairloom.addon.render.dynamics_pass import DynamicsPass
from hairloom.addon.render.textures import texture_to_array


class Simulation(Protocol):
    """A simulation in progress."""

    def advance(self, drive: Drive, settings: DynamicsSettings, duration: float) -> None:
        """Simulate a frame, and wait until the guides are on the CPU."""

    def state(self) -> DynamicsState:
        """The state after the last frame."""

    def release(self) -> None:
        """Free its GPU resources."""


class NumpySimulation:
    def __init__(self, state: DynamicsState) -> None:
        self._state = state

    def advance(self, drive: Drive, settings: DynamicsSettings, duration: float) -> None:
        self._state = advance(self._state, drive, settings, duration)

    def state(self) -> DynamicsState:
        return self._state

    def release(self) -> None:
        """Nothing to free."""


class ComputeSimulation:
    def __init__(self, state: DynamicsState) -> None:
        self._pass = DynamicsPass(state)

    def advance(self, drive: Drive, settings: DynamicsSettings, duration: float) -> None:
        self._pass.advance(drive, settings, duration)
        texture_to_array(self._pass.guides)  # waits for the GPU, as well as copying

    def state(self) -> DynamicsState:
        return self._pass.read()

    def release(self) -> None:
        self._pass.release()


def play(
    simulation: Simulation,
    drives: Iterable[Drive],
    settings: DynamicsSettings,
    fps: float,
    watch: Callable[[DynamicsState, Drive], None] | None = None,
) -> list[float]:
    """Milliseconds of each frame; `watch` is called after each, outside the timing."""
    times = []
    for drive in drives:
        begin = time.perf_counter()
        simulation.advance(drive, settings, 1.0 / fps)
        times.append((time.perf_counter() - begin) * 1000.0)
        if watch is not None:
            watch(simulation.state(), drive)
    return times


def has_compute() -> bool:
    """Whether the GPU backend that runs here has compute shaders."""
    gpu.init()
    return bool(gpu.capabilities.compute_shader_support_get())
