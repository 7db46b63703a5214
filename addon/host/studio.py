"""The studio of the command line: a groom on its head under three lights, before one camera."""

from __future__ import annotations

import bpy
import gpu
import numpy as np

from ..arrays import Floats
from ..pipeline import Pose, Rig
from ..render.camera import Camera, frame_camera
from ..render.frame import render_image
from ..render.mesh_pass import MeshPass
from ..render.snapshot import MeshSnapshot, Snapshot
from ..render.strand_pass import StrandPass
from ..shading.lights import three_point_lights
from ..shading.settings import ShadingSettings, StrandSettings
from ..strands import Surface

#: three-quarter view from the front; heads face -Y
VIEW_DIRECTION = (-0.55, -1.0, 0.18)
FIELD_OF_VIEW = np.radians(30.0)
#: how far around the groom its head is shown, as a share of the groom's size
HEAD_ROOM = 0.25
#: below 1, because nothing fills the corners of the box that the camera holds
MARGIN = 0.85
BACKDROP = (0.045, 0.05, 0.058, 1.0)


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
        shading: ShadingSettings,
        strands: StrandSettings,
    ) -> None:
        ensure_gpu()
        self._rig, self._occlusion, self._head_occlusion = rig, occlusion, head_occlusion
        self._shading, self._strands = shading, strands
        self._passes = MeshPass(), StrandPass()
        self._radius = rig.strands.radius.reshape(rig.strands.strand_count, -1)

    def picture(self, pose: Pose, points: Floats, width: int, height: int, samples: int) -> Floats:
        """Hair at these points on the head in this pose, (height, width, 4) scene-linear.

        Args:
            points: (strand_count, cv_count, 3) [m], world space.
            samples: sub-pixels along each side of a pixel.
        """
        camera = self._camera(width / height)
        snapshot = Snapshot(
            strands=points,
            radius=self._radius,
            occlusion=self._occlusion,
            meshes=self._meshes(pose),
            lights=three_point_lights(camera.view),
            shading=self._shading,
            strand_settings=self._strands,
        )
        return render_image(
            snapshot, camera, width, height, samples, background=BACKDROP, passes=self._passes
        )

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
