"""Batches of meshes on the GPU."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..shading.skin.layout import SkinLayout
from . import gpu_objects
from .mesh_pictures import pictures_of
from .snapshot import MeshSnapshot


def mesh_batch(mesh: MeshSnapshot, skin: SkinLayout | None = None) -> Any:
    """A batch of the triangles of a mesh: position, normal, occlusion; with pictures also UVs, with
    a vertex for each corner.

    Args:
        skin: the layout of the head that it is a part of, which gives each corner a place.
    """
    surface = mesh.surface
    count = len(surface.positions)
    occlusion = np.ones(count) if mesh.occlusion is None else mesh.occlusion
    values = {
        "position": surface.positions,
        "normal": mesh.vertex_normals,
        "occlusion": occlusion[:, None],
    }
    has_corners = skin is not None or pictures_of(mesh) is not None
    if has_corners:
        corners = surface.triangles.ravel()
        values = {name: array[corners] for name, array in values.items()}
    if skin is not None:
        values["skin_place"] = _skin_places(mesh, skin)
    if pictures_of(mesh) is not None and surface.corner_uv is not None:
        values["picture_uv"] = surface.corner_uv.reshape(-1, 2)
    return triangle_batch(values, None if has_corners else surface.triangles)


def triangle_batch(values: dict[str, Floats], triangles: Ints | None) -> Any:
    """A batch of triangles with vertex attributes by name, (vertex_count, length) each.

    Args:
        triangles: (triangle_count, 3); None: every three vertices are a triangle.
    """
    vertices = gpu_objects.vertex_buffer(values)
    indices = None if triangles is None else gpu_objects.index_buffer(triangles)
    return gpu_objects.batch("TRIS", vertices, indices)


def _skin_places(mesh: MeshSnapshot, skin: SkinLayout) -> Floats:
    """UV place and island of each corner, (3 triangle_count, 3)."""
    assert mesh.skin is not None
    chosen = slice(None) if mesh.skin.triangle is None else mesh.skin.triangle
    place = skin.place[chosen].reshape(-1, 2)
    return np.column_stack([place, np.repeat(skin.triangle_island[chosen], 3)])
