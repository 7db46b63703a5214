"""Pictures of presets for Blender's menus: NAME.png beside NAME.json, where there is one."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import bpy.utils.previews


@cache
def pictures() -> Any:
    """Blender's collection of the pictures; lasts until the extension is unregistered."""
    return bpy.utils.previews.new()


def unregister() -> None:
    bpy.utils.previews.remove(pictures())
    pictures.cache_clear()


def icon_of(preset: Path) -> int:
    """The icon number of a preset's picture in layouts; 0 without one.

    Blender reads the picture when it is first drawn; a damaged one stays empty.
    """
    picture = preset.with_suffix(".png")
    if not picture.is_file():
        return 0
    name, loaded = str(picture), pictures()
    if name not in loaded:
        loaded.load(name, name, "IMAGE")
    icon: int = loaded[name].icon_id
    return icon


def forget(preset: Path) -> None:
    """Drop the picture of a preset, as it has changed or is gone."""
    name, loaded = str(preset.with_suffix(".png")), pictures()
    if name in loaded:
        del loaded[name]
