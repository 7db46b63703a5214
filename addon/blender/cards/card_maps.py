"""The maps of a groom's cards: baked from its strands or made by chance, with the artist's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats
from ...cards.build import CardBuild
from ...params import SettingsMap
from ...pipeline import Rig
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.texture_settings import TextureSettings
from ...shading.textures import TEXTURES, HairTextures, hair_textures
from .card_atlas import AtlasDraw, baked_atlas, drawn_maps


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
    rig: Rig,
    build: CardBuild,
    settings: SettingsMap,
    pictures: Mapping[str, Floats],
    draw: AtlasDraw = drawn_maps,
) -> CardMaps:
    """The maps of these cards.

    Shift and noise break up highlights from strand to strand and are made by chance in any case.

    Args:
        pictures: that take the place of maps, by name.
        draw: see `card_atlas.baked_atlas`.
    """
    texture = settings[TextureSettings]
    made = hair_textures(texture, build.finest.atlas.columns)
    if build.plan is None:
        textures = made.with_pictures(pictures)
        by_name = {name: getattr(textures, name) for name in TEXTURES}
        return CardMaps(by_name, textures, texture.highlights)
    maps = baked_atlas(rig, build.plan, settings[ShadingSettings], settings[StrandSettings], draw)
    # as many strips above each other as the atlas has rows
    rows = (build.plan.grid.rows, 1)
    noises = {"shift": np.tile(made.shift, rows), "noise": np.tile(made.noise, rows)}
    by_name = {**maps.by_name, **noises, **pictures}
    gain = 1.0 if "base" in pictures else maps.base_gain
    names = ("alpha", "shift", "noise", "tangent", "normal")
    shown = {name: by_name[name] for name in names}
    textures = HairTextures(base=by_name["base"] * gain, **shown)
    return CardMaps(by_name, textures, "tangent", gain, is_even="alpha" not in pictures)
