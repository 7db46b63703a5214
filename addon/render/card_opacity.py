"""Draws hair cards into opacity maps, as opacity_pass.py does strands.

A card's triangles add what its alpha stands for (shading/volume/card_opacity.py) to all layers that
end behind them. Deep layers lie between the first and the last card that are not clear: two depth
buffers as large as the map find them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gpu
import numpy as np

from ..cards.card_mesh import CardMesh
from ..exchange.cards.sidecar import LEAST_ALPHA
from ..shading.lights import Light, kept_lights
from ..shading.settings import StrandSettings
from ..shading.volume.light_frame import Ball, ball_around
from ..shading.volume.map_size import START_TEXELS
from ..shading.volume.settings import VolumeSettings
from .card_textures import tiles_of
from .opacity_maps import OpacityMaps
from .opacity_pass import OpacityPass
from .shader_program import ShaderRecipe, program
from .snapshot import Caster
from .textures import drawing_into, drawing_state

_BLOCKS = (("Opacity", "opacity"),)
_INPUTS = (("VEC3", "position"), ("VEC2", "uv"), ("VEC3", "tangent"))
_VARYINGS = (
    ("smooth", "VEC2", "card_uv"),
    ("smooth", "FLOAT", "strand_depth"),
    ("smooth", "VEC3", "card_point"),
    ("smooth", "VEC3", "card_tangent"),
    ("smooth", "VEC3", "light_way"),
)


def card_opacity_recipe(slots: int, *, is_deep: bool, is_even: bool) -> ShaderRecipe:
    """The program that draws cards into so many slots; is_even: see CardSnapshot."""
    starts = (("UINT_2D", "opacity_starts"),) if is_deep else ()
    return ShaderRecipe(
        name=f"opacity_cards_{slots}_{'deep' if is_deep else 'slices'}{'_even' * is_even}",
        vertex="opacity_card.vert.glsl",
        fragment="opacity.frag.glsl",
        structs=("struct_opacity.glsl",),
        blocks=_BLOCKS,
        textures=(("FLOAT_2D", "alpha_texture"), *starts),
        integers=("light_index", "first_texel", *(("map_index",) if is_deep else ())),
        numbers=(("FLOAT", "card_thickness"), ("VEC2", "atlas_tiles")),
        inputs=_INPUTS,
        varyings=_VARYINGS,
        outputs=tuple(("VEC4", f"layers_{slot}") for slot in range(slots)),
        defines=(
            ("TARGETS", slots),
            ("DEEP", int(is_deep)),
            ("CARDS", 1),
            ("EVEN", int(is_even)),
        ),
    )


_DEPTH_RECIPE = ShaderRecipe(
    name="opacity_card_depth",
    vertex="opacity_card.vert.glsl",
    fragment="opacity_card_depth.frag.glsl",
    structs=("struct_opacity.glsl",),
    blocks=_BLOCKS,
    textures=(("FLOAT_2D", "alpha_texture"),),
    integers=("light_index",),
    numbers=(("FLOAT", "least_alpha"), ("VEC2", "atlas_tiles")),
    inputs=_INPUTS,
    varyings=_VARYINGS,
)


_STARTS_RECIPE = ShaderRecipe(
    name="opacity_card_starts",
    compute="opacity_card_starts.comp.glsl",
    textures=(("DEPTH_2D", "first_cards"), ("DEPTH_2D", "last_cards")),
    images=(("R32UI", "starts", "READ_WRITE"),),
    integers=("map_index",),
)


class CardOpacity(OpacityPass):
    """Keeps the maps of one set of cards from draw to draw; making one touches no GPU."""

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it anew."""
        super().release()
        self._batch: Any = None
        self._alpha: Any = None
        self._thickness, self._is_even, self._tiles = 1.0, False, (1.0, 1.0)
        self._serial = 0
        self._extent: tuple[CardMesh | None, Ball] = (None, Ball(np.zeros(3), 1.0))

    def of(
        self,
        mesh: CardMesh,
        batch: Any,
        alpha: Any,
        lights: Sequence[Light],
        settings: VolumeSettings,
        casters: tuple[Caster, ...] = (),
        thickness: float = 1.0,
        is_even: bool = False,
    ) -> OpacityMaps:
        """The maps of these cards.

        Args:
            batch: the mesh on the GPU. alpha: its texture; another object whenever it is another.
            lights, casters: as in OpacityPass.maps.
            thickness, is_even: see CardSnapshot.
        """
        counted = self._thickness, self._is_even
        is_same = self._batch is batch and self._alpha is alpha and counted == (thickness, is_even)
        if not is_same:
            self._batch, self._alpha, self._serial = batch, alpha, self._serial + 1
            self._thickness, self._is_even = thickness, is_even
        self._tiles = tiles_of(mesh.atlas)
        if self._extent[0] is not mesh:
            self._extent = mesh, ball_around(mesh.positions)
        ball, lit_by = self._extent[1], kept_lights(lights)
        strands = StrandSettings()
        return self.maps(None, self._serial, (1, 2), ball, lit_by, settings, strands, casters)

    def _draw_map(
        self, maps: OpacityMaps, number: int, light: int, hair: Any, settings: VolumeSettings
    ) -> None:
        """The map of one light: where its layers start, then what they hold."""
        blocks = {"opacity": self._blocks["opacity"].buffer}
        textures, integers = {"alpha_texture": self._alpha}, {"light_index": light}
        if maps.starts is not None:
            self._draw_starts(maps, number, light)
            textures["opacity_starts"] = maps.starts
            integers["map_index"] = number
        slots, passes = len(maps.slots), maps.passes
        is_deep = maps.starts is not None
        shader = program(card_opacity_recipe(slots, is_deep=is_deep, is_even=self._is_even))
        for turn in range(passes):
            layer = number * passes + turn
            target = gpu.types.GPUFrameBuffer(
                color_slots=tuple({"texture": slot, "layer": layer} for slot in maps.slots)
            )
            with (
                drawing_into(target),
                drawing_state(depth_test="NONE", depth_write=False, blend="ADDITIVE_PREMULT"),
            ):
                target.clear(color=(0.0, 0.0, 0.0, 0.0))
                shader.bind(
                    blocks=blocks,
                    textures=textures,
                    integers={**integers, "first_texel": turn * slots},
                    numbers={"card_thickness": self._thickness, "atlas_tiles": self._tiles},
                )
                self._batch.draw(shader.shader)

    def _draw_starts(self, maps: OpacityMaps, number: int, light: int) -> None:
        """Depths of the first and the last card, then the outermost of each block of texels."""
        depths = {
            "first_cards": self._depths(maps, light, "LESS_EQUAL", 1.0),
            "last_cards": self._depths(maps, light, "GREATER_EQUAL", 0.0),
        }
        shader = program(_STARTS_RECIPE)
        shader.bind(textures=depths, images={"starts": maps.starts}, integers={"map_index": number})
        groups = -(-maps.size.side // START_TEXELS // 8)
        gpu.compute.dispatch(shader.shader, groups, groups, 1)
        gpu.shader.unbind()

    def _depths(self, maps: OpacityMaps, light: int, depth_test: str, none: float) -> Any:
        """A texture with the depth of the one card in each texel that wins; `none` without any."""
        side = maps.size.side
        depths = gpu.types.GPUTexture((side, side), format="DEPTH_COMPONENT32F")
        target = gpu.types.GPUFrameBuffer(depth_slot=depths)
        shader = program(_DEPTH_RECIPE)
        with drawing_into(target), drawing_state(depth_test=depth_test):
            target.clear(depth=none)
            shader.bind(
                blocks={"opacity": self._blocks["opacity"].buffer},
                textures={"alpha_texture": self._alpha},
                integers={"light_index": light},
                numbers={"least_alpha": LEAST_ALPHA, "atlas_tiles": self._tiles},
            )
            self._batch.draw(shader.shader)
        return depths
