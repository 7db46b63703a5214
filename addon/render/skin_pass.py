"""Draws soft shadows on heads: the light that reaches the skin, in UV space, blurred along it.

    texels     for each texel of a head's UV map its triangle, two weights, island
    stretches  width and height of each texel [m], and the nearest seam
    shadow     the fraction of each light that reaches the skin, a channel per light; first sharp,
               then blurred along rows and along columns
    shifts     corrections that close seams where three or more sides meet

The layout (addon/shading/skin/layout.py) is made when a head's triangles or UVs change; the shadow
when anything has moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..shading.skin.layout import SkinLayout
from ..shading.skin.settings import SkinSettings
from ..strands import Surface
from ..strands.triangles import areas_of
from . import gpu_objects
from .feature_programs import UniformBlocks, bound
from .mesh_shadows import MeshShadows
from .opacity_maps import OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe, program
from .shader_source import SKIN_COPIES_ACROSS, SKIN_SEAMS_ACROSS, SKIN_TRIANGLES_ACROSS
from .skin_layouts import layout_of
from .snapshot import Color, MeshSnapshot
from .textures import texture_from, texture_to_array

#: textures of programs that look up the shadow
SKIN_TEXTURES = tuple(
    ("FLOAT_2D", f"skin_{name}") for name in ("shadow", "texels", "stretches", "seams", "shifts")
)

_ONLY_HAIR = ShaderFeature(name="only_hair", defines={"ONLY_HAIR": 1})
_SHADOW_RECIPE = ShaderRecipe(
    name="skin_shadow",
    compute="skin_shadow.comp.glsl",
    structs=("struct_opacity.glsl", "struct_mesh_shadows.glsl"),
    textures=(("FLOAT_2D", "skin_texels"), ("FLOAT_2D", "skin_corners")),
    images=(("RGBA32F", "unblurred"),),
    integers=("light_count",),
    numbers=(("VEC3", "hair_forward"),),
)
_BLUR_RECIPE = ShaderRecipe(
    name="skin_blur",
    compute="skin_blur.comp.glsl",
    textures=tuple(("FLOAT_2D", f"skin_{name}") for name in ("shadow", "texels", "stretches")),
    images=(("RGBA32F", "spread"),),
    integers=("axis",),
    numbers=(("FLOAT", "softness"),),
)
_CORNER_RECIPE = ShaderRecipe(
    name="skin_corner",
    compute="skin_corner.comp.glsl",
    textures=tuple(
        ("FLOAT_2D", f"skin_{name}") for name in ("shadow", "texels", "seams", "copies")
    ),
    images=(("RGBA32F", "shifts"),),
)


@dataclass(eq=False)
class SkinShadow:
    """The soft shadow on one head.

    textures: by their names in the shader, see SKIN_TEXTURES.
    """

    layout: SkinLayout
    textures: dict[str, Any]

    @property
    def feature(self) -> ShaderFeature:
        """The feature of programs that look up the shadow."""
        return ShaderFeature(
            name="skin",
            textures={name: (kind, self.textures[name]) for kind, name in SKIN_TEXTURES},
            inputs=(("VEC3", "skin_place"),),
            varyings=(("smooth", "VEC3", "mesh_skin"),),
            defines={"SKIN_SHADOW": 1},
        )

    def picture(self) -> Floats:
        """The map as an array (rows, columns, channels), row 0 at v = 0: the fraction of each light
        that reaches the skin, 1 where there is no skin.
        """
        return texture_to_array(self.textures["skin_shadow"])


@dataclass(frozen=True, eq=False)
class _ShadowInputs:
    """The inputs of a shadow."""

    positions: Floats
    opacity: OpacityMaps
    softness: float
    light_count: int
    forward: Color
    shadows: MeshShadows | None
    is_only_hair: bool

    def is_like(self, other: _ShadowInputs) -> bool:
        return (
            self.positions is other.positions
            and self.opacity is other.opacity
            and self.shadows is other.shadows
            and (self.softness, self.light_count) == (other.softness, other.light_count)
            and self.forward == other.forward
            and self.is_only_hair == other.is_only_hair
        )


@dataclass(eq=False)
class _Head:
    """A head on the GPU.

    size: square root of its area when its layout was made [m].
    drawn_inputs: inputs from which its shadow was drawn.
    """

    triangles: Ints
    corner_uv: Floats
    resolution: int
    size: float
    layout: SkinLayout
    textures: dict[str, Any]
    drawn_inputs: _ShadowInputs | None = None
    shadow: SkinShadow | None = None

    def is_of(self, surface: Surface, resolution: int) -> bool:
        return (
            self.triangles is surface.triangles
            and self.corner_uv is surface.corner_uv
            and self.resolution == resolution
        )


class SkinPass:
    """Layouts and shadows of the heads drawn last. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._heads: list[_Head] = []
        self._blocks = UniformBlocks()

    def shadows(
        self,
        meshes: Sequence[MeshSnapshot],
        opacity: OpacityMaps | None,
        settings: SkinSettings,
        light_count: int,
        forward: Color = (0.0, 0.0, 0.0),
        shadows: MeshShadows | None = None,
        *,
        only_hair: bool = False,
    ) -> dict[int, SkinShadow]:
        """The soft shadow on each mesh that is skin, by the mesh's id(). Meshes with unusable UVs
        have none; without opacity maps or softness there are none.

        Args:
            light_count: number of lights in the maps.
            forward: the fraction of light that hair scatters forward, by colour; the shadow uses
                its mean.
            shadows: of all meshes, beyond the opacity maps.
            only_hair: without the shadows of meshes.
        """
        if opacity is None or not settings.soft_shadow or not settings.softness:
            return {}
        found, used = {}, []
        for mesh in meshes:
            if mesh.skin is None or mesh.skin.surface.corner_uv is None:
                continue
            head = self._head(mesh.skin.surface, settings.skin_resolution)
            used.append(head)
            if not head.layout.is_empty:
                light = settings.softness * head.size, light_count, forward, shadows, only_hair
                wanted = _ShadowInputs(mesh.skin.surface.positions, opacity, *light)
                found[id(mesh)] = self._draw_shadow(head, mesh.skin.surface, wanted)
        self._heads = [head for head in self._heads if head in used]
        return found

    @property
    def drawn_shadows(self) -> tuple[SkinShadow, ...]:
        """The shadows of the heads that were drawn last."""
        return tuple(head.shadow for head in self._heads if head.shadow is not None)

    def _head(self, surface: Surface, resolution: int) -> _Head:
        for head in self._heads:
            if head.is_of(surface, resolution):
                return head
        assert surface.corner_uv is not None
        layout = layout_of(surface, resolution)
        textures = {} if layout.is_empty else layout_textures(layout)
        self._heads.append(
            _Head(
                surface.triangles,
                surface.corner_uv,
                resolution,
                head_size(surface),
                layout,
                textures,
            )
        )
        return self._heads[-1]

    def _draw_shadow(self, head: _Head, surface: Surface, inputs: _ShadowInputs) -> SkinShadow:
        if (
            head.shadow is None
            or head.drawn_inputs is None
            or not head.drawn_inputs.is_like(inputs)
        ):
            shadow = self._unblurred_shadow(head, surface, inputs)
            for axis in range(2):
                shadow = spread(shadow, head.textures, inputs.softness, axis)
            shifts = closing_shifts(shadow, head.textures)
            kept = {name: head.textures[name] for _, name in SKIN_TEXTURES[1:4]}
            textures = {"skin_shadow": shadow, "skin_shifts": shifts, **kept}
            head.shadow, head.drawn_inputs = SkinShadow(head.layout, textures), inputs
        return head.shadow

    def _unblurred_shadow(self, head: _Head, surface: Surface, inputs: _ShadowInputs) -> Any:
        """The fraction of each light that reaches the skin, before the blur."""
        corners = texture_from(
            _in_rows(surface.corners.reshape(-1, 3), 3 * SKIN_TRIANGLES_ACROSS), "RGBA32F"
        )
        texels, shadows = head.textures["skin_texels"], inputs.shadows
        found = _like(texels)
        depths = [] if shadows is None else [shadows.feature(sample=0)]
        kind = [_ONLY_HAIR] if inputs.is_only_hair else []
        shader = bound(
            _SHADOW_RECIPE,
            [inputs.opacity.feature, *depths, *kind],
            self._blocks,
            textures={"skin_texels": texels, "skin_corners": corners},
            images={"unblurred": found},
            integers={"light_count": inputs.light_count},
            numbers={"hair_forward": inputs.forward},
        )
        shader.dispatch(found.width, found.height)
        return found


