"""Hair's shadow on the meshes under it where Blender draws them, as in its viewport.

The meshes that throw shadows on the hair (Snapshot.casters) are drawn once more, as black that
covers the picture by as much as hair takes of its light: of each light by its map, over all light
that reaches the place. Where another mesh is nearer nothing is drawn.

Limitations: it darkens the finished picture, for which a matt grey surface stands, so that a
highlight on skin is darkened as its colour is. Two sheets of a mesh closer together than 0.05 % of
their distance to the eye are darkened twice.
"""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..shading.lights import pack_lights
from ..strands import Surface
from .camera import Camera
from .display import Display
from .marschner_textures import hair_forward
from .opacity_maps import OpacityForm, OpacityMaps
from .shader_program import ShaderRecipe, program, released_with_shaders
from .snapshot import Caster, Snapshot, surface_of
from .textures import UniformBlock, drawing_state
from .view_block import view_values

_BLOCKS = (("View", "view"), ("Lights", "lights"), ("Opacity", "opacity"))


def body_shadow_recipe(opacity: OpacityForm, *, has_display: bool) -> ShaderRecipe:
    """The program; with a display it knows how the viewport shows a colour, see display.py."""
    return ShaderRecipe(
        name=f"body_shadow_{opacity.slots}_{opacity.is_deep}{'_display' * has_display}",
        vertex="body_shadow.vert.glsl",
        fragment="body_shadow.frag.glsl",
        structs=("struct_view.glsl", "struct_lights.glsl", "struct_opacity.glsl"),
        blocks=_BLOCKS,
        textures=(
            *opacity.samplers,
            *((("FLOAT_3D", "display_table"),) if has_display else ()),
        ),
        numbers=(
            ("VEC3", "hair_forward"),
            *((("VEC4", "display_shaper"),) if has_display else ()),
        ),
        inputs=(("VEC3", "position"), ("VEC3", "normal")),
        varyings=(("smooth", "VEC3", "mesh_point"), ("smooth", "VEC3", "mesh_normal")),
        outputs=(("VEC4", "color"),),
        defines=(
            ("SHADOWS", 1),
            *opacity.defines,
            *((("DISPLAY", 1),) if has_display else ()),
        ),
    )


class BodyShadow:
    """Keeps the meshes of the last draw on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def draw(
        self,
        snapshot: Snapshot,
        maps: OpacityMaps,
        camera: Camera,
        width: int,
        height: int,
        *,
        display: Display | None = None,
    ) -> None:
        """Darken what is in the bound framebuffer, a viewport's, depth-tested against it.

        Args:
            maps: of the snapshot's hair. Others as in StrandPass.draw.

        Raises:
            ShaderError: the shader does not compile here.
        """
        self._upload(snapshot.casters)
        values = {
            "view": view_values(camera, width, height),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            "opacity": maps.values,
        }
        textures = dict(maps.textures)
        numbers: dict[str, Any] = {"hair_forward": hair_forward(snapshot)}
        if display is not None:
            textures["display_table"] = display.table.texture
            numbers["display_shaper"] = display.shaper
        shader = program(body_shadow_recipe(maps.form, has_display=display is not None))
        for _, batch in self._batches:
            with drawing_state(depth_write=False, blend="ALPHA_PREMULT"):
                shader.bind(
                    blocks={name: self._blocks[name].holding(values[name]) for name in values},
                    textures=textures,
                    numbers=numbers,
                )
                batch.draw(shader.shader)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for _, name in _BLOCKS}
        self._batches: list[tuple[Surface, Any]] = []

    def _upload(self, casters: tuple[Caster, ...]) -> None:
        kept = {id(surface): batch for surface, batch in self._batches}
        self._batches = [
            (surface, kept[id(surface)] if id(surface) in kept else _batch(surface))
            for surface in map(surface_of, casters)
            if len(surface.triangles)
        ]


def _batch(surface: Surface) -> Any:
    layout = gpu.types.GPUVertFormat()
    for name in ("position", "normal"):
        layout.attr_add(id=name, comp_type="F32", len=3, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, len(surface.positions))
    vertices.attr_fill("position", np.ascontiguousarray(surface.positions, np.float32))
    vertices.attr_fill("normal", np.ascontiguousarray(surface.vertex_normals(), np.float32))
    triangles = np.ascontiguousarray(surface.triangles, np.int32)
    indices = gpu.types.GPUIndexBuf(type="TRIS", seq=triangles)
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=indices)
