"""The maps of a groom's cards: baked from its strands or made by chance, with the artist's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ...arrays import Floats
from ...cards.build import CardBuild
from ...pipeline import Rig
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.textures import TEXTURES, HairTextures, TextureSettings, hair_textures
from .card_atlas import AtlasDraw, baked_atlas, drawn_maps


class MapChoices(Protocol):
    """What maps hang on, beside the cards."""

    @property
    def texture(self) -> TextureSettings: ...
    @property
    def shading(self) -> ShadingSettings: ...
    @property
    def strands(self) -> StrandSettings: ...
    @property
    def pictures(self) -> Mapping[str, Floats]: ...


@dataclass(frozen=True)
class CardMaps:
    """by_name: those that are written, see exchange.texture_packing.MEANINGS.

    textures: those that our own pictures are drawn with; their base has the gain in it.
    highlights: what breaks them up, "shift" or "tangent", see TextureSettings: the atlas holds the
        way of its own strands.
    base_gain: what the written base is to be multiplied by.
    is_even: the alpha is that of baked strands, see CardSnapshot.
    """

    by_name: dict[str, Floats]
    textures: HairTextures
    highlights: str
    base_gain: float = 1.0
    is_even: bool = False

    @property
    def has_tangent_map(self) -> bool:
        return self.highlights == "tangent"

    @property
    def card(self) -> Floats:
        """Base as it is written and alpha, (height, width, 4)."""
        return replace(self.textures, base=self.by_name["base"]).card


def made_maps(
    rig: Rig, build: CardBuild, choices: MapChoices, draw: AtlasDraw = drawn_maps
) -> CardMaps:
    """The maps of these cards.

    Shift and noise break up highlights from strand to strand and are made by chance in any case.

    Args:
        draw: see `card_atlas.baked_atlas`.
    """
    made = hair_textures(choices.texture, build.finest.atlas.columns)
    if build.plan is None:
        textures = made.with_pictures(choices.pictures)
        by_name = {name: getattr(textures, name) for name in TEXTURES}
        return CardMaps(by_name, textures, choices.texture.highlights)
    maps = baked_atlas(rig, build.plan, choices.shading, choices.strands, draw)
    # as many strips above each other as the atlas has rows
    rows = (build.plan.grid.rows, 1)
    noises = {"shift": np.tile(made.shift, rows), "noise": np.tile(made.noise, rows)}
    by_name = {**maps.by_name, **noises, **choices.pictures}
    gain = 1.0 if "base" in choices.pictures else maps.base_gain
    names = ("alpha", "shift", "noise", "tangent", "normal")
    shown = {name: by_name[name] for name in names}
    textures = HairTextures(base=by_name["base"] * gain, **shown)
    return CardMaps(by_name, textures, "tangent", gain, is_even="alpha" not in choices.pictures)
