"""The map of settings: typed by class, equal by content."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from hairloom.addon.parameters import ALL_SETTINGS, sections_of
from hairloom.addon.params import Settings, SettingsMap, number


@dataclass(frozen=True, kw_only=True)
class Tilt(Settings):
    section = "tilt"
    angle: float = number(1.0, label="Angle", description="", soft=(0.0, 2.0), hard=(0.0, 2.0))


@dataclass(frozen=True, kw_only=True)
class Reach(Settings):
    section = "reach"
    length: float = number(1.0, label="Length", description="", soft=(0.0, 2.0), hard=(0.0, 2.0))


def test_it_gives_what_was_put_in_and_defaults_for_the_rest() -> None:
    chosen = SettingsMap(Tilt(angle=0.5))
    assert chosen[Tilt].angle == 0.5 and chosen[Reach] == Reach()


def test_maps_that_say_the_same_are_equal_however_they_were_made() -> None:
    explicit = SettingsMap(Reach(), Tilt(angle=0.5))
    assert explicit == SettingsMap(Tilt(angle=0.5)) == SettingsMap().with_settings(Tilt(angle=0.5))
    assert hash(explicit) == hash(SettingsMap(Tilt(angle=0.5)))
    assert explicit != SettingsMap() and explicit != SettingsMap(Tilt(angle=0.25))


def test_with_settings_replaces_one_section_and_changes_nothing_before() -> None:
    before = SettingsMap(Tilt(angle=0.5), Reach(length=2.0))
    after = before.with_settings(Tilt())
    assert after[Tilt] == Tilt() and after[Reach].length == 2.0
    assert before[Tilt].angle == 0.5


def test_only_leaves_the_others_at_their_defaults() -> None:
    assert SettingsMap(Tilt(angle=0.5), Reach(length=2.0)).only(Reach) == SettingsMap(
        Reach(length=2.0)
    )


@pytest.mark.parametrize("section", ALL_SETTINGS)
def test_every_section_is_found_by_its_declaration_and_has_one_owner(section: str) -> None:
    kind = ALL_SETTINGS[section]
    assert kind.section == section and kind.title
    assert kind.parameters() and SettingsMap(kind())[kind] == kind()
    owners = [
        each for each in ("groom", "character", "scene", "job") if section in sections_of(each)
    ]
    assert owners == [kind.owner]
