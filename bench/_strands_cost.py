"""The cost of strands that turn with their guides, keep their lengths and stay out of the head.

A frame of all strands, in numpy and in compute, relative to strands that only add up the
displacements of their guides: an earlier implementation, kept here, with the same frames of roots.
Frames are those of the demo's shake, both variants in turns. Times are processor times of all
threads, so that other load counts little: of each frame the minimum over ROUNDS, then the mean over
frames. In compute, the texture of the strands is read back once, after all frames.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gpu
import numpy as np

from hairloom.addon import motion_flow
from hairloom.addon.arrays import Floats, Ints
from hairloom.addon.groom.roots import RootFrames, root_frames
from hairloom.addon.motion_flow import Motion
from hairloom.addon.render import gpu_objects
from hairloom.addon.render.ride_pass import RidePass
from hairloom.addon.render.shader_program import ShaderRecipe, program
from hairloom.addon.render.shader_source import SHADER_FOLDER
from hairloom.addon.render.strand_layout import strand_rows_size
from hairloom.addon.rig_flow import Pose, Rig

SHADERS = Path(__file__).parent / "shaders"
ROUNDS, EVERY, CHUNK = 40, 4, 512


def cost_figures(rig: Rig, motions: Sequence[Motion]) -> dict[str, float]:
    """Milliseconds per frame and ratios; strands must have as many points as guides have CVs."""
    chosen = motions[EVERY - 1 :: EVERY]
    shape = (rig.strands.strand_count, *rig.guide_grid.shape[1:])
    assert rig.strands.points.size == np.prod(shape)
    rest = RootFrames(*map(np.ascontiguousarray, vars(rig.rest_frames).values()))
    ours, peer = _least(
        lambda motion: motion_flow.strands_and_led(rig, motion),
        lambda motion: _summed(rig, rest, motion),
        [[motion] for motion in chosen],
    )
    ours_gpu, peer_gpu = _on_gpu(rig, rest, chosen)
    return {
        "numpy_ms": ours,
        "numpy_summed_ms": peer,
        "numpy_cost_ratio": ours / peer,
        "compute_ms": ours_gpu,
        "compute_summed_ms": peer_gpu,
        "compute_cost_ratio": ours_gpu / peer_gpu,
    }


def _least(
    one: Callable[[Any], object], other: Callable[[Any], object], parts: Sequence[Sequence[Any]]
) -> tuple[float, float]:
    """Processor milliseconds per frame of two variants, which do each part in turns."""
    times = np.empty((ROUNDS, len(parts), 2))
    for of_round in times:
        for of_part, part in zip(of_round, parts, strict=True):
            for form, work in enumerate((one, other)):
                begin = time.process_time()
                for frame in part:
                    work(frame)
                of_part[form] = (time.process_time() - begin) * 1000.0 / len(part)
    mean = times.min(axis=0).mean(axis=0)
    return float(mean[0]), float(mean[1])


def _summed(rig: Rig, rest: RootFrames, motion: Motion) -> Floats:
    """All strands (strand_count, cv_count, 3), moved by the displacements of their guides."""
    grid = rig.strands.points.reshape(rig.strands.strand_count, -1, 3)
    moved = _carried(rig, rest, motion.pose, slice(None), grid)
    by_roots = _carried(rig, rest, motion.pose, rig.guides, rig.guide_grid)
    width = grid.shape[1] * 3
    flat = moved.reshape(len(grid), width)
    change = (motion.guides - by_roots).astype(np.float32).reshape(len(by_roots), width)
    part = np.empty((min(CHUNK, len(flat)), width), np.float32)
    for start in range(0, len(flat), CHUNK):
        chunk = flat[start : start + CHUNK]
        taken, stop = part[: len(chunk)], start + len(chunk)
        for guide, weight in zip(
            rig.weights.guide[start:stop].T, rig.weights.weight[start:stop].T, strict=True
        ):
            np.take(change, guide, axis=0, out=taken, mode="clip")
            taken *= weight[:, None]
            chunk += taken
    return moved


def _carried(rig: Rig, rest: RootFrames, pose: Pose, chosen: Ints | slice, grid: Floats) -> Floats:
    """The strands of a grid, each carried by its root."""
    strands, head = rig.strands, rig.head
    assert head is not None and pose.head_positions is not None
    assert strands.root_triangle is not None and strands.root_barycentric is not None
    triangle, barycentric = strands.root_triangle[chosen], strands.root_barycentric[chosen]
    now = root_frames(pose.head_positions, head.triangles, triangle, barycentric)
    origin, rotation = rest.origin[chosen], rest.rotation[chosen]
    turn = (now.rotation - rotation) @ rotation.transpose(0, 2, 1)
    rounding = origin - origin.astype(np.float32)
    shift = now.origin - origin - np.einsum("sij,sj->si", turn, rounding)
    moved = (grid - origin[:, None].astype(np.float32)) @ turn.astype(np.float32).transpose(0, 2, 1)
    moved += shift.astype(np.float32)[:, None]
    moved += grid
    return np.asarray(moved, np.float32)


class _SummedPass(RidePass):
    """RidePass whose strands only add up displacements."""

    def _run_guides(self, guides_now: Any) -> None:
        count, cv_count = self._guide_grid.shape[:2]
        if "guide_motions" not in self._textures:
            size = strand_rows_size(count, cv_count)
            self._textures["guide_motions"] = gpu_objects.texture(size, format="RGBA32F")
        names = ("guide_strands", "root_motions", "guide_points")
        shader = program(
            ShaderRecipe(
                name="bench_summed_guides",
                compute="summed_guides.comp.glsl",
                textures=tuple(("FLOAT_2D", name) for name in ("guides_now", *names)),
                images=(("RGBA32F", "guide_motions"),),
                integers=("cv_count", "guide_count"),
                group_size=(8, 8),
                folders=(SHADERS, SHADER_FOLDER),
            )
        )
        shader.bind(
            textures={"guides_now": guides_now, **{name: self._textures[name] for name in names}},
            images={"guide_motions": self._textures["guide_motions"]},
            integers={"cv_count": cv_count, "guide_count": count},
        )
        gpu.compute.dispatch(shader.shader, -(-cv_count // 8), -(-count // 8), 1)
        gpu.shader.unbind()

    def _run_ride(self, turns: str, *_: Any) -> None:
        count, cv_count = self._strands.strand_count, self._guide_grid.shape[1]
        names = ("root_motions", "guide_weights", "rest_points", "guide_motions")
        shader = program(
            ShaderRecipe(
                name="bench_summed_ride",
                compute="summed_ride.comp.glsl",
                textures=tuple(("FLOAT_2D", name) for name in names),
                images=(("RGBA32F", "cv_points"),),
                integers=("cv_count", "strand_count"),
                group_size=(64, 1),
                folders=(SHADERS, SHADER_FOLDER),
            )
        )
        shader.bind(
            textures={name: self._textures[name] for name in names},
            images={"cv_points": self.points.texture},
            integers={"cv_count": cv_count, "strand_count": count},
        )
        gpu.compute.dispatch(shader.shader, -(-count // 64), 1, 1)
        gpu.shader.unbind()


def _on_gpu(rig: Rig, rest: RootFrames, motions: Sequence[Motion]) -> tuple[float, float]:
    """Milliseconds per frame in compute, of the current implementation and of the earlier one."""
    ours, peer = (
        form(rig.strands, rig.root_holds, rig.guides, rig.guide_grid, rig.riders, rig.holds)
        for form in (RidePass, _SummedPass)
    )
    ours.lead_out.set_clearance(motions[0].clearance)

    def shown(form: RidePass, frames: Sequence[Motion]) -> Floats:
        for motion in frames:
            pose, colliders = motion.pose, motion.colliders
            guides, elapsed = motion.guides, motion.duration  # as if frames were consecutive
            form.ride(pose.head_positions, pose.matrix, guides, None, colliders, elapsed=elapsed)
        return form.read()

    off = shown(peer, motions[-1:]) - _summed(rig, rest, motions[-1]).reshape(-1, 3)
    assert np.abs(off).max() < 1.0e-5, "both forms of the peer are one"
    shown(ours, motions[-1:])
    milliseconds = _least(
        lambda frames: shown(ours, frames), lambda frames: shown(peer, frames), [[motions]]
    )
    return milliseconds[0] / len(motions), milliseconds[1] / len(motions)
