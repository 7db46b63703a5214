"""Settings become cards here, whoever shows them, writes them or puts them into the scene."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field

import bpy

from ...arrays import Floats
from ...card_flow import card_build_steps
from ...cards.atlas_settings import AtlasSettings
from ...cards.build import CardBuild
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...pipeline import Rig
from ...shading.ambient import AmbientSettings
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.textures import TextureSettings
from ..properties.card_form import CardForm
from ..properties.choices import Choices
from .card_images import chosen_pictures
from .card_maps import CardMaps, made_maps
from .occluders import OtherHair, read_other_hair


@dataclass(frozen=True)
class CardChoices:
    """All that cards hang on.

    pictures: what takes the place of generated textures, see `textures.picture_as`.
    others: hair of other grooms, which shades these, where it is while these are at rest.
    ambient: of the strands, whose occlusion the cards take over.
    """

    cards: CardSettings
    atlas: AtlasSettings
    occlusion: CardOcclusionSettings
    texture: TextureSettings
    shading: ShadingSettings
    strands: StrandSettings
    pictures: Mapping[str, Floats] = field(default_factory=dict)
    others: OtherHair = field(default_factory=OtherHair)
    ambient: AmbientSettings = field(default_factory=AmbientSettings)

    @classmethod
    def of(
        cls, form: CardForm, pictures: Mapping[str, Floats], others: OtherHair | None = None
    ) -> CardChoices:
        """A form with the pictures themselves, and with the hair of other grooms."""
        return cls(
            form.cards,
            form.atlas,
            form.occlusion,
            form.texture,
            form.shading,
            form.strands,
            pictures,
            OtherHair() if others is None else others,
            form.ambient,
        )


def card_choices(hair: bpy.types.Object) -> tuple[CardChoices, tuple[str, ...]]:
    """What the groom's own settings say of its cards, and warnings of pictures that are no use."""
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    form = Choices.of(hair).card_form
    return CardChoices.of(form, pictures, read_other_hair(form.occlusion, hair)), warnings


@dataclass(frozen=True)
class MadeCards:
    """Cards at rest, and their maps. notes: what the artist should know."""

    build: CardBuild
    maps: CardMaps
    notes: tuple[str, ...] = ()


#: Makes the maps of cards, which is the main thread's work where the GPU bakes them.
type MapsOf = Callable[[CardBuild], CardMaps]


def making_steps(
    rig: Rig, choices: CardChoices, maps_of: MapsOf | None = None
) -> Generator[str, None, MadeCards]:
    """Cards with their maps; each step tells what comes next.

    Args:
        maps_of: None makes them here.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    made: list[CardMaps] = []

    def alpha_of(build: CardBuild) -> Floats:
        made.append(made_maps(rig, build, choices) if maps_of is None else maps_of(build))
        return made[-1].textures.alpha

    yield "Other hair"
    others, notes = choices.others.shades()
    build = yield from card_build_steps(
        rig,
        choices.cards,
        choices.atlas,
        choices.occlusion,
        alpha_of,
        choices.strands,
        others,
        choices.ambient,
    )
    return MadeCards(build, made[-1], (*build.notes, *notes))


def order_line(wrong_share: float) -> str:
    """How often the order of cards is wrong, such as "Order: 18 % of pixels wrong"."""
    return f"Order: {100.0 * wrong_share:.0f} % of pixels wrong"
