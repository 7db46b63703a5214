"""Draws hair cards into whatever target is bound, by the four passes of Scheuermann 2004.

    prime depth              opaque pixels alone, no colours
    opaque                   shades them, where the depth is equal
    transparent back faces   over what is there, without depth
    transparent front faces  over that, with depth, so that nothing farther comes over them later;
                             clear pixels, which would hide it as well, are left out

All four draw the triangles as they stand, so that blending needs no sorting; exchange/sidecar.py
lists them, for engines too. Opaque meshes have to be drawn before.

Limitations: what cards.sort says of the order. Textures have a single level, as Blender's GPU
textures do: what is drawn small has to be drawn with several samples a pixel. At 240 pixels a head
differs from one of 16 x 16 samples by 6 % with one sample, 2 % with 2 x 2 and 1 % with 3 x 3;
smoother textures would make that 5, 2 and 1 %, because it is edges that need the samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..cards.card_mesh import CardMesh
from ..exchange.sidecar import FOUR_PASSES, LEAST_ALPHA, OPAQUE_ALPHA, DrawPass
from ..params.glsl import struct_values
from ..shading.lights import pack_lights
from ..shading.marschner.look import pack_fibre
from ..shading.settings import ShadingSettings
from ..shading.textures import TEXTURES, HairTextures
from .camera import Camera
from .card_opacity import CardOpacity
from .card_snapshot import CardSnapshot
from .marschner_textures import MARSCHNER, MARSCHNER_TEXTURES, SHARES_TEXTURES
from .opacity_maps import OpacityForm, OpacityMaps
from .shader_program import ShaderRecipe, program, released_with_shaders
from .snapshot import Snapshot
from .textures import UniformBlock, drawing_state, texture_from
from .view_block import view_values

#: vertex attribute of a CardMesh -> its length
_ATTRIBUTES = {"position": 3, "normal": 3, "tangent": 3, "uv": 2, "occlusion": 1, "along": 1}
_INPUTS = tuple(
    ("FLOAT" if length == 1 else f"VEC{length}", name) for name, length in _ATTRIBUTES.items()
)
#: textures that repeat in u and v; the others end at their edges
_REPEATED = ("shift", "noise")
_BLOCKS = (("View", "view"), ("Lights", "lights"), ("ShadingSettings", "shading"))

PRIME_RECIPE = ShaderRecipe(
    name="card_prime",
    vertex="card.vert.glsl",
    fragment="card.frag.glsl",
    structs=("struct_view.glsl",),
    blocks=(("View", "view"),),
    textures=(("FLOAT_2D", "alpha_texture"),),
    numbers=(("FLOAT", "opaque_alpha"),),
    inputs=_INPUTS,
    varyings=(("smooth", "VEC2", "card_uv"),),
    outputs=(("VEC4", "color"),),
    defines=(("PRIME", 1),),
)


def card_recipe(
    model: str,
    *,
    has_tangent_map: bool,
    opacity: OpacityForm | None = None,
    scatters: bool = False,
) -> ShaderRecipe:
    """The program that shades cards by one of shading.settings.MODELS.

    With opacity maps hair shades them; `scatters` adds light from strand to strand, in Marschner's
    model.
    """
    is_marschner = model == "marschner"
    lit = f"{'_scattering' * scatters}{f'_{opacity.slots}_{opacity.is_deep}' if opacity else ''}"
    return ShaderRecipe(
        name=f"card_{model}{'_tangent_map' * has_tangent_map}{lit}",
        vertex="card.vert.glsl",
        fragment="card.frag.glsl",
        structs=(
            "struct_view.glsl",
            "struct_lights.glsl",
            "struct_fibre.glsl",
            "struct_opacity.glsl",
        ),
        settings=(ShadingSettings,),
        blocks=(
            *_BLOCKS,
            *((("Fibre", "fibre"),) if is_marschner else ()),
            *((("Opacity", "opacity"),) if opacity else ()),
        ),
        textures=(
            *(("FLOAT_2D", f"{name}_texture") for name in _textures_of(has_tangent_map)),
            *(MARSCHNER_TEXTURES if is_marschner else ()),
            *(SHARES_TEXTURES if scatters else ()),
            *(opacity.samplers if opacity else ()),
        ),
        integers=("is_opaque",),
        numbers=(
            ("FLOAT", "least_alpha"),
            *((("FLOAT", "scatter_density"), ("VEC3", "skin_color")) if scatters else ()),
        ),
        inputs=_INPUTS,
        varyings=(
            ("smooth", "VEC2", "card_uv"),
            ("smooth", "VEC3", "card_point"),
            ("smooth", "VEC3", "card_normal"),
            ("smooth", "VEC3", "card_tangent"),
            ("smooth", "FLOAT", "card_occlusion"),
            ("smooth", "FLOAT", "card_along"),
        ),
        outputs=(("VEC4", "color"),),
        defines=(
            ("PRIME", 0),
            ("TANGENT_MAP", int(has_tangent_map)),
            ("MARSCHNER", int(is_marschner)),
            ("SHADOWS", int(opacity is not None)),
            ("SCATTERING", int(scatters)),
            *(opacity.defines if opacity else ()),
        ),
    )


class CardPass:
    """Keeps the cards of the last snapshot on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self._opacity = CardOpacity()
        self.release()
        released_with_shaders(self)

    def opacity(self, snapshot: Snapshot) -> OpacityMaps | None:
        """How much hair lies between each light and every place, as StrandPass.opacity of strands.

        Raises:
            ShaderError: as `draw`.
        """
        cards = snapshot.cards
        if cards is None or not len(cards.mesh.triangles) or snapshot.volume.shadows == "none":
            return None
        self._upload(cards)
        return self._opacity.of(
            cards.mesh,
            self._batch,
            self._textures["alpha"],
            snapshot.lights,
            snapshot.volume,
            (*(mesh.surface for mesh in snapshot.meshes), *snapshot.casters),
        )

    def draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        opacity: OpacityMaps | None = None,
    ) -> None:
        """Draw the snapshot's cards into the bound framebuffer: premultiplied, scene-linear.

        Args:
            width, height: of the target [pixels].
            opacity: of the hair that shades them, such as their own, see `opacity`.

        Raises:
            ShaderError: a shader does not compile here.
        """
        cards = snapshot.cards
        if cards is None or not len(cards.mesh.triangles):
            return
        self._upload(cards)
        shading, has_map = snapshot.shading, cards.has_tangent_map
        is_marschner = shading.model == "marschner"
        scatters = opacity is not None and is_marschner and snapshot.volume.scattering
        form = None if opacity is None else opacity.form
        shader = program(
            card_recipe(shading.model, has_tangent_map=has_map, opacity=form, scatters=scatters)
        )
        values = {
            "view": view_values(camera, width, height),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            "shading": struct_values(shading),
        }
        textures = {f"{name}_texture": self._textures[name] for name in _textures_of(has_map)}
        if is_marschner:
            values["fibre"] = pack_fibre(shading)
            textures |= MARSCHNER.of(shading, snapshot.table_size)
        if scatters:
            textures |= MARSCHNER.shares(shading, snapshot.table_size)
        if opacity is not None:
            values["opacity"] = opacity.values
            textures |= opacity.textures
        blocks = {name: self._blocks[name].holding(values[name]) for name in values}
        for each in FOUR_PASSES:
            with _state_of(each):
                if each.color_write:
                    integers = {"is_opaque": int(not each.is_blended)}
                    least = LEAST_ALPHA if each.depth_write else 0.0
                    numbers: dict[str, Any] = {"least_alpha": least}
                    if scatters:
                        numbers["scatter_density"] = snapshot.volume.density
                        numbers["skin_color"] = snapshot.skin_color
                    shader.bind(
                        blocks=blocks, textures=textures, integers=integers, numbers=numbers
                    )
                    self._batch.draw(shader.shader)
                else:
                    self._draw_depth(blocks["view"])

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        names = (*(name for _, name in _BLOCKS), "fibre", "opacity")
        self._blocks = {name: UniformBlock() for name in names}
        self._opacity.release()
        self._mesh: CardMesh | None = None
        self._batch: Any = None
        self._pictures: HairTextures | None = None
        self._textures: dict[str, Any] = {}

    def _draw_depth(self, view: Any) -> None:
        """Opaque pixels alone, by a shader that asks for nothing else."""
        shader = program(PRIME_RECIPE)
        textures = {"alpha_texture": self._textures["alpha"]}
        numbers = {"opaque_alpha": OPAQUE_ALPHA}
        shader.bind(blocks={"view": view}, textures=textures, numbers=numbers)
        self._batch.draw(shader.shader)

    def _upload(self, cards: CardSnapshot) -> None:
        if self._mesh is not cards.mesh:
            self._batch, self._mesh = _batch(cards.mesh), cards.mesh
        if self._pictures is not cards.textures:
            self._textures = {name: _texture(cards.textures, name) for name in TEXTURES}
            self._pictures = cards.textures


