"""One frame of the preview, 11,400 strands of 16 points at 960 x 720, stage by stage.

The reference draws the same strands as plain lines with the gpu module's own shader, uploaded again
each frame as a batch, as an add-on would after the module's examples. Ours draws
ribbons with width and adaptive detail, lit by three lights and with two shifted highlights.

The same frames again with guides that stay on the GPU: `gpu_simulate_ms` and `gpu_ride_ms` end when
the GPU is done, `gpu_draw_ms` neither packs nor uploads. `cpu_frame_ms` and `gpu_frame_ms` are the
sums of the three stages.

`draw_ratio` is the time of the lines over ours. Its limit is half of its value on a software driver
when it was set; times have no limits, since they depend on the machine.
"""

import statistics
import sys
import time
from collections.abc import Callable

import gpu
import numpy as np
from _report import report, start
from _suzanne import suzanne
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from shaken import GRAVITY, shaken_poses

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.blender.sessions.compute_solver import ComputeSolver
from hairloom.addon.dynamics.neighbours import run_alone
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.shading.lights import three_point_lights

STRANDS, WIDTH, HEIGHT, FRAMES = 11_400, 960, 720, 30
MIN_LIMITS = {"draw_ratio": 0.024}
WAYS = {
    "cpu": ("simulate_ms", "interpolate_ms", "draw_ms"),
    "gpu": ("gpu_simulate_ms", "gpu_ride_ms", "gpu_draw_ms"),
}


class Stopwatch:
    """Milliseconds of each stage, frame by frame."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}

    def measure[T](self, name: str, work: Callable[[], T]) -> T:
        begin = time.perf_counter()
        result = work()
        self.times.setdefault(name, []).append((time.perf_counter() - begin) * 1000.0)
        return result

    def medians(self) -> dict[str, float]:
        return {name: round(statistics.median(times[2:]), 3) for name, times in self.times.items()}


class Lines:
    """The reference: every strand as a line strip of one pixel, in one colour."""

    def __init__(self, strand_count: int, cv_count: int) -> None:
        self._shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        first = np.arange(strand_count * cv_count, dtype=np.int32).reshape(strand_count, cv_count)
        self._indices = np.stack([first[:, :-1], first[:, 1:]], axis=-1).reshape(-1, 2)

    def draw(self, points: np.ndarray) -> None:
        batch = batch_for_shader(
            self._shader, "LINES", {"pos": points.reshape(-1, 3)}, indices=self._indices
        )
        self._shader.uniform_float("color", (0.5, 0.3, 0.1, 1.0))
        batch.draw(self._shader)


def simulated(solver: ComputeSolver, pose: rig_flow.Pose) -> None:
    """Simulate a frame, and wait for its end by reading the guides back, 0.05 ms."""
    run_alone(
        solver.steps(motion_flow.FrameInput(pose, (), DynamicsSettings(), GRAVITY, 1.0 / 60.0))
    )
    solver.guides()


def ridden(solver: ComputeSolver, snapshot: Snapshot) -> Snapshot:
    """The snapshot with all strands on the GPU; reading them back, 0.1 ms, waits for the end."""
    shown = solver.with_strands(snapshot)
    assert shown.device_points is not None
    shown.device_points.texture.read()
    return shown


def main() -> int:
    start()
    head = suzanne()
    strands = grow(head, GrowSettings(strand_count=STRANDS), scalp_density(head))
    rig = rig_flow.prepare(strands, head, GuideSettings(), place="bench")
    poses = shaken_poses(rig, FRAMES, 60.0)
    motion = motion_flow.begin(rig, poses[0])
    radius = rig.strands.radius.reshape(STRANDS, -1)
    camera = frame_camera(rig.strands.bounds(), (-0.5, -1.0, 0.2), 0.5, WIDTH / HEIGHT)
    lights, ours, riding = three_point_lights(camera.view), StrandPass(), StrandPass()
    solver = ComputeSolver(rig)
    shape = rig.strands.grid.shape  # grown hair has one point count
    lines = Lines(STRANDS, shape[1])
    color = gpu.types.GPUTexture((WIDTH, HEIGHT), format="RGBA16F")
    depth = gpu.types.GPUTexture((WIDTH, HEIGHT), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    matrix = camera.projection @ camera.view

    def drawn(draw: Callable[[], None]) -> None:
        """Draws, and waits until one pixel can be read back."""
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            gpu.state.depth_test_set("LESS_EQUAL")
            gpu.matrix.load_matrix(Matrix(matrix.tolist()))
            gpu.matrix.load_projection_matrix(Matrix.Identity(4))
            draw()
            target.read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    watch = Stopwatch()
    for pose in poses[1:]:
        motion = watch.measure(
            "simulate_ms",
            lambda m=motion, p=pose: motion_flow.advance(
                rig, m, motion_flow.FrameInput(p, (), DynamicsSettings(), GRAVITY, 1.0 / 60.0)
            ),
        )
        points = watch.measure(
            "interpolate_ms", lambda m=motion: motion_flow.strands_and_led(rig, m)[0]
        )
        points = points.reshape(shape)
        snapshot = Snapshot(points=points, radius=radius, lights=lights)
        watch.measure(
            "draw_ms",
            lambda s=snapshot: drawn(lambda: ours.draw(s, camera, WIDTH, HEIGHT)),
        )
        watch.measure("lines_ms", lambda p=points: drawn(lambda: lines.draw(p)))
        watch.measure("gpu_simulate_ms", lambda p=pose: simulated(solver, p))
        snapshot = watch.measure("gpu_ride_ms", lambda s=snapshot: ridden(solver, s))
        watch.measure(
            "gpu_draw_ms",
            lambda s=snapshot: drawn(lambda: riding.draw(s, camera, WIDTH, HEIGHT)),
        )
    medians = watch.medians()
    for method, stages in WAYS.items():
        medians[f"{method}_frame_ms"] = round(sum(medians[stage] for stage in stages), 3)
    medians |= {"strands": STRANDS, "draw_ratio": medians["lines_ms"] / medians["draw_ms"]}
    reference = "LINES, builtin UNIFORM_COLOR, batch_for_shader each frame"
    return report(medians, reference, min_limits=MIN_LIMITS)


sys.exit(main())
