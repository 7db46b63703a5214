"""From a `Settings` class to its table in docs/parameters.md."""

from __future__ import annotations

import math

from .field import Owner, Parameter, Settings

_UNIT_SYMBOLS = {
    "length": "m",
    "angle": "°",
    "time": "s",
    "rate": "1/s",
    "speed": "m/s",
    "acceleration": "m/s²",
    "factor": "0 to 1",
    "percent": "%",
    "pixels": "px",
    "none": "",
}

#: owner of a section -> what holds it in Python; options of a job are arguments of its operator
_HOLDERS: dict[Owner, str] = {
    "groom": "obj.data.hairloom",
    "character": "obj.hairloom",
    "scene": "scene.hairloom",
}


def parameter_table(settings: type[Settings]) -> str:
    """A Markdown section: a heading, where Python finds the section, and a table with a row for
    each parameter."""
    holder = _HOLDERS.get(settings.owner)
    place = [] if holder is None else [f"In Python: `{holder}.{settings.section}`", ""]
    rows = [
        f"## {settings.title} (`{settings.section}`)",
        "",
        *place,
        "| Name | Default | Slider | Allowed | Unit | What it does | Source |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(_row(parameter) for parameter in settings.parameters()),
        "",
    ]
    return "\n".join(rows)


def _row(parameter: Parameter) -> str:
    cells = [
        f"**{parameter.label}** `{parameter.name}`",
        _value_text(parameter, parameter.default),
        _range_text(parameter, parameter.soft_range),
        _allowed_values(parameter),
        _unit(parameter),
        parameter.description,
        parameter.source,
    ]
    return "| " + " | ".join(cells) + " |"


def _unit(parameter: Parameter) -> str:
    """The unit's symbol; none for a factor whose range exceeds 0 to 1."""
    low, high = parameter.hard_range or (0.0, 1.0)
    if parameter.unit == "factor" and not 0.0 <= low <= high <= 1.0:
        return ""
    return _UNIT_SYMBOLS[parameter.unit]


def _allowed_values(parameter: Parameter) -> str:
    """Allowed values, as presets and the command line take them (`code`); choices with labels."""
    if parameter.kind == "choice":
        return "; ".join(f"`{identifier}` {label}" for identifier, label, _ in parameter.choices)
    if parameter.kind == "toggle":
        return "`true`; `false`"
    return _range_text(parameter, parameter.hard_range)


def _range_text(parameter: Parameter, limits: tuple[float, float] | None) -> str:
    if limits is None:
        return ""
    return f"{_value_text(parameter, limits[0])} to {_value_text(parameter, limits[1])}"


def _value_text(parameter: Parameter, value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(f"{channel:g}" for channel in value)
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if parameter.kind == "choice":
        return f"`{value}`"
    if parameter.kind == "integer" and isinstance(value, (int, float)):
        return str(int(value))
    if isinstance(value, (int, float)):
        return f"{math.degrees(value) if parameter.unit == 'angle' else value:g}"
    return str(value)
