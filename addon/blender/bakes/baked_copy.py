"""The copy that renders show: curves that hold only the strands of a bake.

While there is a copy, renders hide the artist's own curves, and the viewport hides the copy.
"""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ...paint_flow import with_colors
from ...shading.settings import ShadingSettings
from ...shading.wet_and_dusty import wet_and_dusty_look
from ..base.attributes import read_attribute, set_attribute
from ..base.objects import link_into, remove_hair
from ..properties.properties import settings_of
from ..scene.curves import set_colors
from ..scene.hair_material import set_look_material
from ..scene.painted_colors import read_colors
from . import playback
from .bake_settings import shown_folder_of
from .baked_rig import BakedRig
from .cache import Cache

_POLY = 1  # in Blender's attribute curve_type
#: properties of objects by which renders show them, beside `hide_render`
_VISIBILITY = (
    *("visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission"),
    *("visible_volume_scatter", "visible_shadow", "is_holdout", "is_shadow_catcher"),
)


def show_in_renders(
    hair: bpy.types.Object, cache: Cache, depsgraph: bpy.types.Depsgraph
) -> bpy.types.Object:
    """Make or update the copy, and let renders show it instead of the hair.

    The render thread writes strands into the copy, so Lock Interface is switched on.

    Raises:
        HairloomError: the bake is damaged.
    """
    rig = playback.rig_in(cache)
    bake = hair.hairloom.bake
    copy = copy_of(hair)
    # a duplicate of hair still points to the copy of its original
    if copy is None or copy.hairloom.bake.shown_hair not in (None, hair):
        curves = bpy.data.hair_curves.new(f"{hair.name} Baked")
        copy = bpy.data.objects.new(curves.name, curves)
    link_into(copy, hair.users_collection, depsgraph.scene)
    _write_strands(copy.data, hair, rig, depsgraph)
    bake.copy = copy
    if not bake.hides:
        bake.hides, bake.was_hidden = True, hair.hide_render
    copy.data.hairloom.baked_in = bake.folder
    copy.data.hairloom.baked_rig = cache.facts.rig_hash
    # renders hide the hair but evaluate it, and its settings, since the copy points to it
    copy.hairloom.bake.shown_hair = hair
    copy.hide_viewport = copy.hide_select = True
    copy.hide_render = bake.was_hidden
    hair.hide_render = True
    follow_visibility()
    scene = depsgraph.scene
    scene.render.use_lock_interface = True
    playback.show_in_copies(scene)
    return copy


def copy_of(hair: bpy.types.Object) -> bpy.types.Object | None:
    """The copy of this hair; None once the artist has converted it, such as to a mesh."""
    copy = hair.hairloom.bake.copy
    return copy if copy is not None and copy.type == "CURVES" else None


def follow_visibility() -> None:
    """Give all copies the visibility of their hair to rays, and whether it is a holdout."""
    for copy in bpy.data.objects:
        hair = copy.hairloom.bake.shown_hair
        # during a render, Hairloom Hair may have hidden it
        for name in () if hair is None or hair.hairloom.hidden_rays else _VISIBILITY:
            value = getattr(hair, name)
            if getattr(copy, name) != value:
                setattr(copy, name, value)


def remove_copy(hair: bpy.types.Object) -> None:
    """Remove the copy, so that renders show the hair itself again."""
    bake = hair.hairloom.bake
    copy = copy_of(hair)
    if bake.hides:
        hair.hide_render, bake.hides = bake.was_hidden, False
    bake.copy = None
    if copy is None:
        return
    other = next((obj for obj in bpy.data.objects if obj.hairloom.bake.copy == copy), None)
    if other is not None:  # a duplicate of the hair, with the same copy
        if copy.hairloom.bake.shown_hair == hair:
            copy.hairloom.bake.shown_hair = other
        return
    remove_hair(copy)


def restore_hair_without_copy() -> list[str]:
    """Let renders show hair again if its copy was deleted, or unlinked from all scenes.

    Returns:
        the names of that hair.
    """
    healed = []
    for hair in bpy.data.objects:
        if is_copy_gone(hair) and hair.library is None:
            remove_copy(hair)
            healed.append(hair.name)
    return healed


def is_copy_gone(hair: bpy.types.Object) -> bool:
    """Whether renders hide hair although its copy is in no scene."""
    copy = copy_of(hair)
    return bool(hair.hairloom.bake.hides and not (copy and copy.users_scene))


def render_problem(hair: bpy.types.Object) -> str:
    """Why renders show a baked groom wrongly: its copy is gone, or the bake of that; else "". Fast
    enough for every redraw."""
    if is_copy_gone(hair):
        return "Renders hide it: the copy that showed its bake was deleted"
    if hair.hairloom.bake.hides and _is_bake_gone(hair.hairloom.bake.copy):
        return "Renders show it without motion: its bake was deleted"
    return ""


def _is_bake_gone(copy: bpy.types.Object) -> bool:
    folder = shown_folder_of(copy.data)
    try:
        return folder is None or playback.cache_in(folder) is None
    except HairloomError:  # it is damaged, which the panel reports
        return False


def _write_strands(
    curves: bpy.types.Curves,
    hair: bpy.types.Object,
    rig: BakedRig,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    """The bake's strands at rest, with the look of the hair."""
    look = wet_and_dusty_look(settings_of(hair.data.hairloom.shading, ShadingSettings))
    head = rig.rig.head
    colors, _ = read_colors(hair, depsgraph, None if head is None else len(head.triangles))
    strands = with_colors(rig.rig.strands, colors, look)
    if len(curves.curves):
        curves.remove_curves()
    curves.add_curves(strands.point_counts.tolist())
    curves.position_data.foreach_set("vector", strands.points.ravel())
    if not _are_poly(hair.data):
        curves.set_types(type="CATMULL_ROM")
    else:
        curves.set_types(type="POLY")
    set_attribute(curves, "radius", "POINT", strands.radius)
    shown = hair.evaluated_get(depsgraph).data
    if len(shown.curves) == strands.strand_count:  # else curves and strands do not correspond
        _copy_attributes(curves, shown)
    set_colors(curves, strands)
    curves.materials.clear()
    for material in hair.data.materials:
        curves.materials.append(material)
    if not len(curves.materials):
        set_look_material(curves, look)


def _are_poly(curves: bpy.types.Curves) -> bool:
    types = read_attribute(curves, "curve_type", "CURVE")
    return types is not None and len(types) > 0 and bool((types == _POLY).all())


def _copy_attributes(curves: bpy.types.Curves, shown: bpy.types.Curves) -> None:
    """Copy the attributes that materials may read from a strand: root UVs, groups, colours."""
    for attribute in shown.attributes:
        # Blender's own are INT8, such as curve types, or have names that begin with a dot
        is_own = attribute.data_type == "INT8" or attribute.name.startswith(".")
        values = read_attribute(shown, attribute.name, "CURVE", width=None)
        if values is not None and not is_own:
            set_attribute(curves, attribute.name, "CURVE", values)
