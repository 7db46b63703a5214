"""Measures frame times on this machine: the report of `self-test --benchmark`, for anyone to send.

A ball of hair is shaken, simulated on the device that this machine uses, and drawn as in the
preview: in layers, in studio light, with shadows. Each measurement ends when the GPU has finished,
as a pixel is read back that depends on the work. Rounds that compile shaders, or that run before
an idle GPU has reached its full clock rate, do not count.
"""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import gpu
import numpy as np

from ... import rig_flow
from ...dynamics.neighbours import run_alone
from ...dynamics.settings import DynamicsSettings
from ...groom.settings import GuideSettings
from ...motion_flow import FrameInput
from ...render import gpu_objects
from ...render.accumulation import Target
from ...render.camera import Camera, frame_camera
from ...render.snapshot import Snapshot
from ...render.strand_layers import is_software
from ...render.strand_pass import StrandPass, ViewState, drawn_transparency
from ...rig_flow import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.lights import three_point_lights
from ...strands import StrandSet
from ...strands.vectors import even_directions
from ..base.gpu_context import ensure_gpu
from ..base.report import environment
from ..sessions.prepared_groom import prepare_groom
from ..sessions.snapshots import snapshot_of
from ..sessions.solvers import Solver, device_name, make_solver, resolved_device

#: version of the JSON; raise it when the meaning of a figure changes
VERSION = 2
SIZES = ((960, 540), (1920, 1080), (3840, 2160))
STRANDS, POINTS = 11_400, 16
#: most rounds, and the time [s] after which no further round begins
_MAX_ROUNDS, _MAX_SECONDS = 9, 3.0
#: time [s] that a GPU works before it is timed
_WARM_UP_SECONDS = 0.5
_DIRECTION, _FIELD_OF_VIEW = (0.0, -1.0, 0.2), 0.5
_GRAVITY, _FRAME = np.array([0.0, 0.0, -9.81]), 1.0 / 60.0


def run_benchmark(
    sizes: tuple[tuple[int, int], ...] = SIZES, strand_count: int = STRANDS
) -> dict[str, Any]:
    """All figures, as written to the JSON; takes seconds on a GPU, and minutes in software.

    Args:
        sizes: of pictures [pixels].

    Raises:
        HairloomError: there is no GPU here.
        ShaderError: the GPU cannot draw hair.
    """
    ensure_gpu()
    rig = hair_ball(strand_count)
    form = resolved_device("automatic")
    plain = snapshot_of(prepare_groom(rig, AmbientSettings(), with_occluders=False))
    bench = _Bench(rig, make_solver(rig, form), StrandPass(), Target(), plain)
    return {
        "benchmark": VERSION,
        "device": gpu.platform.renderer_get(),
        "vendor": gpu.platform.vendor_get(),
        **environment(),
        "system": platform.platform(),
        "is_software": is_software(),
        "simulated_on": device_name(form),
        "transparency": drawn_transparency(plain.strand_settings),
        "strands": strand_count,
        "points": POINTS,
        "simulation_ms": bench.time(bench.simulate),
        "maps_ms": bench.time(bench.draw_maps, bench.simulate),
        "frames": [bench.frame(*size) for size in sizes],
    }


@dataclass(eq=False)
class _Bench:
    """Hair that is shaken, and a target that it is drawn into."""

    rig: Rig
    solver: Solver
    strands: StrandPass
    target: Target
    plain: Snapshot
    frame_number: int = 0

    def __post_init__(self) -> None:
        points = self.rig.strands.points
        # computed once, as finding it over all points takes as long as the timed frame
        self._box = points.min(axis=0), points.max(axis=0)
        self._lights = three_point_lights(self.camera(1.0).view)

    def simulate(self) -> None:
        """Simulate a frame, with the strands that ride on the guides."""
        self.frame_number += 1
        moved = np.eye(4)
        moved[0, 3] = 0.02 * np.sin(0.3 * self.frame_number)
        frame = FrameInput(Pose(None, moved), (), DynamicsSettings(), _GRAVITY, _FRAME)
        run_alone(self.solver.steps(frame))
        self.shown()

    def shown(self) -> Snapshot:
        return replace(self.solver.with_strands(self.plain), lights=self._lights)

    def camera(self, aspect: float) -> Camera:
        return frame_camera(self._box, _DIRECTION, _FIELD_OF_VIEW, aspect)

    def draw_maps(self) -> None:
        self.strands.opacity(self.shown())

    def frame(self, width: int, height: int) -> dict[str, float]:
        """Times of one size: drawing alone, with hair at rest; and a playing frame in full."""
        camera = self.camera(width / height)
        main_thread_times: list[float] = []

        def draw(*, is_moving: bool) -> None:
            self.target.sized(width, height).clear((0.0, 0.0, 0.0, 0.0))
            with self.target.drawing():
                view = ViewState("benchmark", is_moving=is_moving)
                self.strands.draw(self.shown(), camera, width, height, view=view)

        def play() -> None:
            start = time.thread_time()
            self.simulate()
            draw(is_moving=True)
            main_thread_times.append(1000.0 * (time.thread_time() - start))

        at_rest = self.time(lambda: draw(is_moving=False))
        return {
            "width": width,
            "height": height,
            "at_rest_ms": at_rest,
            "frame_ms": self.time(play),
            "main_thread_ms": round(statistics.median(main_thread_times), 3),
        }

    def time(self, work: Callable[[], None], before: Callable[[], None] | None = None) -> float:
        """Median milliseconds until the GPU has finished `work`; `before` is not timed."""
        times: list[float] = []
        is_awake, begin = False, time.perf_counter()
        while not times or (
            len(times) < _MAX_ROUNDS and time.perf_counter() - begin < _MAX_SECONDS
        ):
            if before is not None:
                before()
            _finish()
            start = time.perf_counter()
            work()
            _finish()
            if is_awake:
                times.append(1000.0 * (time.perf_counter() - start))
            is_awake = is_awake or is_software() or time.perf_counter() - begin > _WARM_UP_SECONDS
        return round(statistics.median(times), 3)


def _finish() -> None:
    """Wait until the GPU has finished: it works in order, so reading back a pixel waits for all."""
    last = gpu_objects.texture((1, 1), format="R32F")
    last.clear(format="FLOAT", value=(0.0,))
    last.read()


def hair_ball(strand_count: int) -> Rig:
    """Strands of 15 cm on a ball of 10 cm radius, evenly distributed and bent downwards."""
    along = np.linspace(0.0, 1.0, POINTS)
    points = even_directions(strand_count)[:, None] * (0.1 + 0.15 * along[:, None])
    points[..., 2] -= 0.1 * along * along
    strands = StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(strand_count + 1) * POINTS,
        radius=np.full(strand_count * POINTS, 4.0e-5),
        group=np.zeros(strand_count, np.int32),
    )
    return rig_flow.prepare(strands, None, GuideSettings(), place="the benchmark")
