"""An artist's edits to the mesh of cards, read back from that mesh.

They are found by two things in the mesh: the face attribute `made_card`, the card's number, 0 for
faces that are not ours; and the record of what was made, a custom property. See cards/edits.py.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...cards.atlas_grid import AtlasGrid
from ...cards.edits import CardEdits, CardRecord, find_edits
from ...errors import HairloomError
from ...strands import Surface
from ..base.attributes import read_attribute
from ..base.objects import matrix_of
from ..scene.surfaces import OCCLUSION_LAYER
from .adopt import loop_triangles
from .made_objects import card_objects

#: the face attribute: the number of the card in the record, counted from 1
MADE_ATTRIBUTE = "made_card"
#: the custom property of the mesh that holds the record
RECORD_PROPERTY = "hairloom_made"
#: the UV map on the atlas
TILE_LAYER = "UVMap"
#: arrays of the record: field of CardRecord -> (dtype, shape for each card)
_ARRAYS: dict[str, tuple[Any, tuple[int, ...]]] = {
    "places": (np.float32, (5, 3)),
    "tile": (np.int32, ()),
    "prints": (np.int32, ()),
    "represented_by": (np.int32, ()),
    "triangle": (np.int32, ()),
    "corners": (np.float32, (3, 3)),
}


def read_edits(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, motion: Floats | None = None
) -> tuple[CardEdits | None, tuple[str, ...]]:
    """The artist's edits to a groom's cards in the scene, which are to be kept, and notes; None
    where nothing was edited or edits cannot be recognised.

    Args:
        motion: (4, 4) how the hair has moved since the pose that its cards are built in.

    Raises:
        HairloomError: the cards have lost their UVs, so that their tiles are unknown.
    """
    objects = card_objects(hair.original)
    if not objects:
        return None, ()
    obj = objects[0]
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    record = read_record(obj.data)
    if record is None:
        if not len(obj.data.polygons) or obj.hairloom.card_object.shell_layers:
            return None, ()
        return None, (
            f"{obj.name}: it has no record of its cards as they were made, so edits cannot be "
            "detected and all its cards are made again.",
        )
    surface, made = read_pieces(obj.data)
    matrix = matrix_of(hair, depsgraph)
    if motion is not None:
        matrix = np.linalg.pinv(motion) @ matrix
    edits = find_edits(surface, made, record, matrix)
    return (edits, ()) if edits else (None, tuple(f"{obj.name}: {each}." for each in edits.notes))


def same_edits(one: CardEdits | None, other: CardEdits | None) -> bool:
    """Whether both keep the same, wherever the hair is."""
    return one is other if one is None else one.has_same_edits(other)


def read_pieces(mesh: bpy.types.Mesh) -> tuple[Surface, Ints | None]:
    """All triangles of a mesh with their UVs, in its own space, and the number of the made card of
    each, see `find_edits`.

    Raises:
        HairloomError: it has no UV map.
    """
    positions, triangles, corners, polygon = loop_triangles(mesh)
    uv = np.zeros((len(mesh.loops), 2), np.float32)
    if len(triangles):
        _tile_layer(mesh).uv.foreach_get("vector", uv.ravel())
    number = read_attribute(mesh, MADE_ATTRIBUTE, "FACE")
    made = None if number is None else number[polygon].astype(np.int32) - 1
    return Surface(positions, triangles, uv[corners]), made


def write_record(mesh: bpy.types.Mesh, record: CardRecord, prints: Ints, matrix: Floats) -> None:
    """Write the record of the cards in a mesh.

    Args:
        record: world space.
        prints: (card_count,) prints of the cards as they are in the mesh.
        matrix: (4, 4) of the mesh's object.
    """
    local = record.moved(np.linalg.inv(matrix))
    content: dict[str, Any] = {
        field: np.ascontiguousarray(getattr(local, field), dtype).ravel()
        for field, (dtype, _) in _ARRAYS.items()
    }
    content["prints"] = np.ascontiguousarray(prints, np.int32)
    grid = record.grid
    content["grid"] = [grid.columns, grid.rows]
    content["padding"] = list(grid.padding)
    content["triangle_count"] = record.triangle_count
    mesh[RECORD_PROPERTY] = content


def forget_record(mesh: bpy.types.Mesh) -> None:
    """Remove the record of a mesh that does not hold cards any more."""
    if RECORD_PROPERTY in mesh:
        del mesh[RECORD_PROPERTY]


def read_record(mesh: bpy.types.Mesh) -> CardRecord | None:
    """The record of a mesh; None if there is none, or if it was changed and is inconsistent."""
    content = mesh.get(RECORD_PROPERTY)
    try:
        arrays = {
            field: np.array(content[field], dtype).reshape(-1, *shape)
            for field, (dtype, shape) in _ARRAYS.items()
        }
        columns, rows = (int(each) for each in content["grid"])
        across, along = (float(each) for each in content["padding"])
        grid = AtlasGrid(columns, rows, (across, along))
        triangle_count = int(content["triangle_count"])
    except (TypeError, KeyError, ValueError):
        return None
    count = len(arrays["places"])
    if not count or any(len(each) != count for each in arrays.values()):
        return None
    return CardRecord(grid=grid, triangle_count=triangle_count, **arrays)


def _tile_layer(mesh: bpy.types.Mesh) -> bpy.types.MeshUVLoopLayer:
    own = [layer for layer in mesh.uv_layers if layer.name != OCCLUSION_LAYER]
    if not own:
        raise HairloomError(
            "its UV map is missing, so it is unknown what its cards show",
            place=mesh.name,
            remedy=f"Undo, or give it a UV map called {TILE_LAYER}, or press Discard Edits",
        )
    return mesh.uv_layers.get(TILE_LAYER) or own[0]
