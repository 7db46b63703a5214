"""The table of the docs: one row a parameter, in the artist's units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params import Settings, number
from hairloom.addon.params.docs import table


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
    assert table(Tilt).splitlines()[-1] == (
        "| **Angle** `angle` | 45 | 0 to 90 | -180 to 180 | ° | How far it tilts | Euclid |"
    )


@pytest.mark.parametrize("kind", ALL_SETTINGS.values(), ids=ALL_SETTINGS)
def test_each_parameter_has_a_row_of_seven_cells(kind: type[Settings]) -> None:
    lines = table(kind).splitlines()
    assert lines[0] == f"## {kind.title} (`{kind.section}`)"
    rows = [line for line in lines if line.startswith("| **")]
    assert len(rows) == len(kind.parameters())
    for row, parameter in zip(rows, kind.parameters(), strict=True):
        assert f"`{parameter.name}`" in row
        assert row.count("|") == 8
