"""Where and when parameters are drawn stands in their declarations, and names what there is."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params import both, either, when

DEFAULTS = SimpleNamespace(**{section: kind() for section, kind in ALL_SETTINGS.items()})


@pytest.mark.parametrize("section", ALL_SETTINGS)
def test_panels_are_those_of_the_section_and_conditions_can_be_asked(section: str) -> None:
    kind = ALL_SETTINGS[section]
    used = {parameter.panel for parameter in kind.parameters()} - {""}
    assert used == set(kind.panels)
    for parameter in kind.parameters():
        for condition in (parameter.shown_when, parameter.active_when):
            assert condition is None or condition(DEFAULTS) in (True, False), parameter.name


def test_conditions_ask_for_values_or_for_what_is_not_0() -> None:
    sections = SimpleNamespace(tilt=SimpleNamespace(mode="fixed", angle=0.0))
    fixed, tilted = when("tilt.mode", "fixed"), when("tilt.angle")
    assert fixed(sections) and not when("tilt.mode", "free")(sections) and not tilted(sections)
    assert either(fixed, tilted)(sections) and not both(fixed, tilted)(sections)
    sections.tilt.angle = 0.5
    assert both(fixed, tilted)(sections)
