"""Presets: JSON data with a version and a source, validated and never executed.

{"hairloom": 1, "section": "shading", "title": "...", "source": "...", "values": {...},
 "also": {"shafts": {...}}}
`also` is for presets of more than one section; most have none.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..errors import HairloomError
from .field import Settings

PRESET_VERSION = 1
#: Largest size of a preset file: most have a few thousand bytes, and JSON may take twenty times its
#: size in memory.
MAX_PRESET_BYTES = 1 << 16

#: version n -> the step that converts it to version n + 1; an entry for each version ever released
MIGRATIONS: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}


@dataclass(frozen=True)
class Preset[S: Settings]:
    """A named set of values, and where they come from.

    settings: values of its main section, under which it is listed.
    also: values of other sections, applied together with it.
    """

    title: str
    source: str
    settings: S
    also: tuple[Settings, ...] = ()

    @property
    def all(self) -> tuple[Settings, ...]:
        """All settings of the preset, one for each section."""
        return (self.settings, *self.also)


def read_any_preset(path: Path, kinds: Mapping[str, type[Settings]]) -> Preset[Any]:
    """Read and validate a preset of any of these sections.

    Raises:
        HairloomError: too large, not JSON, of a newer version, of none of these sections, or with a
            bad value.
    """
    data = _read_json(path)
    section = data.get("section") if isinstance(data, dict) else None
    kind = kinds.get(section) if isinstance(section, str) else None
    if kind is None:
        raise HairloomError(
            f"this preset has an unknown kind ('{section}')",
            place=str(path),
            remedy="Choose a preset of " + ", ".join(kinds),
        )
    preset = _checked(data, kind, str(path))
    return replace(preset, also=_also(data.get("also", {}), kinds, str(path)))


def _also(data: Any, kinds: Mapping[str, type[Settings]], place: str) -> tuple[Settings, ...]:
    """A preset's settings of other sections."""
    unknown = [data] if not isinstance(data, Mapping) else sorted(set(data) - set(kinds))
    if unknown or not all(isinstance(values, Mapping) for values in data.values()):
        raise HairloomError(
            "this preset also sets an unknown kind of settings",
            place=place,
            remedy="Choose a preset saved by Hairloom",
        )
    return tuple(kinds[section].from_dict(values, place) for section, values in data.items())


def _read_json(path: Path) -> Any:
    try:
        if path.stat().st_size > MAX_PRESET_BYTES:
            raise ValueError(f"it has more than {MAX_PRESET_BYTES:,} bytes")
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise HairloomError(
            f"this preset cannot be read ({error})", place=str(path), remedy="Save it again"
        ) from error


def _checked[S: Settings](data: Any, settings: type[S], place: str) -> Preset[S]:
    """A preset from plain data, checked against the declarations; older versions are migrated."""
    if not isinstance(data, dict) or not isinstance(data.get("values"), Mapping):
        raise HairloomError(
            "this is not a Hairloom preset", place=place, remedy="Choose a preset saved by Hairloom"
        )
    data = migrate(data, place)
    values = settings.from_dict(data["values"], place)
    return Preset(str(data.get("title", "")), str(data.get("source", "")), values)


def preset_as_dict(preset: Preset[Any]) -> dict[str, Any]:
    """Plain data, ready for JSON."""
    also = {settings.section: settings.as_dict() for settings in preset.also}
    return {
        "hairloom": PRESET_VERSION,
        "section": preset.settings.section,
        "title": preset.title,
        "source": preset.source,
        "values": preset.settings.as_dict(),
        **({"also": also} if also else {}),
    }


def migrate(data: dict[str, Any], place: str) -> dict[str, Any]:
    """The same preset in the current version.

    Raises:
        HairloomError: a newer version, or one that was never released.
    """
    version = data.get("hairloom")
    if not isinstance(version, int) or isinstance(version, bool) or version > PRESET_VERSION:
        raise HairloomError(
            f"preset version {version!r} is not supported by this Hairloom (it supports "
            f"{PRESET_VERSION})",
            place=place,
            remedy="Update Hairloom",
        )
    while version < PRESET_VERSION:
        if version not in MIGRATIONS:
            raise HairloomError(
                f"preset version {version} was never released",
                place=place,
                remedy="Choose a preset saved by Hairloom",
            )
        data = MIGRATIONS[version](data)
        version += 1
    return data
