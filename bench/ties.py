"""Whether hair stays in a tie: a ponytail on the built-in head, shaken for two seconds.

Of all drawn strands: how far they leave their place in the ring (at most 1 mm), and how much they
change their lengths; with the demo's shake and one of 5 Hz, at 24 frames a second, so that
half a substep is left at every other frame. The last line is one JSON object; the exit status is 1
if a limit is missed.

make bench NAME="ties --strands 8000 --pictures out"
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from _ponytail import Ponytail, ponytail
from _report import report, start

from hairloom.addon import rig_flow
from hairloom.addon.blender.colliders.fields import field_of
from hairloom.addon.blender.command_line.simulate_job import shake_matrix
from hairloom.addon.blender.sessions.compute_solver import ComputeSolver
from hairloom.addon.blender.sessions.numpy_solver import NumpySolver
from hairloom.addon.dynamics.colliders import PosedCollider
from hairloom.addon.dynamics.neighbours import run_alone
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.motion_flow import FrameInput
from hairloom.addon.strands.arc_length import strand_lengths

REFERENCE = "the ring, and lengths at rest"
MAX_LIMITS = {"tie_escape_mm": 1.0}
FPS, SECONDS = 24.0, 2.0
GRAVITY = np.array([0.0, 0.0, -9.81])


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--strands", type=int, default=8000)
    options.add_argument("--pictures", type=Path, help="folder of pictures of the shaken ponytail")
    options.add_argument("--compute", action="store_true", help="on the GPU instead of in numpy")
    arguments = options.parse_args()
    start()
    tail = ponytail(arguments.strands)
    assert tail.rig.holds is not None and tail.rig.guide_holds is not None
    found: dict[str, object] = {
        "strands": tail.rig.strands.strand_count,
        "held_strands": len(tail.rig.holds.strand),
        "guides": len(tail.rig.guides),
        "held_guides": len(tail.rig.guide_holds.strand),
        "device": "compute" if arguments.compute else "numpy",
    }
    collider = field_of(tail.bust.surface, DynamicsSettings(), place="head")
    shakes = {"shake": lambda time: shake_matrix(np.zeros(3), time), "shake_5hz": fast_shake}
    max_escape_mm = 0.0
    for name, shake in shakes.items():
        seen, shown = played(tail, shake, collider, compute=arguments.compute)
        found |= {f"{name}_{key}": value for key, value in seen.items()}
        max_escape_mm = max(max_escape_mm, seen["tie_escape_mm"])
        if arguments.pictures is not None:
            draw(tail, shown, arguments.pictures / f"ties_{name}.png")
    found["tie_escape_mm"] = max_escape_mm
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


def fast_shake(time: float) -> np.ndarray:
    """0.1 m to either side, five times a second, with a smooth start."""
    matrix = np.eye(4)
    matrix[0, 3] = 0.1 * np.sin(np.pi * min(time, 0.5)) ** 2 * np.sin(10.0 * np.pi * time)
    return matrix


def played(tail: Ponytail, shake, collider, *, compute: bool):
    """Figures of all strands, and some moments: (pose, strands)."""
    rig, settings = tail.rig, DynamicsSettings()
    solver = (ComputeSolver if compute else NumpySolver)(rig)
    offsets = rig.strands.offsets
    rest = strand_lengths(rig.strands.points, offsets)
    escapes, changes, shown, before = [], [], [], np.eye(4)
    for frame in range(1, round(SECONDS * FPS) + 1):
        matrix = shake(frame / FPS)
        posed = (PosedCollider(collider, before, matrix),)
        run_alone(solver.steps(FrameInput(tail.pose(matrix), posed, settings, GRAVITY, 1.0 / FPS)))
        before, strands = matrix, solver.strands()
        assert np.isfinite(strands).all()
        escapes.append(escape(tail, solver.pose, strands))
        changes.append(np.abs(strand_lengths(strands, offsets) / rest - 1.0))
        if frame % 4 == 0:
            shown.append((solver.pose, strands))
    gap, change = np.array(escapes), np.array(changes)
    return {
        "tie_escape_mm": round(float(gap.max()) * 1e3, 4),
        "tie_escape_p99_mm": round(float(np.quantile(gap, 0.99)) * 1e3, 4),
        "length_worst_percent": round(float(change.max()) * 100.0, 3),
        "length_p99_percent": round(float(np.quantile(change, 0.99)) * 100.0, 3),
    }, shown


def escape(tail: Ponytail, pose: rig_flow.Pose, strands: np.ndarray) -> np.ndarray:
    """How far each held strand is from its place in the ring [m]."""
    holds = tail.rig.holds
    first = holds.place.astype(int)
    part = (holds.place - first)[:, None]
    first += tail.rig.strands.offsets[holds.strand]

    def at(points: np.ndarray) -> np.ndarray:
        return points[first] * (1.0 - part) + points[first + 1] * part

    target = at(tail.rig.strands.points) @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]
    return np.linalg.norm(at(strands) - target, axis=1)


def draw(tail: Ponytail, shown: list, path: Path) -> None:
    """Draw twelve moments, from behind at an angle."""
    from hairloom.addon.blender.base import images
    from hairloom.addon.blender.pictures.studio import FIELD_OF_VIEW, Studio
    from hairloom.addon.blender.properties.groom_settings import GroomSettings
    from hairloom.addon.blender.sessions.prepared_groom import prepare_groom
    from hairloom.addon.refine.settings import DetailSettings
    from hairloom.addon.render.camera import frame_camera
    from hairloom.addon.shading.ambient_settings import AmbientSettings

    settings = GroomSettings().with_settings(DetailSettings(lod_size=0.0))
    groom = prepare_groom(tail.rig, AmbientSettings())
    studio = Studio(groom, settings, look=tail.bust.look("light"))
    rest = tail.rig.strands.points
    box = rest.min(axis=0) - 0.03, rest.max(axis=0) + 0.03
    camera = frame_camera(box, (-0.9, 0.9, 0.25), FIELD_OF_VIEW, 320 / 360)
    pictures = [studio.picture(pose, points, 320, 360, 2, camera) for pose, points in shown[:12]]
    images.write_png(path, images.contact_sheet(pictures, 4))


if __name__ == "__main__":
    sys.exit(main())
