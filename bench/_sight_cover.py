"""Whether hair covers the body that it grows on, from six sides.

The groom's outline is where strands as wide as they are apart would hide all; in it the share of
pixels is counted through which less than a twentieth of the body is seen. The body is drawn as a
hole, so that alpha is what hair covers of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from _sight_grooms import rig_of, scaled

from hairloom.addon.blender.sessions.prepared_groom import PreparedGroom
from hairloom.addon.blender.sessions.snapshots import snapshot_of
from hairloom.addon.groom.widths import _found
from hairloom.addon.pipeline import Rig
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0.01, 1), (0, 0.01, -1))
SIZE, SAMPLES = 400, 3
#: of the body, in a pixel
SHOWS_THROUGH = 0.05


def cover(pair, name: str, factor: float = 1.0) -> float:
    """The share of pixels in the outline through which no body is seen."""
    rig = rig_of(scaled(pair, factor), name)
    groom = PreparedGroom(rig, AmbientSettings())
    plain = replace(
        snapshot_of(groom), lights=(), volume=VolumeSettings(shadows="none"), meshes=_holes(rig)
    )
    wide = replace(plain, radius=plain.radius * np.float32(_apart(rig)))
    inside = covered = 0
    for side in SIDES:
        camera = frame_camera(rig.strands.bounds(), side, np.radians(30.0), 1.0)
        outline = _alpha(wide, camera) > 0.95
        shown = _body(rig, camera) * (1.0 - _alpha(plain, camera))
        inside += int(outline.sum())
        covered += int((outline & (shown < SHOWS_THROUGH)).sum())
    return covered / max(inside, 1)


def _apart(rig: Rig) -> float:
    """How many times as wide strands would be, if they touched."""
    width = 2.0 * float(np.median(rig.strands.radius[rig.strands.offsets[:-1]]))
    return _found(rig.strands).spacing / width


def _holes(rig: Rig) -> tuple[MeshSnapshot, ...]:
    return () if rig.head is None else (replace(MeshSnapshot.of(rig.head), is_holdout=True),)


def _alpha(snapshot: Snapshot, camera: Camera) -> np.ndarray:
    return render_image(snapshot, camera, SIZE, SIZE, SAMPLES)[..., 3]


def _body(rig: Rig, camera: Camera) -> np.ndarray:
    """What of each pixel the body would fill; without one, all that hair is drawn before."""
    if rig.head is None:
        return np.ones((SIZE, SIZE), np.float32)
    nothing = np.zeros((0, 2, 3), np.float32), np.zeros((0, 2), np.float32)
    body = Snapshot(*nothing, meshes=(MeshSnapshot.of(rig.head),))
    return _alpha(body, camera)
