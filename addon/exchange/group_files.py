"""A file for each group, for formats that hold none: hair_front.tfx, hair_back.tfx."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .files.file_set import written_together
from .files.names import plain_name
from .groom import Groom


def write_groups(
    path: Path, groom: Groom, write: Callable[[Path, Groom], tuple[str, ...]]
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Write the groups of a groom to files of their own, beside each other, all or none.

    A groom of one group is written to `path` itself.

    Args:
        write: such as `write_tfx`, with all but its path and groom given.

    Returns:
        The files in the order of the groups, and what they cannot say.

    Raises:
        HairloomError: nothing can be written there.
    """
    files = group_files(path, groom)
    notes: list[str] = []
    with written_together(next(iter(files))) as folder:
        for file, group in files.items():
            notes += write(folder / file.name, group)
    return tuple(files), tuple(notes)


def group_files(path: Path, groom: Groom) -> dict[Path, Groom]:
    """The file of each group, by its name or number, and the group's strands."""
    numbers = np.unique(groom.strands.group).tolist()
    if len(numbers) < 2:
        return {path: groom}
    names = [plain_name(groom.group_names.get(number, f"group{number}")) for number in numbers]
    taken = Counter(name.casefold() for name in names)
    files: dict[Path, Groom] = {}
    for name, number in zip(names, numbers, strict=True):
        ending = name if taken[name.casefold()] == 1 else f"{name}_{number}"
        strands = np.flatnonzero(groom.strands.group == number)
        files[path.with_name(f"{path.stem}_{ending}{path.suffix}")] = groom.take(strands)
    return files
