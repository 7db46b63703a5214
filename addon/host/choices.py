"""All that the artist has set for one groom, checked."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..dynamics.settings import DynamicsSettings
from ..groom.children_settings import ChildrenSettings
from ..groom.settings import GuideSettings
from ..refine.settings import DetailSettings
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings, StrandSettings
from .properties import settings_of


@dataclass(frozen=True)
class Choices:
    """The settings of the curves, and those of their object."""

    guides: GuideSettings
    children: ChildrenSettings
    detail: DetailSettings
    ambient: AmbientSettings
    shading: ShadingSettings
    strands: StrandSettings
    dynamics: DynamicsSettings

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
            settings_of(character.dynamics, DynamicsSettings),
        )
