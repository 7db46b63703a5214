"""Files that are called after the hair in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...exchange.files.names import distinct_names, no_device, plain_name


def file_stem(hair_name: str) -> str:
    """What a file is called after the hair in it: no character that a file system refuses."""
    return no_device(plain_name(hair_name))


def in_own_folder(path: Path) -> Path:
    """Where the files of an asset go if they are to have a folder of their own, named after it,
    beside where `path` would be; one that is in such a folder stays."""
    return path if path.parent.name == path.stem else path.parent / path.stem / path.name


def files_of(path: Path, hair_names: Sequence[str]) -> list[Path]:
    """Where each hair goes; of several in a file each, it has its name behind the file's.

    Names that differ for Blender alone, such as "Hair.001" and "hair_001", get a number.
    """
    if len(hair_names) == 1:
        return [path]
    stems = distinct_names(f"{path.stem}_{file_stem(name)}" for name in hair_names)
    return [path.with_stem(stem) for stem in stems]
