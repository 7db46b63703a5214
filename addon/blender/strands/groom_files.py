"""Grooms in and out of the open scene, as the artist's buttons ask for it."""

from __future__ import annotations

from typing import Any

import bpy

from ...groom.grow import grow, scalp_density
from ...groom.settings import GrowSettings
from ..base.vertex_weights import read_weights
from ..properties.properties import settings_of
from ..scene.curves import write_curves
from ..scene.surfaces import read_surface


def grow_on(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    values: Any,
    *,
    density_group: str = "",
    length_group: str = "",
) -> bpy.types.Object:
    """Hair curves grown on a mesh.

    Args:
        values: an operator or group with the properties of GrowSettings.
        density_group, length_group: vertex groups or float attributes on points, by name. Without
            a density combed hair grows on the scalp of an upright head, hair along the normals
            everywhere; without a length all is as long as the settings say.

    Raises:
        HairloomError: it has no faces to grow on, there is no group of this name, or all is 0.
    """
    settings = settings_of(values, GrowSettings)
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    density = read_weights(head, depsgraph, density_group) if density_group else None
    length = read_weights(head, depsgraph, length_group) if length_group else None
    if density is None and settings.method == "combed":
        density = scalp_density(surface)
    strands = grow(surface, settings, density, length)
    return write_curves(f"{head.name} Hair", strands, head, collection)
