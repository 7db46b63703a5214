"""Pictures of presets for Blender's menus: NAME.png beside NAME.json, where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy.utils.previews

_pictures: Any = None


def register() -> None:
    global _pictures
    _pictures = bpy.utils.previews.new()


def unregister() -> None:
    global _pictures
    bpy.utils.previews.remove(_pictures)
    _pictures = None


def icon_of(preset: Path) -> int:
    """The number by which layouts know its picture; 0 without one.

    Blender reads the picture when it is first drawn; a damaged one stays empty.
    """
    picture = preset.with_suffix(".png")
    if _pictures is None or not picture.is_file():
        return 0
    name = str(picture)
    if name not in _pictures:
        _pictures.load(name, name, "IMAGE")
    icon: int = _pictures[name].icon_id
    return icon


def forget(preset: Path) -> None:
    """Its picture is another one now, or gone."""
    name = str(preset.with_suffix(".png"))
    if _pictures is not None and name in _pictures:
        del _pictures[name]
