"""Keeps materials of looks up to date with their looks, until an artist changes their nodes."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ...shading.settings import ShadingSettings
from ...shading.wet_and_dusty import wet_and_dusty_look
from ..properties import changed
from ..properties.properties import settings_of
from .hair_material import (
    has_unchanged_nodes,
    is_outdated,
    look_material,
    set_look_material,
    set_material_colors,
)
from .painted_colors import colors_of_curves

#: time without edits before painted colours are looked up again [s]
_UPDATE_DELAY = 0.3

#: session numbers of curves whose material is updated then
_deferred: set[int] = set()


def apply_look(hair: bpy.types.Object) -> tuple[bpy.types.Material, tuple[str, ...]]:
    """Give hair the material of its look; returns the material and notes.

    Raises:
        HairloomError: see `colors_of_curves`.
    """
    look = _look_of(hair.data)
    painted, notes = colors_of_curves(hair, look, bpy.context.evaluated_depsgraph_get())
    material, more = set_look_material(hair.data, look, painted=painted)
    return material, (*notes, *more)


def update_after_new_curves(hair: bpy.types.Object) -> None:
    """Update the material, or the colours that it reads, after the hair's curves were replaced."""
    look, material = _look_of(hair.data), look_material(hair.data)
    try:
        if material is not None and has_unchanged_nodes(material):
            apply_look(hair)
        else:
            depsgraph = bpy.context.evaluated_depsgraph_get()
            set_material_colors(hair.data, look, colors_of_curves(hair, look, depsgraph)[0])
    except HairloomError:  # painted colours cannot be read; the preview reports it
        return


def update_after_edit(owner: bpy.types.ID) -> None:
    """After a setting was edited, update the material if the look has changed."""
    if not isinstance(owner, bpy.types.Curves) or not owner.is_editable:
        return
    material = look_material(owner)
    look = _look_of(owner)
    if material is None or not is_outdated(material, look):
        return
    if look.color_map and not bpy.app.background:  # looking up a colour map is slow
        _deferred.add(owner.session_uid)
        if not bpy.app.timers.is_registered(_update_deferred):
            bpy.app.timers.register(_update_deferred, first_interval=_UPDATE_DELAY)
        return
    _update_material(owner)


def _update_deferred() -> None:
    """A timer for Blender: update the materials that were deferred."""
    for curves in [each for each in bpy.data.hair_curves if each.session_uid in _deferred]:
        _update_material(curves)
    _deferred.clear()


def _update_material(owner: bpy.types.Curves) -> None:
    hair = next((obj for obj in bpy.data.objects if obj.data == owner), None)
    try:
        if hair is not None:
            apply_look(hair)
    except HairloomError:  # painted colours cannot be read; the preview reports it
        return


def _look_of(curves: bpy.types.Curves) -> ShadingSettings:
    return wet_and_dusty_look(settings_of(curves.hairloom.shading, ShadingSettings))


LISTENER = ("settings", update_after_edit)


def register() -> None:
    changed.subscribe(*LISTENER)


def unregister() -> None:
    changed.unsubscribe(*LISTENER)
    _deferred.clear()
    if bpy.app.timers.is_registered(_update_deferred):
        bpy.app.timers.unregister(_update_deferred)
