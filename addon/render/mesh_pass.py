"""Draws lit meshes, such as the head under the hair, into whatever target is bound."""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..shading.lights import pack_lights
from .camera import Camera
from .shader_program import ShaderRecipe, program, released_with_shaders
from .shader_source import output_index
from .snapshot import MeshSnapshot, Snapshot
from .textures import UniformBlock, drawing_state
from .view_block import view_values

MESH_RECIPE = ShaderRecipe(
    name="mesh",
    vertex="mesh.vert.glsl",
    fragment="mesh.frag.glsl",
    structs=("struct_view.glsl", "struct_lights.glsl"),
    blocks=(("View", "view"), ("Lights", "lights")),
    integers=("output_encoding",),
    numbers=(("VEC3", "mesh_color"), ("FLOAT", "mesh_sheen")),
    inputs=(("VEC3", "position"), ("VEC3", "normal"), ("FLOAT", "occlusion")),
    varyings=(
        ("smooth", "VEC3", "mesh_point"),
        ("smooth", "VEC3", "mesh_normal"),
        ("smooth", "FLOAT", "mesh_occlusion"),
    ),
    outputs=(("VEC4", "color"),),
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
    ) -> None:
        """Draw all meshes of the snapshot into the bound framebuffer, depth-tested.

        Arguments as in StrandPass.draw.
        """
        self._upload(snapshot.meshes)
        for mesh, batch in self._batches:
            shader = program(MESH_RECIPE)
            with drawing_state():
                shader.bind(
                    blocks={
                        "view": self._blocks["view"].holding(view_values(camera, width, height)),
                        "lights": self._blocks["lights"].holding(
                            pack_lights(snapshot.lights, snapshot.ambient)
                        ),
                    },
                    integers={"output_encoding": output_index(output)},
                    numbers={"mesh_color": mesh.color, "mesh_sheen": mesh.sheen},
                )
                batch.draw(shader.shader)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for _, name in MESH_RECIPE.blocks}
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