@contextmanager
def _state_of(each: DrawPass) -> Iterator[None]:
    """The state of a pass, and afterwards what was there before."""
    blend = "ALPHA_PREMULT" if each.is_blended else "NONE"
    depth_test = each.depth_test.upper()
    with drawing_state(depth_test=depth_test, depth_write=each.depth_write, blend=blend):
        gpu.state.face_culling_set(each.cull.upper())
        gpu.state.color_mask_set(*(each.color_write,) * 4)
        yield


def _textures_of(has_tangent_map: bool) -> tuple[str, ...]:
    """What cards are shaded with, of TEXTURES."""
    return ("base", "alpha", "noise", "tangent" if has_tangent_map else "shift")


def _texture(textures: HairTextures, name: str) -> Any:
    """One texture as RGBA or one channel, filtered linearly."""
    picture: Floats = getattr(textures, name)
    if picture.ndim == 2:
        texture = texture_from(picture[..., None], "R32F")
    else:
        opaque = np.ones((*picture.shape[:2], 1), np.float32)
        texture = texture_from(np.concatenate([picture, opaque], axis=-1), "RGBA16F")
    texture.extend_mode("REPEAT" if name in _REPEATED else "EXTEND")
    return texture


def _batch(mesh: CardMesh) -> Any:
    layout = gpu.types.GPUVertFormat()
    for name, length in _ATTRIBUTES.items():
        layout.attr_add(id=name, comp_type="F32", len=length, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, len(mesh.positions))
    values = {
        "position": mesh.positions,
        "occlusion": mesh.occlusion[:, None],
        "along": mesh.along[:, None],
    }
    for name in _ATTRIBUTES:  # a CardMesh holds contiguous float32, as attr_fill needs it
        vertices.attr_fill(name, values[name] if name in values else getattr(mesh, name))
    indices = gpu.types.GPUIndexBuf(type="TRIS", seq=mesh.triangles)
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=indices)
