"""Names of files: those that operators are given, and those after the hair in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...errors import HairloomError
from ...exchange.files.atomic import check_writable
from ...exchange.files.file_names import (
    avoid_device_name,
    identifier_name,
    unique_names,
    with_added_suffix,
)


def given_path(filepath: str, *, place: str) -> Path:
    """The path in an operator's property; // at its start is the folder of the blend file.

    Raises:
        HairloomError: it is empty, as if a script leaves it out, or begins with // in a file that
            has not been saved.
    """
    if not filepath:
        raise HairloomError("no file is named", place=place, remedy="Name one as filepath")
    return Path(absolute_path(filepath))


def absolute_path(path: str) -> str:
    """A path; // at its start is the folder of the blend file.

    Raises:
        HairloomError: that file has not been saved. Blender would take the folder in which it was
            started.
    """
    if path.startswith("//") and not bpy.data.filepath:
        raise HairloomError(
            "// is the folder of the blend file, which has not been saved",
            place=path,
            remedy="Save it, or give the whole path",
        )
    return str(bpy.path.abspath(path))


def path_to_write(filepath: str, suffix: str, *, place: str) -> Path:
    """As `given_path`, for a file that is made by long work; it gets the suffix if it lacks it.

    Raises:
        HairloomError: it is empty, or cannot be written.
    """
    path = given_path(filepath, place=place)
    if path.suffix.lower() != suffix:
        path = with_added_suffix(path, suffix)
    check_writable(path)
    return path


def file_stem(hair_name: str) -> str:
    """A file's name after the hair in it, without characters or names that file systems refuse."""
    return avoid_device_name(identifier_name(hair_name))


def in_asset_folder(path: Path) -> Path:
    """The path inside a folder named after the asset; unchanged if it is in such a folder."""
    return path if path.parent.name == path.stem else path.parent / path.stem / path.name


def file_paths(path: Path, hair_names: Sequence[str]) -> list[Path]:
    """The file of each hair; where there are several, with the hair's name appended.

    Names that differ for Blender but not as file names, such as "Hair.001" and "hair_001", get a
    number.
    """
    if len(hair_names) == 1:
        return [path]
    stems = unique_names(f"{path.stem}_{file_stem(name)}" for name in hair_names)
    return [path.with_stem(stem) for stem in stems]
