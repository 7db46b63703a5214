"""What water and dust in the hair change of all its settings: looks, children and motion.

The settings that an artist makes stay as they are; what is drawn, grown and simulated are these.

Water is weight: soaked hair holds about its own in water (Robbins 2012, "Chemical and Physical
Behavior of Human Hair", chapter 9, has a third within the fibre; the rest is the film). A stiffness
that is given in swings a second falls with the root of the mass; damping, the wind and what the
style carries of the weight fall with the mass itself. And it draws strands together in clumps.
"""

from __future__ import annotations

from dataclasses import replace

from .dynamics.settings import DynamicsSettings
from .groom.children_settings import ChildrenSettings
from .params import SettingsMap
from .shading.coat import coated, is_coated
from .shading.settings import ShadingSettings

#: Water that soaked hair holds, over its own mass.
WATER = 1.0
#: How far water draws the children of a clump together that were apart.
CLUMPED = 0.75
#: What water leaves of strays.
_FRIZZ_LEFT, _FLY_AWAYS_LEFT = 0.25, 0.0


def acting(settings: SettingsMap) -> SettingsMap:
    """The settings as they act; of settings that have been through it, never again."""
    look = settings[ShadingSettings]
    if not is_coated(look):
        return settings
    return settings.with_settings(
        coated(look),
        wet_children(settings[ChildrenSettings], look.wetness),
        heavier(settings[DynamicsSettings], look.wetness),
    )


def wet_children(settings: ChildrenSettings, wetness: float) -> ChildrenSettings:
    """Children of wet hair, 0 to 1."""
    if not wetness:
        return settings
    return replace(
        settings, clump=settings.clump + wetness * CLUMPED * (1.0 - settings.clump)
    ).multiplied(
        frizz=1.0 + wetness * (_FRIZZ_LEFT - 1.0),
        fly_aways=1.0 + wetness * (_FLY_AWAYS_LEFT - 1.0),
    )


def heavier(settings: DynamicsSettings, wetness: float) -> DynamicsSettings:
    """The motion of wet hair, 0 to 1."""
    if not wetness:
        return settings
    mass = 1.0 + WATER * wetness
    slower, weaker = mass**-0.5, 1.0 / mass
    return settings.multiplied(
        style_root=slower,
        style_tip=slower,
        bend=slower,
        curl_bounce=slower,
        style_damping=weaker,
        damping=weaker,
        drag=weaker,
        sag_compensation=weaker,
        force_fields=weaker,
    )
