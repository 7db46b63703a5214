"""Adopted cards: an artist's own mesh is read as cards, sorted, and given ambient occlusion.

This writes the order of the mesh's own faces, which every exporter keeps, ambient occlusion, and
the place between root and tip. The latter two have the names that our own cards use: as attributes,
and as a UV map, (occlusion, along), which every format can store. Faces are not triangulated, and
keep their corners, materials, UV maps and other attributes.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...arrays import Floats, Ints, means_by
from ...cards.adopted import AdoptedCards, adopt_cards
from ...cards.occlusion import CardOccluder, occlusion_steps
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...cards.sort import SortBy, order_steps
from ...cards.steps import map_progress
from ...cards.uv_directions import UvDirection
from ...errors import HairloomError
from ...strands import Surface
from ..base.attributes import set_attribute
from ..base.mesh_arrays import (
    corner_vertices,
    triangle_corners,
    triangle_polygons,
    vertex_positions,
)
from ..base.objects import matrix_of
from ..base.vertex_weights import weights_on
from ..scene.surfaces import (
    CARD_ATTRIBUTES,
    OCCLUSION_LAYER,
    evaluated_mesh,
    read_corner_uv,
    read_surface,
)
from .material import read_alpha
from .mesh import OCCLUSION_IS_OURS, reorder_faces, set_uv_map
from .occluders import read_occluders

#: What can be sorted: identifier, label, description.
(ORDERS,) = (p.choices for p in CardSettings.parameters() if p.name == "order_by")
#: Weight from which a vertex counts as a member of a vertex group.
_MEMBER = 0.5
#: The group of cards that dangle.
_DANGLING = 1


@dataclass(frozen=True)
class SortOptions:
    """The artist's choices.

    head: the mesh that the hair grows on, which occludes it too, or None.
    by: see cards.sort.
    direction: see cards.uv_directions.
    dangling: a vertex group, whose cards are drawn after all others; "" for none.
    occlusion: None leaves ambient occlusion as it is.
    alpha: a picture with the alpha of the cards; None: that of their material.
    """

    head: bpy.types.Object | None = None
    by: SortBy = "pieces"
    direction: UvDirection = "auto"
    dangling: str = ""
    occlusion: CardOcclusionSettings | None = field(default_factory=CardOcclusionSettings)
    alpha: bpy.types.Image | None = None


@dataclass(frozen=True)
class CardSource:
    """A mesh read as cards, world space.

    polygon: (triangle_count,) the face of the mesh that each triangle is part of.
    corner: (triangle_count, 3) the face corner of the mesh at each corner of a triangle.
    notes: doubts about the mesh, for the artist.
    """

    cards: AdoptedCards
    head: Surface | None
    polygon: Ints
    corner: Ints
    notes: tuple[str, ...]


@dataclass(frozen=True)
class SortedCards:
    """The result of sorting. moved: the number of faces whose place in the order has changed."""

    card_count: int
    face_count: int
    moved: int
    notes: tuple[str, ...]


def sort_steps(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, options: SortOptions
) -> Generator[float, None, SortedCards]:
    """Put the faces of a mesh into the order in which its cards are to be drawn.

    Each step yields the fraction that is done; the mesh changes in the last one.

    Raises:
        HairloomError: not a mesh, in Edit Mode, no faces, no UVs, or no such vertex group.
    """
    if options.occlusion is not None:
        _check_names(obj)
    source = read_cards(obj, depsgraph, options)
    mesh = source.cards.mesh
    notes = list(source.notes)
    apart = [_DANGLING] if options.dangling else None
    part_count = 1.0 if options.occlusion is None else 2.0
    needs_alpha = options.by != "distance" or options.occlusion is not None
    alpha, problems = read_alpha(obj, options.alpha) if needs_alpha else (None, [])
    ordering = order_steps(mesh, source.head, options.by, apart, alpha=alpha)
    orders = yield from map_progress(ordering, lambda fraction: fraction / part_count)
    order = orders.front
    if options.occlusion is not None:
        bodies = [] if source.head is None else [source.head]
        others, doubts = read_occluders(options.occlusion, obj, depsgraph).cards()
        problems += doubts
        occluders = [CardOccluder(mesh, alpha), *others]
        shading = occlusion_steps(mesh, occluders, bodies, options.occlusion)
        openness = yield from map_progress(shading, lambda fraction: (1.0 + fraction) / 2.0)
        corner = np.zeros(len(obj.data.loops), np.int32)
        corner[source.corner] = source.cards.corner_vertex
        problems += _write_occlusion(
            obj.data, source.cards.source_vertex, corner, openness, mesh.along
        )
    notes += problems
    moved = reorder_faces(obj.data, _face_order(source.polygon[order]))
    return SortedCards(mesh.card_count, len(obj.data.polygons), moved, tuple(notes))


def read_cards(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, options: SortOptions
) -> CardSource:
    """A mesh as cards, deformed by its modifiers, with the direction of the hair on them.

    Raises:
        HairloomError: not a mesh, in Edit Mode, no faces, no UVs, or no such vertex group.
    """
    _check(obj)
    head = options.head
    surface = None
    if head is not None:
        surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    source, polygon, corner, notes = _read_faces(obj, depsgraph)
    group = _dangling_groups(obj, options.dangling)
    cards = adopt_cards(source, surface, group=group, direction=options.direction, place=obj.name)
    return CardSource(
        cards, surface, polygon, corner, (*notes, *_shared_mesh_notes(obj.data), *cards.notes)
    )


def _check(obj: bpy.types.Object) -> None:
    if obj.type != "MESH":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, not a mesh of cards",
            place=obj.name,
            remedy="Select the mesh of your hair cards",
        )
    if obj.mode == "EDIT":
        raise HairloomError(
            "it is in Edit Mode", place=obj.name, remedy="Leave Edit Mode and sort again"
        )


def _check_names(obj: bpy.types.Object) -> None:
    """Refuse a mesh that has data of the artist's under the names that occlusion is written to."""
    mesh = obj.data
    if mesh.get(OCCLUSION_IS_OURS):
        return
    taken = [f"UV map {OCCLUSION_LAYER}"] if mesh.uv_layers.get(OCCLUSION_LAYER) else []
    taken += [f"attribute {name}" for name in CARD_ATTRIBUTES if name in mesh.attributes]
    if taken:
        raise HairloomError(
            f"it already has the {taken[0]}, which ambient occlusion would replace",
            place=mesh.name,
            remedy="Rename or delete it, or turn Ambient Occlusion off",
        )


