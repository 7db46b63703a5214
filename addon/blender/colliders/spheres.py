"""Spheres fitted to a mesh: created, parented to it so that they follow it, and removed.

Each is an Empty shown as a sphere, whose display size is its radius in metres. It is parented to
three vertices of the evaluated mesh, so it follows a head that an armature turns. Where vertices
cannot be parents, it is parented to the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np
from mathutils import Matrix

from ...arrays import Floats, Ints
from ...dynamics.fitting.settings import SphereFitSettings
from ...dynamics.fitting.sphere_fit import SphereFit, fit_spheres
from ..base.objects import accepts_objects, head_of, objects_in
from ..base.parts import Part, Parts
from ..scene.surfaces import read_positions, read_surface

#: Custom property of data-blocks made here: on the collection the mesh, on each Empty True.
MARK = "hairloom_fitted"
#: Custom property of the collection: the mesh's collider shape before its spheres replaced it.
_REPLACED_SHAPE = "hairloom_collided_as"
#: Vertices that a sphere may be parented to: maximum distance in radii, and minimum number.
_PARENT_REACH, _MIN_PARENT_VERTICES = 1.3, 12
#: Modifiers that make several vertices from one; Blender uses their centre as the parent.
_COPYING_MODIFIERS = frozenset(
    ("MIRROR", "ARRAY", "SCREW", "SKIN", "REMESH", "BOOLEAN", "BUILD", "NODES")
)


@dataclass(frozen=True)
class FittedSpheres:
    """The fitted spheres. unskinned: how many follow the object only, not its deformation."""

    collection: bpy.types.Collection
    fit: SphereFit
    unskinned: int


def fit_spheres_to(
    mesh: bpy.types.Object,
    context: bpy.types.Context,
    settings: SphereFitSettings,
) -> Parts[FittedSpheres]:
    """Replace the spheres of this mesh, fitted to its present pose.

    Raises:
        HairloomError: no faces, or no volume.
    """
    depsgraph = context.evaluated_depsgraph_get()
    surface = read_surface(mesh, depsgraph, need_uv=False, place=mesh.name)
    fit = yield Part("Fitting spheres", partial(fit_spheres, surface, settings, place=mesh.name))
    vertices = _deformed_vertices(mesh, depsgraph)
    collection = _empty_collection(mesh, context.scene)
    empties = []
    for radius in fit.radii:
        empty = bpy.data.objects.new(f"{mesh.name} Sphere", None)
        empty.empty_display_type, empty.empty_display_size = "SPHERE", float(radius)
        empty.show_in_front, empty.hide_render = True, True
        empty[MARK] = True
        collection.objects.link(empty)
        empties.append(empty)
    unskinned = _parent_to(empties, fit, mesh, vertices, context)
    return FittedSpheres(collection, fit, unskinned)


def fitted_collections(mesh: bpy.types.Object) -> list[bpy.types.Collection]:
    """The collections of spheres fitted to a mesh."""
    return [each for each in bpy.data.collections if each.get(MARK) == mesh]


def use_spheres(
    hair: bpy.types.Object, collection: bpy.types.Collection, scene: bpy.types.Scene
) -> None:
    """Let hair collide with a collection, in addition to its present one. If that must not be
    changed, such as the spheres of another mesh, both go into a new collection."""
    used = hair.hairloom.collider_collection
    if used is None:
        hair.hairloom.collider_collection = collection
    elif collection not in (used, *used.children_recursive):
        if used.get(MARK) is not None or not accepts_objects(used):
            both = bpy.data.collections.new(f"{hair.name} Colliders")
            scene.collection.children.link(both)
            both.children.link(used)
            hair.hairloom.collider_collection = used = both
        used.children.link(collection)


def replace_mesh(mesh: bpy.types.Object, collection: bpy.types.Collection) -> None:
    """Let the spheres in this collection collide instead of their mesh."""
    if mesh.hairloom.collider_shape != "none":
        collection[_REPLACED_SHAPE] = mesh.hairloom.collider_shape
        mesh.hairloom.collider_shape = "none"


def remove_spheres(mesh: bpy.types.Object) -> int:
    """Remove all spheres fitted to a mesh, which then collides as before; returns their number."""
    count = 0
    for collection in fitted_collections(mesh):
        count += _remove_empties(collection)
        shape = collection.pop(_REPLACED_SHAPE, None)
        if shape is not None and mesh.hairloom.collider_shape == "none":
            mesh.hairloom.collider_shape = shape
        if not collection.all_objects and not collection.children:
            bpy.data.collections.remove(collection)
    return count


def hair_on(mesh: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The hair that grows on a mesh."""
    return [obj for obj in objects_in(view_layer) if obj.type == "CURVES" and head_of(obj) == mesh]


