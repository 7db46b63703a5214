"""Rigs from hair that was read and its settings."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ... import rig_flow
from ...arrays import same_content
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...groom.width_settings import WidthSettings
from ...params import SettingsMap
from ...rig_flow import ChildPlacement, Rig
from ...strands.result_cache import NO_CACHE, ResultCache
from ..properties.groom_settings import GroomSettings
from ..scene.source import Source
from .fields import head_field_of

#: The fields of `Source` that a rig is made from.
_RIG_INPUTS = ("strands", "head", "density", "masks", "partings", "holders")


def rig_from(
    source: Source, settings: SettingsMap, *, place: str, cache: ResultCache = NO_CACHE
) -> Rig:
    """The rig of hair, at rest as it was read; from arrays alone.

    Args:
        place: the hair's name in messages.
        cache: see `rig_flow.prepare`.

    Raises:
        HairloomError: no hair that can be used.
    """
    return rig_flow.prepare(
        source.strands,
        source.head,
        settings[GuideSettings],
        place=place,
        children=settings[ChildrenSettings],
        placement=ChildPlacement(
            source.density, source.masks, source.partings, lambda: head_field_of(source.head)
        ),
        widths=settings[WidthSettings].method,
        holders=source.holders,
        cache=cache,
        is_animated=settings[DynamicsSettings].animated_style,
    )


@dataclass(frozen=True, eq=False)
class CachedRig:
    """A rig with the inputs that it was made from, so that the same rig is not made twice."""

    source: Source
    settings: GroomSettings
    rig: Rig

    @classmethod
    def of(
        cls, hair: bpy.types.Object, source: Source, cached: tuple[CachedRig, ...] = ()
    ) -> CachedRig:
        """The rig of hair with its own settings, at rest as it was read.

        Args:
            cached: rigs that were made before, maybe of this hair; one with the same inputs is
                returned.

        Raises:
            HairloomError: no hair that can be used.
        """
        return cls.find(source, GroomSettings.of(hair), cached, hair.name)

    @classmethod
    def find(
        cls, source: Source, settings: GroomSettings, cached: tuple[CachedRig, ...], place: str
    ) -> CachedRig:
        """`of`, from arrays alone."""
        for each in cached:
            if each.was_made_from(source, settings):
                return each
        return cls(source, settings, rig_from(source, settings.sections, place=place))

    def was_made_from(self, source: Source, settings: GroomSettings) -> bool:
        """Whether the rig made from these inputs is the same, to the last bit."""
        return self.settings.rig_settings == settings.rig_settings and all(
            same_content(getattr(self.source, name), getattr(source, name)) for name in _RIG_INPUTS
        )
