"""Tools for cards in the mesh of their object: in Edit Mode they change selected cards, in Object
Mode they add cards along curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bmesh
import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...cards.card_mesh import CardMesh
from ...cards.edits import CardRecord
from ...cards.settings import CardSettings
from ...cards.shaping import CardVertices, card_along_line, line_from_root, tile_offset
from ...errors import HairloomError
from ...strands.affine import transform_points
from ..base.objects import check_shape_editable, head_of, matrix_of
from ..properties.groom_settings import GroomSettings
from ..scene.drawn_lines import joined_lines
from ..scene.surfaces import OCCLUSION_LAYER, read_surface
from .edits import MADE_ATTRIBUTE, TILE_LAYER, read_record
from .made_objects import card_objects


def edited_cards(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects of cards in Edit Mode, without coarser levels, which are made from the finest."""
    if context.mode != "EDIT_MESH":
        return []
    objects = context.objects_in_mode
    cards = [(obj, obj.hairloom.card_object) for obj in objects]
    return [obj for obj, card in cards if card.groom is not None and not card.level]


def shape_selected(obj: bpy.types.Object, shape: Callable[[CardVertices], Floats]) -> int:
    """Move the vertices of all cards that have a selected vertex; returns the number of cards.

    Args:
        shape: gives the vertices' new positions, (vertex_count, 3) [m], object space.

    Raises:
        HairloomError: the mesh has no UV map, or a vertex would go to a place that is not finite.
    """
    edited = bmesh.from_edit_mesh(obj.data)
    pieces = _selected_pieces(edited)
    if not pieces:
        return 0
    layer = _uv_layer(edited, obj)
    vertices = [vertex for piece in pieces for vertex in piece]
    cards = CardVertices(
        np.array([vertex.co[:] for vertex in vertices]),
        np.array([vertex.link_loops[0][layer].uv[:] for vertex in vertices]),
        np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]),
    )
    places = shape(cards)
    if not np.isfinite(places).all():
        raise HairloomError(
            "the cards would go to places that are not finite",
            place=obj.name,
            remedy="Use finite numbers",
        )
    for vertex, place in zip(vertices, places.tolist(), strict=True):
        vertex.co = place
    edited.normal_update()
    bmesh.update_edit_mesh(obj.data)
    return len(pieces)


def move_to_tiles(obj: bpy.types.Object, tile_of: Callable[[Ints, int], Ints]) -> list[int]:
    """Move the UVs of all cards that have a selected vertex to other tiles; returns these tiles.

    Args:
        tile_of: maps the tile of each card and the number of tiles to new tiles.

    Raises:
        HairloomError: the mesh has no UV map, or no record of its atlas.
    """
    edited = bmesh.from_edit_mesh(obj.data)
    pieces = _selected_pieces(edited)
    if not pieces:
        return []
    grid, layer = _record_of(obj).grid, _uv_layer(edited, obj)
    loops = [[loop for vertex in piece for loop in vertex.link_loops] for piece in pieces]
    middles = np.array([np.mean([loop[layer].uv[:] for loop in own], axis=0) for own in loops])
    tile = grid.tile_at(middles)
    wanted = tile_of(tile, grid.tile_count)
    for own, shift in zip(loops, tile_offset(grid, tile, wanted).tolist(), strict=True):
        for loop in own:
            u, v = loop[layer].uv
            loop[layer].uv = u + shift[0], v + shift[1]
    bmesh.update_edit_mesh(obj.data)
    found: list[int] = wanted.tolist()
    return found


