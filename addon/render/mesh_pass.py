"""Draws lit meshes, such as the head under the hair, into whatever target is bound."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..shading.lights import kept_lights
from ..shading.skin.layout import SkinLayout
from .camera import Camera
from .feature_programs import UniformBlocks, bound
from .hashed_alpha import shifts
from .marschner_textures import hair_forward, under_hair_feature
from .mesh_batch import mesh_batch
from .mesh_pictures import PictureTextures, pictures_of
from .mesh_shadows import MeshShadowPass, MeshShadows
from .opacity_maps import OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe, released_with_shaders
from .shader_source import output_index
from .skin_pass import SkinPass, SkinShadow
from .snapshot import MeshSnapshot, Snapshot
from .textures import drawing_state
from .view_block import lights_feature, view_feature

_RECIPE = ShaderRecipe(
    name="mesh",
    vertex="mesh.vert.glsl",
    fragment="mesh.frag.glsl",
    structs=(
        *("struct_view.glsl", "struct_lights.glsl"),
        *("struct_opacity.glsl", "struct_mesh_shadows.glsl"),
    ),
    integers=("output_encoding",),
    inputs=(("VEC3", "position"), ("VEC3", "normal"), ("FLOAT", "occlusion")),
    varyings=(
        ("smooth", "VEC3", "mesh_point"),
        ("smooth", "VEC3", "mesh_normal"),
        ("smooth", "FLOAT", "mesh_occlusion"),
    ),
    outputs=(("VEC4", "color"),),
    defines=(("SHADOWS", 0),),
)

type _Batch = tuple[MeshSnapshot, SkinLayout | None, Any]


class MeshPass:
    """Keeps the meshes of the last snapshot on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.mesh_shadows = MeshShadowPass()
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
        shadows: MeshShadows | None = None,
        between: Any = None,
    ) -> None:
        """Draw all meshes of the snapshot into the bound framebuffer, depth-tested.

        Args:
            opacity: the hair's maps, see StrandPass.opacity.
            shadows: of all meshes; without, they shade each other only where the hair's maps are.
            between: what other hair is in the way, at each pixel of the target, see
                InterGroomShadow;
                counts where there are maps. Others as in StrandPass.draw.
        """
        skins = self.skin.shadows(
            snapshot.meshes,
            opacity,
            snapshot.skin,
            len(kept_lights(snapshot.lights)),
            (0.0, 0.0, 0.0) if opacity is None else hair_forward(snapshot),
            shadows,
        )
        self._upload(snapshot.meshes, skins)
        shared = [view_feature(camera, width, height), lights_feature(snapshot)]
        if opacity is not None:
            shared.append(under_hair_feature(snapshot, opacity))
        if shadows is not None:
            shared.append(shadows.feature(camera.sample))
        integers = {"output_encoding": output_index(output)}
        for number, (mesh, _, batch) in enumerate(_far_to_near(self._batches, camera)):
            features = [*shared, *self._mesh_features(mesh, skins.get(id(mesh)))]
            is_blended = mesh.transparency == "blended"
            # a pixel stands for what lies behind all that is blended
            if between is not None and opacity is not None and not is_blended:
                features.append(_inter_groom_feature(between))
            if mesh.transparency == "hashed":
                features.append(_hashed_feature(number, camera.sample))
            blend = "ALPHA_PREMULT" if is_blended else "NONE"
            with drawing_state(depth_write=not is_blended, blend=blend):
                batch.draw(bound(_RECIPE, features, self._blocks, integers=integers).shader)
        self._pictures.forget_but(snapshot.meshes)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = UniformBlocks()
        self._batches: list[_Batch] = []
        self.skin = SkinPass()
        self.mesh_shadows.release()
        self._pictures = PictureTextures()

    def _mesh_features(
        self, mesh: MeshSnapshot, skin: SkinShadow | None
    ) -> Iterator[ShaderFeature]:
        """What the program of one mesh has: its surface, its soft shadow, its pictures."""
        yield ShaderFeature(
            numbers={
                "mesh_specular": ("FLOAT", mesh.specular),
                "mesh_roughness": ("FLOAT", mesh.roughness),
                "mesh_cover": ("FLOAT", 0.0 if mesh.is_holdout else 1.0),
            }
        )
        if skin is not None:
            yield skin.feature
        pictures = pictures_of(mesh)
        if pictures is None:
            yield ShaderFeature(numbers={"mesh_color": ("VEC3", mesh.color)})
        else:
            yield self._pictures.feature(mesh, pictures)
        if mesh.transparency != "opaque":
            yield ShaderFeature(
                name=mesh.transparency,
                numbers={"mesh_alpha": ("FLOAT", mesh.alpha)},
                defines={mesh.transparency.upper(): 1},
            )

    def _upload(self, meshes: tuple[MeshSnapshot, ...], skins: Mapping[int, SkinShadow]) -> None:
        kept = {(id(mesh), id(layout)): batch for mesh, layout, batch in self._batches}
        wanted = [
            (mesh, skins[id(mesh)].layout if id(mesh) in skins else None)
            for mesh in meshes
            if len(mesh.surface.triangles)
        ]
        self._batches = [
            (mesh, layout, kept.get((id(mesh), id(layout))) or mesh_batch(mesh, layout))
            for mesh, layout in wanted
        ]


def _inter_groom_feature(between: Any) -> ShaderFeature:
    """What a program has that knows of more hair in the way than the maps hold, by pixel."""
    return ShaderFeature(
        name="others",
        textures={"inter_groom_shadow": ("FLOAT_2D", between)},
        defines={"OTHER_TAU": 1},
    )


def _hashed_feature(number: int, sample: int) -> ShaderFeature:
    """How far the pattern by which a hashed mesh is left out is shifted; see hashed_alpha.py."""
    return ShaderFeature(numbers={"mesh_chance": ("VEC2", shifts(number, sample))})


def _far_to_near(batches: list[_Batch], camera: Camera) -> list[_Batch]:
    """What covers what is behind it first, then what is blended, the farthest first."""
    return sorted(
        batches,
        key=lambda each: (
            each[0].transparency == "blended",
            -_distance(each[0], camera) if each[0].transparency == "blended" else 0.0,
        ),
    )


def _distance(mesh: MeshSnapshot, camera: Camera) -> float:
    """Of the middle of a mesh along the view [m]."""
    low, high = mesh.surface.bounds()
    return -float(camera.view[2, :3] @ (0.5 * (low + high)) + camera.view[2, 3])
