"""Meshes that hair grows from or collides with: evaluated mesh to a `Surface` in world space.

A mesh that is read again, for another groom or after an edit elsewhere, gives the same `Surface`
object while that is in use, with all that was computed on it: its search trees, the balls within.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...arrays import Floats, Ints, all_equal
from ...errors import HairloomError
from ...strands import Surface
from ...strands.affine import transform_points
from ..base.attributes import read_attribute
from ..base.mesh_arrays import (
    corner_vertices,
    triangle_corners,
    triangle_materials,
    vertex_positions,
)
from ..base.objects import as_mesh

#: the UV map of cards that holds occlusion and along
OCCLUSION_LAYER = "Occlusion"
#: attributes of cards: how open each vertex is, and how far from the root
CARD_ATTRIBUTES = ("occlusion", "along")


@dataclass
class _SurfaceCache:
    """The surfaces that were read. in_use: those that may still be in use. last: the one that was
    read last, kept in case it is read again."""

    in_use: list[weakref.ref[Surface]] = field(default_factory=list)
    last: Surface | None = None

    def shared(self, surface: Surface) -> Surface:
        """An equal surface that is in use already, or else this one."""
        there = [known for one in self.in_use if (known := one()) is not None]
        self.last = next((known for known in there if _is_same(surface, known)), surface)
        if self.last is surface:
            there.append(surface)
        self.in_use = [weakref.ref(each) for each in there]
        return self.last


_cache = _SurfaceCache()


def read_surface(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, need_uv: bool, place: str
) -> Surface:
    """The mesh that Blender shows after all modifiers, triangulated, in world space.

    Args:
        need_uv: False: a mesh without UVs gives a Surface without them.
        place: names the mesh in error messages.

    Raises:
        HairloomError: not a mesh, no faces, or no UVs where they are needed.
    """
    with evaluated_mesh(obj, depsgraph, place) as mesh:
        corners = triangle_corners(mesh)
        if not len(corners):
            raise HairloomError(
                "this mesh has no faces", place=place, remedy="Choose a mesh with faces"
            )
        corner_uv = read_corner_uv(mesh, corners)
        if corner_uv is None and need_uv:
            raise HairloomError(
                "this mesh has no UVs, so hair cannot be placed on its texture",
                place=place,
                remedy="Unwrap it (Edit Mode, UV > Unwrap), or omit --strict",
            )
        surface = Surface(vertex_positions(mesh), corner_vertices(mesh)[corners], corner_uv)
    return _cache.shared(surface.transformed(np.array(obj.evaluated_get(depsgraph).matrix_world)))


def read_rest_surfaces(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, posed: Surface
) -> tuple[list[Surface], bool]:
    """The mesh at rest: before shape keys and modifiers, and with its shape keys alone, each if it
    is known, with the triangles of the posed one; and whether modifiers only deform it.

    Args:
        posed: what `read_surface` returns now.
    """
    with evaluated_mesh(obj, depsgraph, obj.name) as mesh:
        rest = read_attribute(mesh, "rest_position", "POINT", 3)
    original = obj.original.data
    is_deformed_only = len(original.vertices) == len(posed.positions)
    found = [rest]
    if is_deformed_only:
        found = [
            vertex_positions(original) if rest is None else rest,
            _shape_key_positions(original, depsgraph),
        ]
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world)
    positions = [
        transform_points(each, matrix)
        for each in found
        if each is not None and each.shape == posed.positions.shape and np.isfinite(each).all()
    ]
    # the same objects until one changes, with all that was computed on them
    surfaces = posed.compute_if_changed(_with_positions, *positions)
    return surfaces, is_deformed_only


def _with_positions(posed: Surface, *positions: Floats) -> list[Surface]:
    return [replace(posed, positions=each) for each in positions]


def _shape_key_positions(mesh: bpy.types.Mesh, depsgraph: bpy.types.Depsgraph) -> Floats | None:
    """The vertices with the current relative shape keys alone; None without any."""
    if mesh.shape_keys is None or not mesh.shape_keys.use_relative:
        return None
    keys = mesh.shape_keys.evaluated_get(depsgraph).key_blocks
    places = {key.name: np.empty((len(mesh.vertices), 3), np.float32) for key in keys}
    for key in keys:
        key.points.foreach_get("co", places[key.name].ravel())
    result: Floats = places[keys[0].name].copy()
    for key in keys[1:]:
        # vertex groups of keys are rare and ignored: another surface then fits better
        if not key.mute and key.value:
            change = places[key.name] - places[key.relative_key.name]
            result += np.float32(key.value) * change
    return result


def _is_same(one: Surface, other: Surface) -> bool:
    return all_equal(
        (one.positions, one.triangles, one.corner_uv),
        (other.positions, other.triangles, other.corner_uv),
    )


def uv_map_note(obj: bpy.types.Object) -> str:
    """A note on which of several UV maps is used; "" if there are not several."""
    maps = obj.data.uv_layers
    if len(maps) < 2:
        return ""
    return (
        f"{obj.name}: it has {len(maps)} UV maps, and hair and its shadow use the active one, "
        f"'{maps.active.name}'. Make another one active (Data > UV Maps) if that is not the "
        "skin's."
    )


def read_positions(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, place: str) -> Floats:
    """The vertices of the evaluated mesh, (vertex_count, 3) float32 [m], world space.

    Raises:
        HairloomError: not a mesh.
    """
    with evaluated_mesh(obj, depsgraph, place) as mesh:
        positions = vertex_positions(mesh)
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float32)
    return positions @ matrix[:3, :3].T + matrix[:3, 3]


def read_material_slots(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Ints:
    """The material slot of each triangle of the evaluated mesh, (triangle_count,).

    Raises:
        HairloomError: not a mesh.
    """
    with evaluated_mesh(obj, depsgraph, obj.name) as mesh:
        return triangle_materials(mesh)


@contextmanager
def evaluated_mesh(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, place: str
) -> Iterator[bpy.types.Mesh]:
    """The evaluated mesh, even in Edit Mode; it is freed at the end of the block.

    Raises:
        HairloomError: not a mesh.
    """
    if obj.type != "MESH":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, not a mesh",
            place=place,
            remedy="Choose a mesh object",
        )
    with as_mesh(obj, depsgraph) as mesh:
        assert mesh is not None
        yield mesh


def read_corner_uv(mesh: bpy.types.Mesh, loops: Ints) -> Floats | None:
    """UVs of the active map at each triangle's corners, (triangle_count, 3, 2), or None. If the
    active map is the one that holds the occlusion of cards, the first other map is used.

    Args:
        loops: (triangle_count, 3), see `mesh_arrays.triangle_corners`.
    """
    layer = mesh.uv_layers.active
    is_cards = all(name in mesh.attributes for name in CARD_ATTRIBUTES)
    if layer is not None and layer.name == OCCLUSION_LAYER and is_cards:
        layer = next((each for each in mesh.uv_layers if each.name != OCCLUSION_LAYER), None)
    if layer is None:
        return None
    uv = np.empty((len(mesh.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.ravel())
    return uv[loops]
