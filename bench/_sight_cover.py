"""Whether hair covers the body that it grows on, from six sides.

The groom's outline is where its own curves, without children, would be opaque if they were widened
until neighbours touch, eroded by half the added width. Within it the fraction of pixels is counted
through which less than a twentieth of the body is seen. The body is drawn as a holdout, so that
alpha is the hair's coverage.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from _sight_grooms import rig_of, scaled

from hairloom.addon.blender.sessions.prepared_groom import PreparedGroom
from hairloom.addon.blender.sessions.snapshots import snapshot_of
from hairloom.addon.groom.widths import with_widths
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0.01, 1), (0, 0.01, -1))
SIZE, SAMPLES = 400, 3
#: visible fraction of the body in a pixel, above which the body shows
SHOWS_THROUGH = 0.05


def cover(pair, name: str, factor: float = 1.0) -> float:
    """The fraction of pixels in the outline through which no body is seen."""
    pair = scaled(pair, factor)
    rig, own = rig_of(pair, name), rig_of(pair, name, "none")
    plain, wide = _unlit(rig), _unlit(own)
    wide = replace(wide, radius=wide.radius * np.float32(_apart(own)))
    inside = covered = 0
    for side in SIDES:
        camera = frame_camera(rig.strands.bounds(), side, np.radians(30.0), 1.0)
        margin = 0.5 * (_apart(own) - 1.0) * _width(own) * _pixels_per_metre(rig, camera)
        outline = _eroded(_alpha(wide, camera) > 0.95, margin)
        shown = _body(rig, camera) * (1.0 - _alpha(plain, camera))
        inside += int(outline.sum())
        covered += int((outline & (shown < SHOWS_THROUGH)).sum())
    return covered / max(inside, 1)


def coverage(rig: Rig, camera: Camera, size: int, samples: int) -> np.ndarray:
    """Coverage of each pixel by hair that the body does not hide, (size, size)."""
    return render_image(_unlit(rig), camera, size, size, samples)[..., 3]


def _unlit(rig: Rig) -> Snapshot:
    groom = PreparedGroom(rig, AmbientSettings())
    shadows = VolumeSettings(shadows="none")
    return replace(snapshot_of(groom), lights=(), volume=shadows, meshes=_holes(rig))


def _width(rig: Rig) -> float:
    """The width of the median strand at its root [m]."""
    return 2.0 * float(np.median(rig.strands.radius[rig.strands.offsets[:-1]]))


def _apart(rig: Rig) -> float:
    """The factor by which strands would have to be wider to touch."""
    return with_widths(rig.strands, "found")[1].spacing / _width(rig)


def _pixels_per_metre(rig: Rig, camera: Camera) -> float:
    """Scale of a picture at the depth of the hair's middle."""
    low, high = rig.strands.bounds()
    away = np.linalg.norm(camera.eye[:3] - (low + high) / 2.0)
    return float(0.5 * SIZE * camera.projection[1, 1] / away)


def _eroded(mask: np.ndarray, margin: float) -> np.ndarray:
    """The mask, eroded by `margin` [pixels]."""
    reach = int(margin)
    padded = np.pad(mask, reach)
    inside = np.ones_like(mask)
    for y in range(-reach, reach + 1):
        for x in range(-reach, reach + 1):
            if x * x + y * y <= margin * margin:
                inside &= np.roll(padded, (y, x), (0, 1))[
                    reach : reach + mask.shape[0], reach : reach + mask.shape[1]
                ]
    return inside


def _holes(rig: Rig) -> tuple[MeshSnapshot, ...]:
    return () if rig.head is None else (replace(MeshSnapshot.of(rig.head), is_holdout=True),)


def _alpha(snapshot: Snapshot, camera: Camera) -> np.ndarray:
    return render_image(snapshot, camera, SIZE, SIZE, SAMPLES)[..., 3]


def _body(rig: Rig, camera: Camera) -> np.ndarray:
    """Coverage of each pixel by the body, without hair; 1 everywhere if there is no body."""
    if rig.head is None:
        return np.ones((SIZE, SIZE), np.float32)
    nothing = np.zeros((0, 2, 3), np.float32), np.zeros((0, 2), np.float32)
    body = Snapshot(*nothing, meshes=(MeshSnapshot.of(rig.head),))
    return _alpha(body, camera)
