"""Parameters from the command line: --set SECTION.NAME=VALUE."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from ...errors import HairloomError, did_you_mean
from ...parameters import ALL_SETTINGS


def overrides(assignments: list[str], section: str) -> dict[str, Any]:
    """The values that --set gives to one section.

    Raises:
        HairloomError: an assignment names no section, or has no value.
    """
    values: dict[str, Any] = {}
    choices = {each.name for each in ALL_SETTINGS[section].parameters() if each.choices}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        owner, dot, parameter = name.partition(".")
        if not equals or not dot or owner not in ALL_SETTINGS:
            raise HairloomError(
                f"'{assignment}' does not name a parameter",
                place="--set",
                remedy=(did_you_mean(owner, ALL_SETTINGS) if dot else "")
                + "Write SECTION.NAME=VALUE with a section of "
                + ", ".join(ALL_SETTINGS),
            )
        if owner == section:
            values[parameter] = text if parameter in choices else plain_value(text)
    return values


#: A number, also as .5 or 1., which JSON refuses; in degrees if a unit follows.
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(deg|°)?", re.IGNORECASE)


def plain_value(text: str) -> Any:
    """The value of a text: JSON, a number, several with commas (a colour or a curve), or the text
    itself (a choice). Angles are in radians, or in degrees if followed by `deg`.
    """
    if not text.strip():
        return text
    for content in (text, f"[{text}]"):
        try:
            return json.loads(content)
        except (ValueError, RecursionError):
            continue
    numbers = [_NUMBER.fullmatch(each.strip()) for each in text.split(",")]
    if not all(numbers):
        return text
    values = [_number(*each.groups()) for each in numbers if each]
    if not all(map(math.isfinite, values)):
        return text
    return values if len(values) > 1 else values[0]


def _number(digits: str, unit: str | None) -> float:
    return math.radians(float(digits)) if unit else float(digits)
