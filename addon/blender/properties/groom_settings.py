"""All settings of one groom, checked, with the effects of wetness and dust applied."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ...cards.drawing_settings import CardDrawingSettings
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import mask_names
from ...groom.settings import GuideSettings
from ...groom.width_settings import WidthSettings
from ...parameters import ALL_SETTINGS, sections_of
from ...params import Owner, Settings, SettingsMap
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings
from ...wet_flow import effective_settings
from .card_group import picture_names
from .properties import settings_of


@dataclass(frozen=True)
class GroomSettings:
    """The settings of the curves and of their object, adjusted where hair is wet or dusty.

    `groom[ShadingSettings]` is one section.

    card_pictures: (texture, picture) by name, of pictures instead of generated textures.
    children_density: vertex group or attribute of the head, by name; empty: none.
    debug_view: the quantity that strands are coloured by, see render.snapshot.DEBUG_VIEWS.
    """

    sections: SettingsMap = field(default_factory=SettingsMap)
    card_pictures: tuple[tuple[str, str], ...] = ()
    children_density: str = ""
    debug_view: str = "none"

    def __getitem__[S: Settings](self, kind: type[S]) -> S:
        return self.sections[kind]

    @classmethod
    def of(
        cls, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph | None = None
    ) -> GroomSettings:
        """The present settings.

        Blender writes animated and driven settings into the original data only if a window shows
        them. A render has them only in its evaluated copies, which lag behind edits in a window.

        Args:
            hair: not the evaluated copy.
            depsgraph: where the hair is shown or rendered.
        """
        groom, character = hair.data.hairloom, hair.hairloom
        if depsgraph is not None and depsgraph.mode == "RENDER":
            groom = hair.data.evaluated_get(depsgraph).hairloom
            character = hair.evaluated_get(depsgraph).hairloom
        owners: dict[Owner, bpy.types.PropertyGroup] = {"groom": groom, "character": character}
        stored = SettingsMap(
            *(
                settings_of(getattr(group, section), ALL_SETTINGS[section])
                for owner, group in owners.items()
                for section in sections_of(owner)
            )
        )
        return cls(
            effective_settings(stored),
            picture_names(groom.card_images),
            character.children_density,
            character.debug_view,
        )

    def with_settings(self, *settings: Settings) -> GroomSettings:
        """These settings with the given sections replaced."""
        return replace(self, sections=self.sections.with_settings(*settings))

    @property
    def shows_cards(self) -> bool:
        """Whether cards are shown instead of the strands."""
        return self[CardDrawingSettings].shown_as == "cards"

    @property
    def rig_settings(self) -> tuple[SettingsMap, str, bool]:
        """The settings that determine strands, guides and their points."""
        is_animated = self[DynamicsSettings].animated_style
        if self[ChildrenSettings].method == "none":
            return self.sections.only(GuideSettings, WidthSettings), "", is_animated
        kinds = (GuideSettings, WidthSettings, ChildrenSettings)
        return self.sections.only(*kinds), self.children_density, is_animated

    def needs_no_rebuild(self, before: GroomSettings) -> bool:
        """Whether no setting that differs needs anything to be read or built again."""
        return self._read_settings == before._read_settings

    @property
    def _read_settings(self) -> tuple[Any, ...]:
        """The settings that determine what is read and built."""
        names = mask_names(self[DynamicsSettings]), self[ShadingSettings].color_map
        return self.rig_settings, self[AmbientSettings], names

    def with_built_values_of(self, before: GroomSettings) -> GroomSettings:
        """These settings, but with earlier values of those that need the hair to be read again."""
        kinds = (GuideSettings, WidthSettings, ChildrenSettings, AmbientSettings)
        earlier = (before[kind] for kind in kinds)
        return replace(self.with_settings(*earlier), children_density=before.children_density)
