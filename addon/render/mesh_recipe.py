"""The programs that draw meshes."""

from __future__ import annotations

from dataclasses import dataclass

from .mesh_shadows import MESH_SHADOW_BLOCKS, MESH_SHADOW_TEXTURES
from .opacity_pass import OpacityForm
from .shader_program import ShaderRecipe
from .skin_pass import SKIN_TEXTURES

MESH_BLOCKS = (("View", "view"), ("Lights", "lights"))
_INPUTS = (("VEC3", "position"), ("VEC3", "normal"), ("FLOAT", "occlusion"))
_VARYINGS = (
    ("smooth", "VEC3", "mesh_point"),
    ("smooth", "VEC3", "mesh_normal"),
    ("smooth", "FLOAT", "mesh_occlusion"),
)
#: of the pictures of a material
PICTURES = ("mesh_color_map", "mesh_normal_map")
_STRUCTS = (
    *("struct_view.glsl", "struct_lights.glsl"),
    *("struct_opacity.glsl", "struct_mesh_shadows.glsl"),
)


@dataclass(frozen=True)
class MeshForm:
    """Which of the programs a mesh needs.

    opacity: of the maps through which hair and meshes throw shadows on it; None: there are none.
    is_skin: whether the shadow is looked up where it has been spread.
    has_pictures: whether pictures are laid over its UVs.
    transparency: one of TRANSPARENCIES.
    light_kinds: see kinds_needed.
    has_depths: whether there are maps of the depths of all meshes.
    has_others: whether there is more hair in the way than the maps hold, by pixel.
    """

    opacity: OpacityForm | None = None
    is_skin: bool = False
    has_pictures: bool = False
    transparency: str = "opaque"
    light_kinds: int = 2
    has_depths: bool = False
    has_others: bool = False

    @property
    def recipe(self) -> ShaderRecipe:
        opacity = self.opacity
        parts = [f"{opacity.slots}_{opacity.is_deep}"] if opacity else []
        parts += ["skin"] * self.is_skin + ["pictures"] * self.has_pictures
        parts += ["depths"] * self.has_depths + ["others"] * self.has_others
        return ShaderRecipe(
            name="_".join(["mesh", *parts, self.transparency, str(self.light_kinds)]),
            vertex="mesh.vert.glsl",
            fragment="mesh.frag.glsl",
            structs=_STRUCTS,
            blocks=(
                *MESH_BLOCKS,
                *((("Opacity", "opacity"),) if opacity else ()),
                *(MESH_SHADOW_BLOCKS if self.has_depths else ()),
            ),
            textures=(
                *(opacity.samplers if opacity else ()),
                *(MESH_SHADOW_TEXTURES if self.has_depths else ()),
                *((("FLOAT_2D", "hair_between"),) if self.has_others else ()),
                *(SKIN_TEXTURES if self.is_skin else ()),
                *((("FLOAT_2D", name) for name in PICTURES) if self.has_pictures else ()),
            ),
            integers=("output_encoding",),
            numbers=(
                ("FLOAT", "mesh_sheen"),
                ("FLOAT", "mesh_cover"),
                *((("VEC3", "hair_forward"),) if opacity else ()),
                ("FLOAT", "mesh_bump") if self.has_pictures else ("VEC3", "mesh_color"),
                *((("FLOAT", "mesh_alpha"),) if self.transparency != "opaque" else ()),
                *((("VEC2", "mesh_chance"),) if self.transparency == "hashed" else ()),
            ),
            inputs=(
                *_INPUTS,
                *((("VEC3", "skin_place"),) if self.is_skin else ()),
                *((("VEC2", "picture_place"),) if self.has_pictures else ()),
            ),
            varyings=(
                *_VARYINGS,
                *((("smooth", "VEC3", "mesh_skin"),) if self.is_skin else ()),
                *((("smooth", "VEC2", "mesh_uv"),) if self.has_pictures else ()),
            ),
            outputs=(("VEC4", "color"),),
            defines=(
                ("SHADOWS", int(opacity is not None)),
                ("LIGHT_KINDS", self.light_kinds),
                *(opacity.defines if opacity else ()),
                *((("MESH_SHADOWS", 1),) if self.has_depths else ()),
                *((("OTHERS", 1),) if self.has_others else ()),
                *((("SKIN", 1),) if self.is_skin else ()),
                *((("PICTURES", 1),) if self.has_pictures else ()),
                *(((self.transparency.upper(), 1),) if self.transparency != "opaque" else ()),
            ),
        )
