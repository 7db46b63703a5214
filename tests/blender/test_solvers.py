"""The two solvers: numpy against `motion_flow`, compute against numpy, and changing solvers."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from typing import Any

import bpy
import numpy as np
import pytest
from extension_loader import REPOSITORY
from shaken import GRAVITY, shaken_poses
from tiers import few_in_commits

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.sessions import solvers
from hairloom.addon.blender.sessions.compute_solver import ComputeSolver
from hairloom.addon.blender.sessions.numpy_solver import NumpySolver
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.measure import length_changes
from hairloom.addon.dynamics.neighbours import run_alone
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.motion_flow import FrameInput, Motion
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.draws(light=False)

RATE = 30.0
#: With local shape, a few guides in a hundred are so ill-conditioned that even numpy differs from
#: itself by centimetres when it starts one rounding error apart. Without it, rounding grows to 0.1
#: mm.
SETTINGS = DynamicsSettings(bend=0.0)


@pytest.fixture(scope="module")
def rig() -> Rig:
    head = built_in_head().surface
    strands = grow(head, GrowSettings(strand_count=300), scalp_density(head))
    return rig_flow.prepare(strands, head, GuideSettings(), place="test")


@pytest.fixture(scope="module")
def poses(rig: Rig) -> list[Pose]:
    return shaken_poses(rig, 31, RATE)


def advance(solver: Any, poses: list[Pose], settings: DynamicsSettings = SETTINGS) -> None:
    for pose in poses:
        run_alone(solver.steps(FrameInput(pose, (), settings, GRAVITY, 1.0 / RATE)))


def agree(found: np.ndarray, expected: np.ndarray, quantile: float = 1.0) -> bool:
    """Whether the median difference of strands is below 5 micrometres, and that of this fraction of
    them below half a millimetre."""
    apart = np.abs(found - expected).reshape(-1, 16 * 3).max(axis=1)
    return bool(np.median(apart) < 5.0e-6 and np.quantile(apart, quantile) < 5.0e-4)


def test_the_numpy_solver_equals_the_pipeline(rig: Rig, poses: list[Pose]) -> None:
    solver = solvers.make_solver(rig, "numpy")
    assert solver.device == "numpy"
    assert np.array_equal(solver.strands(), rig.strands.points)
    motion = motion_flow.begin(rig, rig.rest_pose)
    for pose in poses[1:6]:
        motion = motion_flow.advance(
            rig, motion, FrameInput(pose, (), SETTINGS, GRAVITY, 1.0 / RATE)
        )
    advance(solver, poses[1:6])
    assert solver.pose is poses[5]
    assert np.array_equal(solver.guides(), motion.guides)
    assert np.array_equal(solver.strands(), motion_flow.strands_and_led(rig, motion)[0])
    solver.rest(poses[3])
    assert np.array_equal(solver.strands(), motion_flow.carried_strands(rig, poses[3]))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize(
    ("settings", "share"),
    few_in_commits(
        [
            pytest.param(SETTINGS, 1.0),
            pytest.param(DynamicsSettings(), 0.9),
            pytest.param(replace(SETTINGS, length_solver="relaxation"), 1.0),
        ],
        2,
    ),
)
def test_both_agree_on_a_shaken_head(
    rig: Rig, poses: list[Pose], settings: DynamicsSettings, share: float
) -> None:
    """A second of shaking. `share` is the fraction of strands that have to agree."""
    both = numpy, compute = NumpySolver(rig), ComputeSolver(rig)
    for solver in both:
        advance(solver, poses[1:], settings)
    assert np.abs(numpy.guides() - motion_flow.carried_guides(rig, poses[-1])).max() > 0.01
    assert agree(compute.guides(), numpy.guides(), share)
    assert agree(compute.strands(), numpy.strands(), share)
    for solver in both:
        solver.rest(poses[10])
    assert np.abs(compute.strands() - numpy.strands()).max() < 1.0e-6
    assert np.abs(compute.guides() - numpy.guides()).max() < 1.0e-6


@pytest.mark.slow(instead="test_both_agree_on_a_shaken_head")
@pytest.mark.usefixtures("gpu_context")
def test_coils_bounce_alike_and_keep_their_lengths() -> None:
    """A row of coils, whose upper ends swing up and down and are then held still."""
    along, roots = np.linspace(0.0, 1.0, 200), np.arange(24)[:, None] * [0.02, 0.0, 0.0]
    angle = 2.0 * np.pi * 12.0 * along
    around = 0.006 * np.minimum(1.0, 20.0 * along)
    coil = np.stack([around * np.cos(angle), around * np.sin(angle), -0.2 * along], axis=1)
    points, offsets = (roots[:, None] + coil).reshape(-1, 3), np.arange(25) * 200
    strands = StrandSet(points, offsets, np.full(len(points), 5e-5), np.zeros(24))
    coils = rig_flow.prepare(strands, None, GuideSettings(guide_count=8), place="coils")
    offsets, length = coils.strands.offsets, coils.strands.lengths()

    def pose(frame: int) -> Pose:
        matrix = np.eye(4)
        matrix[2, 3] = 0.05 * np.sin(4.0 * np.pi * min(frame, 30) / RATE)
        return Pose(None, matrix)

    both = numpy, compute = NumpySolver(coils), ComputeSolver(coils)
    heights = []
    for frame in range(1, 90):
        for solver in both:
            run_alone(
                solver.steps(FrameInput(pose(frame), (), DynamicsSettings(), GRAVITY, 1.0 / RATE))
            )
        found = numpy.strands()
        heights.append(float(np.ptp(found[: offsets[1], 2])))
        if frame % 10 == 0:
            assert np.abs(compute.strands() - found).max() < 5.0e-4
            assert length_changes(found, offsets, length).max() < 1.0e-5
    assert max(heights) > 1.1 * 0.2 and min(heights) < 0.95 * 0.2
    assert heights[-1] == pytest.approx(0.2, rel=0.02)


@pytest.mark.usefixtures("gpu_context")
def test_strands_that_are_led_out_do_not_depend_on_who_looks(rig: Rig, poses: list[Pose]) -> None:
    """Led strands continue from the frame before, whether they are read or not, until a rest."""
    low, high = rig.head.bounds()
    ball = SphereCollider(tuple((low + high) / 2.0), 0.55 * float(np.max(high - low)))

    def play(solver: Any, *, looks: bool, known: Motion | None = None) -> np.ndarray:
        solver.rest(rig.rest_pose, known)
        for before, now in pairwise(poses[:8]):
            posed = (PosedCollider(ball, before.matrix, now.matrix),)
            run_alone(solver.steps(FrameInput(now, posed, SETTINGS, GRAVITY, 1.0 / RATE)))
            if looks:
                solver.strands()
        return solver.strands()

    for form in (NumpySolver, ComputeSolver):
        solver = form(rig)
        seen = play(solver, looks=True)
        assert len(solver.led_out_strands().strands) > 10
        np.testing.assert_array_equal(play(solver, looks=False), seen)
        np.testing.assert_array_equal(play(form(rig), looks=False), seen)
        standing = (PosedCollider(ball, poses[0].matrix, poses[0].matrix),)
        begun = motion_flow.begin(rig, rig.rest_pose)
        known = motion_flow.with_clearance(rig, begun, standing, SETTINGS)
        for looks in (True, False):
            found = play(solver, looks=looks, known=known)
            np.testing.assert_array_equal(found, seen, "how far they stay was known before")


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("forms", [("numpy", "compute"), ("compute", "numpy")])
def test_switching_the_solver_continues_the_motion(
    rig: Rig, poses: list[Pose], forms: tuple[str, str]
) -> None:
    whole = NumpySolver(rig)
    advance(whole, poses[1:21])
    first = solvers.make_solver(rig, forms[0])
    advance(first, poses[1:11])
    second = solvers.make_solver(rig, forms[1], first.motion)
    assert (first.device, second.device) == forms
    assert np.abs(second.strands() - first.strands()).max() < 1.0e-6
    advance(second, poses[11:21])
    assert agree(second.strands(), whole.strands())


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("form", ["numpy", "compute"])
def test_baked_guides_are_shown_and_let_go(rig: Rig, poses: list[Pose], form: str) -> None:
    source = NumpySolver(rig)
    advance(source, poses[1:9])
    baked, pose = source.guides(), poses[8]
    solver = solvers.make_solver(rig, form)
    advance(solver, poses[1:3])
    solver.show_baked(pose, baked)
    assert solver.pose is pose
    assert np.array_equal(solver.guides(), baked)
    assert np.abs(solver.strands() - source.strands()).max() < 1.0e-6
    run_alone(solver.steps(FrameInput(pose, (), SETTINGS, np.zeros(3), 1.0 / RATE)))
    kept = np.abs(solver.guides() - baked).max()
    assert 0.0 < kept < 0.05, "they go towards their style, at first at no speed"
    with pytest.raises(HairloomError, match="Bake again"):
        solver.show_baked(pose, baked[:, :5])


@pytest.mark.usefixtures("gpu_context")
def test_snapshots_hold_an_array_or_what_lies_on_the_gpu(rig: Rig, poses: list[Pose]) -> None:
    radius = rig.strands.radius.reshape(rig.strands.strand_count, -1)
    snapshot = Snapshot(rig.strands.grid, radius)
    numpy, compute = NumpySolver(rig), ComputeSolver(rig)
    on_gpu = compute.with_strands(snapshot)
    assert on_gpu.device_points is not None and on_gpu.points is snapshot.points
    assert np.array_equal(compute.strands(), rig.strands.points)
    for solver in (numpy, compute):
        advance(solver, poses[1:5])
    on_cpu = numpy.with_strands(compute.with_strands(snapshot))
    assert on_cpu.device_points is None and np.shares_memory(on_cpu.points, numpy.strands())
    assert compute.with_strands(snapshot).center == pytest.approx(on_cpu.center, abs=1.0e-4)
    points = compute.with_strands(snapshot).device_points
    pixels = np.array(points.texture.read()).reshape(rig.strands.strand_count, -1, 4)
    assert agree(pixels[..., :3].reshape(-1, 3), numpy.strands())


@pytest.mark.usefixtures("gpu_context")
def test_released_buffers_are_restored(rig: Rig, poses: list[Pose]) -> None:
    from hairloom.addon.render import shader_program

    solver, expected = ComputeSolver(rig), NumpySolver(rig)
    advance(expected, poses[1:7])
    advance(solver, poses[1:4])
    before = solver.strands()
    solver.release()
    assert np.array_equal(solver.strands(), before)
    advance(solver, poses[4:7])
    assert agree(solver.strands(), expected.strands())
    solver.rest(poses[4])
    at_rest = solver.strands()
    shader_program.release()
    assert np.array_equal(solver.strands(), at_rest)


@pytest.mark.usefixtures("gpu_context")
def test_automatic_takes_the_gpu(rig: Rig) -> None:
    assert solvers.compute_problem() == ""
    assert (
        solvers.resolved_device("automatic")
        == "compute"
        == solvers.make_solver(rig, "automatic").device
    )
    assert solvers.resolved_device("numpy") == "numpy"


@pytest.mark.skipif(not bpy.app.module, reason="it needs Blender as a module, to start another")
def test_automatic_takes_numpy_without_a_gpu() -> None:
    """In a separate Blender, since a GPU that is once initialised stays."""
    script = (
        "import sys, bpy, numpy\n"
        f"sys.path.insert(0, {str(REPOSITORY / 'tools')!r})\n"
        "from extension_loader import load_package\n"
        "load_package()\n"
        "from hairloom.addon import rig_flow\n"
        "from hairloom.addon.errors import HairloomError\n"
        "from hairloom.addon.groom.settings import GuideSettings\n"
        "from hairloom.addon.blender.sessions import solvers\n"
        "from hairloom.addon.strands import StrandSet\n"
        "points = numpy.linspace((0, 0, 0), (0, 0, 1), 6)\n"
        "strands = StrandSet(points, numpy.array([0, 6]), numpy.full(6, 1e-4), numpy.zeros(1))\n"
        "rig = rig_flow.prepare(strands, None, GuideSettings(), place='test')\n"
        "assert not solvers.can_compute()\n"
        "assert solvers.make_solver(rig, 'automatic').device == 'numpy'\n"
        "try:\n"
        "    solvers.make_solver(rig, 'compute')\n"
        "except HairloomError as error:\n"
        "    assert 'without a GPU' in str(error), error\n"
        "else:\n"
        "    raise SystemExit('no error')\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
