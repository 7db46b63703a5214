"""Files of a bake on disk."""

from __future__ import annotations

import json
from pathlib import Path


def frames_in(folder: Path) -> Path:
    """The folder that holds the frames which `cache.json` of a bake folder points to."""
    return folder / json.loads((folder / "cache.json").read_text())["frames"]


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder: relative path -> content."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}
