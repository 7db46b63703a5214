"""Draws positions and numbers of the nearest meshes, for masks and for look-ups at these places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..arrays import Floats
from .camera import Camera
from .caster_batch import alpha_picture, caster_batch
from .mesh_pictures import PictureTextures
from .shader_program import ShaderRecipe, program, released_with_shaders
from .snapshot import MeshSnapshot
from .textures import UniformBlock, drawing_state
from .view_block import view_values

#: pattern of a mesh that is discarded where alpha is at most a half, see mesh_place.frag.glsl
FIXED_CUT = (-1.0, -1.0)


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A mesh to draw.

    number: written for its pixels. hash_shifts: shifts of its pattern, see hashed_alpha.shifts.
    vertex_values: (vertex_count, 3), written instead of the positions; None: positions.
    """

    mesh: MeshSnapshot
    number: float
    hash_shifts: tuple[float, float] = FIXED_CUT
    vertex_values: Floats | None = None


def place_recipe(*, has_alpha: bool, has_pictures: bool, has_vertex_values: bool) -> ShaderRecipe:
    """The program of meshes with or without holes."""
    parts = "_alpha" * has_alpha, "_pictures" * has_pictures, "_values" * has_vertex_values
    return ShaderRecipe(
        name=f"mesh_place{''.join(parts)}",
        vertex="mesh_place.vert.glsl",
        fragment="mesh_place.frag.glsl",
        structs=("struct_view.glsl",),
        blocks=(("View", "view"),),
        textures=(("FLOAT_2D", "mesh_color_map"),) if has_pictures else (),
        numbers=(
            ("FLOAT", "mesh_number"),
            *((("FLOAT", "mesh_alpha"), ("VEC2", "mesh_hash_shift")) if has_alpha else ()),
        ),
        inputs=(
            ("VEC3", "position"),
            *((("VEC2", "picture_uv"),) if has_pictures else ()),
            *((("VEC3", "vertex_values"),) if has_vertex_values else ()),
        ),
        varyings=(
            ("smooth", "VEC3", "mesh_point"),
            *((("smooth", "VEC2", "mesh_uv"),) if has_pictures else ()),
        ),
        outputs=(("VEC4", "color"),),
        defines=(
            *((("ALPHA", 1),) if has_alpha else ()),
            *((("PICTURES", 1),) if has_pictures else ()),
            *((("VERTEX_VALUES", 1),) if has_vertex_values else ()),
        ),
    )


class MeshPlaces:
    """The meshes of the last draw on the GPU. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._view = UniformBlock()
        self._batches: list[tuple[PlacedMesh, Any]] = []
        self._pictures = PictureTextures()

    def draw(self, meshes: Sequence[PlacedMesh], camera: Camera, width: int, height: int) -> None:
        """Draw position [m, world] and number of each mesh into the bound framebuffer."""
        kept = {_key(each): batch for each, batch in self._batches}
        self._batches = [
            (each, kept.get(_key(each)) or caster_batch(each.mesh, each.vertex_values))
            for each in meshes
            if len(each.mesh.surface.triangles)
        ]
        view = self._view.holding(view_values(camera, width, height))
        for each, batch in self._batches:
            shader = self._bound(each, view)
            with drawing_state():
                batch.draw(shader)
        self._pictures.forget_but([each.mesh for each in meshes])

    def _bound(self, each: PlacedMesh, view: Any) -> Any:
        """The shader of a mesh, bound and ready to draw."""
        mesh, picture = each.mesh, alpha_picture(each.mesh)
        has_alpha, has_pictures = mesh.transparency != "opaque", picture is not None
        textures: dict[str, Any] = {}
        if picture is not None:
            textures["mesh_color_map"] = self._pictures.color(picture)
        numbers: dict[str, Any] = {"mesh_number": each.number}
        if has_alpha:
            numbers |= {"mesh_alpha": mesh.alpha, "mesh_hash_shift": each.hash_shifts}
        recipe = place_recipe(
            has_alpha=has_alpha,
            has_pictures=has_pictures,
            has_vertex_values=each.vertex_values is not None,
        )
        shader = program(recipe)
        shader.bind(blocks={"view": view}, textures=textures, numbers=numbers)
        return shader.shader


def _key(each: PlacedMesh) -> tuple[int, int]:
    """The identities of the inputs of its batch, which are kept alive as long as the batch."""
    return id(each.mesh), id(each.vertex_values)
