"""The table of the docs: one row per parameter, in the artist's units."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import ClassVar

import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params import Settings, number
from hairloom.addon.params.docs import parameter_table


@dataclass(frozen=True, kw_only=True)
class Tilt(Settings):
    section: ClassVar[str] = "tilt"
    title: ClassVar[str] = "Tilt"

    angle: float = number(
        math.pi / 4,
        label="Angle",
        description="How far it tilts",
        unit="angle",
        soft=(0.0, math.pi / 2),
        hard=(-math.pi, math.pi),
        source="Euclid",
    )


def test_angles_are_shown_in_degrees() -> None:
    assert parameter_table(Tilt).splitlines()[-1] == (
        "| **Angle** `angle` | 45 | 0 to 90 | -180 to 180 | ° | How far it tilts | Euclid |"
    )


@pytest.mark.parametrize("kind", ALL_SETTINGS.values(), ids=ALL_SETTINGS)
def test_what_the_table_allows_as_code_is_taken(kind: type[Settings]) -> None:
    """A setting accepts all values that its row shows as code, the default among them; a choice
    shows all."""
    rows = [line for line in parameter_table(kind).splitlines() if line.startswith("| **")]
    for row, parameter in zip(rows, kind.parameters(), strict=True):
        default, allowed = (re.findall("`(.+?)`", row.split("|")[cell]) for cell in (2, 4))
        if parameter.kind in ("choice", "toggle"):
            assert default[0] in allowed and len(allowed) == (len(parameter.choices) or 2)
        for text in allowed:
            value = json.loads(text) if parameter.kind == "toggle" else text
            kind.from_dict({parameter.name: value}, "--set")


def test_a_factor_without_those_limits_is_not_called_one_from_0_to_1() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Fractions(Settings):
        share: float = number(
            0.5,
            label="Share",
            description="A part",
            unit="factor",
            soft=(0.0, 1.0),
            hard=(0.0, 1.0),
        )
        stretch: float = number(
            0.5, label="Stretch", description="Any", unit="factor", soft=(0.0, 1.0), hard=(0.0, 9.0)
        )

    one, other = parameter_table(Fractions).splitlines()[-2:]
    assert "| 0 to 1 | A part |" in one and "|  | Any |" in other


@pytest.mark.parametrize("kind", ALL_SETTINGS.values(), ids=ALL_SETTINGS)
def test_what_an_artist_reads_stands_alone_and_is_in_round_degrees(kind: type[Settings]) -> None:
    """A tooltip appears without its neighbours, so it must not refer to them ("The same"), and
    avoids the term CV."""
    for parameter in kind.parameters():
        assert not parameter.description.startswith("The same"), parameter.name
        assert "CV" not in parameter.description, parameter.name
        if parameter.unit == "angle":
            ends = (*(parameter.soft_range or ()), *(parameter.hard_range or ()))
            for angle in map(math.degrees, (parameter.default, *ends)):
                assert 2.0 * angle == pytest.approx(round(2.0 * angle), abs=1e-4), parameter.name


@pytest.mark.parametrize("kind", ALL_SETTINGS.values(), ids=ALL_SETTINGS)
def test_each_parameter_has_a_row_of_seven_cells(kind: type[Settings]) -> None:
    lines = parameter_table(kind).splitlines()
    assert lines[0] == f"## {kind.title} (`{kind.section}`)"
    rows = [line for line in lines if line.startswith("| **")]
    assert len(rows) == len(kind.parameters())
    for row, parameter in zip(rows, kind.parameters(), strict=True):
        assert f"`{parameter.name}`" in row
        assert row.count("|") == 8