def _empty_collection(mesh: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection of this mesh's spheres, emptied of old ones; other objects stay in it."""
    fitted = fitted_collections(mesh)
    collection = fitted[0] if fitted else bpy.data.collections.new(f"{mesh.name} Spheres")
    _remove_empties(collection)
    collection[MARK] = mesh
    if collection not in scene.collection.children_recursive:
        scene.collection.children.link(collection)
    return collection


def _remove_empties(collection: bpy.types.Collection) -> int:
    old = [obj for obj in collection.objects if obj.get(MARK) and obj.type == "EMPTY"]
    bpy.data.batch_remove(old)
    return len(old)


def _deformed_vertices(mesh: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats | None:
    """(vertex_count, 3) [m] world, the mesh's own vertices as deformed; None if they cannot be
    identified among those that modifiers add."""
    positions = read_positions(mesh, depsgraph, place=mesh.name)
    count = len(mesh.data.vertices)
    copied = any(each.show_viewport and each.type in _COPYING_MODIFIERS for each in mesh.modifiers)
    if len(positions) < count or (len(positions) > count and copied):
        return None
    return positions[:count]  # subdivision keeps them first


def _parent_to(
    empties: list[bpy.types.Object],
    fit: SphereFit,
    mesh: bpy.types.Object,
    vertices: Floats | None,
    context: bpy.types.Context,
) -> int:
    """Parent the spheres and place them; returns how many are parented to the object only."""
    unskinned = 0
    for empty, center, radius in zip(empties, fit.centers, fit.radii, strict=True):
        parents = None if vertices is None else _parent_vertices(vertices, center, radius)
        empty.parent = mesh
        if parents is None:
            unskinned += 1
        else:
            empty.parent_type, empty.parent_vertices = "VERTEX_3", parents.tolist()
    context.view_layer.update()  # Blender computes the frame of each sphere's parent
    for empty, center in zip(empties, fit.centers, strict=True):
        empty.matrix_parent_inverse = empty.matrix_world.inverted_safe()
        empty.matrix_basis = Matrix.Translation([float(value) for value in center])
    context.view_layer.update()
    return unskinned


def _parent_vertices(vertices: Floats, center: Floats, radius: float) -> Ints | None:
    """Three vertices near a sphere (3,), far apart so that they define its rotation well; None if
    there is no triangle."""
    distance = np.linalg.norm(vertices - center, axis=1)
    near = np.flatnonzero(distance <= _PARENT_REACH * radius)
    if len(near) < _MIN_PARENT_VERTICES:
        near = np.argsort(distance, kind="stable")[:_MIN_PARENT_VERTICES]
    first = near[distance[near].argmin()]
    offset = vertices[near] - vertices[first]
    second = near[np.linalg.norm(offset, axis=1).argmax()]
    area = np.linalg.norm(np.cross(offset, vertices[second] - vertices[first]), axis=1)
    if area.max() <= 1.0e-6 * float(distance.max()) ** 2:
        return None
    return np.array([first, second, near[area.argmax()]])
