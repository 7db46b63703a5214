"""The presets that come with Hairloom, found by section, and put onto a groom."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import bpy

from ..errors import HairloomError
from ..parameters import ALL_SETTINGS
from ..params import Settings
from ..params.preset import Preset, read_any_preset

PRESET_FOLDER = Path(__file__).parents[2] / "presets"


@cache
def shipped(section: str) -> tuple[tuple[str, str], ...]:
    """(name, title) of the presets of one section; a name is a path below the preset folder."""
    found = []
    for path in sorted(PRESET_FOLDER.rglob("*.json")):
        preset = read_any_preset(path, ALL_SETTINGS)
        if preset.settings.section == section:
            name = path.relative_to(PRESET_FOLDER).with_suffix("").as_posix()
            found.append((name, preset.title))
    return tuple(found)


def named_preset(name: str) -> Preset[Any]:
    """A preset by its name, such as looks/blond, or by the path of a file.

    Raises:
        HairloomError: there is no such preset, or it is damaged.
    """
    own = PRESET_FOLDER / f"{name}.json"
    path = own if own.is_file() and own.resolve().is_relative_to(PRESET_FOLDER) else Path(name)
    if not path.is_file():
        known = ", ".join(one for section in ALL_SETTINGS for one, _ in shipped(section))
        raise HairloomError("there is no such preset", place=name, remedy=f"Use a file or {known}")
    return read_any_preset(path, ALL_SETTINGS)


def apply(settings: Settings, hair: bpy.types.Object) -> None:
    """Put all values of one section onto a groom or its object.

    Raises:
        HairloomError: settings that a groom does not keep, such as those for growing one.
    """
    for owner in (hair.data.hairloom, hair.hairloom):
        group = getattr(owner, settings.section, None)
        if group is not None:
            for name, value in settings.as_dict().items():
                setattr(group, name, value)
            return
    raise HairloomError(
        f"a groom keeps no '{settings.section}' settings",
        place="preset",
        remedy="Choose a preset of looks or dynamics",
    )
