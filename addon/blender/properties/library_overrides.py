"""Settings on library overrides, which shall last when the file is saved.

Blender stores what differs from the library, setting by setting, and sets it again when the file is
loaded. Of a group of settings that the library does not hold yet, because nobody has looked at it
there or because it is newer than the library, it stores that the whole group differs, and cannot
set that: all that was set in the group is lost. A group is held as soon as it was looked at once,
so before a file is saved all groups are looked at: those of the overrides, and those of what they
override, as it is in memory. The library on disk stays as it is.
"""

from __future__ import annotations

from typing import Any

import bpy


def make_last() -> None:
    """To be called before a file is saved."""
    for owner in (*bpy.data.objects, *bpy.data.hair_curves):
        override = owner.override_library
        if override is not None and override.reference is not None:
            _look_at(owner.hairloom)
            _look_at(override.reference.hairloom)


def _look_at(group: Any) -> None:
    for name in type(group).__annotations__:
        value = getattr(group, name)
        if isinstance(value, bpy.types.PropertyGroup):
            _look_at(value)
