"""Makes settings on library overrides survive saving and loading.

Blender stores each setting that differs from the library, and sets it again when the file is
loaded. A group of settings may not exist in the library yet, because nothing has accessed it there
or because it is newer than the library. Blender then stores that the whole group differs, cannot
set that when loading, and all settings of the group are lost. A group exists once it has been
accessed, so all groups are accessed before a file is saved: those of the overrides, and those of
the overridden data in memory. The library on disk stays as it is.
"""

from __future__ import annotations

from typing import Any

import bpy


def access_all_groups() -> None:
    """Access all groups of settings, so that they exist; call it before a file is saved."""
    for owner in (*bpy.data.objects, *bpy.data.hair_curves):
        override = owner.override_library
        if override is not None and override.reference is not None:
            _access_groups(owner.hairloom)
            _access_groups(override.reference.hairloom)


def _access_groups(group: Any) -> None:
    for name in type(group).__annotations__:
        value = getattr(group, name)
        if isinstance(value, bpy.types.PropertyGroup):
            _access_groups(value)
