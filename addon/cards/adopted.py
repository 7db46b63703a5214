"""An artist's own cards, any mesh of triangles with UVs, as a `CardMesh`.

A card is a connected piece. Its triangles, positions and UVs stay as they are; this module finds
the direction from root to tip, the tangents, and which side faces away from the head. Vertices on a
seam of the UVs are split, which does not divide a card.

Limitation: in a card whose UVs are cut across, one island for the roots and another for the tips,
`along` runs from 0 to 1 in each island.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints, sums_by
from ..errors import HairloomError
from ..strands import Surface
from ..strands.closest_point import closest_point
from ..strands.triangles import areas_of
from ..strands.vectors import unit_or
from .card_mesh import CardMesh
from .sort import connected_components
from .uv_directions import UvAxes, UvDirection, coordinate_gradients, island_bounds, uv_axes

#: A triangle whose area is below this fraction of its squared longest edge counts as without area.
_MIN_AREA = 1.0e-7
#: Minimum mean cosine of a card that faces away from the head, or towards it.
_MIN_FACING = 0.25
#: The normal where no other is known, and the length below which vectors have no direction.
_DOWN, _MIN_LENGTH = (0.0, 0.0, -1.0), 1.0e-20


@dataclass(frozen=True)
class AdoptedCards:
    """mesh: its triangles are those of the source, in their order; occlusion is 1.
    source_vertex: (vertex_count,) which vertex of the source each vertex is.
    corner_vertex: (triangle_count, 3) the vertex at each corner of the source's triangles, some of
        which are flipped in the mesh.
    notes: doubts for the artist, a sentence each.
    """

    mesh: CardMesh
    source_vertex: Ints
    corner_vertex: Ints
    notes: tuple[str, ...]


def adopt_cards(
    source: Surface,
    head: Surface | None,
    *,
    group: Ints | None = None,
    direction: UvDirection = "auto",
    place: str,
) -> AdoptedCards:
    """Read cards out of a mesh.

    Args:
        source: with UVs, in the space of the head.
        head: the surface that hair grows on; without one the higher ends of cards are their roots.
        group: (vertex_count,) of the source's vertices; a card belongs to the group of most of its
            corners.
        direction: in which the UVs of all cards run from root to tip; "auto" finds it.
        place: names the mesh in messages.

    Raises:
        HairloomError: the mesh has no triangles, or no UVs.
    """
    _check_source(source, place)
    assert source.corner_uv is not None
    vertex, uv, triangles = _split_at_seams(source.triangles, source.corner_uv)
    card = connected_components(source.triangles)
    island = connected_components(triangles)
    outwards = _outwards_from(source.positions, head)
    corners = source.corners.astype(np.float64)
    distance = outwards.distance[source.triangles]
    axes = uv_axes(corners, uv[triangles], distance, island, direction)
    normal, is_flipped, is_mixed = _facing_normals(source, card, outwards.direction)
    along = _along(uv[triangles], island, axes)
    mesh = CardMesh(
        positions=source.positions[vertex],
        triangles=np.where(is_flipped[:, None], triangles[:, ::-1], triangles),
        uv=uv,
        along=_at_vertices(triangles, along, len(vertex)),
        normal=normal[vertex],
        tangent=_tangents(corners, uv, triangles, along, island, axes),
        occlusion=np.ones(len(vertex), np.float32),
        card=card,
        group=_groups(source.triangles, card, group),
    )
    notes = (
        *_direction_notes(axes, island, card, head if direction == "auto" else source),
        *_shape_notes(source, card, is_mixed),
        *_uv_notes(uv),
    )
    return AdoptedCards(mesh, vertex, triangles, notes)


def _check_source(source: Surface, place: str) -> None:
    if not len(source.triangles):
        raise HairloomError("this mesh has no faces", place=place, remedy="Choose a mesh of cards")
    if source.corner_uv is None:
        raise HairloomError(
            "these cards have no UVs, so the direction of the hair on them is unknown",
            place=place,
            remedy="Unwrap them (Edit Mode, UV > Unwrap) and lay them on the hair texture",
        )


def _split_at_seams(triangles: Ints, corner_uv: Floats) -> tuple[Ints, Floats, Ints]:
    """(source vertex, uv, triangles) with a vertex for each pair of a source vertex and a UV."""
    flat = np.ascontiguousarray(corner_uv.reshape(-1, 2), np.float32) + np.float32(0.0)
    key = np.column_stack([triangles.ravel(), flat.view(np.int32)])
    _, first, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return triangles.ravel()[first], flat[first], index.reshape(-1, 3).astype(np.int32)


@dataclass(frozen=True)
class _Outwards:
    """direction: (vertex_count, 3) out of the head; distance: (vertex_count,) from it [m]."""

    direction: Floats
    distance: Floats


def _outwards_from(positions: Floats, head: Surface | None) -> _Outwards:
    """Without a head, directions are from the middle of all vertices, and distances are 0."""
    if head is None or not len(head.triangles):
        middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
        outward = positions - middle
        return _Outwards(unit_or(outward, _DOWN, _MIN_LENGTH), np.zeros(len(positions)))
    nearest = closest_point(positions, head)
    return _Outwards(head.triangle_normals()[nearest.triangle], nearest.distance)


def _facing_normals(source: Surface, card: Ints, away: Floats) -> tuple[Floats, Bools, Bools]:
    """Normals away from the head, and which triangles must be flipped for that.

    A card is flipped as a whole; if its own triangles disagree, each is flipped by itself.

    Returns:
        ((vertex_count, 3) unit normals, (triangle_count,) is flipped, (card_count,) is mixed).
    """
    a, b, c = np.moveaxis(source.corners.astype(np.float64), 1, 0)
    outward = np.cross(b - a, c - a)
    ahead = np.einsum("ti,tci->t", outward, away[source.triangles]) / 3.0
    is_mixed = _has_mixed_winding(source.triangles, card)
    is_inward = _is_facing_inwards((a + b + c) / 3.0, outward, ahead, card)
    is_flipped = np.where(is_mixed[card], ahead < 0.0, is_inward[card])
    outward[is_flipped] *= -1.0
    total = np.zeros((len(source.positions), 3))
    for corner in range(3):
        np.add.at(total, source.triangles[:, corner], outward)
    return unit_or(total, unit_or(away, _DOWN, _MIN_LENGTH), _MIN_LENGTH), is_flipped, is_mixed


def _is_facing_inwards(centers: Floats, outward: Floats, ahead: Floats, card: Ints) -> Bools:
    """Cards that face the head, (card_count,). Of cards that face all sides, such as closed tubes,
    those that face their own middle: their volume is negative.
    """
    area = np.linalg.norm(outward, axis=1)
    total = np.maximum(np.bincount(card, area), 1e-30)
    middle = sums_by(card, area[:, None] * centers)
    from_middle = centers - (middle / total[:, None])[card]
    volume = np.bincount(card, np.einsum("ti,ti->t", outward, from_middle))
    fraction = np.bincount(card, ahead) / total
    is_inward: Bools = np.where(np.abs(fraction) > _MIN_FACING, fraction, volume) < 0.0
    return is_inward


def _has_mixed_winding(triangles: Ints, card: Ints) -> Bools:
    """Cards in which two triangles run along an edge in the same direction, (card_count,)."""
    edges = np.concatenate([triangles[:, (0, 1)], triangles[:, (1, 2)], triangles[:, (2, 0)]])
    key = edges[:, 0].astype(np.int64) * (int(triangles.max()) + 1) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    twice = order[1:][np.diff(key[order]) == 0]
    found = np.zeros(int(card.max()) + 1, bool)
    found[np.tile(card, 3)[twice]] = True
    return found


def _along(uv: Floats, island: Ints, axes: UvAxes) -> Floats:
    """0 at the roots to 1 at the tips of each island, (triangle_count, 3)."""
    axis = axes.axis[island]
    coordinate = np.take_along_axis(uv, axis[:, None, None], axis=2)[:, :, 0]
    low, high = (bound[island, None] for bound in island_bounds(coordinate, island))
    size = high - low
    fraction = np.divide(coordinate - low, size, out=np.zeros_like(coordinate), where=size > 0.0)
    return np.where(axes.is_reversed[island, None], 1.0 - fraction, fraction)


def _tangents(
    corners: Floats, uv: Floats, triangles: Ints, along: Floats, island: Ints, axes: UvAxes
) -> Floats:
    """Unit vectors along the cards, (vertex_count, 3), by the UVs; by the positions of root and tip
    where UVs give no direction."""
    gradients = coordinate_gradients(corners, uv[triangles])
    chosen = np.take_along_axis(gradients, axes.axis[island][:, None, None], axis=1)[:, 0]
    chosen *= np.where(axes.is_reversed[island], -1.0, 1.0)[:, None]
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(edge_1, edge_2), axis=1)
    chosen = unit_or(chosen, _DOWN, _MIN_LENGTH) * area[:, None]
    total = np.zeros((len(uv), 3))
    for corner in range(3):
        np.add.at(total, triangles[:, corner], chosen)
    from_root = np.einsum("tc,tci->ti", along - along.mean(axis=1, keepdims=True), corners)
    whole = sums_by(island, from_root)
    fallback = np.zeros_like(total)
    fallback[triangles] = whole[island][:, None]
    return unit_or(total, unit_or(fallback, _DOWN, _MIN_LENGTH), _MIN_LENGTH)


def _at_vertices(triangles: Ints, values: Floats, vertex_count: int) -> Floats:
    found = np.zeros(vertex_count)
    found[triangles] = values
    return found


def _groups(triangles: Ints, card: Ints, group: Ints | None) -> Ints:
    """The group that most corners of each card are in, (card_count,) int32."""
    count = int(card.max()) + 1
    if group is None:
        return np.zeros(count, np.int32)
    names, number = np.unique(group, return_inverse=True)
    key = np.repeat(card.astype(np.int64), 3) * len(names) + number[triangles].ravel()
    votes = np.bincount(key, minlength=count * len(names)).reshape(count, len(names))
    return names[votes.argmax(axis=1)].astype(np.int32)


def _direction_notes(axes: UvAxes, island: Ints, card: Ints, head: Surface | None) -> Iterator[str]:
    if head is None:
        yield "There is no head, so the higher end of the cards was taken for their roots"
    count = int(card.max()) + 1
    deviating, undecided = (
        len(np.unique(card[flags[island]])) for flags in (axes.is_deviating, axes.is_undecided)
    )
    if deviating:
        yield (
            f"The UVs of {deviating} of {_cards(count)} run in another direction than those of the "
            "others"
        )
    if undecided:
        yield (
            f"The UVs of {undecided} of {_cards(count)} do not tell which end is the root. Choose "
            "it under Root to Tip"
        )


def _shape_notes(source: Surface, card: Ints, is_mixed: Bools) -> Iterator[str]:
    count = int(card.max()) + 1
    if count == 1:
        yield "All faces are connected, so there is nothing to sort: cards must be separate pieces"
    if is_mixed.any():
        yield f"The faces of {_cards(int(is_mixed.sum()))} do not all point to the same side"
    a, b, c = np.moveaxis(source.corners.astype(np.float64), 1, 0)
    area = 2.0 * areas_of(source.corners.astype(np.float64))
    longest = np.max([((x - y) ** 2).sum(axis=1) for x, y in ((a, b), (b, c), (c, a))], axis=0)
    is_flat = np.bincount(card, area > _MIN_AREA * longest, minlength=count) == 0
    if is_flat.any():
        yield f"No face of {_cards(int(is_flat.sum()))} has any area"
    shared = _count_with_crowded_edges(source.triangles, card)
    if shared:
        yield f"In {_cards(shared)} more than two faces share an edge"
    doubled = _count_duplicates(source, card)
    if doubled:
        yield f"{_cards(doubled)} {'lies' if doubled == 1 else 'lie'} exactly on another"


def _count_with_crowded_edges(triangles: Ints, card: Ints) -> int:
    """Number of cards with an edge of more than two triangles."""
    edges = np.concatenate([triangles[:, (0, 1)], triangles[:, (1, 2)], triangles[:, (2, 0)]])
    _, number, uses = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return len(np.unique(np.tile(card, 3)[uses[number.ravel()] > 2]))


def _count_duplicates(source: Surface, card: Ints) -> int:
    """Number of cards whose corners all lie where those of an earlier card lie."""
    seen, found = set(), 0
    order = np.argsort(card, kind="stable")
    starts = np.searchsorted(card[order], np.arange(1, int(card.max()) + 1))
    for triangles in np.split(source.triangles[order], starts):
        places = np.unique(source.positions[triangles.ravel()], axis=0).tobytes()
        found += places in seen
        seen.add(places)
    return found


def _uv_notes(uv: Floats) -> Iterator[str]:
    outside = int(((uv < -1e-4) | (uv > 1.0 + 1e-4)).any(axis=1).sum())
    if outside:
        yield f"{outside} of {len(uv)} vertices have UVs beyond the edge of the texture"


def _cards(count: int) -> str:
    return "1 card" if count == 1 else f"{count} cards"
