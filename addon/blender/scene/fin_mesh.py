"""Data of a fin's original mesh that its simulation reads, beside the triangles."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Ints
from ...errors import HairloomError
from ..base.mesh_arrays import corner_vertices, edge_vertices
from ..base.objects import Handle
from .fin_modifier import fin_modifier, other_fin_with


def check_usable(obj: bpy.types.Object, handle: Handle) -> None:
    """Check that a fin can be simulated.

    Raises:
        HairloomError: it is not a fin, is being edited, or shares its mesh with another fin.
    """
    if obj.type != "MESH" or fin_modifier(obj) is None:
        raise HairloomError(
            "it is not cloth", place=obj.name, remedy="Press Make Cloth in its Physics tab"
        )
    if obj.mode == "EDIT":
        raise HairloomError(
            "it is in Edit Mode", place=obj.name, remedy="Leave Edit Mode and play again"
        )
    other = other_fin_with(obj.data, handle)
    if other is not None:
        raise HairloomError(
            f"it shares its mesh with {other.name}, which would move the same way",
            place=obj.name,
            remedy="Use Object > Relations > Make Single User > Object & Data",
        )


def loose_edges_of(mesh: bpy.types.Mesh) -> Ints:
    """Edges without a face, (n, 2) int32."""
    is_loose = np.empty(len(mesh.edges), bool)
    mesh.edges.foreach_get("is_loose", is_loose)
    loose: Ints = edge_vertices(mesh)[is_loose]
    return loose


def corners_of(mesh: bpy.types.Mesh) -> Ints:
    """The vertex of each polygon corner, then the number of vertices; int32."""
    return np.append(corner_vertices(mesh), np.int32(len(mesh.vertices)))
