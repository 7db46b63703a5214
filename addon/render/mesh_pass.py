"""Draws lit meshes, such as the head under the hair, into whatever target is bound."""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..shading.lights import pack_lights
from .camera import Camera
from .opacity_pass import OpacityForm, OpacityMaps
from .shader_program import ShaderRecipe, program, released_with_shaders
from .shader_source import output_index
from .snapshot import MeshSnapshot, Snapshot
from .textures import UniformBlock, drawing_state
from .view_block import view_values

_BLOCKS = (("View", "view"), ("Lights", "lights"))


def mesh_recipe(opacity: OpacityForm | None = None) -> ShaderRecipe:
    """The program that draws meshes; with opacity maps hair and meshes throw shadows on them."""
    return ShaderRecipe(
        name=f"mesh{f'_{opacity.slots}_{opacity.is_deep}' if opacity else ''}",
        vertex="mesh.vert.glsl",
        fragment="mesh.frag.glsl",
        structs=("struct_view.glsl", "struct_lights.glsl", "struct_opacity.glsl"),
        blocks=(*_BLOCKS, *((("Opacity", "opacity"),) if opacity else ())),
        textures=opacity.samplers if opacity else (),
        integers=("output_encoding",),
        numbers=(("VEC3", "mesh_color"), ("FLOAT", "mesh_sheen")),
        inputs=(("VEC3", "position"), ("VEC3", "normal"), ("FLOAT", "occlusion")),
        varyings=(
            ("smooth", "VEC3", "mesh_point"),
            ("smooth", "VEC3", "mesh_normal"),
            ("smooth", "FLOAT", "mesh_occlusion"),
        ),
        outputs=(("VEC4", "color"),),
        defines=(("SHADOWS", int(opacity is not None)), *(opacity.defines if opacity else ())),
    )


class MeshPass:
    """Keeps the meshes of the last snapshot on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        output: str = "scene_linear",
        opacity: OpacityMaps | None = None,
    ) -> None:
        """Draw all meshes of the snapshot into the bound framebuffer, depth-tested.

        Args:
            opacity: the hair's maps, see StrandPass.opacity. Others as in StrandPass.draw.
        """
        self._upload(snapshot.meshes)
        values = {
            "view": view_values(camera, width, height),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            **({} if opacity is None else {"opacity": opacity.values}),
        }
        shader = program(mesh_recipe(None if opacity is None else opacity.form))
        for mesh, batch in self._batches:
            with drawing_state():
                shader.bind(
                    blocks={name: self._blocks[name].holding(values[name]) for name in values},
                    textures={} if opacity is None else opacity.textures,
                    integers={"output_encoding": output_index(output)},
                    numbers={"mesh_color": mesh.color, "mesh_sheen": mesh.sheen},
                )
                batch.draw(shader.shader)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for name in ("view", "lights", "opacity")}
        self._batches: list[tuple[MeshSnapshot, Any]] = []

    def _upload(self, meshes: tuple[MeshSnapshot, ...]) -> None:
        kept = {id(mesh): batch for mesh, batch in self._batches}
        self._batches = [
            (mesh, kept[id(mesh)] if id(mesh) in kept else _batch(mesh))
            for mesh in meshes
            if len(mesh.surface.triangles)
        ]


def _batch(mesh: MeshSnapshot) -> Any:
    layout = gpu.types.GPUVertFormat()
    for name, length in (("position", 3), ("normal", 3), ("occlusion", 1)):
        layout.attr_add(id=name, comp_type="F32", len=length, fetch_mode="FLOAT")
    count = len(mesh.surface.positions)
    occlusion = np.ones(count) if mesh.occlusion is None else mesh.occlusion
    vertices = gpu.types.GPUVertBuf(layout, count)
    # attr_fill checks neither dtype nor order
    vertices.attr_fill("position", np.ascontiguousarray(mesh.surface.positions, np.float32))
    vertices.attr_fill("normal", np.ascontiguousarray(mesh.vertex_normals, np.float32))
    vertices.attr_fill("occlusion", np.ascontiguousarray(occlusion, np.float32)[:, None])
    triangles = np.ascontiguousarray(mesh.surface.triangles, np.int32)
    indices = gpu.types.GPUIndexBuf(type="TRIS", seq=triangles)
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=indices)
