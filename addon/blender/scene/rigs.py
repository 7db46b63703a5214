"""Hair that was read, made ready by its own settings."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ... import pipeline
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...pipeline import Rig
from ..properties.properties import settings_of
from .source import Source


@dataclass(frozen=True)
class RigSettings:
    """What decides which strands and guides there are; name: of the hair, in messages."""

    name: str
    guides: GuideSettings
    children: ChildrenSettings

    @classmethod
    def of(cls, hair: bpy.types.Object) -> RigSettings:
        groom = hair.data.hairloom
        guides = settings_of(groom.guides, GuideSettings)
        return cls(hair.name, guides, settings_of(groom.children, ChildrenSettings))

    def rig(self, source: Source) -> Rig:
        """The hair made ready, at rest as it was read; from arrays alone.

        Raises:
            HairloomError: no hair that can be used.
        """
        return pipeline.prepare(
            source.strands,
            source.head,
            self.guides,
            place=self.name,
            children=self.children,
            density=source.density,
        )


def rig_of(hair: bpy.types.Object, source: Source) -> Rig:
    """The hair made ready by its own settings, at rest as it was read.

    Raises:
        HairloomError: no hair that can be used.
    """
    return RigSettings.of(hair).rig(source)
