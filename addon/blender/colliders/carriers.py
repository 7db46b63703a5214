"""Following an object that collides: by its matrix, and by how an armature deforms its mesh.

Most heads in Blender do not move as objects: an armature moves their vertices. A collider moves by
the rotation, scale and translation that fit the vertices best; the remainder deforms a mesh
collider. With hair, only vertices near its roots count, because the rest of a body moves
independently of the head.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.fitting.similarity import fit_similarity
from ...errors import HairloomError
from ...strands import Surface
from ...strands.affine import transform_points
from ..base.objects import Body
from ..scene.surfaces import read_positions

#: Approximate number of vertices by which a mesh is tracked; more would not change the result.
_TRACKED_VERTICES = 2000
#: Rings of triangles around the roots that count as near them.
_TRIANGLE_RINGS = 2
#: Modifiers that do not move a mesh.
_STATIC_MODIFIERS = frozenset(
    ("SUBSURF", "MULTIRES", "TRIANGULATE", "MIRROR", "EDGE_SPLIT", "WEIGHTED_NORMAL", "BEVEL")
    + ("NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WELD", "DECIMATE", "REMESH", "SOLIDIFY", "MASK")
)


@dataclass
class Carrier:
    """An object that carries a collider, and the vertices that it is tracked by.

    rest: (n, 3) [m] world, these vertices at rest; none for an object without a mesh.
    vertex_count: of the whole evaluated mesh.
    shape: (vertex_count, 3) [m] world, all vertices when last seen, if its shape may change.
    """

    body: Body
    index: Ints
    rest: Floats
    vertex_count: int
    shape: Floats | None = None

    @classmethod
    def of_object(cls, body: Body) -> Carrier:
        return cls(body, np.zeros(0, np.int64), np.zeros((0, 3)), 0)

    @classmethod
    def of_mesh(cls, body: Body, surface: Surface, roots: Ints | None = None) -> Carrier:
        """Args:
        surface: world space, with the body at rest.
        roots: indices of the vertices that hair grows on; None: all vertices count.
        """
        used = np.unique(surface.triangles)
        if roots is not None and len(roots):
            near = _vertices_near_roots(surface.triangles, roots, len(surface.positions))
            if fit_similarity(surface.positions[near], surface.positions[near]) is not None:
                used = near
        used = used[:: max(len(used) // _TRACKED_VERTICES, 1)]
        return cls(body, used, surface.positions[used], len(surface.positions))

    def motion_from_rest(self, depsgraph: bpy.types.Depsgraph) -> Floats:
        """(4, 4), world space, from its rest to where it is now.

        Raises:
            HairloomError: it is gone, or it has another mesh.
        """
        obj = self.body.resolve()
        matrix: Floats = self.body.motion_from_rest(depsgraph)
        if not self.vertex_count:
            return matrix
        if not is_deforming(obj):
            evaluated = obj.evaluated_get(depsgraph)
            self._check(len(evaluated.data.vertices) if obj.type == "MESH" else 0)
            self.shape = None
            return matrix
        positions = read_positions(obj, depsgraph, place=obj.name)
        self._check(len(positions))
        self.shape = positions
        fit = fit_similarity(transform_points(self.rest, matrix), positions[self.index])
        if fit is None:
            return matrix
        result: Floats = fit.matrix @ matrix
        return result

    def _check(self, vertex_count: int) -> None:
        if vertex_count != self.vertex_count:
            raise HairloomError(
                f"its mesh now has {vertex_count:,} vertices instead of {self.vertex_count:,}",
                place=self.body.handle.name,
                remedy="Press Play again",
            )


def is_deforming(obj: bpy.types.Object) -> bool:
    """Whether the shape of the mesh may change from frame to frame."""
    return (
        any(each.show_viewport and each.type not in _STATIC_MODIFIERS for each in obj.modifiers)
        or getattr(obj.data, "shape_keys", None) is not None
        or (obj.parent is not None and obj.parent_type in {"ARMATURE", "LATTICE", "CURVE"})
    )


def is_disabled(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether the artist has disabled it in viewports or excluded it from the view layer.

    Blender evaluates it anyway, because the hair refers to it. Hiding it with the eye icon does not
    count: colliders need not be visible.
    """
    layer = depsgraph.view_layer
    if obj.hide_viewport or not obj.evaluated_get(depsgraph).is_evaluated:
        return True
    if layer.objects.get(obj.name) != obj and obj not in layer.objects.values():
        return True  # lookup by name is fast, but libraries may have objects of the same name
    is_seen = obj.visible_get(view_layer=layer)
    return not is_seen and all(each.hide_viewport for each in obj.users_collection)


def scales_of(matrix: Floats) -> Floats:
    """(3,) lengths of a matrix's axes."""
    lengths: Floats = np.linalg.norm(matrix[:3, :3], axis=0)
    return lengths


def _vertices_near_roots(triangles: Ints, roots: Ints, vertex_count: int) -> Ints:
    """The vertices of `_TRIANGLE_RINGS` rings of triangles around the roots."""
    chosen = np.zeros(vertex_count, bool)
    chosen[np.asarray(roots)] = True
    for _ in range(_TRIANGLE_RINGS):
        chosen[triangles[chosen[triangles].any(axis=1)]] = True
    return np.flatnonzero(chosen)
