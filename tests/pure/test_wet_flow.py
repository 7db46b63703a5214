"""The effect of water on children and on motion, against a mass on a spring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_wig import GUIDES, sheet, wig_strands

from hairloom.addon import rig_flow
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.paint_flow import with_colors
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.wet_and_dusty import wet_and_dusty_color
from hairloom.addon.wet_flow import (
    SOAKED_WATER_MASS,
    effective_settings,
    wet_children,
    wet_dynamics,
)

WET = ShadingSettings(wetness=1.0)


def test_dry_settings_are_the_same_object() -> None:
    settings = SettingsMap(ShadingSettings(melanin=0.3), ChildrenSettings(clump=0.2))
    assert effective_settings(settings) is settings


def test_the_settings_of_looks_children_and_motion_act_together() -> None:
    dry = SettingsMap(WET, ChildrenSettings(), DynamicsSettings())
    wet = effective_settings(dry)
    assert wet[ShadingSettings].width_r < dry[ShadingSettings].width_r
    assert wet[ChildrenSettings] == wet_children(dry[ChildrenSettings], 1.0)
    assert wet[DynamicsSettings] == wet_dynamics(dry[DynamicsSettings], 1.0)


def test_a_heavier_mass_swings_slower_and_loses_less() -> None:
    """Frequency and rate of decay of m x'' = -(k x + c x') for the larger mass."""
    stiffness, loss, mass = 30.0, 0.4, 1.0 + SOAKED_WATER_MASS
    dry, wet = (np.roots([m, loss, stiffness])[0] for m in (1.0, mass))
    settings = DynamicsSettings()
    after = wet_dynamics(settings, 1.0)
    # abs() of the root is the undamped frequency
    assert after.style_tip / settings.style_tip == pytest.approx(abs(wet / dry), rel=1e-6)
    assert after.damping / settings.damping == pytest.approx(wet.real / dry.real, rel=1e-6)
    assert after.sag_compensation == pytest.approx(1.0 / mass)


def test_children_of_wet_hair_lie_closer_in_their_clumps() -> None:
    def gap(settings: ChildrenSettings) -> float:
        """Mean distance of a child's tip from the nearest other tip [m]."""
        rig = rig_flow.prepare(wig_strands(), sheet(), GUIDES, place="a wig", children=settings)
        tips = rig.strands.grid[60:, -1]
        away = np.linalg.norm(tips[:, None] - tips[None], axis=2)
        np.fill_diagonal(away, np.inf)
        return float(away.min(axis=1).mean())

    dry = ChildrenSettings(
        method="multi",
        strand_count=1500,
        clump=0.3,
        frizz=0.01,
        baby_hair=0.0,
        length_variation=0.0,
    )
    assert gap(wet_children(dry, 1.0)) < 0.6 * gap(dry)


def test_own_colours_of_strands_are_wet_too() -> None:
    strands = wig_strands()
    color = np.full((strands.point_count, 3), 0.4, np.float32)
    colored = replace(strands, color=color)
    np.testing.assert_allclose(
        with_colors(colored, None, WET).color, wet_and_dusty_color(color, WET), rtol=1e-6
    )
    assert with_colors(colored, None, ShadingSettings()) is colored
    by_look = replace(WET, color_source="look")
    assert with_colors(colored, None, by_look) is colored
