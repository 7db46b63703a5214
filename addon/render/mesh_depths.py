"""Draws shadow maps: the depth of the first mesh that a light meets, with holes by its alpha."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..strands import Surface
from . import gpu_objects
from .caster_batch import alpha_picture, caster_batch
from .mesh_pictures import PictureTextures
from .shader_program import ShaderRecipe, program
from .snapshot import Caster, MeshSnapshot, surface_of
from .textures import drawing_into, drawing_state

#: rows of a map, by their names in the shader: x, y, w and depth of (world position, 1)
_ROWS = ("map_x", "map_y", "map_w", "map_depth")
#: the golden ratio, by which patterns of meshes differ, so that their holes do not coincide
_NEXT_PATTERN = 0.6180339887


def depth_recipe(*, has_alpha: bool, has_pictures: bool) -> ShaderRecipe:
    """The program of meshes with or without holes."""
    return ShaderRecipe(
        name=f"mesh_depth{'_alpha' * has_alpha}{'_pictures' * has_pictures}",
        vertex="mesh_depth.vert.glsl",
        fragment="mesh_depth.frag.glsl",
        textures=(("FLOAT_2D", "mesh_color_map"),) if has_pictures else (),
        numbers=(
            *(("VEC4", row) for row in _ROWS),
            *((("FLOAT", "mesh_alpha"), ("VEC2", "mesh_hash_shift")) if has_alpha else ()),
        ),
        inputs=(("VEC3", "position"), *((("VEC2", "picture_uv"),) if has_pictures else ())),
        varyings=(
            ("smooth", "FLOAT", "mesh_depth"),
            *((("smooth", "VEC2", "mesh_uv"),) if has_pictures else ()),
        ),
        defines=(
            *((("ALPHA", 1),) if has_alpha else ()),
            *((("PICTURES", 1),) if has_pictures else ()),
        ),
    )


class MeshDepths:
    """Meshes that cast shadows, on the GPU. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._batches: list[tuple[Caster, Any]] = []
        self._pictures = PictureTextures()

    def hold(self, casters: Sequence[Caster]) -> None:
        """Upload these meshes and release all others; objects that are there are kept."""
        kept = {id(caster): batch for caster, batch in self._batches}
        self._batches = [
            (caster, kept[id(caster)] if id(caster) in kept else caster_batch(caster))
            for caster in casters
            if len(surface_of(caster).triangles)
        ]
        self._pictures.forget_but([each for each in casters if isinstance(each, MeshSnapshot)])

    def draw(self, depths: Any, layer: int, rows: Floats) -> None:
        """Draw one map.

        Args:
            depths: texture array; the layer is overwritten.
            rows: (4, 4) x, y, w and depth of a place (x, y, z, 1) in the map.
        """
        target = gpu_objects.framebuffer(depth_slot={"texture": depths, "layer": layer})
        of_map = {name: row.astype(float).tolist() for name, row in zip(_ROWS, rows, strict=True)}
        with drawing_into(target), drawing_state(depth_test="LESS_EQUAL"):
            target.clear(depth=1.0)
            for number, (caster, batch) in enumerate(self._batches):
                if _is_seen(surface_of(caster), rows):
                    shader = self._bound(caster, number, of_map)
                    batch.draw(shader)

    def _bound(self, caster: Caster, number: int, of_map: dict[str, Any]) -> Any:
        """The shader of a mesh, bound and ready to draw."""
        numbers, picture, has_alpha = dict(of_map), alpha_picture(caster), False
        textures = {} if picture is None else {"mesh_color_map": self._pictures.color(picture)}
        if isinstance(caster, MeshSnapshot) and caster.transparency != "opaque":
            has_alpha = True
            hash_shifts = 1.0 - 2.0 * (number % 2), number // 2 * _NEXT_PATTERN % 1.0
            numbers |= {"mesh_alpha": caster.alpha, "mesh_hash_shift": hash_shifts}
        shader = program(depth_recipe(has_alpha=has_alpha, has_pictures=picture is not None))
        shader.bind(textures=textures, numbers=numbers)
        return shader.shader


def _is_seen(surface: Surface, rows: Floats) -> bool:
    """Whether the surface's box may intersect the map."""
    low, high = surface.bounds()
    ends = np.array([low, high], np.float64)
    x, y, z = np.indices((2, 2, 2)).reshape(3, 8)
    corners = np.stack([ends[x, 0], ends[y, 1], ends[z, 2], np.ones(8)], axis=1)
    clip = corners @ rows[:3].T
    beyond = [clip[:, axis] * sign > clip[:, 2] for axis in (0, 1) for sign in (1.0, -1.0)]
    return not any(side.all() for side in beyond)
