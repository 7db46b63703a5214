"""Hair that was read, made ready by settings."""

from __future__ import annotations

import bpy

from ... import rig_flow
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...groom.width_settings import WidthSettings
from ...params import SettingsMap
from ...rig_flow import ChildGround, Rig
from ...strands.kept import NOTHING_KEPT, Kept
from ..properties.groom_settings import GroomSettings
from ..scene.source import Source
from .fields import solid_of


def rig_from(
    source: Source, settings: SettingsMap, *, place: str, kept: Kept = NOTHING_KEPT
) -> Rig:
    """The hair made ready, at rest as it was read; from arrays alone.

    Args:
        place: names the hair in messages.
        kept: see `rig_flow.prepare`.

    Raises:
        HairloomError: no hair that can be used.
    """
    return rig_flow.prepare(
        source.strands,
        source.head,
        settings[GuideSettings],
        place=place,
        children=settings[ChildrenSettings],
        ground=ChildGround(
            source.density, source.masks, source.partings, lambda: solid_of(source.head)
        ),
        widths=settings[WidthSettings].method,
        holders=source.holders,
        kept=kept,
        is_animated=settings[DynamicsSettings].animated_style,
    )


def rig_of(hair: bpy.types.Object, source: Source) -> Rig:
    """The hair made ready by its own settings, at rest as it was read.

    Raises:
        HairloomError: no hair that can be used.
    """
    return rig_from(source, GroomSettings.of(hair).sections, place=hair.name)
