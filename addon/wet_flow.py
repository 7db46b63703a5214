"""How water and dust in the hair change its settings: look, children and motion.

The artist's own settings stay as they are; the changed ones are drawn, grown and simulated.

Water is weight: soaked hair holds about its own mass of water (Robbins 2012, "Chemical and Physical
Behavior of Human Hair", chapter 9, has a third within the fibre; the rest is the film). A stiffness
given as a frequency is divided by the square root of the mass; damping, drag, force fields and sag
compensation are divided by the mass itself. Water also draws strands together in clumps.
"""

from __future__ import annotations

from dataclasses import replace

from .dynamics.settings import DynamicsSettings
from .groom.children_settings import ChildrenSettings
from .params import SettingsMap
from .shading.settings import ShadingSettings
from .shading.wet_and_dusty import is_wet_or_dusty, wet_and_dusty_look

#: Water that soaked hair holds, over its own mass.
SOAKED_WATER_MASS = 1.0
#: How far soaking closes the gap between the artist's clumping and full clumping.
SOAKED_CLUMPING = 0.75
#: The factors of frizz and fly-aways in soaked hair.
_SOAKED_FRIZZ, _SOAKED_FLY_AWAYS = 0.25, 0.0


def effective_settings(settings: SettingsMap) -> SettingsMap:
    """The settings with the effects of water and dust; not to be applied twice."""
    look = settings[ShadingSettings]
    if not is_wet_or_dusty(look):
        return settings
    return settings.with_settings(
        wet_and_dusty_look(look),
        wet_children(settings[ChildrenSettings], look.wetness),
        wet_dynamics(settings[DynamicsSettings], look.wetness),
    )


def wet_children(settings: ChildrenSettings, wetness: float) -> ChildrenSettings:
    """Settings of children in hair of this wetness, 0 to 1."""
    if not wetness:
        return settings
    return replace(
        settings, clump=settings.clump + wetness * SOAKED_CLUMPING * (1.0 - settings.clump)
    ).multiplied(
        frizz=1.0 + wetness * (_SOAKED_FRIZZ - 1.0),
        fly_aways=1.0 + wetness * (_SOAKED_FLY_AWAYS - 1.0),
    )


def wet_dynamics(settings: DynamicsSettings, wetness: float) -> DynamicsSettings:
    """Settings of the motion of hair of this wetness, 0 to 1."""
    if not wetness:
        return settings
    mass = 1.0 + SOAKED_WATER_MASS * wetness
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