def add_along_curves(
    hair: bpy.types.Object,
    curves: Sequence[bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    width: float,
    tile: int,
) -> int:
    """Add a card along each line of these curves to the cards of a groom; returns their number.

    Args:
        width: at the root [m]; 0: that of the other cards.
        tile: from 0; -1: that of the nearest card.

    Raises:
        HairloomError: no cards yet, no line, or a tile that the atlas does not have.
    """
    objects = card_objects(hair)
    if not objects:
        raise HairloomError("it has no cards yet", place=hair.name, remedy="Press Make Cards first")
    obj, settings = objects[0], GroomSettings.of(hair)[CardSettings]
    check_shape_editable(obj)
    matrix, head = matrix_of(obj, depsgraph), head_of(hair)
    record = _record_of(obj).moved(matrix)
    if tile >= record.grid.tile_count:
        raise HairloomError(
            f"its atlas has {record.grid.tile_count} tiles",
            place=obj.name,
            remedy="Choose one of these",
        )
    surface = None
    if head is not None:
        surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    lines = [line for curve in curves for line in joined_lines(curve, depsgraph)]
    edited = bmesh.new()
    try:
        edited.from_mesh(obj.data)
        for line in lines:
            rooted, outwards = line_from_root(line, surface)
            near = np.linalg.norm(record.places[:, 0] - rooted[0], axis=1).argmin()
            card = card_along_line(
                rooted,
                outwards,
                settings,
                width=width or record.median_width,
                tile=tile if tile >= 0 else int(record.tile[near]),
                grid=record.grid,
            )
            _append_card(edited, card, matrix)
        edited.to_mesh(obj.data)
    finally:
        edited.free()
    obj.data.update()
    return len(lines)


def _record_of(obj: bpy.types.Object) -> CardRecord:
    if obj.hairloom.card_object.shell_layers:
        raise HairloomError(
            "it holds shells, which have no cards to edit",
            place=obj.name,
            remedy="Set Kind to Cards and press Make Cards Again",
        )
    record = read_record(obj.data)
    if record is None:
        raise HairloomError(
            "it has no record of its atlas", place=obj.name, remedy="Press Make Cards Again"
        )
    return record


def _uv_layer(edited: bmesh.types.BMesh, obj: bpy.types.Object) -> bmesh.types.BMLayerItem:
    layers = edited.loops.layers.uv
    layer = layers.get(TILE_LAYER)
    if layer is None:
        raise HairloomError(
            f"it has no UV map called {TILE_LAYER}",
            place=obj.name,
            remedy="Undo, or give the UV map this name",
        )
    return layer


def _selected_pieces(edited: bmesh.types.BMesh) -> list[list[bmesh.types.BMVert]]:
    """The vertices of each connected piece with a selected vertex; loose vertices are left out."""
    seen: set[bmesh.types.BMVert] = set()
    pieces = []
    for start in edited.verts:
        if not start.select or start in seen or not start.link_faces:
            continue
        piece, waiting = [], [start]
        seen.add(start)
        while waiting:
            vertex = waiting.pop()
            piece.append(vertex)
            for face in vertex.link_faces:
                for other in face.verts:
                    if other not in seen:
                        seen.add(other)
                        waiting.append(other)
        pieces.append(piece)
    return pieces


def _append_card(edited: bmesh.types.BMesh, card: CardMesh, matrix: Floats) -> None:
    """Add a card, world space, to a mesh in the space of an object, as one of the artist's own."""
    places = transform_points(card.positions, np.linalg.inv(matrix))
    normal = card.normal @ matrix[:3, :3]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1.0e-12)
    is_mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
    points, corners = edited.verts.layers, edited.loops.layers.uv
    normals = points.float_vector.get("custom_normal")
    along = points.float.get("along")
    occlusion = points.float.get("occlusion")
    tiles, shade = corners.get(TILE_LAYER), corners.get(OCCLUSION_LAYER)
    made = edited.faces.layers.int.get(MADE_ATTRIBUTE)
    vertices = []
    for index, place in enumerate(places.tolist()):
        vertex = edited.verts.new(place)
        if normals is not None:
            vertex[normals] = normal[index].tolist()
        if along is not None:
            vertex[along] = float(card.along[index])
        if occlusion is not None:
            vertex[occlusion] = 1.0
        vertices.append(vertex)
    for triangle in card.triangles.tolist():
        numbers = triangle[::-1] if is_mirrored else triangle
        face = edited.faces.new([vertices[number] for number in numbers])
        if made is not None:
            face[made] = 0
        for loop, number in zip(face.loops, numbers, strict=True):
            if tiles is not None:
                loop[tiles].uv = card.uv[number].tolist()
            if shade is not None:
                loop[shade].uv = 1.0, float(card.along[number])