def _read_faces(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Surface, Ints, Ints, list[str]]:
    """Triangles as Blender draws them, in world space; the face and face corners of each; notes."""
    matrix = matrix_of(obj, depsgraph)
    with evaluated_mesh(obj, depsgraph, obj.name) as bent:
        if np.array_equal(_corners(bent), _corners(obj.data)):
            return (*_triangles(bent, matrix), [])
    note = "Modifiers that add or remove faces were ignored, because they run after the sorting"
    return (*_triangles(obj.data, matrix), [note])


def _corners(mesh: bpy.types.Mesh) -> Ints:
    """The vertices of all face corners, followed by the first corner of each face."""
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return np.append(corner_vertices(mesh), starts)


def loop_triangles(mesh: bpy.types.Mesh) -> tuple[Floats, Ints, Ints, Ints]:
    """A mesh's triangles.

    Returns:
        vertex positions (n, 3) float32 in the mesh's own space, and the vertices (m, 3), corners
        (m, 3) and polygon (m,) of each triangle, int32.
    """
    corners = triangle_corners(mesh)
    return vertex_positions(mesh), corner_vertices(mesh)[corners], corners, triangle_polygons(mesh)


def _triangles(mesh: bpy.types.Mesh, matrix: Floats) -> tuple[Surface, Ints, Ints]:
    positions, triangles, corner, polygon = loop_triangles(mesh)
    corner_uv = read_corner_uv(mesh, corner) if len(triangles) else None
    surface = Surface(positions, triangles, corner_uv).transformed(matrix)
    if np.linalg.det(matrix[:3, :3]) < 0.0:  # `transformed` has flipped mirrored triangles
        corner = corner[:, ::-1]
    return surface, polygon, corner


def _dangling_groups(obj: bpy.types.Object, name: str) -> Ints | None:
    """(vertex_count,) _DANGLING for members of a vertex group, 0 for all others."""
    if not name:
        return None
    if name not in obj.vertex_groups:
        raise HairloomError(
            f"it has no vertex group '{name}'",
            place=obj.name,
            remedy="Choose one of its vertex groups, or none",
        )
    weights, _ = weights_on(obj, obj.data, name)
    is_member = weights >= _MEMBER
    return np.where(is_member, _DANGLING, 0)


def _shared_mesh_notes(mesh: bpy.types.Mesh) -> list[str]:
    if mesh.users < 2:
        return []
    return [f"{mesh.users} objects share the mesh '{mesh.name}' and have been sorted together"]


def _write_occlusion(
    mesh: bpy.types.Mesh, vertex: Ints, corner: Ints, openness: Floats, along: Floats
) -> list[str]:
    """Write occlusion and place along the hair into attributes and into a UV map. In attributes, a
    vertex on a UV seam has the mean of its copies.

    Args:
        vertex: (n,) the vertex of the mesh that each value belongs to.
        corner: (loop_count,) the index of the value of each face corner.
        openness, along: (n,).

    Returns:
        a note if the mesh has no room for the UV map.
    """
    mesh[OCCLUSION_IS_OURS] = True
    for name, values in zip(CARD_ATTRIBUTES, (openness, along), strict=True):
        set_attribute(mesh, name, "POINT", _at_source_vertices(values, vertex, len(mesh.vertices)))
    if not set_uv_map(mesh, OCCLUSION_LAYER, np.stack([openness, along], axis=1)[corner]):
        return [
            "It already has the maximum number of UV maps, so occlusion is stored as an attribute "
            "only"
        ]
    mesh.update_tag()
    return []


def _at_source_vertices(values: Floats, vertex: Ints, count: int) -> Floats:
    """Means over the copies of each of `count` vertices; 1 for a vertex without faces."""
    means = means_by(vertex, values, count)
    means[np.bincount(vertex, minlength=count) == 0] = 1.0
    return means.astype(np.float32)


def _face_order(polygon: Ints) -> Ints:
    """Faces in the order of their first triangles, (face_count,)."""
    faces, first = np.unique(polygon, return_index=True)
    order: Ints = faces[np.argsort(first, kind="stable")]
    return order
