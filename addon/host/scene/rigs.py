"""Hair that was read, made ready by its own settings."""

from __future__ import annotations

import bpy

from ... import pipeline
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...pipeline import Rig
from ..settings.properties import settings_of
from .source import Source


def rig_of(hair: bpy.types.Object, source: Source) -> Rig:
    """The hair made ready by its own settings, at rest as it was read.

    Raises:
        HairloomError: no hair that can be used.
    """
    groom = hair.data.hairloom
    return pipeline.prepare(
        source.strands,
        source.head,
        settings_of(groom.guides, GuideSettings),
        place=hair.name,
        children=settings_of(groom.children, ChildrenSettings),
        density=source.density,
    )
