"""Grows hair on a mesh, and again when its settings are edited, unless the hair was combed.

The settings are stored in the groom, with a digest of the curves that they made: curves follow an
edit of the settings only if nothing has changed them since they grew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.grow import grow
from ...groom.scalp import scalp_density
from ...groom.settings import GrowSettings
from ...groom.widths import with_widths
from ...strands import StrandSet
from ...strands.affine import mean_scale
from ..base.attributes import read_attribute
from ..base.digests import digest
from ..base.objects import check_curves_editable, head_of, matrix_of, objects_using
from ..base.parts import Part, Parts, run_parts
from ..properties import changed
from ..properties.properties import settings_of
from ..scene.curves import curve_offsets, curve_points, fill_curves, write_curves
from ..scene.hair_material import MATERIAL_COLOR
from ..scene.look_materials import update_after_new_curves
from ..scene.masks import read_map
from ..scene.sag_correction import restore_sag_correction
from ..scene.surfaces import read_surface

#: attributes of hair as it grows
_GROWN_ATTRIBUTES = ("position", "radius", "surface_uv_coordinate")
#: what growing again loses of the grown curves themselves
COMBED_SHAPE = "combed shape"


def grow_on(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    values: Any,
    *,
    density_group: str = "",
    length_group: str = "",
) -> Parts[bpy.types.Object]:
    """Hair curves grown on a mesh, which store the settings that they grew by.

    Args:
        values: an operator or group with the properties of GrowSettings.
        density_group, length_group: vertex groups, attributes or images, by name. Without a
            density, combed hair grows on the scalp of an upright head, and hair along the normals
            grows everywhere. Without a length, all hair has the length in the settings.

    Raises:
        HairloomError: the mesh has no faces, there is no group of this name, or it is 0 everywhere.
    """
    settings = settings_of(values, GrowSettings)
    strands = yield from _grow_steps(head, depsgraph, settings, density_group, length_group)
    hair = write_curves(f"{head.name} Hair", strands, head, collection, are_widths_estimated=True)
    growth = hair.data.hairloom.grow
    for name, value in settings.as_dict().items():
        setattr(growth, name, value)
    growth.density_group, growth.length_group = density_group, length_group
    _store_digests(hair.data)
    return hair


def grow_again(grooms: Sequence[bpy.types.Object], depsgraph: bpy.types.Depsgraph) -> Parts[None]:
    """Replace the curves of hair by those that its settings make now, even if they were combed.

    Raises:
        HairloomError: some hair has no mesh to grow on, is linked from another file, or Blender
            does not evaluate it or its head; or as `grow_on`. Nothing is changed then.
    """
    results = []
    for hair in grooms:
        results.append((yield from _grow_again_steps(hair, depsgraph)))
    for hair, strands in zip(grooms, results, strict=True):
        replace_curves(hair, strands, depsgraph)
        hair.data.hairloom.grow.problem = ""
        _store_digests(hair.data)


def _grow_again_steps(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Parts[StrandSet]:
    check_curves_editable(hair, depsgraph)
    head, growth = head_of(hair), hair.data.hairloom.grow
    if head is None:
        raise HairloomError(
            "it has no surface to grow on",
            place=hair.name,
            remedy="Set Surface in its Data properties",
        )
    for obj in (head, hair):
        if not _is_evaluated(obj, depsgraph):
            raise HairloomError(
                "it is disabled in viewports or excluded from the view layer, so its current "
                "position is unknown",
                place=obj.name,
                remedy="Enable it in the Outliner, then press Grow Again",
            )
    return (
        yield from _grow_steps(
            head,
            depsgraph,
            settings_of(growth, GrowSettings),
            growth.density_group,
            growth.length_group,
            replaced_hair=hair,
        )
    )


def replace_curves(
    hair: bpy.types.Object, strands: StrandSet, depsgraph: bpy.types.Depsgraph
) -> None:
    """Give hair other curves, in world space. All attributes of the old curves are lost, except the
    colours that its material reads, which are made again."""
    curves = hair.data
    to_object = np.linalg.inv(matrix_of(hair, depsgraph))
    has_colors = MATERIAL_COLOR in curves.attributes
    curves.remove_curves()
    for name in set(curves.attributes.keys()).difference(_GROWN_ATTRIBUTES):
        curves.attributes.remove(curves.attributes[name])
    fill_curves(curves, strands.transformed(to_object))
    curves.update_tag()
    restore_sag_correction(curves)
    if has_colors:
        update_after_new_curves(hair)


def grow_after_edit(curves: bpy.types.ID) -> None:
    """After a setting of growth was edited, grow hair again that is still as it grew."""
    assert isinstance(curves, bpy.types.Curves)
    growth = curves.hairloom.grow
    if (
        not curves.is_editable
        or growth.made_by == _settings_digest(growth)
        or lost_by_regrowing(curves)
    ):
        return
    users = [obj for obj in objects_using(curves) if head_of(obj) is not None]
    depsgraph = bpy.context.evaluated_depsgraph_get()
    users.sort(key=lambda obj: not _is_evaluated(obj, depsgraph))
    try:
        if users:
            run_parts(grow_again(users[:1], depsgraph))
    except HairloomError as error:  # shown in the panel; the artist may not have finished editing
        growth.problem = str(error)


def lost_by_regrowing(curves: bpy.types.Curves) -> tuple[str, ...]:
    """What growing again would lose, in a few words each; empty: curves follow their settings."""
    growth = curves.hairloom.grow
    if not growth.shape:
        return (f"{len(curves.curves):,} curves",) if len(curves.curves) else ()
    is_combed = growth.shape != _shape_digest(curves)
    return (*((COMBED_SHAPE,) if is_combed else ()), *_other_attributes(curves))


def has_grown(curves: bpy.types.Curves) -> bool:
    """Whether the curves were grown by settings, not drawn by a brush or read from a file."""
    return bool(curves.hairloom.grow.shape)


def is_outdated(curves: bpy.types.Curves) -> bool:
    """Whether the settings have changed since the curves grew."""
    growth = curves.hairloom.grow
    return bool(growth.made_by != _settings_digest(growth))


def _grow_steps(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    settings: GrowSettings,
    density_group: str,
    length_group: str,
    replaced_hair: bpy.types.Object | None = None,
) -> Parts[StrandSet]:
    """Strands grown in world space, on the head in its present pose.

    Args:
        replaced_hair: the hair whose curves they replace, and whose widths they keep.
    """
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    density = read_map(head, depsgraph, density_group) if density_group else None
    length = read_map(head, depsgraph, length_group) if length_group else None
    radius: Floats | None = None
    offsets: Ints = np.zeros(1, np.int32)
    if replaced_hair is not None:
        radius, offsets = (
            _radius_in_world(replaced_hair, depsgraph),
            curve_offsets(replaced_hair.data),
        )

    def work() -> StrandSet:
        uses_scalp = density is None and settings.method == "combed"
        density_or_scalp = surface.compute_once(scalp_density) if uses_scalp else density
        return _with_widths(grow(surface, settings, density_or_scalp, length), radius, offsets)

    return (yield Part(f"Growing {settings.strand_count:,} strands", work))


def _is_evaluated(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    return bool(obj.evaluated_get(depsgraph).is_evaluated)


def _radius_in_world(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats | None:
    """Radii of the points of its curves, (point_count,) [m]; None: they have no widths."""
    radius: Floats | None = read_attribute(hair.data, "radius", "POINT")
    return None if radius is None else radius * np.float32(mean_scale(matrix_of(hair, depsgraph)))


def _with_widths(strands: StrandSet, radius: Floats | None, offsets: Ints) -> StrandSet:
    """Strands with the widths of those that they replace; if there are none, or their number
    differs, with estimated widths."""
    if radius is not None and np.array_equal(offsets, strands.offsets):
        return replace(strands, radius=radius, has_widths=True)
    return with_widths(strands, "found")[0]


def _other_attributes(curves: bpy.types.Curves) -> tuple[str, ...]:
    """Names of attributes that were added to grown curves, such as painted colours.

    Attributes made from the look do not count, nor selection and visibility, whose names begin
    with a dot in Blender.
    """
    names = (attribute.name for attribute in curves.attributes)
    ours = (*_GROWN_ATTRIBUTES, MATERIAL_COLOR)
    return tuple(n for n in names if n not in ours and not n.startswith("."))


def _store_digests(curves: bpy.types.Curves) -> None:
    """Store digests of the curves and of the settings that they have just grown by."""
    growth = curves.hairloom.grow
    growth.shape, growth.made_by = _shape_digest(curves), _settings_digest(growth)


def _shape_digest(curves: bpy.types.Curves) -> str:
    radius: Floats | None = read_attribute(curves, "radius", "POINT")
    parts = (curve_offsets(curves), curve_points(curves), radius)
    return digest(*(part.tobytes() for part in parts if part is not None))


def _settings_digest(growth: Any) -> str:
    settings = settings_of(growth, GrowSettings).as_dict()
    return digest((settings, growth.density_group, growth.length_group))


LISTENER = ("grow", grow_after_edit)


def register() -> None:
    changed.subscribe(*LISTENER)


def unregister() -> None:
    changed.unsubscribe(*LISTENER)
