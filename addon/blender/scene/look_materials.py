"""Keeps materials of looks up to date with their looks, until an artist changes their nodes."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ...shading.settings import ShadingSettings
from ...shading.wet_and_dusty import wet_and_dusty_look
from ..properties import changed
from ..properties.properties import settings_of
from .hair_material import is_as_made, is_behind, look_material, put_colors, put_look_material
from .painted_colors import colors_of_curves

#: time without edits before painted colours are looked up again [s]
_PAUSE = 0.3

#: session numbers of curves whose material is updated then
_deferred: set[int] = set()


def put_look(hair: bpy.types.Object) -> tuple[bpy.types.Material, tuple[str, ...]]:
    """Give hair the material of its look; returns the material and notes.

    Raises:
        HairloomError: see `colors_of_curves`.
    """
    look = _look_of(hair.data)
    painted, notes = colors_of_curves(hair, look, bpy.context.evaluated_depsgraph_get())
    material, more = put_look_material(hair.data, look, painted=painted)
    return material, (*notes, *more)


def follow_curves(hair: bpy.types.Object) -> None:
    """Update the material, or the colours that it reads, after the hair's curves were replaced."""
    look, material = _look_of(hair.data), look_material(hair.data)
    try:
        if material is not None and is_as_made(material):
            put_look(hair)
        else:
            depsgraph = bpy.context.evaluated_depsgraph_get()
            put_colors(hair.data, look, colors_of_curves(hair, look, depsgraph)[0])
    except HairloomError:  # painted colours cannot be read; the preview reports it
        return


def follow(owner: bpy.types.ID) -> None:
    """After a setting was edited, update the material if the look has changed."""
    if not isinstance(owner, bpy.types.Curves) or not owner.is_editable:
        return
    material = look_material(owner)
    look = _look_of(owner)
    if material is None or not is_behind(material, look):
        return
    if look.color_map and not bpy.app.background:  # looking up a colour map is slow
        _deferred.add(owner.session_uid)
        if not bpy.app.timers.is_registered(_follow_deferred):
            bpy.app.timers.register(_follow_deferred, first_interval=_PAUSE)
        return
    _put_again(owner)


def _follow_deferred() -> None:
    """A timer for Blender: update the materials that were deferred."""
    for curves in [each for each in bpy.data.hair_curves if each.session_uid in _deferred]:
        _put_again(curves)
    _deferred.clear()


def _put_again(owner: bpy.types.Curves) -> None:
    hair = next((obj for obj in bpy.data.objects if obj.data == owner), None)
    try:
        if hair is not None:
            put_look(hair)
    except HairloomError:  # painted colours cannot be read; the preview reports it
        return


def _look_of(curves: bpy.types.Curves) -> ShadingSettings:
    return wet_and_dusty_look(settings_of(curves.hairloom.shading, ShadingSettings))


LISTENER = ("settings", follow)


def register() -> None:
    changed.subscribe(*LISTENER)


def unregister() -> None:
    changed.unsubscribe(*LISTENER)
    _deferred.clear()
    if bpy.app.timers.is_registered(_follow_deferred):
        bpy.app.timers.unregister(_follow_deferred)
