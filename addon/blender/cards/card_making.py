"""Settings become cards here, whoever shows them, writes them or puts them into the scene."""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Mapping
from dataclasses import dataclass, field

import bpy

from ...arrays import Floats
from ...card_flow import card_build_steps
from ...cards.atlas_settings import AtlasSettings
from ...cards.build import CardBuild
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...params import SettingsMap
from ...pipeline import Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.texture_settings import TextureSettings
from ..properties.groom_settings import GroomSettings
from .card_maps import CardMaps, made_maps
from .occluders import OtherHair, read_other_hair
from .textures import chosen_pictures


@dataclass(frozen=True, eq=False)
class CardInputs:
    """All that cards are built from, beside the rig.

    pictures: what takes the place of generated textures, see `textures.picture_as`.
    others: hair of other grooms, which shades these, where it is while these are at rest.
    """

    settings: SettingsMap
    pictures: Mapping[str, Floats] = field(default_factory=dict)
    others: OtherHair = field(default_factory=OtherHair)


def cards_key(groom: GroomSettings) -> Hashable:
    """The same for settings that give the same cards.

    Of the strands in the atlas a change of colours alone counts as none, since the atlas holds how
    strands differ from the mean, which colours hardly change.
    """
    kinds = CardSettings, AtlasSettings, CardOcclusionSettings, TextureSettings
    look = groom[ShadingSettings]
    return (
        groom.sections.only(*kinds, StrandSettings, AmbientSettings),
        (look.model, look.color_variation, look.grey_share),
        groom.card_pictures,
    )


def card_inputs(hair: bpy.types.Object) -> tuple[CardInputs, tuple[str, ...]]:
    """What the groom's own settings say of its cards, and warnings of pictures that are no use."""
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    settings = GroomSettings.of(hair).sections
    others = read_other_hair(settings[CardOcclusionSettings], hair)
    return CardInputs(settings, pictures, others), warnings


@dataclass(frozen=True)
class MadeCards:
    """Cards at rest, and their maps. notes: what the artist should know."""

    build: CardBuild
    maps: CardMaps
    notes: tuple[str, ...] = ()


#: Makes the maps of cards, which is the main thread's work where the GPU bakes them.
type MapsOf = Callable[[CardBuild], CardMaps]


def making_steps(
    rig: Rig, inputs: CardInputs, maps_of: MapsOf | None = None
) -> Generator[str, None, MadeCards]:
    """Cards with their maps; each step tells what comes next.

    Args:
        maps_of: None makes them here.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    made: list[CardMaps] = []

    def alpha_of(build: CardBuild) -> Floats:
        made.append(
            made_maps(rig, build, inputs.settings, inputs.pictures)
            if maps_of is None
            else maps_of(build)
        )
        return made[-1].textures.alpha

    yield "Other hair"
    others, notes = inputs.others.shades()
    settings = inputs.settings
    build = yield from card_build_steps(
        rig,
        settings[CardSettings],
        settings[AtlasSettings],
        settings[CardOcclusionSettings],
        alpha_of,
        settings[StrandSettings],
        others,
        settings[AmbientSettings],
    )
    return MadeCards(build, made[-1], (*build.notes, *notes))


def order_line(wrong_share: float) -> str:
    """How often the order of cards is wrong, such as "Order: 18 % of pixels wrong"."""
    return f"Order: {100.0 * wrong_share:.0f} % of pixels wrong"
