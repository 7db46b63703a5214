"""Solvers move the hair of one groom from frame to frame: with numpy, or with compute shaders.

Both give the same motion within rounding. On the GPU, guides stay there from simulation to drawing:
only the head's vertices are uploaded, and results are read back only on request.
"""

from __future__ import annotations

from functools import cache
from typing import Protocol

import gpu
import numpy as np

from ... import rig_flow
from ...arrays import Floats
from ...dynamics.colliders import PosedCollider
from ...dynamics.neighbours import FrameSteps, run_alone
from ...dynamics.painted import PaintedGuides
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...groom.settings import GuideSettings
from ...motion_flow import FrameInput, Motion
from ...refine.lead_out import NO_LED_OUT, LedOut
from ...render.ride_pass import RideTexels
from ...render.snapshot import Snapshot
from ...rig_flow import Pose, Rig
from ...strands import StrandSet
from ..base.gpu_context import gpu_info
from .compute_solver import ComputeSolver
from .numpy_solver import NumpySolver

#: Greatest distance [m] between the results of both solvers after the test frame.
_MAX_DIFFERENCE = 1.0e-4
#: Blender's identifiers of GPU backends -> their usual names
_BACKENDS = {"OPENGL": "OpenGL", "VULKAN": "Vulkan", "METAL": "Metal"}


class Solver(Protocol):
    """Moves one groom. A new solver has its hair at rest, in the pose of the rig.

    device: "numpy" or "compute".
    """

    device: str

    @property
    def pose(self) -> Pose:
        """The pose of the body as it is shown."""

    @property
    def motion(self) -> Motion:
        """Everything that another solver needs to go on from here; read back if need be."""

    @property
    def size(self) -> float:
        """The median length of the guides when the motion began [m]."""

    def rest(self, pose: Pose, known: Motion | None = None) -> None:
        """Put hair into its style, carried by the body, without velocity.

        Args:
            known: the motion at rest in this pose, if it has been found already.
        """

    def find_clearance(
        self,
        colliders: tuple[PosedCollider, ...],
        settings: DynamicsSettings,
        painted: PaintedGuides | None = None,
    ) -> None:
        """Find how far hair stays from colliders, see `motion_flow.with_clearance`. Without this
        call, `steps` does so."""

    def steps(self, frame: FrameInput) -> FrameSteps[None]:
        """One frame of motion, as `motion_flow.steps`."""

    def take_style(self, rig: Rig) -> None:
        """Use this rig from the next frame on: the same groom with curves of other shapes, see
        `motion_flow.with_style`."""

    def has_jumped(self, pose: Pose, settings: DynamicsSettings, duration: float) -> bool:
        """Whether the head has moved suddenly, as at a cut, see `motion_flow.has_jumped`."""

    def advance_rigidly(self, frame: FrameInput) -> None:
        """A frame in which hair moves rigidly with its roots, see `motion_flow.advance_rigidly`."""

    def show_baked(self, pose: Pose, guides: Floats, led: LedOut = NO_LED_OUT) -> None:
        """Show guides of a bake, (guide_count, cv_count, 3) [m, world], and its strands that were
        led out of colliders.

        Advancing from them starts without velocity.

        Raises:
            HairloomError: guides of another shape.
        """

    def guides(self) -> Floats:
        """Guides at frame's end, (guide_count, cv_count, 3) [m, world]; read back if need be."""

    def strands(self) -> Floats:
        """Strands at frame's end, (point_count, 3) [m, world]; read back if need be."""

    def led_out_strands(self) -> LedOut:
        """The strands that were led out of colliders; read back if need be."""

    def with_strands(self, snapshot: Snapshot) -> Snapshot:
        """The snapshot with the present strands, as an array or as a texture on the GPU."""


def make_solver(
    rig: Rig, device: str, motion: Motion | None = None, texels: RideTexels | None = None
) -> Solver:
    """A solver for this groom.

    Args:
        device: "numpy", "compute", or "automatic": compute if it works, else numpy.
        motion: motion to go on from, of a solver for the same rig; None: start at rest.
        texels: see `texels_of`, if they are made already.

    Raises:
        HairloomError: the device is "compute", and that does not work.
    """
    if device == "numpy" or (device == "automatic" and not can_compute()):
        return NumpySolver(rig, motion)
    if not can_compute():
        raise HairloomError(
            f"the GPU cannot compute here ({compute_problem()})",
            place=DynamicsSettings.title,
            remedy="Set Device to Automatic",
        )
    return ComputeSolver(rig, motion, texels)


def resolved_device(device: str) -> str:
    """The device that `make_solver` chooses: "numpy" or "compute"."""
    if device == "automatic":
        return "compute" if can_compute() else "numpy"
    return device


def device_name(device: str) -> str:
    """The name of a device: "CPU (numpy)", or such as "GPU (OpenGL, llvmpipe)"."""
    if device == "numpy":
        return "CPU (numpy)"
    used = gpu_info()
    backend = _BACKENDS.get(used["backend"], used["backend"])
    return f"GPU ({backend}, {used['renderer'].partition(' (')[0]})"


def can_compute() -> bool:
    """Whether the GPU can simulate at the moment; the first call with a GPU runs a test."""
    return not compute_problem()


def compute_problem() -> str:
    """Why the GPU cannot simulate here; empty if it can.

    Blender in background mode has no GPU until gpu.init(), so its presence is checked in each call;
    the GPU itself is tested once.
    """
    try:
        gpu.platform.backend_type_get()
    except SystemError:
        return "Blender runs without a GPU"
    return _test_frame_error()


@cache
def _test_frame_error() -> str:
    """The error of a test frame on the GPU, compared with numpy; empty if they agree."""
    along = np.linspace(0.0, 0.2, 6)
    points = np.zeros((3, len(along), 3))
    points[..., 0], points[:, 0, 1] = along, (0.0, 0.1, 0.2)
    points[:, 1:, 1] = points[:, :1, 1]
    strands = StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(4) * len(along),
        radius=np.full(3 * len(along), 4.0e-5),
        group=np.zeros(3, np.int32),
    )
    rig = rig_flow.prepare(strands, None, GuideSettings(), place="a few strands")
    moved = np.eye(4)
    moved[:3, 3] = 0.01
    frame = FrameInput(Pose(None, moved), (), DynamicsSettings(), np.array([0, 0, -9.81]), 0.04)
    ends = []
    try:
        for solver in (NumpySolver(rig), ComputeSolver(rig)):
            run_alone(solver.steps(frame))
            ends.append(solver.strands())
    except Exception as error:  # a driver may fail at any point, each with an error of its own
        return f"{type(error).__name__}: {error}"
    apart = float(np.abs(ends[1] - ends[0]).max())
    return "" if apart <= _MAX_DIFFERENCE else f"it is {apart:.2g} m off after one frame"
