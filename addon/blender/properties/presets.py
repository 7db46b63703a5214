"""Presets, those that come with Hairloom and the artist's own: find, apply, save and delete them.

The artist's own are in the folder that Blender keeps for the extension. They are data like all
presets, checked and never executed; other files in the folder are only reported.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, lru_cache
from pathlib import Path, PurePath
from typing import Any

import bpy

from ...errors import HairloomError
from ...exchange.files.atomic import write_text_atomic
from ...exchange.files.file_names import name_key, safe_folder_name
from ...parameters import ALL_SETTINGS
from ...params import Settings
from ...params.preset import Preset, preset_as_dict, read_any_preset
from . import changed, previews
from .properties import settings_of

PRESET_FOLDER = Path(__file__).resolve().parents[3] / "presets"
#: prefix of the names of the artist's own presets
OWN_PREFIX = "own/"
#: larger files [bytes] are not read; presets are far smaller
_MAX_SIZE = 1_000_000
_MAX_TITLE_LENGTH = 40
#: section of a preset -> further sections that it stores, such as the atlas for cards
_LINKED_SECTIONS = {"cards": ("atlas", "card_texture")}
#: the name of the package as Blender knows it: what precedes `.addon`
_EXTENSION = __package__.rpartition(".addon")[0]


@dataclass(frozen=True)
class Entry:
    """One preset in a menu.

    name: the name that `named_preset` takes.
    """

    name: str
    title: str
    path: Path
    preset: Preset[Any]

    @property
    def is_own(self) -> bool:
        return self.name.startswith(OWN_PREFIX)

    @property
    def icon(self) -> int:
        """See `previews.icon_of`."""
        return previews.icon_of(self.path)


@cache
def shipped_presets(section: str) -> tuple[Entry, ...]:
    """The presets of one section that come with Hairloom; a name is a path in their folder."""
    entries = []
    for path in sorted(PRESET_FOLDER.rglob("*.json")):
        preset = read_any_preset(path, ALL_SETTINGS)
        if preset.settings.section == section:
            name = path.relative_to(PRESET_FOLDER).with_suffix("").as_posix()
            entries.append(Entry(name, preset.title, path, preset))
    return tuple(entries)


def own_presets(section: str) -> tuple[tuple[Entry, ...], tuple[str, ...]]:
    """The artist's own presets of one section, and warnings about other files in their folder."""
    entries, warnings = [], []
    for path in _own_files():
        try:
            stat = path.stat()
            preset = _read(path, stat.st_mtime_ns, stat.st_size)
        except (HairloomError, OSError, RecursionError) as error:
            why = error.problem if isinstance(error, HairloomError) else error
            warnings.append(f"{path.name} is not a preset: {why}")
            continue
        if preset.settings.section == section:
            title = _clean_title(preset.title) or path.stem
            entries.append(Entry(OWN_PREFIX + path.stem, title, path, preset))
    return tuple(sorted(entries, key=lambda entry: entry.title.lower())), tuple(warnings)


def names_by_title(section: str) -> dict[str, str]:
    """Title of each preset of one section -> its name; shipped ones come first.

    If an earlier preset has the same title, a preset is listed under its name.
    """
    names: dict[str, str] = {}
    for entry in (*shipped_presets(section), *own_presets(section)[0]):
        names[entry.name if entry.title in names else entry.title] = entry.name
    return names


def own_folder() -> Path:
    """The folder of the artist's own presets; it may not exist yet."""
    try:
        return Path(bpy.utils.extension_path_user(_EXTENSION, path="presets"))
    except ValueError:  # not installed as an extension
        return Path(bpy.utils.user_resource("CONFIG", path="hairloom")) / "presets"


def settings_to_store(hair: bpy.types.Object, section: str) -> tuple[Settings, ...]:
    """The settings that a preset of this section stores: its own, then those that go with it."""
    return tuple(
        _current_settings(hair, name) for name in (section, *_LINKED_SECTIONS.get(section, ()))
    )


def _current_settings(hair: bpy.types.Object, section: str) -> Settings:
    """The settings of one section, from the groom or its object."""
    owners = hair.data.hairloom, hair.hairloom
    owner = next(each for each in owners if hasattr(each, section))
    return settings_of(getattr(owner, section), ALL_SETTINGS[section])


def matching_preset(
    hair: bpy.types.Object, entries: Iterable[Entry], ignored: Container[str] = ()
) -> Entry | None:
    """The first of these presets whose values all equal those of this groom.

    Args:
        ignored: names of parameters that have no effect on this hair.
    """
    current: dict[str, Settings] = {}
    for entry in entries:
        stored = entry.preset.all
        for each in stored:
            if each.section not in current:
                current[each.section] = _current_settings(hair, each.section)
        if all(_is_same(current[each.section], each, ignored) for each in stored):
            return entry
    return None


def _is_same(one: Settings, other: Settings, ignored: Container[str]) -> bool:
    values = other.with_masks_of(one).as_dict()
    return all(name in ignored or value == values[name] for name, value in one.as_dict().items())


def save_own(title: str, settings: Settings, *also: Settings) -> Path:
    """Save settings as a preset of this title; one with the same title is replaced.

    Args:
        settings: of the section under which the preset is listed.
        also: settings of other sections that go with it.

    Raises:
        HairloomError: the title is empty, or the file cannot be written.
    """
    title = _clean_title(title)
    stem = re.sub(r"[\W_]+", "_", title.lower()).strip("_")
    if not title:
        raise HairloomError("a preset needs a name", place="Save Preset", remedy="Type one")
    path = _file_for(stem, title, settings.section)
    data = preset_as_dict(Preset(title, "saved by the artist", settings, also))
    write_text_atomic(path, json.dumps(data, indent=2) + "\n")
    return path


