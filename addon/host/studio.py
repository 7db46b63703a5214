"""The studio of the command line: a groom on its head under three lights, before one camera."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import bpy
import gpu
import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..pipeline import Pose, Rig
from ..refine.settings import DetailSettings
from ..render.camera import Camera, frame_camera
from ..render.card_pass import CardPass
from ..render.card_snapshot import CardSnapshot
from ..render.frame import render_image
from ..render.mesh_pass import MeshPass
from ..render.snapshot import MeshSnapshot, Snapshot
from ..render.strand_pass import Statistics, StrandPass
from ..shading.lights import three_point_lights
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.volume.settings import VolumeSettings
from ..strands import Surface
from .hiders import Hiders
from .shown import snapshot_of

#: three-quarter view from the front; heads face -Y
VIEW_DIRECTION = (-0.55, -1.0, 0.18)
FIELD_OF_VIEW = np.radians(30.0)
#: how far around the groom its head is shown, as a share of the groom's size
HEAD_ROOM = 0.25
#: below 1, because nothing fills the corners of the box that the camera holds
MARGIN = 0.85
BACKDROP = (0.045, 0.05, 0.058, 1.0)


@dataclass(frozen=True)
class Look:
    """How strands are drawn. debug_view: what they are coloured by, see render.snapshot."""

    shading: ShadingSettings
    strands: StrandSettings
    detail: DetailSettings
    debug_view: str = "none"
    volume: VolumeSettings = field(default_factory=VolumeSettings)


class Studio:
    """Draws moments of one groom, always with the same framing, so that pictures compare.

    Args:
        occlusion: (strand_count, cv_count) in [0, 1], at rest.
        head_occlusion: (vertex_count,) in [0, 1], at rest; None without a head.
    """

    def __init__(
        self,
        rig: Rig,
        occlusion: Floats,
        head_occlusion: Floats | None,
        look: Look,
    ) -> None:
        ensure_gpu()
        self._rig, self._head_occlusion = rig, head_occlusion
        self._passes, self._card_pass = (MeshPass(), StrandPass()), CardPass()
        self._hiders = None if rig.head is None else Hiders(rig.head, rig.strands.roots)
        self._at_rest = replace(
            snapshot_of(rig, occlusion, pipeline.strand_ranks(rig)),
            shading=look.shading,
            strand_settings=look.strands,
            detail=look.detail,
            volume=look.volume,
            debug_view=look.debug_view,
        )

    def picture(
        self,
        pose: Pose,
        points: Floats,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
    ) -> Floats:
        """Hair at these points on the head in this pose, (height, width, 4) scene-linear.

        Args:
            points: (strand_count, cv_count, 3) [m], world space.
            samples: sub-pixels along each side of a pixel.
            camera: in place of the studio's own.
        """
        camera = camera or self._camera(width / height)
        snapshot = replace(
            self._at_rest,
            strands=points,
            meshes=self._meshes(pose),
            lights=three_point_lights(camera.view),
            hiders=None if self._hiders is None else self._hiders.at(pose),
        )
        return render_image(
            snapshot, camera, width, height, samples, background=BACKDROP, passes=self._passes
        )

    def card_picture(
        self,
        cards: CardSnapshot,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
    ) -> Floats:
        """These cards in place of the strands at rest; arguments as in `picture`."""
        camera = camera or self._camera(width / height)
        cv_count = self._at_rest.cv_count
        snapshot = Snapshot(
            strands=np.zeros((0, cv_count, 3), np.float32),
            radius=np.zeros((0, cv_count), np.float32),
            meshes=self._meshes(self._rig.rest_pose),
            lights=three_point_lights(camera.view),
            shading=self._at_rest.shading,
            cards=cards,
        )
        return render_image(
            snapshot,
            camera,
            width,
            height,
            samples,
            background=BACKDROP,
            passes=self._passes,
            card_pass=self._card_pass,
        )

    @property
    def statistics(self) -> Statistics:
        """What was drawn of the hair in the last picture."""
        return self._passes[1].statistics

    def _camera(self, aspect: float) -> Camera:
        """Holds the groom at rest and what of the head is near it, with room for the motion."""
        low, high = self._rig.strands.bounds()
        if self._rig.head is not None:
            room = HEAD_ROOM * float(np.max(high - low))
            head_low, head_high = self._rig.head.bounds()
            low = np.minimum(low, np.maximum(head_low, low - room))
            high = np.maximum(high, np.minimum(head_high, high + room))
        return frame_camera((low, high), VIEW_DIRECTION, FIELD_OF_VIEW, aspect, margin=MARGIN)

    def _meshes(self, pose: Pose) -> tuple[MeshSnapshot, ...]:
        if self._rig.head is None or pose.head_positions is None:
            return ()
        surface = Surface(pose.head_positions, self._rig.head.triangles)
        return (MeshSnapshot.of(surface, occlusion=self._head_occlusion),)


def ensure_gpu() -> None:
    """A GPU context in background mode, where Blender makes one only when asked."""
    if bpy.app.background:
        gpu.init()


def gpu_in_use() -> dict[str, str]:
    """Backend, renderer and driver; empty strings where this process has no GPU context."""
    try:
        return {
            "backend": gpu.platform.backend_type_get(),
            "renderer": gpu.platform.renderer_get(),
            "driver": gpu.platform.version_get(),
        }
    except SystemError:  # what gpu raises where no context was ever made
        return {"backend": "", "renderer": "", "driver": ""}
