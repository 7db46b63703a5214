"""Draws hair cards into whatever target is bound, by the four passes of Scheuermann 2004.

    prime depth              opaque pixels alone, no colours
    opaque                   shades them, where the depth is equal
    transparent back faces   over what is there, without depth
    transparent front faces  over that, with depth, so that nothing farther comes over them later;
                             clear pixels, which would hide it as well, are left out by choice

The first alone tests alpha, so that in the others hidden pixels are left out before they are
shaded. The author's simpler scheme has three passes, each with a test. Either draws triangles as
they stand, or sorted by card for the eye; exchange/cards/sidecar.py lists the states, for engines
too. Opaque meshes have to be drawn before.

Textures have their mip maps in them, see card_textures.py. Seen at a slant, cards of a baked atlas
cover as much as their strands do, see shading/card_look.py.

Limitations: what cards.sort says of the order. Front faces that are nearly clear write depth, as
the paper has it, and hide what is behind them but drawn later: an eighth of what thin hair covers.
Baked cards are made so much denser (card_look.MEAN_FACING).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import gpu

from ..cards.drawing_settings import CardDrawingSettings
from ..exchange.cards.sidecar import FOUR_PASSES, OPAQUE_ALPHA, THREE_PASSES, DrawPass
from ..params.glsl import struct_values
from ..shading.lights import kept_lights, kinds_needed, pack_lights
from ..shading.marschner.look import pack_fibre
from .camera import Camera
from .card_batches import CardBatches
from .card_opacity import CardOpacity
from .card_recipe import PRIME_RECIPE, CardShading
from .card_snapshot import CardSnapshot
from .card_textures import CardTextures, tiles_of
from .display import Display
from .marschner_textures import MARSCHNER
from .opacity_maps import OpacityMaps
from .shader_program import program, released_with_shaders
from .shader_source import output_index
from .snapshot import Snapshot
from .textures import UniformBlock, drawing_state
from .view_block import view_values

_BLOCKS = ("view", "lights", "shading", "fibre", "opacity")
#: from this alpha on a card is what stands in a pixel, for depth and object masks
_PRESENT_ALPHA = 0.5


@dataclass(frozen=True)
class _Shaded:
    """All that the passes which shade bind."""

    shading: CardShading
    blocks: dict[str, Any]
    textures: dict[str, Any]
    integers: dict[str, int]
    numbers: dict[str, Any]


class CardPass:
    """Keeps the cards of the last snapshot on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self._opacity = CardOpacity()
        self._batches = CardBatches()
        self.release()
        released_with_shaders(self)

    def opacity(self, snapshot: Snapshot) -> OpacityMaps | None:
        """How much hair lies between each light and every place, as StrandPass.opacity of strands.

        Raises:
            ShaderError: as `draw`.
        """
        cards = _drawn(snapshot)
        if cards is None or snapshot.volume.shadows == "none":
            return None
        self._take_textures(cards)
        return self._opacity.of(
            cards.mesh,
            self._batches.static(cards),
            self._textures.of("alpha"),
            snapshot.lights,
            snapshot.volume,
            snapshot.all_casters,
            cards.thickness,
            is_even=cards.is_even,
        )

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
            opacity: of the hair that shades them, such as their own, see `opacity`.
            output, display: as in StrandPass.draw.

        Raises:
            ShaderError: a shader does not compile here.
        """
        cards = _drawn(snapshot)
        if cards is None:
            return
        self._take_textures(cards)
        batches = self._batches.of(cards, camera.eye)
        shaded = self._shaded(snapshot, cards, camera, (width, height), opacity, display)
        shaded.integers["output_encoding"] = output_index(output)
        for each in passes_of(cards.drawing):
            batch = batches["back" if each.cull == "front" else "front"]
            with _state_of(each):
                if each.color_write:
                    _draw_shaded(each, shaded, batch)
                else:
                    self._draw_depth(shaded.blocks["view"], batch, OPAQUE_ALPHA, sharpness=1.0)

    def draw_depth(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        least_alpha: float = _PRESENT_ALPHA,
    ) -> None:
        """The depth of the cards alone, wherever they cover at least so much.

        Raises:
            ShaderError: as `draw`.
        """
        cards = _drawn(snapshot)
        if cards is None:
            return
        self._take_textures(cards)
        view = self._blocks["view"].holding(view_values(camera, width, height))
        with _state_of(FOUR_PASSES[0]):
            self._draw_depth(view, self._batches.static(cards), least_alpha, sharpness=0.0)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for name in _BLOCKS}
        self._opacity.release()
        self._batches.release()
        self._own_textures = self._textures = CardTextures()

    def _take_textures(self, cards: CardSnapshot) -> None:
        self._textures = cards.device or self._own_textures
        self._textures.upload(cards)

    def _shaded(
        self,
        snapshot: Snapshot,
        cards: CardSnapshot,
        camera: Camera,
        size: tuple[int, int],
        opacity: OpacityMaps | None,
        display: Display | None,
    ) -> _Shaded:
        look = snapshot.shading
        is_marschner = look.model == "marschner"
        shading = CardShading(
            model=look.model,
            has_tangent_map=cards.has_tangent_map,
            has_normal_map=cards.textures.normal is not None,
            has_display=display is not None,
            is_even=cards.is_even,
            opacity=None if opacity is None else opacity.form,
            scatters=opacity is not None and is_marschner and snapshot.volume.scattering,
            light_kinds=kinds_needed(kept_lights(snapshot.lights)),
        )
        values = {
            "view": view_values(camera, *size),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            "shading": struct_values(look),
        }
        textures = {f"{name}_texture": self._textures.of(name) for name in shading.textures}
        numbers: dict[str, Any] = {"atlas_tiles": tiles_of(cards.mesh.atlas)}
        if is_marschner:
            values["fibre"] = pack_fibre(look)
            textures |= MARSCHNER.of(look, snapshot.table_size)
        if shading.scatters:
            textures |= MARSCHNER.shares(look, snapshot.table_size)
            numbers["scatter_density"] = snapshot.volume.density
            numbers["skin_color"] = snapshot.skin_color
        if opacity is not None:
            values["opacity"] = opacity.values
            textures |= opacity.textures
            numbers["card_thickness"] = cards.thickness
        if display is not None:
            textures["display_table"] = display.table.texture
            numbers["display_shaper"] = display.shaper
        blocks = {name: self._blocks[name].holding(values[name]) for name in values}
        return _Shaded(shading, blocks, textures, {}, numbers)

    def _draw_depth(self, view: Any, batch: Any, least_alpha: float, *, sharpness: float) -> None:
        """Pixels of that alpha alone, by a shader that asks for nothing else.

        Args:
            sharpness: 1 chooses mip maps as shading does; 0 asks the picture itself, of which small
                pixels meet as many that are opaque as large ones.
        """
        shader = program(PRIME_RECIPE)
        textures = {"alpha_texture": self._textures.of("alpha")}
        numbers = {
            "opaque_alpha": least_alpha,
            "sharpness": sharpness,
            "atlas_tiles": self._textures.tiles,
        }
        shader.bind(blocks={"view": view}, textures=textures, numbers=numbers)
        batch.draw(shader.shader)


def passes_of(drawing: CardDrawingSettings) -> tuple[DrawPass, ...]:
    """The passes of a scheme, as `draw` goes through them."""
    if drawing.passes == "three":
        return THREE_PASSES
    if drawing.skip_clear:
        return FOUR_PASSES
    return (*FOUR_PASSES[:-1], replace(FOUR_PASSES[-1], pixels="all"))


def _drawn(snapshot: Snapshot) -> CardSnapshot | None:
    cards = snapshot.cards
    return None if cards is None or not len(cards.mesh.triangles) else cards


def _draw_shaded(each: DrawPass, shaded: _Shaded, batch: Any) -> None:
    clip = each.alpha_range
    shader = program(replace(shaded.shading, is_clipped=clip is not None).recipe)
    shader.bind(
        blocks=shaded.blocks,
        textures=shaded.textures,
        integers={**shaded.integers, "is_opaque": int(not each.is_blended)},
        numbers=shaded.numbers if clip is None else {**shaded.numbers, "alpha_range": clip},
    )
    batch.draw(shader.shader)


@contextmanager
def _state_of(each: DrawPass) -> Iterator[None]:
    """The state of a pass, and afterwards what was there before."""
    blend = "ALPHA_PREMULT" if each.is_blended else "NONE"
    depth_test = each.depth_test.upper()
    with drawing_state(depth_test=depth_test, depth_write=each.depth_write, blend=blend):
        gpu.state.face_culling_set(each.cull.upper())
        gpu.state.color_mask_set(*(each.color_write,) * 4)
        yield