def _clean_title(text: str) -> str:
    """The text as a title: in one line, and not too long."""
    return " ".join(text.split())[:_MAX_TITLE_LENGTH].rstrip()


def is_title_taken(title: str, section: str) -> bool:
    """Whether the artist has a preset of this title; saving another one would replace it."""
    return _own_preset_titled(_clean_title(title), section) is not None


def free_title(title: str, section: str) -> str:
    """This title, with a number if one of the artist's presets has it already."""
    title, number, free = _clean_title(title), 2, _clean_title(title)
    while is_title_taken(free, section):
        free = f"{title[: _MAX_TITLE_LENGTH - 1 - len(str(number))].rstrip()} {number}"
        number += 1
    return free


def delete_own(name: str) -> None:
    """Delete one of the artist's own presets, with its picture.

    Raises:
        HairloomError: there is no such preset of the artist's own, or it cannot be deleted.
    """
    path = _own_path(name)
    if path is None:
        raise HairloomError(
            "you have no preset of this name" if name else "no preset is named",
            place=name or "preset",
            remedy=_own_remedy(),
        )
    previews.forget(path)
    try:
        path.unlink()
        path.with_suffix(".png").unlink(missing_ok=True)
    except OSError as error:
        raise HairloomError(
            f"it cannot be deleted ({error.strerror})",
            place=str(path),
            remedy="Delete the file yourself",
        ) from error


def named_preset(name: str, sections: Iterable[str] = tuple(ALL_SETTINGS)) -> Preset[Any]:
    """A preset by its name, such as looks/blond or own/mine, or by the path of a file.

    Args:
        sections: those whose presets the error message suggests if there is none of this name.

    Raises:
        HairloomError: there is no such preset, or it is damaged.
    """
    shipped_path = PRESET_FOLDER / f"{name}.json"
    is_shipped = os.path.isfile(shipped_path) and shipped_path.resolve().is_relative_to(
        PRESET_FOLDER
    )
    path = (shipped_path if is_shipped else None) or _own_path(name) or Path(name)
    if not os.path.isfile(path):
        raise _no_preset(
            name,
            [one.name for each in sections for one in shipped_presets(each) + own_presets(each)[0]],
        )
    return read_any_preset(path, ALL_SETTINGS)


def _no_preset(name: str, names: list[str]) -> HairloomError:
    """The error for a missing preset, with similar names and all existing ones."""
    stem = PurePath(name).stem
    stems = {each: PurePath(each).name for each in names}
    matches = [stem] if stem in stems.values() else get_close_matches(stem, stems.values())
    suggestions = " or ".join(each for each, stem in stems.items() if stem in matches)
    return HairloomError(
        "there is no such preset" if name else "no preset is named",
        place=name or "preset",
        remedy=(f"Did you mean {suggestions}? " if suggestions else "")
        + f"Use a file or {', '.join(names)}",
    )


def apply(settings: Settings, hair: bpy.types.Object) -> None:
    """Apply all values of one section to a groom or its object. Its masks stay if these settings
    name none.

    Raises:
        HairloomError: a groom does not store these settings.
    """
    owners = hair.data.hairloom, hair.hairloom
    for owner in owners:
        group = getattr(owner, settings.section, None)
        if group is not None:
            settings = settings.with_masks_of(settings_of(group, type(settings)))
            with changed.as_one_change():
                for name, value in settings.as_dict().items():
                    setattr(group, name, value)
            return
    sections = [name for name in ALL_SETTINGS if any(hasattr(owner, name) for owner in owners)]
    raise HairloomError(
        f"a groom has no '{settings.section}' settings",
        place="preset",
        remedy=f"Choose a preset of {', '.join(sections)}",
    )


def _own_remedy() -> str:
    names = ", ".join(OWN_PREFIX + path.stem for path in _own_files())
    return f"Name one of {names}" if names else "Save one first"


def _own_files() -> list[Path]:
    try:
        return sorted(own_folder().glob("*.json"))
    except OSError:
        return []


def _own_path(name: str) -> Path | None:
    """The file of a name such as own/mine, if it exists; never one outside the folder."""
    found = (
        {OWN_PREFIX + path.stem: path for path in _own_files()}
        if name.startswith(OWN_PREFIX)
        else {}
    )
    return found.get(name)


@lru_cache(maxsize=256)
def _read(path: Path, _changed: int, size: int) -> Preset[Any]:
    """The preset in a file; cached until the file changes."""
    if size > _MAX_SIZE:
        raise HairloomError("it is too long", place=path.name, remedy="Delete it")
    return read_any_preset(path, ALL_SETTINGS)


def _file_for(stem: str, title: str, section: str) -> Path:
    """The file of the preset with this title, or a new path that no other file has."""
    existing = _own_preset_titled(title, section)
    if existing is not None:
        return existing.path
    taken = {name_key(path.stem) for path in _own_files()}
    return own_folder() / f"{safe_folder_name(stem, taken, 'preset')}.json"


def _own_preset_titled(title: str, section: str) -> Entry | None:
    """The artist's own preset with a title, ignoring case."""
    entries, _ = own_presets(section)
    return next((each for each in entries if name_key(each.title) == name_key(title)), None)
