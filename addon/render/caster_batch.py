"""Meshes on the GPU for passes that only need positions, and alpha for holes."""

from __future__ import annotations

from typing import Any

from ..arrays import Floats
from .mesh_batch import triangle_batch
from .mesh_pictures import pictures_of
from .snapshot import Caster, MeshSnapshot, surface_of


def alpha_picture(caster: Caster) -> Floats | None:
    """The picture whose alpha makes holes in a mesh; None if there is none."""
    if not isinstance(caster, MeshSnapshot) or caster.transparency == "opaque":
        return None
    pictures = pictures_of(caster)
    return None if pictures is None else pictures.color


def caster_batch(caster: Caster, vertex_values: Floats | None = None) -> Any:
    """A batch of the triangles with positions; with an alpha picture also UVs, with a vertex for
    each corner.

    Args:
        vertex_values: (vertex_count, 3), an additional attribute of this name; None for none.
    """
    surface = surface_of(caster)
    values, has_corners = {"position": surface.positions}, alpha_picture(caster) is not None
    if vertex_values is not None:
        values["vertex_values"] = vertex_values
    if has_corners and surface.corner_uv is not None:
        corners = surface.triangles.ravel()
        values = {name: array[corners] for name, array in values.items()}
        values["picture_uv"] = surface.corner_uv.reshape(-1, 2)
    return triangle_batch(values, None if has_corners else surface.triangles)
