"""Whether the folders of docs/engines are complete, so that each can be copied alone."""

from __future__ import annotations

import re
from pathlib import Path

#: references to other files of a folder, in Godot's scripts and shaders, plugin.cfg and JavaScript
_NAMES = re.compile(
    r"""(?:preload\(|#include |^script=|from )["']([^"'\n]+\.\w+)["']""", re.MULTILINE
)


def missing_files(folder: Path) -> set[str]:
    """Files that a folder's files refer to but that it lacks, apart from three.js's and Unity's."""
    named = {
        name
        for file in folder.rglob("*")
        if file.is_file()
        for name in _NAMES.findall(file.read_text(encoding="utf-8"))
        if not name.startswith(("three/", "Packages/"))
    }
    return {name for name in named if ".." in name or not any(folder.rglob(Path(name).name))}
