"""All that the artist has set for one groom, checked."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from ...cards.atlas_settings import AtlasSettings
from ...cards.drawing_settings import CardDrawingSettings
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...params import Settings
from ...refine.settings import DetailSettings
from ...shading.ambient import AmbientSettings
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.shafts_settings import ShaftSettings
from ...shading.skin.settings import SkinSettings
from ...shading.textures import TextureSettings
from ...shading.volume.settings import VolumeSettings
from .card_form import CardForm, CardsDrawn
from .card_group import picture_names
from .properties import settings_of


@dataclass(frozen=True)
class Choices:
    """The settings of the curves, and those of their object.

    card_pictures: names of pictures in the place of textures, see shown_cards.picture_names.
    children_density: vertex group or attribute of the head, by name; empty: none.
    debug_view: what strands are coloured by, see render.snapshot.DEBUG_VIEWS.
    """

    guides: GuideSettings
    children: ChildrenSettings
    detail: DetailSettings
    ambient: AmbientSettings
    shading: ShadingSettings
    strands: StrandSettings
    volume: VolumeSettings
    skin: SkinSettings
    shafts: ShaftSettings
    dynamics: DynamicsSettings
    cards: CardSettings
    atlas: AtlasSettings
    card_occlusion: CardOcclusionSettings
    card_texture: TextureSettings
    card_drawing: CardDrawingSettings
    card_pictures: tuple[tuple[str, str], ...] = ()
    children_density: str = ""
    debug_view: str = "none"

    @classmethod
    def of(cls, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph | None = None) -> Choices:
        """What is set at the moment.

        Blender writes animated and driven settings into the data itself only where a window shows
        them. A render has them in its own copies alone, which in a window lag behind edits.

        Args:
            hair: not the evaluated copy.
            depsgraph: where the hair is shown or rendered.
        """
        groom, character = hair.data.hairloom, hair.hairloom
        if depsgraph is not None and depsgraph.mode == "RENDER":
            groom = hair.data.evaluated_get(depsgraph).hairloom
            character = hair.evaluated_get(depsgraph).hairloom
        return cls(
            settings_of(groom.guides, GuideSettings),
            settings_of(groom.children, ChildrenSettings),
            settings_of(groom.detail, DetailSettings),
            settings_of(groom.ambient, AmbientSettings),
            settings_of(groom.shading, ShadingSettings),
            settings_of(groom.strands, StrandSettings),
            settings_of(groom.volume, VolumeSettings),
            settings_of(groom.skin, SkinSettings),
            settings_of(groom.shafts, ShaftSettings),
            settings_of(character.dynamics, DynamicsSettings),
            settings_of(groom.cards, CardSettings),
            settings_of(groom.atlas, AtlasSettings),
            settings_of(groom.card_occlusion, CardOcclusionSettings),
            settings_of(groom.card_texture, TextureSettings),
            settings_of(groom.card_drawing, CardDrawingSettings),
            picture_names(groom.card_images),
            character.children_density,
            character.debug_view,
        )

    @property
    def shows_cards(self) -> bool:
        """Whether cards are shown in place of the strands."""
        return self.card_drawing.shown_as == "cards"

    @property
    def cards_drawn(self) -> CardsDrawn:
        """What acts on cards at once."""
        return self.card_drawing, self.strands

    @property
    def card_form(self) -> CardForm:
        """What cards are built by."""
        return CardForm(
            self.cards,
            self.atlas,
            self.card_occlusion,
            self.card_texture,
            self.strands,
            self.card_pictures,
            self.shading,
            self.ambient,
        )

    @property
    def of_rig(self) -> tuple[Settings | str, ...]:
        """What decides which strands and guides there are."""
        if self.children.way == "none":
            return (self.guides,)
        return self.guides, self.children, self.children_density

    def acts_at_once(self, before: Choices) -> bool:
        """Whether only such settings differ that need nothing to be read or made again."""
        return (self.of_rig, self.ambient) == (before.of_rig, before.ambient)

    def at_once(self, before: Choices) -> Choices:
        """These, but for what waits until the hair is read again."""
        return replace(
            self,
            guides=before.guides,
            children=before.children,
            children_density=before.children_density,
            ambient=before.ambient,
        )
