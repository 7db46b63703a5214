"""What a bake looks like on disk."""

from __future__ import annotations

import json
from pathlib import Path


def frames_in(folder: Path) -> Path:
    """The folder of the frames that the bake in a folder shows."""
    return folder / json.loads((folder / "cache.json").read_text())["frames"]


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder, by their paths in it."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}
