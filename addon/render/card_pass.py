"""Draws hair cards into the bound framebuffer, by the four passes of Scheuermann 2004.

    prime depth              opaque pixels only, no colours
    opaque                   shades these, with the depth test EQUAL
    transparent back faces   blended over the picture, without writing depth
    transparent front faces  blended over that, writing depth, so that nothing farther is drawn over
                             them later; optionally without clear pixels, which would hide it too

Only the first pass tests alpha, so that in the others the early depth test discards hidden pixels
before they are shaded. The author's simpler scheme has three passes, each with an alpha test. Both
draw triangles in the order of the mesh, or sorted by card for the eye. exchange/cards/sidecar.py
lists the states, also for engines. Opaque meshes must be drawn first.

Textures contain their mip maps, see card_textures.py. Seen at a slant, cards of a baked atlas keep
the coverage of their strands, see shading/card_look.py.

Limitations: those of the order, see cards.sort. Nearly clear front faces write depth, as in the
paper, and hide farther hair that is drawn later: an eighth of what thin hair covers. Baked cards
are made denser by as much (card_look.MEAN_FACING).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import gpu

from ..cards.drawing_settings import CardDrawingSettings
from ..exchange.cards.sidecar import FOUR_PASSES, OPAQUE_ALPHA, THREE_PASSES, DrawPass
from ..params.glsl import struct_values
from ..shading.drawn_strands import in_color
from ..shading.settings import ShadingSettings
from .camera import Camera
from .card_batches import ATTRIBUTES, CardBatches
from .card_opacity import CardOpacity
from .card_snapshot import CardSnapshot
from .card_textures import CardTextures, tiles_of
from .display import Display
from .feature_programs import UniformBlocks, bound
from .marschner_textures import marschner_feature, scattering_feature
from .opacity_maps import OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe, released_with_shaders
from .shader_source import output_index
from .snapshot import Snapshot
from .textures import drawing_state
from .view_block import lights_feature, view_feature

_INPUTS = tuple(
    ("FLOAT" if length == 1 else f"VEC{length}", name) for name, length in ATTRIBUTES.items()
)

_PRIME_RECIPE = ShaderRecipe(
    name="card_prime",
    vertex="card.vert.glsl",
    fragment="card.frag.glsl",
    structs=("struct_view.glsl",),
    textures=(("FLOAT_2D", "alpha_texture"),),
    numbers=(("FLOAT", "opaque_alpha"), ("FLOAT", "sharpness"), ("VEC2", "atlas_tiles")),
    inputs=_INPUTS,
    varyings=(("smooth", "VEC2", "card_uv"),),
    outputs=(("VEC4", "color"),),
    defines=(("PRIME", 1),),
)
#: shading; features add the optional parts
_SHADED_RECIPE = ShaderRecipe(
    name="card",
    vertex="card.vert.glsl",
    fragment="card.frag.glsl",
    structs=("struct_view.glsl", "struct_lights.glsl", "struct_fibre.glsl", "struct_opacity.glsl"),
    settings=(ShadingSettings,),
    integers=("is_opaque", "output_encoding"),
    inputs=_INPUTS,
    varyings=(
        ("smooth", "VEC2", "card_uv"),
        ("smooth", "VEC3", "card_point"),
        ("smooth", "VEC3", "card_normal"),
        ("smooth", "VEC3", "card_tangent"),
        ("smooth", "FLOAT", "card_occlusion"),
        ("smooth", "FLOAT", "card_along"),
        *(("smooth", "VEC4", f"card_{name}") for name in ("openness", "received", "beneath")),
        ("smooth", "FLOAT", "card_depth"),
    ),
    outputs=(("VEC4", "color"),),
    defines=(
        *(
            ("PRIME", 0),
            ("CLIPPED", 0),
            ("VIEW_COMPENSATED", 0),
            ("LAYERED", 0),
            ("TANGENT_MAP", 0),
            ("NORMAL_MAP", 0),
            ("PLACE_MAP", 0),
        ),
        *(("MARSCHNER", 0), ("SHADOWS", 0), ("SCATTERING", 0)),
    ),
)
#: alpha from which a card counts as present in a pixel, for depth and object masks
_PRESENT_ALPHA = 0.5


class CardPass:
    """The cards of the last snapshot on the GPU. Creating one does not touch the GPU.

    notes: notes to the artist on their last maps, each with its remedy.
    """

    def __init__(self) -> None:
        self.notes: tuple[str, ...] = ()
        self._opacity = CardOpacity()
        self._batches = CardBatches()
        self.release()
        released_with_shaders(self)

    def opacity(self, snapshot: Snapshot) -> OpacityMaps | None:
        """The opacity maps of the cards, as StrandPass.opacity for strands; None without shadows.

        Raises:
            ShaderError: as `draw`.
        """
        cards, self.notes = _drawn(snapshot), ()
        if cards is None or snapshot.volume.shadows == "none":
            return None
        self._take_textures(cards)
        batch, alpha = self._batches.static(cards), self._textures.texture("alpha")
        maps = self._opacity.maps(cards, batch, alpha, snapshot)
        self.notes = (maps.note,) if maps.note else ()
        return maps

    def draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        opacity: OpacityMaps | None = None,
        output: str = "scene_linear",
        display: Display | None = None,
    ) -> None:
        """Draw the snapshot's cards into the bound framebuffer: premultiplied, scene-linear.

        Args:
            width, height: of the target [pixels].
            opacity: maps of the hair that shades them, such as their own, see `opacity`.
            output, display: as in StrandPass.draw.

        Raises:
            ShaderError: a shader does not compile here.
        """
        cards = _drawn(snapshot)
        if cards is None:
            return
        self._take_textures(cards)
        if cards.base_color is not None:
            shading = in_color(cards.base_color, snapshot.shading)
            snapshot = replace(snapshot, shading=shading)
        batches = self._batches.sorted_batches(cards, camera.eye)
        view = view_feature(camera, width, height)
        features = (view, *self._shading(snapshot, cards, opacity))
        if display is not None:
            features = (*features, display.feature)
        encoding = output_index(output)
        for each in passes_of(cards.drawing):
            batch = batches["back" if each.cull == "front" else "front"]
            with _state_of(each):
                if each.color_write:
                    self._draw_shaded(each, features, batch, encoding)
                else:
                    self._draw_depth(view, batch, OPAQUE_ALPHA, sharpness=1.0)

    def draw_depth(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        min_alpha: float = _PRESENT_ALPHA,
    ) -> None:
        """Draw only the depth of the cards, where their alpha is at least `min_alpha`.

        Raises:
            ShaderError: as `draw`.
        """
        cards = _drawn(snapshot)
        if cards is None:
            return
        self._take_textures(cards)
        view = view_feature(camera, width, height)
        with _state_of(FOUR_PASSES[0]):
            self._draw_depth(view, self._batches.static(cards), min_alpha, sharpness=0.0)

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._blocks = UniformBlocks()
        self._opacity.release()
        self._batches.release()
        self._own_textures = self._textures = CardTextures()

    def _take_textures(self, cards: CardSnapshot) -> None:
        self._textures = cards.device or self._own_textures
        self._textures.upload(cards)

    def _shading(
        self, snapshot: Snapshot, cards: CardSnapshot, maps: OpacityMaps | None
    ) -> Iterator[ShaderFeature]:
        """The features of all programs that shade these cards."""
        yield lights_feature(snapshot)
        yield self._maps_feature(cards)
        yield ShaderFeature(
            blocks={"shading": ("ShadingSettings", struct_values(snapshot.shading))},
            defines={
                "VIEW_COMPENSATED": int(cards.is_view_compensated),
                "LAYERED": int(cards.is_layered),
            },
        )
        is_marschner = snapshot.shading.model == "marschner"
        if is_marschner:
            yield marschner_feature(snapshot)
        if maps is not None:
            yield maps.feature
            numbers = {
                "card_thickness": ("FLOAT", cards.thickness),
                "lit_level": ("FLOAT", cards.lit_level),
            }
            yield ShaderFeature(numbers=numbers)
        if maps is not None and is_marschner and snapshot.volume.scattering:
            yield scattering_feature(snapshot)

    def _maps_feature(self, cards: CardSnapshot) -> ShaderFeature:
        """The feature of programs that read the textures of these cards."""
        has_normal, has_tangent = cards.textures.normal is not None, cards.has_tangent_map
        has_place = cards.textures.place is not None
        names = ["base", "alpha", "noise", "tangent" if has_tangent else "shift"]
        names += ["normal"] * has_normal + ["place"] * has_place
        return ShaderFeature(
            name="_".join(names[3:]),
            textures={
                f"{name}_texture": ("FLOAT_2D", self._textures.texture(name)) for name in names
            },
            numbers={"atlas_tiles": ("VEC2", tiles_of(cards.mesh.atlas))},
            defines={
                "TANGENT_MAP": int(has_tangent),
                "NORMAL_MAP": int(has_normal),
                "PLACE_MAP": int(has_place),
            },
        )

    def _draw_shaded(
        self, each: DrawPass, features: Sequence[ShaderFeature], batch: Any, encoding: int
    ) -> None:
        """Draw one shaded pass. One that tests alpha may shade hidden pixels too."""
        if each.alpha_range is not None:
            numbers = {"alpha_range": ("VEC2", each.alpha_range)}
            clipped = ShaderFeature(name="clipped", numbers=numbers, defines={"CLIPPED": 1})
            features = [*features, clipped]
        integers = {"is_opaque": int(not each.is_blended), "output_encoding": encoding}
        batch.draw(bound(_SHADED_RECIPE, features, self._blocks, integers=integers).shader)

    def _draw_depth(
        self, view: ShaderFeature, batch: Any, min_alpha: float, *, sharpness: float
    ) -> None:
        """Draw the depth of pixels with at least this alpha, by a shader that reads nothing else.

        Args:
            sharpness: 1 chooses mip maps as shading does; 0 reads level 0, so that the fraction of
                opaque pixels does not depend on their size.
        """
        shader = bound(
            _PRIME_RECIPE,
            [view],
            self._blocks,
            textures={"alpha_texture": self._textures.texture("alpha")},
            numbers={
                "opaque_alpha": min_alpha,
                "sharpness": sharpness,
                "atlas_tiles": self._textures.tiles,
            },
        )
        batch.draw(shader.shader)


def passes_of(drawing: CardDrawingSettings) -> tuple[DrawPass, ...]:
    """The passes of a scheme, in the order of drawing."""
    if drawing.passes == "three":
        return THREE_PASSES
    if drawing.skip_clear:
        return FOUR_PASSES
    return (*FOUR_PASSES[:-1], replace(FOUR_PASSES[-1], pixels="all"))


def _drawn(snapshot: Snapshot) -> CardSnapshot | None:
    cards = snapshot.cards
    return None if cards is None or not len(cards.mesh.triangles) else cards


@contextmanager
def _state_of(each: DrawPass) -> Iterator[None]:
    """Set the GPU state of a pass, and restore it afterwards."""
    blend = "ALPHA_PREMULT" if each.is_blended else "NONE"
    depth_test = each.depth_test.upper()
    with drawing_state(depth_test=depth_test, depth_write=each.depth_write, blend=blend):
        gpu.state.face_culling_set(each.cull.upper())
        gpu.state.color_mask_set(*(each.color_write,) * 4)
        yield
