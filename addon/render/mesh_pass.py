"""Draws lit meshes, such as the head under the hair, into the bound framebuffer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any

from ..shading.lights import packed_lights
from ..shading.skin.layout import SkinLayout
from .camera import Camera
from .caster_batch import alpha_picture
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

#: the fraction of light on meshes that hair lets through, instead of the meshes
_SHADOW_RECIPE = replace(
    _RECIPE, name="mesh_hair_shadow", fragment="mesh_hair_shadow.frag.glsl", integers=()
)

type _Batch = tuple[MeshSnapshot, SkinLayout | None, Any]


class MeshPass:
    """The meshes of the last snapshot on the GPU. Creating one does not touch the GPU."""

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
        other_tau: Any = None,
    ) -> None:
        """Draw all meshes of the snapshot into the bound framebuffer, depth-tested.

        Args:
            opacity: the hair's maps, see StrandPass.opacity.
            shadows: of all meshes; without them, meshes shade each other only within the hair's
                maps.
            other_tau: optical depth of other hair at each pixel of the target, see
                InterGroomShadow; only used with `opacity`. Others as in StrandPass.draw.
        """
        # a hole in the picture shows neither the mesh nor a shadow on it
        seen = [mesh for mesh in snapshot.meshes if not mesh.is_holdout]
        skins = self._skins(seen, snapshot, opacity, shadows)
        self._upload(snapshot.meshes, skins)
        shared = _shared(snapshot, camera, (width, height), opacity, shadows)
        integers = {"output_encoding": output_index(output)}
        for number, (mesh, _, batch) in enumerate(_far_to_near(self._batches, camera)):
            features = [*shared, *self._mesh_features(mesh, skins.get(id(mesh)))]
            features += _sample_features(mesh, number, camera.sample, opacity and other_tau)
            with _state_for(mesh):
                batch.draw(bound(_RECIPE, features, self._blocks, integers=integers).shader)
        self._pictures.forget_but(snapshot.meshes)

    def draw_hair_shadow(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        opacity: OpacityMaps | None = None,
        shadows: MeshShadows | None = None,
        other_tau: Any = None,
    ) -> None:
        """Draw the shadow of hair on all meshes of the snapshot into the bound framebuffer,
        depth-tested: the fraction of light that hair lets through, by colour.

        Args:
            all as of `draw`.
        """
        skins = self._skins(snapshot.meshes, snapshot, opacity, shadows, only_hair=True)
        self._upload(snapshot.meshes, skins)
        shared = _shared(snapshot, camera, (width, height), opacity, shadows)
        for number, (mesh, _, batch) in enumerate(_far_to_near(self._batches, camera)):
            features = [*shared, *self._coverage_features(mesh, skins.get(id(mesh)))]
            features += _sample_features(mesh, number, camera.sample, opacity and other_tau)
            with _state_for(mesh):
                batch.draw(bound(_SHADOW_RECIPE, features, self._blocks).shader)
        self._pictures.forget_but(snapshot.meshes)

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._blocks = UniformBlocks()
        self._batches: list[_Batch] = []
        self.skin = SkinPass()
        self.mesh_shadows.release()
        self._pictures = PictureTextures()

    def _skins(
        self,
        meshes: Sequence[MeshSnapshot],
        snapshot: Snapshot,
        opacity: OpacityMaps | None,
        shadows: MeshShadows | None,
        *,
        only_hair: bool = False,
    ) -> dict[int, SkinShadow]:
        """The soft shadows on meshes that are skin, see SkinPass.shadows."""
        return self.skin.shadows(
            meshes,
            opacity,
            snapshot.skin,
            len(packed_lights(snapshot.lights)),
            (0.0, 0.0, 0.0) if opacity is None else hair_forward(snapshot),
            shadows,
            only_hair=only_hair,
        )

    def _mesh_features(
        self, mesh: MeshSnapshot, skin: SkinShadow | None
    ) -> Iterator[ShaderFeature]:
        """The features of one mesh: its surface, its soft shadow, its pictures."""
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
            yield _alpha_feature(mesh)
        if any(mesh.emission):
            yield ShaderFeature(
                name="emission",
                numbers={"mesh_emission": ("VEC3", mesh.emission)},
                defines={"EMISSION": 1},
            )

    def _coverage_features(
        self, mesh: MeshSnapshot, skin: SkinShadow | None
    ) -> Iterator[ShaderFeature]:
        """The features of one mesh in programs that need its coverage but not its surface."""
        if skin is not None:
            yield skin.feature
        if mesh.transparency != "opaque":
            yield _alpha_feature(mesh)
            picture = alpha_picture(mesh)
            if picture is not None:
                yield self._pictures.alpha_feature(picture)

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


def _shared(
    snapshot: Snapshot,
    camera: Camera,
    size: tuple[int, int],
    opacity: OpacityMaps | None,
    shadows: MeshShadows | None,
) -> list[ShaderFeature]:
    """The features of all meshes: view, lights, and shadows."""
    found = [view_feature(camera, *size), lights_feature(snapshot)]
    if opacity is not None:
        found.append(under_hair_feature(snapshot, opacity))
    if shadows is not None:
        found.append(shadows.feature(camera.sample))
    return found


def _sample_features(
    mesh: MeshSnapshot, number: int, sample: int, other_tau: Any
) -> Iterable[ShaderFeature]:
    """The features of one mesh that depend on the sample."""
    # `other_tau` is that at the nearest mesh that is not blended
    if other_tau is not None and mesh.transparency != "blended":
        yield _inter_groom_feature(other_tau)
    if mesh.transparency == "hashed":
        yield _hashed_feature(number, sample)


def _state_for(mesh: MeshSnapshot) -> AbstractContextManager[None]:
    is_blended = mesh.transparency == "blended"
    blend = "ALPHA_PREMULT" if is_blended else "NONE"
    return drawing_state(depth_write=not is_blended, blend=blend)


def _alpha_feature(mesh: MeshSnapshot) -> ShaderFeature:
    return ShaderFeature(
        name=mesh.transparency,
        numbers={"mesh_alpha": ("FLOAT", mesh.alpha)},
        defines={mesh.transparency.upper(): 1},
    )


def _inter_groom_feature(other_tau: Any) -> ShaderFeature:
    """The feature of programs that read the optical depth of other hair per pixel."""
    return ShaderFeature(
        name="others",
        textures={"inter_groom_shadow": ("FLOAT_2D", other_tau)},
        defines={"OTHER_TAU": 1},
    )


def _hashed_feature(number: int, sample: int) -> ShaderFeature:
    """The feature with the shift of a hashed mesh's pattern, see hashed_alpha.py."""
    return ShaderFeature(numbers={"mesh_hash_shift": ("VEC2", shifts(number, sample))})


def _far_to_near(batches: list[_Batch], camera: Camera) -> list[_Batch]:
    """First the batches that are not blended, then the blended ones, the farthest first."""
    return sorted(
        batches,
        key=lambda each: (
            each[0].transparency == "blended",
            -_distance(each[0], camera) if each[0].transparency == "blended" else 0.0,
        ),
    )


def _distance(mesh: MeshSnapshot, camera: Camera) -> float:
    """Distance of the middle of a mesh along the view [m]."""
    low, high = mesh.surface.bounds()
    return -float(camera.view[2, :3] @ (0.5 * (low + high)) + camera.view[2, 3])
