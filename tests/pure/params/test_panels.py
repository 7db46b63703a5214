"""The panels and conditions in parameter declarations name existing panels and settings."""

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


def variants(changed: str) -> list[SimpleNamespace]:
    """The defaults, and the defaults with one switch, choice or number of this section changed."""
    found = [DEFAULTS]
    for parameter in ALL_SETTINGS[changed].parameters():
        others: tuple[object, ...] = tuple(name for name, _, _ in parameter.choices)
        if parameter.kind == "toggle":
            others = (True, False)
        if parameter.kind in {"number", "integer"} and parameter.hard_range:
            others = parameter.hard_range
        for other in others:
            sections = SimpleNamespace(**vars(DEFAULTS))
            values = {**vars(getattr(DEFAULTS, changed)), parameter.name: other}
            setattr(sections, changed, SimpleNamespace(**values))
            found.append(sections)
    return found


def test_what_does_not_act_says_why() -> None:
    sections = [each for section in ALL_SETTINGS for each in variants(section)]
    idle = set()
    for section, kind in ALL_SETTINGS.items():
        for parameter in kind.parameters():
            condition = parameter.active_when
            for each in sections:
                if condition is not None and not condition(each):
                    assert condition.unmet_reason(each), f"{section}.{parameter.name}"
                    idle.add((section, parameter.name))
    assert ("children", "clump_size") in idle and ("skin", "softness") in idle and len(idle) > 20


def test_what_lacks_is_the_first_that_does() -> None:
    sections = SimpleNamespace(tilt=SimpleNamespace(mode="free", angle=0.0))
    fixed, tilted = (
        when("tilt.mode", "fixed", unmet_reason="free"),
        when("tilt.angle", unmet_reason="level"),
    )
    assert both(fixed, tilted).unmet_reason(sections) == "free"
    assert either(tilted, fixed).unmet_reason(sections) == "level"
    sections.tilt.mode = "fixed"
    assert both(fixed, tilted).unmet_reason(sections) == "level"
