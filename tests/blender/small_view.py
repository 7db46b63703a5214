"""A small 3D view without a window, which the overlay draws into."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import gpu
import numpy as np

from hairloom.addon.blender.viewport import overlay
from hairloom.addon.render.accumulation import Target
from hairloom.addon.render.camera import Camera
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.textures import texture_to_array

SIZE, ADDRESS = 64, 7
TRANSPARENT = (0.0, 0.0, 0.0, 0.0)


class SmallView:
    """A 3D view of SIZE pixels of the current scene, with the context that Blender passes to draw
    handlers.

    depth: the value that Blender leaves in the depth buffer.
    """

    def __init__(self, camera: Camera) -> None:
        spaces = (
            area.spaces.active
            for screen in bpy.data.screens
            for area in screen.areas
            if area.type == "VIEW_3D"
        )
        self.space = next(spaces)
        self.space.shading.type = "MATERIAL"
        self.space.shading.use_scene_lights = self.space.shading.use_scene_world = True
        bpy.context.scene.view_settings.view_transform = "Standard"
        region_data = SimpleNamespace(
            as_pointer=lambda: ADDRESS,
            view_matrix=camera.view,
            window_matrix=camera.projection,
            use_clip_planes=False,
        )
        self.context = SimpleNamespace(
            scene=bpy.context.scene,
            view_layer=bpy.context.view_layer,
            space_data=self.space,
            region_data=region_data,
            mode="OBJECT",
        )
        self.target, self.depth = Target(), 1.0

    def shows(self, **grooms: Snapshot | None) -> np.ndarray:
        """The picture of these grooms, (SIZE, SIZE, 4). None hides a groom."""
        numbers = {name: number for number, name in enumerate(sorted(grooms), start=1)}
        for uid in set(overlay._overlay.drawn) - set(numbers.values()):
            overlay.stop_drawing(uid)
        for name, groom in grooms.items():
            if groom is None:
                overlay.hide(numbers[name])
            else:
                known = overlay.drawing_of(numbers[name])
                if known is None or known.snapshot is not groom or not known.is_visible:
                    overlay.show(numbers[name], overlay.GroomDrawing(groom))
        return self.drawn()

    def drawn(self) -> np.ndarray:
        self.target.sized(SIZE, SIZE).clear(TRANSPARENT)
        with self.target.drawing():
            gpu.state.active_framebuffer_get().clear(depth=self.depth)
            overlay._draw_strands(self.context)
        return texture_to_array(self.target.color)
