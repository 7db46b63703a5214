"""The hair that renders show: curves that hold nothing but the bake's strands.

Renders leave out the artist's own curves while there is such a copy, and the viewport the copy.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import playback
from .baked_rig import BakedRig
from .cache import Cache

#: data types of attributes that go over to the copy -> (name of the value, width, dtype)
_LAYOUTS: dict[str, tuple[str, int, Any]] = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
}
_POLY = 1  # in Blender's attribute curve_type


def show_in_renders(
    hair: bpy.types.Object, cache: Cache, depsgraph: bpy.types.Depsgraph
) -> bpy.types.Object:
    """Make the copy, or make it anew, and let renders show it in place of the hair.

    The render's thread writes strands into the copy, so the window is locked while it does.

    Raises:
        HairloomError: the bake is damaged.
    """
    rig = playback.rig_in(cache)
    bake = hair.hairloom.bake
    copy = bake.copy
    if copy is None or copy.hairloom.bake.stands_for not in (None, hair):  # its original's
        curves = bpy.data.hair_curves.new(f"{hair.name} Baked")
        copy = bake.copy = bpy.data.objects.new(curves.name, curves)
    if not bake.hides:
        bake.hides, bake.was_hidden = True, hair.hide_render
    _link_beside(copy, hair)
    _fill(copy.data, hair, rig, depsgraph)
    copy.data.hairloom.baked_in = bake.folder
    # what a copy names is evaluated in renders though it is hidden there: so are its settings
    copy.hairloom.bake.stands_for = hair
    copy.hide_viewport = copy.hide_select = True
    copy.hide_render = bake.was_hidden
    hair.hide_render = True
    scene = depsgraph.scene
    scene.render.use_lock_interface = True
    playback.show_in_copies(scene)
    return copy


def remove(hair: bpy.types.Object) -> None:
    """Renders show the hair itself again."""
    bake = hair.hairloom.bake
    copy = bake.copy
    if bake.hides:
        hair.hide_render, bake.hides = bake.was_hidden, False
    if copy is None:
        return
    bake.copy = None
    other = next((obj for obj in bpy.data.objects if obj.hairloom.bake.copy == copy), None)
    if other is not None:  # a duplicate of the hair, which names the same copy
        if copy.hairloom.bake.stands_for == hair:
            copy.hairloom.bake.stands_for = other
        return
    curves = copy.data
    bpy.data.objects.remove(copy)
    if not curves.users:
        bpy.data.hair_curves.remove(curves)


def _link_beside(copy: bpy.types.Object, hair: bpy.types.Object) -> None:
    for collection in hair.users_collection:
        if copy.name not in collection.objects:
            collection.objects.link(copy)


def _fill(
    curves: bpy.types.Curves,
    hair: bpy.types.Object,
    rig: BakedRig,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    """The bake's strands at rest, with the look of the hair."""
    strands = rig.rig.strands
    grid = strands.grid
    if len(curves.curves):
        curves.remove_curves()
    curves.add_curves([grid.shape[1]] * len(grid))
    curves.position_data.foreach_set("vector", grid.ravel())
    if not _are_poly(hair.data):
        curves.set_types(type="CATMULL_ROM")
    else:
        curves.set_types(type="POLY")
    _write(curves, "radius", "FLOAT", "POINT", strands.radius)
    shown = hair.evaluated_get(depsgraph).data
    if len(shown.curves) == len(grid):  # else it is not known which strand is which
        _take_attributes(curves, shown)
    curves.materials.clear()
    for material in hair.data.materials:
        curves.materials.append(material)


def _are_poly(curves: bpy.types.Curves) -> bool:
    attribute = curves.attributes.get("curve_type")
    if attribute is None or not len(attribute.data):
        return False
    types = np.empty(len(attribute.data), np.int32)
    attribute.data.foreach_get("value", types)
    return bool((types == _POLY).all())


def _take_attributes(curves: bpy.types.Curves, shown: bpy.types.Curves) -> None:
    """What a material may ask of a strand: UVs of the root, groups, colours."""
    for attribute in shown.attributes:
        layout = _LAYOUTS.get(attribute.data_type)
        is_internal = attribute.name.startswith(".") or attribute.is_internal
        if attribute.domain == "CURVE" and layout is not None and not is_internal:
            value, width, dtype = layout
            values = np.empty(len(attribute.data) * width, dtype)
            attribute.data.foreach_get(value, values)
            _write(curves, attribute.name, attribute.data_type, "CURVE", values)


def _write(
    curves: bpy.types.Curves, name: str, data_type: str, domain: str, values: np.ndarray
) -> None:
    attribute = curves.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, domain):
        curves.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = curves.attributes.new(name, data_type, domain)
    attribute.data.foreach_set(_LAYOUTS[data_type][0], values.ravel())
