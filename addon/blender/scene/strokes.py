"""Strokes of one groom: curves that its hair is combed along, the objects in a collection."""

from __future__ import annotations

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from .drawn_lines import joined_lines
from .hair_collections import objects_in

#: setting of the hair that names the collection, and the name for what it holds
COLLECTION_PROPERTY, COLLECTION_LABEL = "stroke_collection", "Strokes"


def strokes_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that this hair is combed along, each once."""
    return objects_in(hair, COLLECTION_PROPERTY)


def read_strokes(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[tuple[Floats, ...], tuple[str, ...]]:
    """All strokes, each from its first point to its last, (m, 3) [m] world space; and notes on
    unusable ones."""
    strokes: list[Floats] = []
    unusable: list[str] = []
    for obj in strokes_of(hair):
        try:
            strokes += joined_lines(obj, depsgraph)
        except HairloomError as error:
            unusable.append(str(error))
    return tuple(strokes), tuple(unusable)
