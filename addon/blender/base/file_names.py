"""Files that are called after the hair in them."""

from __future__ import annotations

from pathlib import Path

from ...exchange.files.names import plain_name


def file_stem(hair_name: str) -> str:
    """What a file is called after the hair in it: no character that a file system refuses."""
    return plain_name(hair_name)


def file_of(path: Path, hair_name: str, *, is_alone: bool) -> Path:
    """Where a hair goes; of several in a file each, it has its name behind the file's."""
    return path if is_alone else path.with_stem(f"{path.stem}_{file_stem(hair_name)}")
