"""Depths of meshes in a viewport whose depth buffer Blender leaves empty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gpu

from ..strands import Surface
from .camera import Camera
from .caster_batch import caster_batch
from .mesh_places import place_recipe
from .shader_program import program, released_with_shaders
from .textures import UniformBlock, drawing_state
from .view_block import view_values


class OwnDepth:
    """The meshes of the last draw on the GPU. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._view = UniformBlock()
        self._batches: list[tuple[Surface, Any]] = []

    def draw(self, meshes: Sequence[Surface], camera: Camera, width: int, height: int) -> None:
        """Replace all depths in the bound framebuffer by those of these meshes, world space.

        Raises:
            ShaderError: the shader does not compile here.
        """
        kept = {id(mesh): batch for mesh, batch in self._batches}
        self._batches = [
            (mesh, kept[id(mesh)] if id(mesh) in kept else caster_batch(mesh))
            for mesh in meshes
            if len(mesh.triangles)
        ]
        gpu.state.active_framebuffer_get().clear(depth=1.0)
        shader = program(place_recipe(has_alpha=False, has_pictures=False, has_vertex_values=False))
        view = self._view.holding(view_values(camera, width, height))
        with drawing_state():
            gpu.state.color_mask_set(False, False, False, False)
            for _, batch in self._batches:
                shader.bind(blocks={"view": view}, numbers={"mesh_number": 0.0})
                batch.draw(shader.shader)
