"""Sintel's cards on a head that shakes, as joints and as motion textures.

It needs Blender, or Blender as a module, for its pictures.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from extension_loader import load_package

load_package()

from _cards_groom import SETTINGS, sintel_rig  # noqa: E402
from shaken import GRAVITY, ComputedMotion, shaken_poses  # noqa: E402

from hairloom.addon import motion_flow  # noqa: E402
from hairloom.addon.blender.base.images import read_texture  # noqa: E402
from hairloom.addon.blender.cards.motion import (  # noqa: E402
    TextureMotion,
    joint_motion_steps,
    moved_cards,
)
from hairloom.addon.card_flow import card_build_steps  # noqa: E402
from hairloom.addon.cards.export_settings import CardExportSettings  # noqa: E402
from hairloom.addon.cards.steps import result_of  # noqa: E402
from hairloom.addon.dynamics.colliders import DistanceField, PosedCollider  # noqa: E402
from hairloom.addon.dynamics.settings import DynamicsSettings  # noqa: E402
from hairloom.addon.exchange.cards.card_formats import GLB  # noqa: E402
from hairloom.addon.params import SettingsMap  # noqa: E402
from hairloom.addon.rig_flow import MotionStart, Rig, SimulatedSolids  # noqa: E402

RATE = 60.0


def motion_figures(seconds: float) -> dict[str, float]:
    """Errors in percent of the hair's mean length and in mm, counts of the skeleton, and times.

    Args:
        seconds: of motion.
    """
    rig = sintel_rig()
    motion = shaken(rig, seconds)
    cards, atlas, occlusion = SETTINGS
    # few rays, as occlusion does not affect motion
    settings = SettingsMap(cards, atlas, replace(occlusion, rays=8))
    levels = result_of(card_build_steps(rig, settings)).levels
    begin = time.perf_counter()
    moved = result_of(moved_cards(motion, levels, space="head", with_directions=True))
    ridden = time.perf_counter()
    joints = result_of(joint_motion_steps(moved.tracks, CardExportSettings(motion="joints")))
    fitted = time.perf_counter()
    length, facts = moved.tracks.hair_length, joints.sidecar_section
    figures = {
        "joint_error_percent": 100.0 * joints.relative_error,
        "joint_error_percent_99": 100.0 * joints.error.percentile_99 / length,
        "joint_error_percent_worst": 100.0 * joints.error.maximum / length,
        "chains": facts["chains"],
        "joints": facts["joints_in_chain"],
        "keys": facts["keys"],
        "motion_ride_seconds": ridden - begin,
        "joint_seconds": fitted - ridden,
    }
    texture = TextureMotion.of(moved, CardExportSettings(motion="texture"), GLB, "bench")
    with tempfile.TemporaryDirectory() as folder:
        files = texture.write(Path(folder) / "cards.glb")
        figures["vat_seconds"] = time.perf_counter() - fitted
        paths = [Path(folder) / name for name in files.values()]
        figures["vat_megabytes"] = sum(path.stat().st_size for path in paths) / 1e6
        stored = read_texture(Path(folder) / files["position"], is_color=False)
    layout = texture.layout
    texels = stored[::-1].reshape(layout.frame_count, -1, 3)[:, : layout.vertex_count]
    found = texels.transpose(1, 0, 2)
    pairs = zip(moved.tracks.moved_positions, levels, strict=True)
    offsets = np.concatenate([now - mesh.positions[:, None] for now, mesh in pairs])
    miss = np.linalg.norm(found - GLB.to_file_space(offsets), axis=-1)
    figures["vat_error_mm"] = 1000.0 * float(miss.max())
    return figures


def shaken(rig: Rig, seconds: float) -> ComputedMotion:
    """The shake, simulated by numpy; cards are led out of the head, as in a bake."""
    assert rig.head is not None
    settings = DynamicsSettings()
    collider = DistanceField.from_surface(rig.head, settings, place="Sintel")
    first, *later = shaken_poses(rig, round(seconds * RATE) + 1, RATE)
    motion = motion_flow.begin(rig, first)
    collider_at_rest = PosedCollider(collider, first.matrix, first.matrix)
    guides, posed, before, earlier = [motion.guides], [(collider_at_rest,)], first, None
    for now in later:
        posed.append((PosedCollider(collider, before.matrix, now.matrix, earlier),))
        motion = motion_flow.advance(
            rig, motion, motion_flow.FrameInput(now, posed[-1], settings, GRAVITY, 1.0 / RATE)
        )
        guides.append(motion.guides)
        earlier, before = before.matrix, now
    assert motion.clearance is not None
    start = MotionStart(first, posed[0], motion.clearance.max_distance)
    poses = [
        replace(pose, solids=SimulatedSolids(start, colliders))
        for pose, colliders in zip((first, *later), posed, strict=True)
    ]
    return ComputedMotion(rig, range(len(poses)), RATE, lambda frame: (poses[frame], guides[frame]))


if __name__ == "__main__":
    for name, value in motion_figures(2.0).items():
        print(f"{name:28} {value:,.4g}")