def head_size(surface: Surface) -> float:
    """The size of a head, of which softness is a fraction: the square root of its area [m]."""
    return float(np.sqrt(areas_of(surface.corners.astype(np.float64)).sum()))


def layout_textures(layout: SkinLayout) -> dict[str, Any]:
    """The textures of a layout for lib_skin.glsl and skin_*.comp.glsl, by name."""
    texels = np.dstack([layout.triangle, layout.weights, layout.island])
    stretches = np.dstack([layout.stretch, layout.seam, np.zeros_like(layout.seam)])
    count = len(layout.seams)
    parts = np.zeros((max(count, 1), 4, 4))
    if count:
        parts[:, :2] = layout.seams
        parts[:, 2, :2] = layout.seam_islands
        parts[:, 3] = layout.end_copies.reshape(-1, 4)
    rows = {
        "skin_texels": texels,
        "skin_stretches": stretches,
        "skin_seams": _in_rows(parts.reshape(-1, 4), 4 * SKIN_SEAMS_ACROSS),
        "skin_copies": _in_rows(layout.copies, SKIN_COPIES_ACROSS),
    }
    return {name: texture_from(values, "RGBA32F") for name, values in rows.items()}


def spread(shadow: Any, textures: dict[str, Any], softness: float, axis: int) -> Any:
    """The texture blurred by `softness` metres along rows (axis 0) or columns (axis 1)."""
    found, shader = _like(shadow), program(_BLUR_RECIPE)
    names = ("skin_texels", "skin_stretches")
    shader.bind(
        textures={"skin_shadow": shadow, **{name: textures[name] for name in names}},
        images={"spread": found},
        integers={"axis": axis},
        numbers={"softness": softness},
    )
    shader.dispatch(found.width, found.height)
    return found


def closing_shifts(shadow: Any, textures: dict[str, Any]) -> Any:
    """A texture with two texels per seam, see skin_corner.comp.glsl."""
    seams = textures["skin_seams"]
    found = gpu_objects.texture((seams.width // 2, seams.height), format="RGBA32F")
    shader = program(_CORNER_RECIPE)
    names = ("skin_texels", "skin_seams", "skin_copies")
    shader.bind(
        textures={"skin_shadow": shadow, **{name: textures[name] for name in names}},
        images={"shifts": found},
    )
    shader.dispatch(found.width, found.height)
    return found


def _in_rows(values: Floats, across: int) -> Floats:
    """Values (n, channels) as texels, `across` per row, (rows, across, 4)."""
    rows = max(-(-len(values) // across), 1)
    texels = np.zeros((rows * across, 4), np.float32)
    texels[: len(values), : values.shape[1]] = values
    return texels.reshape(rows, across, 4)


def _like(texture: Any) -> Any:
    return gpu_objects.texture((texture.width, texture.height), format="RGBA32F")
