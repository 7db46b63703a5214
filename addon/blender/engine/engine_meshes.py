"""Evaluated objects as meshes to draw: meshes, and objects that Blender converts to meshes."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...render.snapshot import MeshPictures, MeshSnapshot, Skin
from ...strands import Surface
from ...strands.affine import transform_points
from ...strands.vectors import unit
from ..base.mesh_arrays import (
    corner_vertices,
    triangle_corners,
    triangle_materials,
    vertex_positions,
)
from ..scene.mesh_materials import MeshMaterial, material_of
from ..scene.surfaces import read_corner_uv

#: types of objects with faces; instances of texts and legacy curves come from Blender as meshes
SOLID_TYPES = frozenset({"MESH", "META"})


def read_meshes(
    obj: bpy.types.Object, matrix: Floats, *, is_head: bool
) -> tuple[MeshSnapshot, ...]:
    """A mesh for each material that an evaluated object uses; none without faces.

    Args:
        matrix: (4, 4) from object to world space, of the instance.
        is_head: whether hair grows on it, so that the hair's shadow on it may be soft.
    """
    # in Edit Mode, the mesh's data is elsewhere
    is_plain = obj.type == "MESH" and not obj.data.is_editmode
    mesh = obj.data if is_plain else obj.to_mesh()
    if mesh is None:
        return ()
    try:
        return _split_by_material(mesh, obj, matrix, is_head) if len(mesh.polygons) else ()
    finally:
        if not is_plain:
            obj.to_mesh_clear()


def _split_by_material(
    mesh: bpy.types.Mesh, obj: bpy.types.Object, matrix: Floats, is_head: bool
) -> tuple[MeshSnapshot, ...]:
    corners = triangle_corners(mesh)
    triangles, positions, normals = _geometry(mesh, corners)
    # multiplied from the right, as normals transform by the inverse transpose
    from_world = np.linalg.pinv(matrix[:3, :3])
    positions = transform_points(positions, matrix)
    if not np.isfinite(positions).all():
        return ()
    normals = unit(normals @ from_world.astype(np.float32))
    slots: Ints = np.zeros(len(triangles), np.int32)
    if len(obj.material_slots) > 1:
        slots = triangle_materials(mesh)
    meshes = []
    corner_uv = read_corner_uv(mesh, corners)
    is_skin = is_head and corner_uv is not None
    head = Surface(positions, triangles, corner_uv) if is_skin else None
    for slot in np.unique(slots):
        rows = np.flatnonzero(slots == slot)
        used, vertices = np.unique(triangles[rows], return_inverse=True)
        material = _material(obj, int(slot))
        uv = None if corner_uv is None or material.pictures is None else corner_uv[rows]
        surface = Surface(positions[used], vertices.reshape(-1, 3).astype(np.int32), uv)
        skin = None if head is None else Skin(head, rows)
        meshes.append(_with_material(MeshSnapshot(surface, normals[used], skin=skin), material))
    return tuple(meshes)


def _geometry(mesh: bpy.types.Mesh, corners: Ints) -> tuple[Ints, Floats, Floats]:
    """Triangles, positions and normals; split normals split vertices."""
    positions, vertices = vertex_positions(mesh), corner_vertices(mesh)
    if mesh.normals_domain == "POINT":
        normals = np.empty_like(positions)
        mesh.vertex_normals.foreach_get("vector", normals.ravel())
        return vertices[corners], positions, normals
    normals = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    return corners, positions[vertices], normals


def _material(obj: bpy.types.Object, slot: int) -> MeshMaterial:
    slots = obj.material_slots
    return material_of(slots[min(slot, len(slots) - 1)].material if len(slots) else None)


def _with_material(mesh: MeshSnapshot, material: MeshMaterial) -> MeshSnapshot:
    return replace(
        mesh,
        color=material.color,
        specular=material.specular,
        roughness=material.roughness,
        pictures=material.pictures,
        alpha=material.alpha,
        transparency=material.transparency,
        emission=material.emission,
    )


def reused_or_new(old: MeshSnapshot, new: MeshSnapshot) -> MeshSnapshot:
    """The old mesh if both look the same, so that it can stay on the GPU; for a head that has only
    moved, the new mesh with the old triangles and UVs."""
    is_same = (
        _look_key(old) == _look_key(new)
        and np.array_equal(old.surface.triangles, new.surface.triangles)
        and _same_uv(old.surface, new.surface)
        and np.array_equal(old.surface.positions, new.surface.positions)
        and np.array_equal(old.vertex_normals, new.vertex_normals)
    )
    was, now = old.skin, new.skin
    if was is None or now is None or not _same_uv_layout(was.surface, now.surface):
        return old if is_same else new
    if is_same:
        return old
    surface = replace(now.surface, triangles=was.surface.triangles, corner_uv=was.surface.corner_uv)
    return replace(new, skin=replace(now, surface=surface))


def _look_key(mesh: MeshSnapshot) -> tuple[object, ...]:
    """A key of everything that drawing depends on, except the surface."""
    pictures = mesh.pictures or MeshPictures()
    return (
        *(mesh.color, mesh.specular, mesh.roughness),
        *(mesh.key, mesh.name, mesh.number, mesh.is_holdout, mesh.skin is None),
        *(mesh.alpha, mesh.transparency, mesh.emission, pictures.bump),
        *(id(pictures.color), id(pictures.normal)),
    )


def _same_uv_layout(one: Surface, other: Surface) -> bool:
    return np.array_equal(one.triangles, other.triangles) and _same_uv(one, other)


def _same_uv(one: Surface, other: Surface) -> bool:
    was, now = one.corner_uv, other.corner_uv
    return was is now or (was is not None and now is not None and np.array_equal(was, now))
