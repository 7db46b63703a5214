"""Draws hair cards into opacity maps, see opacity_maps.py.

A card's triangles add the optical depth of its alpha (shading/volume/card_opacity.py) to all layers
that end behind them. Deep layers lie between the first and the last card that are not clear, which
are found by two depth buffers of the map's size.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..cards.card_mesh import CardMesh
from ..exchange.cards.sidecar import MIN_ALPHA
from ..shading.lights import packed_lights
from ..shading.volume.light_frame import Ball, ball_around
from .card_snapshot import CardSnapshot
from .card_textures import tiles_of
from .feature_programs import UniformBlocks, bound
from .opacity_maps import OpacityDrawing, OpacityMaps
from .opacity_starts import draw_starts
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe
from .snapshot import Snapshot

_INPUTS = (("VEC3", "position"), ("VEC2", "uv"), ("VEC3", "tangent"))
_VARYINGS = (
    ("smooth", "VEC2", "card_uv"),
    ("smooth", "FLOAT", "strand_depth"),
    ("smooth", "VEC3", "card_point"),
    ("smooth", "VEC3", "card_tangent"),
    ("smooth", "VEC3", "light_direction"),
)
_LAYERS_RECIPE = ShaderRecipe(
    name="opacity_cards",
    vertex="opacity_card.vert.glsl",
    fragment="opacity.frag.glsl",
    structs=("struct_opacity.glsl",),
    numbers=(("FLOAT", "card_thickness"), ("FLOAT", "lit_level")),
    inputs=_INPUTS,
    varyings=_VARYINGS,
    defines=(("DEEP", 0), ("CARDS", 1), ("LAYERED", 0)),
)
_DEPTH_RECIPE = ShaderRecipe(
    name="opacity_card_depth",
    vertex="opacity_card.vert.glsl",
    fragment="opacity_card_depth.frag.glsl",
    structs=("struct_opacity.glsl",),
    numbers=(("FLOAT", "min_alpha"),),
    inputs=_INPUTS,
    varyings=_VARYINGS,
)


@dataclass(frozen=True, eq=False)
class _Cards:
    """Cards on the GPU; see CardSnapshot for thickness and is_view_compensated."""

    state: Hashable
    blocks: UniformBlocks
    batch: Any
    alpha: Any
    tiles: tuple[float, float]
    thickness: float
    is_view_compensated: bool
    is_layered: bool
    lit_level: int

    @property
    def feature(self) -> ShaderFeature:
        return ShaderFeature(
            name="view_compensated" * self.is_view_compensated + "layered" * self.is_layered,
            textures={"alpha_texture": ("FLOAT_2D", self.alpha)},
            numbers={"atlas_tiles": ("VEC2", self.tiles)},
            defines={
                "VIEW_COMPENSATED": int(self.is_view_compensated),
                "LAYERED": int(self.is_layered),
            },
        )

    def draw_layers(self, features: Sequence[ShaderFeature]) -> None:
        shader = bound(
            _LAYERS_RECIPE,
            [*features, self.feature],
            self.blocks,
            numbers={"card_thickness": self.thickness, "lit_level": self.lit_level},
        )
        self.batch.draw(shader.shader)

    def draw_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        """Draw the depths of the first and the last card into `maps.starts`."""

        def draw() -> None:
            features, numbers = [place, maps.mesh_feature, self.feature], {"min_alpha": MIN_ALPHA}
            shader = bound(_DEPTH_RECIPE, features, self.blocks, numbers=numbers)
            self.batch.draw(shader.shader)

        draw_starts(maps, number, maps.size.side, draw)


class CardOpacity:
    """The opacity maps of one set of cards. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._drawing, self._blocks = OpacityDrawing(), UniformBlocks()
        self._drawn: tuple[Any, Any] = (None, None)
        self._serial = 0
        self._extent: tuple[CardMesh | None, Ball] = (None, Ball(np.zeros(3), 1.0))

    def maps(self, cards: CardSnapshot, batch: Any, alpha: Any, snapshot: Snapshot) -> OpacityMaps:
        """The maps of these cards in the lights of a snapshot, drawn only when something changed.

        Args:
            batch: the mesh on the GPU. alpha: its alpha texture. Pass a new object for each change.
        """
        if self._drawn[0] is not batch or self._drawn[1] is not alpha:
            self._drawn, self._serial = (batch, alpha), self._serial + 1
        mesh = cards.mesh
        if self._extent[0] is not mesh:
            self._extent = mesh, ball_around(mesh.positions)
        state = self._serial, cards.thickness, cards.is_view_compensated, cards.is_layered
        tiles = tiles_of(mesh.atlas)
        hair = _Cards(
            state,
            self._blocks,
            batch,
            alpha,
            tiles,
            cards.thickness,
            cards.is_view_compensated,
            cards.is_layered,
            cards.lit_level,
        )
        lights = packed_lights(snapshot.lights)
        return self._drawing.maps(
            hair, self._extent[1], lights, snapshot.volume, snapshot.all_casters
        )
