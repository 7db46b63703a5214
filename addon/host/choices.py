"""All that the artist has set for one groom, checked."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from ..dynamics.settings import DynamicsSettings
from ..groom.children_settings import ChildrenSettings
from ..groom.settings import GuideSettings
from ..params import Settings
from ..refine.settings import DetailSettings
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.shafts_settings import ShaftSettings
from ..shading.skin.settings import SkinSettings
from ..shading.volume.settings import VolumeSettings
from .properties import settings_of


@dataclass(frozen=True)
class Choices:
    """The settings of the curves, and those of their object.

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
    children_density: str = ""
    debug_view: str = "none"

    @classmethod
    def of(cls, hair: bpy.types.Object) -> Choices:
        groom, character = hair.data.hairloom, hair.hairloom
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
            character.children_density,
            character.debug_view,
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
