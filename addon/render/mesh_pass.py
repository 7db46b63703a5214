"""Draws lit meshes, such as the head under the hair, into whatever target is bound."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..shading.lights import kept_lights, kinds_needed, pack_lights
from ..shading.skin.layout import SkinLayout
from .camera import Camera
from .hashed_alpha import shifts
from .marschner_textures import hair_forward
from .mesh_batch import mesh_batch
from .mesh_pictures import PictureTextures, pictures_of
from .mesh_recipe import MeshForm
from .mesh_shadows import MeshShadowPass, MeshShadows, ShadowBlock
from .opacity_pass import OpacityMaps
from .shader_program import program, released_with_shaders
from .shader_source import output_index
from .skin_pass import SkinPass, SkinShadow
from .snapshot import MeshPictures, MeshSnapshot, Snapshot
from .textures import UniformBlock, drawing_state
from .view_block import view_values

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
            between: what other hair is in the way, at each pixel of the target, see HairBetween;
                counts where there are maps. Others as in StrandPass.draw.
        """
        forward = (0.0, 0.0, 0.0) if opacity is None else hair_forward(snapshot)
        light_count = len(kept_lights(snapshot.lights))
        skins = self.skin.shadows(
            snapshot.meshes, opacity, snapshot.skin, light_count, forward, shadows
        )
        self._upload(snapshot.meshes, skins)
        values = {
            "view": view_values(camera, width, height),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            **({} if opacity is None else {"opacity": opacity.values}),
        }
        form = None if opacity is None else opacity.form
        shadow_block = self._shadow_block.of(shadows, camera.sample)
        kinds = kinds_needed(kept_lights(snapshot.lights))
        for number, (mesh, _, batch) in enumerate(_far_to_near(self._batches, camera)):
            skin, pictures = skins.get(id(mesh)), pictures_of(mesh)
            is_blended = mesh.transparency == "blended"
            # a pixel stands for what lies behind all that is blended
            has_others = between is not None and opacity is not None and not is_blended
            shader = program(
                MeshForm(
                    form,
                    skin is not None,
                    pictures is not None,
                    mesh.transparency,
                    kinds,
                    shadows is not None,
                    has_others,
                ).recipe
            )
            with drawing_state(
                depth_write=not is_blended, blend="ALPHA_PREMULT" if is_blended else "NONE"
            ):
                shader.bind(
                    blocks={
                        **{name: self._blocks[name].holding(values[name]) for name in values},
                        **shadow_block,
                    },
                    textures={
                        **({} if opacity is None else opacity.textures),
                        **({} if shadows is None else shadows.textures),
                        **({"hair_between": between} if has_others else {}),
                        **({} if skin is None else skin.textures),
                        **({} if pictures is None else self._pictures.textures(mesh, pictures)),
                    },
                    integers={"output_encoding": output_index(output)},
                    numbers={
                        **_numbers(mesh, pictures),
                        **_chance(mesh, number, camera.sample),
                        **({} if opacity is None else {"hair_forward": forward}),
                    },
                )
                batch.draw(shader.shader)
        self._pictures.forget_but(snapshot.meshes)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for name in ("view", "lights", "opacity")}
        self._shadow_block = ShadowBlock()
        self._batches: list[_Batch] = []
        self.skin = SkinPass()
        self.mesh_shadows.release()
        self._pictures = PictureTextures()

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


def _numbers(mesh: MeshSnapshot, pictures: MeshPictures | None) -> dict[str, Any]:
    """Those that the program of a mesh has."""
    return {
        "mesh_sheen": mesh.sheen,
        "mesh_cover": 0.0 if mesh.is_holdout else 1.0,
        **({"mesh_color": mesh.color} if pictures is None else {"mesh_bump": pictures.bump}),
        **({} if mesh.transparency == "opaque" else {"mesh_alpha": mesh.alpha}),
    }


def _chance(mesh: MeshSnapshot, number: int, sample: int) -> dict[str, Any]:
    """How far the pattern by which a hashed mesh is left out is shifted; see hashed_alpha.py."""
    return {"mesh_chance": shifts(number, sample)} if mesh.transparency == "hashed" else {}


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
