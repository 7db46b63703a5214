"""Parameters from the command line: --set SECTION.NAME=VALUE."""

from __future__ import annotations

import json
from typing import Any

from ...errors import HairloomError
from ...parameters import ALL_SETTINGS


def overrides(assignments: list[str], section: str) -> dict[str, Any]:
    """The values that --set gives to one section."""
    values: dict[str, Any] = {}
    choices = {each.name for each in ALL_SETTINGS[section].parameters() if each.choices}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        owner, dot, parameter = name.partition(".")
        if not equals or not dot or owner not in ALL_SETTINGS:
            raise HairloomError(
                f"'{assignment}' does not name a parameter",
                place="--set",
                remedy="Write SECTION.NAME=VALUE with a section of " + ", ".join(ALL_SETTINGS),
            )
        if owner == section:
            values[parameter] = text if parameter in choices else plain_value(text)
    return values


def plain_value(text: str) -> Any:
    """A JSON value, several with commas (a colour or a curve), or the text itself (a choice)."""
    for content in (text, f"[{text}]"):
        try:
            return json.loads(content)
        except (ValueError, RecursionError):
            continue
    return text
