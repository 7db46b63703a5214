"""What the folders of docs/engines need to be complete wherever they are copied to."""

from __future__ import annotations

import re
from pathlib import Path

#: what names another file of the folder: scripts and shaders of Godot, plugin.cfg, JavaScript
_NAMES = re.compile(
    r"""(?:preload\(|#include |^script=|from )["']([^"'\n]+\.\w+)["']""", re.MULTILINE
)


def missing_files(folder: Path) -> set[str]:
    """Files that those of a folder name, and that are not in it; not three.js and Unity's own."""
    named = {
        name
        for file in folder.rglob("*")
        if file.is_file()
        for name in _NAMES.findall(file.read_text(encoding="utf-8"))
        if not name.startswith(("three/", "Packages/"))
    }
    return {name for name in named if ".." in name or not any(folder.rglob(Path(name).name))}
