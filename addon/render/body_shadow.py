"""Hair's shadow on meshes that Blender draws, as in its viewport.

The meshes that cast shadows on the hair (Snapshot.casters) are drawn again, in black. Alpha is the
fraction of their brightness that hair takes, from the opacity map of each light. The draw is
depth-tested, so hidden meshes get no shadow.

For a sample, this fraction is not drawn: the brightness that hair takes and the brightness without
hair are stored instead, so that both can be summed, see soft_picture.py.

Limitations: the finished picture is darkened, as if its meshes were matt skin. So highlights darken
as much as the colour, and a view transform makes the shadow on white cloth too dark. Two sheets of
a mesh closer together than 0.05 % of their distance to the eye are darkened twice.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..strands import Surface
from . import gpu_objects
from .camera import Camera
from .display import Display
from .feature_programs import UniformBlocks, bound
from .image_stores import finish_stores
from .marschner_textures import under_hair_feature
from .opacity_maps import OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe, released_with_shaders
from .snapshot import Caster, Snapshot, surface_of
from .textures import drawing_state
from .view_block import lights_feature, view_feature

_RECIPE = ShaderRecipe(
    name="body_shadow",
    vertex="body_shadow.vert.glsl",
    fragment="body_shadow.frag.glsl",
    structs=("struct_view.glsl", "struct_lights.glsl", "struct_opacity.glsl"),
    inputs=(("VEC3", "position"), ("VEC3", "normal")),
    varyings=(("smooth", "VEC3", "mesh_point"), ("smooth", "VEC3", "mesh_normal")),
    outputs=(("VEC4", "color"),),
)
_SAMPLED_RECIPE = replace(
    _RECIPE,
    name="body_shadow_sample",
    fragment="body_shadow_sample.frag.glsl",
    images=(("RGBA32F", "blocked_and_all", "READ_WRITE"),),
)


class BodyShadow:
    """The meshes of the last draw on the GPU. Creating one does not touch the GPU."""

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
        sample: Any = None,
    ) -> None:
        """Darken the picture in the bound framebuffer, that of a viewport, depth-tested against it.

        Args:
            maps: of the snapshot's hair. Others as in StrandPass.draw.
            sample: an RGBA32F texture that covers the viewport, 0 where other hair has stored no
                shadow yet. The shadow is stored into it, and nothing is drawn.

        Raises:
            ShaderError: the shader does not compile here.
        """
        self._upload(snapshot.casters)
        features = [
            view_feature(camera, width, height),
            lights_feature(snapshot),
            under_hair_feature(snapshot, maps),
            ShaderFeature(numbers={"body_color": ("VEC3", snapshot.skin_color)}),
            *([] if display is None else [display.feature]),
        ]
        recipe = _RECIPE if sample is None else _SAMPLED_RECIPE
        images = {} if sample is None else {"blocked_and_all": sample}
        for _, batch in self._batches:
            with drawing_state(depth_write=False, blend="ALPHA_PREMULT"):
                batch.draw(bound(recipe, features, self._blocks, images=images).shader)
        if sample is not None:
            finish_stores()

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._blocks = UniformBlocks()
        self._batches: list[tuple[Surface, Any]] = []

    def _upload(self, casters: tuple[Caster, ...]) -> None:
        kept = {id(surface): batch for surface, batch in self._batches}
        self._batches = [
            (surface, kept[id(surface)] if id(surface) in kept else _batch(surface))
            for surface in map(surface_of, casters)
            if len(surface.triangles)
        ]


def _batch(surface: Surface) -> Any:
    values = {"position": surface.positions, "normal": surface.vertex_normals()}
    vertices = gpu_objects.vertex_buffer(values)
    return gpu_objects.batch("TRIS", vertices, gpu_objects.index_buffer(surface.triangles))
