"""What a program will see of strands, found before they are written: as numbers and in words."""

from __future__ import annotations

from typing import Any

from .groom import Groom
from .groom_presets import preflight
from .strand_export_settings import StrandExportSettings, layout_of
from .strand_formats import StrandFormat

#: units in a metre -> name
_UNITS = {1.0: "m", 10.0: "dm", 100.0: "cm", 1000.0: "mm"}
#: Maximum number of groups that are named one by one.
_MAX_NAMED = 8


def check_strands(
    groom: Groom, kind: StrandFormat, settings: StrandExportSettings
) -> dict[str, Any]:
    """`groom_presets.preflight` for any format, in the file's unit and axes.

    Returns:
        Its facts, and: format; unit, such as "cm"; up; is_mirrored; group_names of those groups
        that have one.

    Raises:
        HairloomError: an engine or option that the format does not have.
    """
    preset = layout_of(kind, settings)
    space = preset.space
    facts = preflight(groom, preset)
    return {
        "format": kind.name,
        **facts,
        "group_names": {g: groom.group_names[g] for g in facts["groups"] if g in groom.group_names},
        "unit": _UNITS.get(round(space.units_per_metre, 6), f"1/{space.units_per_metre:g} m"),
        "up": space.up,
        "is_mirrored": space.is_mirrored,
    }


def check_lines(facts: dict[str, Any]) -> list[str]:
    """The facts as short lines for panels and terminals; warnings are not among them."""
    unit = facts["unit"]
    low, high = facts["lowest"], facts["highest"]
    size = " x ".join(f"{b - a:.3g}" for a, b in zip(low, high, strict=True))
    hand = ", left-handed" if facts["is_mirrored"] else ""
    return [
        f"{facts['strands']:,} strands, {facts['guides']:,} guides, {facts['points']:,} points",
        f"Points per strand: {_range(facts['points_per_curve'], 'd')}",
        f"Groups: {_groups(facts)}",
        f"Width: {_range(facts['width'], '.3g')} {unit}",
        f"Length: {_range(facts['length'], '.3g')} {unit}",
        f"Size: {size} {unit}, {facts['up']} up{hand}",
        f"From {_corner(low)} to {_corner(high)} {unit}",
    ]


def _range(values: tuple[float, float], form: str) -> str:
    lowest, highest = (format(value, form) for value in values)
    return lowest if lowest == highest else f"{lowest} to {highest}"


def _corner(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"


def _groups(facts: dict[str, Any]) -> str:
    names = facts["group_names"]
    named = [f"{names.get(group, group)} ({size:,})" for group, size in facts["groups"].items()]
    rest = len(named) - _MAX_NAMED
    return ", ".join(named[:_MAX_NAMED]) + (f" and {rest} more" if rest > 0 else "")
