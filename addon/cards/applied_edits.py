"""Cards that an artist has edited, deleted or added, among cards that are made again.

The rule: a new card belongs to the nearest card on record. If that one was edited, the edited card
replaces the new one; if it was deleted, the place stays free. So edits hold too when there are more
cards now, fewer, or others. Nothing that the artist has made is left out: an edited card for which
no new one is found stays beside the others.

Kept cards move with the skin under their roots, if that has moved since.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints, means_by
from ..strands import Surface
from ..strands.affine import transform_points
from ..strands.closest_point import closest_point
from ..strands.frames import tangents, volume_normals
from ..strands.vectors import unit, unit_or
from .adopted import adopt_cards
from .atlas_grid import AtlasGrid
from .card_mesh import VERTEX_FIELDS, CardMesh, join_meshes
from .edits import (
    MAX_MATCH_DISTANCE,
    NO_PRINT,
    CardEdits,
    CardRecord,
    EditCounts,
    card_gaps,
    card_places,
    median_gap,
)
from .settings import CardSettings
from .sort import sorted_by_key
from .strip import MAX_ROOT_SLOPE, CardFrames, Strips, UncutCards

#: Motion of the skin below this fraction of a card's length is ignored.
_MIN_MOTION = 1.0e-3
#: Cards that begin farther from the head than this part of their length are reported.
_MAX_ROOT_GAP = 0.25
#: A vector shorter than this has no direction.
_MIN_LENGTH = 1.0e-12
_CHUNK = 512


@dataclass(frozen=True, eq=False)
class AppliedEdits:
    """New cards with the kept ones among them.

    cards: all, the artist's own ones last; replaced and deleted ones are marked absent.
    kept_mesh: of the kept cards alone, world space, as the artist left them.
    model_card: (card_count,) the new card whose strands each card represents.
    record: of the new cards, with the card that represents each.
    notes: for the artist.
    """

    cards: UncutCards
    kept_mesh: CardMesh
    model_card: Ints
    record: CardRecord
    counts: EditCounts
    notes: tuple[str, ...]

    @property
    def kept_numbers(self) -> Ints:
        """The numbers of the kept cards, ascending, (n,)."""
        return np.unique(self.kept_mesh.card)

    @property
    def kept_triangles(self) -> Ints:
        """(card_count,) triangles of each kept card; 0 of the others."""
        return np.bincount(self.kept_mesh.card, minlength=len(self.cards))

    def with_kept_mesh(self, mesh: CardMesh) -> CardMesh:
        """The finest level with the kept cards as they are."""
        is_made = ~np.isin(mesh.card, self.kept_numbers)
        rest = replace(mesh, triangles=mesh.triangles[is_made], card=mesh.card[is_made])
        both = (
            join_meshes([rest.without_loose_vertices(), self.kept_mesh])
            if len(rest.triangles)
            else self._only_kept(mesh)
        )
        return sorted_by_key(both, np.arange(len(self.cards)))

    def _only_kept(self, mesh: CardMesh) -> CardMesh:
        own: dict[str, Any] = {name: getattr(self.kept_mesh, name) for name in VERTEX_FIELDS}
        return replace(mesh, triangles=self.kept_mesh.triangles, card=self.kept_mesh.card, **own)


def apply_edits(
    edits: CardEdits,
    cards: UncutCards,
    settings: CardSettings,
    head: Surface | None,
    is_baked: bool,
) -> AppliedEdits:
    """Place an artist's cards among new ones.

    Args:
        cards: new cards without edits, world space.
        is_baked: whether the tiles show the groom's own strands, so that their contents may have
            changed.
    """
    record = CardRecord.of(cards.strips, cards.tile, cards.atlas, head)
    before = edits.record.moved(edits.matrix)
    moves = _skin_moves(before, head)
    places = _carried_vertices(edits, before, moves)
    before = replace(before, places=_transform_each(before.places, moves).astype(np.float32))
    ancestor = _matching_cards(record.places, before.places)
    matched = np.flatnonzero(ancestor >= 0)
    old_card, is_free = np.full(len(record), -1, np.int32), np.zeros(len(record), bool)
    old_card[matched] = before.represented_by[ancestor[matched]]
    # a place is free if the card that represented it is gone
    is_free[matched] = ~edits.is_present[old_card[matched]]
    number = np.full(len(edits.card_of_piece), -1, np.int32)
    represented_by = np.arange(len(record), dtype=np.int32)
    for index in np.flatnonzero(edits.card_of_piece >= 0):
        mine = np.flatnonzero(old_card == edits.card_of_piece[index])
        if len(mine):
            old_places = before.places[edits.card_of_piece[index]][None]
            number[index] = mine[card_gaps(old_places, record.places[mine])[0].argmin()]
            represented_by[mine] = number[index]
    is_lost = number < 0
    number[is_lost] = len(record) + np.arange(np.count_nonzero(is_lost))
    return _assembled(
        edits,
        cards,
        settings,
        head,
        replace(record, represented_by=represented_by),
        _PlacedPieces(
            places, number, is_free, _current_tiles(edits, record, ancestor, number, is_baked)
        ),
        _counts(edits, old_card, is_lost),
    )


@dataclass(frozen=True)
class _PlacedPieces:
    """The kept pieces. positions: of their vertices, world space. number: (piece_count,) of each
    among the current cards. is_free: (new card count,). tile: (piece_count,)."""

    positions: Floats
    number: Ints
    is_free: Bools
    tile: Ints


def _assembled(
    edits: CardEdits,
    cards: UncutCards,
    settings: CardSettings,
    head: Surface | None,
    record: CardRecord,
    placed: _PlacedPieces,
    counts: EditCounts,
) -> AppliedEdits:
    count, piece_count = len(record), len(placed.number)
    is_new = placed.number >= count
    total = count + int(np.count_nonzero(is_new))
    mesh, strips, slope_of_piece = _adopted(edits, cards, settings, head, placed)
    model = np.resize(np.arange(count, dtype=np.int32), total)
    if is_new.any():
        near = card_gaps(card_places(strips.select(np.flatnonzero(is_new))), record.places).argmin(
            axis=1
        )
        model[placed.number[is_new]] = near
    all_strips = _with_replaced(cards.strips, placed.number, strips, total)
    is_replaced = record.represented_by != np.arange(count)
    is_absent = np.zeros(total, bool)
    is_absent[:count] = placed.is_free | is_replaced
    strand_count = cards.strand_count[model]
    covered = np.bincount(record.represented_by, cards.strand_count, count)
    strand_count[:count] = np.where(is_replaced, strand_count[:count], covered)
    tile = cards.tile[model]
    tile[placed.number] = placed.tile
    slope = np.zeros(len(cards), np.float32) if cards.root_slope is None else cards.root_slope
    slope = slope[model]
    slope[placed.number] = slope_of_piece
    record.prints[is_absent[:count]] = NO_PRINT
    record.prints[placed.number[~is_new]] = NO_PRINT
    both = replace(
        cards,
        strips=all_strips,
        strand_count=strand_count.astype(np.int32),
        group=cards.group[model],
        layer=cards.layer[model],
        tile=tile,
        is_absent=is_absent,
        root_slope=slope,
    )
    mesh = replace(mesh, group=both.group, layer=both.layer, tile=both.tile, atlas=both.atlas)
    notes = _notes(edits, counts, strips, head, piece_count)
    if is_absent.all() and not piece_count:
        notes = (*notes, "all its cards were deleted; Discard Edits makes them again")
    return AppliedEdits(both, mesh, model, record, counts, notes)


def _matching_cards(places: Floats, before: Floats) -> Ints:
    """The card on record that each new one belongs to, (n,); -1 for none."""
    found = np.full(len(places), -1, np.int32)
    if not len(before):
        return found
    reach = MAX_MATCH_DISTANCE * median_gap(before)
    for start in range(0, len(places), _CHUNK):
        gap = card_gaps(places[start : start + _CHUNK], before)
        nearest = gap.argmin(axis=1)
        is_near = gap[np.arange(len(gap)), nearest] <= reach
        found[start : start + _CHUNK] = np.where(is_near, nearest, -1)
    return found


def _counts(edits: CardEdits, old_card: Ints, is_lost: Bools) -> EditCounts:
    is_found = np.isin(np.arange(len(edits.record)), old_card)
    return EditCounts(
        edited=edits.edited_count,
        deleted=int(np.count_nonzero(edits.is_deleted & is_found)),
        added=edits.added_count,
        lost_edits=int(np.count_nonzero(is_lost & (edits.card_of_piece >= 0))),
        lost_deletions=int(np.count_nonzero(edits.is_deleted & ~is_found)),
    )


def _notes(
    edits: CardEdits, counts: EditCounts, strips: Strips, head: Surface | None, piece_count: int
) -> tuple[str, ...]:
    notes = list(edits.notes)
    if counts.lost_edits:
        notes.append(
            f"no new card matches {counts.lost_edits:,} edited ones, which stay as your own cards"
        )
    if counts.lost_deletions:
        notes.append(
            f"no new card matches {counts.lost_deletions:,} deleted ones, which are forgotten"
        )
    if head is not None and len(head.triangles) and piece_count:
        center = strips.frames.center
        length = np.linalg.norm(np.diff(center, axis=1), axis=2).sum(axis=1)
        away = closest_point(center[:, 0].astype(np.float64), head).distance
        far = int(np.count_nonzero(away > _MAX_ROOT_GAP * length))
        if far:
            notes.append(f"{far:,} of the kept cards begin away from the head")
    return tuple(notes)


def _skin_moves(before: CardRecord, head: Surface | None) -> Floats:
    """Motion of the skin under each card on record, (n, 4, 4), world space; the identity where it
    has hardly moved, or if it is another skin.

    Args:
        before: the record, in world space at its object's current place.
    """
    moves = np.tile(np.eye(4), (len(before), 1, 1))
    if head is None or len(head.triangles) != before.triangle_count:
        return moves
    found = _frames(head.corners[before.triangle]) @ np.linalg.inv(_frames(before.corners))
    gap = np.linalg.norm(_transform_each(before.places, found) - before.places, axis=2).max(axis=1)
    length = np.linalg.norm(np.diff(before.places[:, :4], axis=1), axis=2).sum(axis=1)
    has_moved = gap > _MIN_MOTION * length
    moves[has_moved] = found[has_moved]
    return moves


def _transform_each(points: Floats, moves: Floats) -> Floats:
    """Points (n, m, 3) moved by matrices (n, 4, 4)."""
    return np.einsum("nij,nmj->nmi", moves[:, :3, :3], points) + moves[:, None, :3, 3]


def _carried_vertices(edits: CardEdits, before: CardRecord, moves: Floats) -> Floats:
    """The vertices of the kept pieces, (n, 3) float32 [m, world], carried by the skin under the
    roots of their cards; own cards by the skin under the nearest card."""
    places = transform_points(edits.surface.positions, edits.matrix)
    count = len(edits.card_of_piece)
    if not count:
        return places
    owner = np.zeros(len(places), np.int64)
    owner[edits.surface.triangles] = edits.piece_of_triangle[:, None]
    middle = means_by(owner, places, count)
    centers = before.places[:, :4].mean(axis=1)
    number = np.array(edits.card_of_piece)
    for index in np.flatnonzero(number < 0):
        number[index] = np.linalg.norm(centers - middle[index], axis=1).argmin()
    is_still = np.array_equal(moves[number], np.tile(np.eye(4), (count, 1, 1)))
    if is_still:
        return places
    return _transform_each(places[:, None], moves[number][owner])[:, 0].astype(np.float32)


def _frames(corners: Floats) -> Floats:
    """(n, 4, 4) from a frame on each triangle, scaled by its size, to the space of its corners."""
    a, b, c = np.moveaxis(corners.astype(np.float64), 1, 0)
    normal = np.cross(b - a, c - a)
    size = np.sqrt(np.maximum(np.linalg.norm(normal, axis=1), 1.0e-18))
    x, z = unit_or(b - a, (1.0, 0.0, 0.0), _MIN_LENGTH), unit_or(normal, (0.0, 0.0, 1.0), 1.0e-30)
    frames = np.zeros((len(corners), 4, 4))
    frames[:, :3, :3] = np.stack([x, np.cross(z, x), z], axis=2) * size[:, None, None]
    frames[:, :3, 3] = corners.mean(axis=1)
    frames[:, 3, 3] = 1.0
    return frames


def _current_tiles(
    edits: CardEdits, record: CardRecord, ancestor: Ints, number: Ints, is_baked: bool
) -> Ints:
    """The tile of each piece in the current atlas, (piece_count,).

    A card whose tile the artist has not changed gets that of the card that it replaces. For a
    changed tile, it is the tile of most new cards whose cards on record had that tile.
    """
    old = edits.record
    old_tile = piece_tiles(edits, old.grid)
    is_same_grid = record.grid == old.grid
    chosen = old_tile % max(record.grid.tile_count, 1)
    if is_baked or not is_same_grid:
        matched = np.flatnonzero(ancestor >= 0)
        for index, tile in enumerate(old_tile):
            now = record.tile[matched][old.tile[ancestor[matched]] == tile]
            if len(now):
                chosen[index] = np.bincount(now).argmax()
    is_unchanged = (edits.card_of_piece >= 0) & (number < len(record))
    is_unchanged[is_unchanged] = (
        old.tile[edits.card_of_piece[is_unchanged]] == old_tile[is_unchanged]
    )
    chosen[is_unchanged] = record.tile[number[is_unchanged]]
    return chosen.astype(np.int32)


def piece_tiles(edits: CardEdits, grid: AtlasGrid) -> Ints:
    """The tile that holds the middle of each piece's UVs, (piece_count,)."""
    assert edits.surface.corner_uv is not None
    flat = edits.surface.corner_uv.reshape(-1, 2)
    return grid.tile_at(
        means_by(np.repeat(edits.piece_of_triangle, 3), flat, len(edits.card_of_piece))
    )


def _adopted(
    edits: CardEdits,
    cards: UncutCards,
    settings: CardSettings,
    head: Surface | None,
    placed: _PlacedPieces,
) -> tuple[CardMesh, Strips, Floats]:
    """The kept cards as a mesh with their numbers, and as strips in the order of the pieces, with
    the slopes of their root edges."""
    row_count = cards.strips.width.shape[1]
    if not len(edits.card_of_piece):
        none = np.zeros(0, np.int32)
        empty = np.zeros((0, 3), np.float32)
        flat = np.zeros((0, 2), np.float32)
        mesh = CardMesh(
            positions=empty,
            triangles=np.zeros((0, 3), np.int32),
            uv=flat,
            normal=empty,
            tangent=empty,
            occlusion=np.zeros(0, np.float32),
            card=none,
            along=np.zeros(0, np.float32),
        )
        return mesh, cards.strips.select(none), np.zeros(0, np.float32)
    uv = _uvs_on_tiles(edits, cards.atlas, placed.tile)
    triangles: Ints = edits.surface.triangles
    if np.linalg.det(edits.matrix[:3, :3]) < 0.0:  # a mirrored object turns its faces around
        triangles, uv = triangles[:, ::-1], uv[:, ::-1]
    surface = Surface(placed.positions, triangles, uv)
    found = adopt_cards(surface, head, direction="up", place="the edited cards")
    adopted = _with_original_facing(found.mesh, found.corner_vertex)
    # pieces share no vertices, so each is a card of its own
    of_card = np.zeros(len(edits.card_of_piece), np.int32)
    of_card[adopted.card] = edits.piece_of_triangle
    piece = of_card[adopted.card]
    owner = np.zeros(len(adopted.positions), np.int64)
    owner[adopted.triangles] = piece[:, None]
    across = _across(adopted.uv, cards.atlas, placed.tile[owner])
    unknown = np.zeros(0, np.int32)
    mesh = replace(adopted, card=placed.number[piece], group=unknown, layer=unknown, tile=unknown)
    if cards.center is not None:
        mesh = _with_normals_of_volume(mesh, cards.center, across, settings)
    shape = len(edits.card_of_piece), row_count
    return mesh, *_strips(adopted, owner, across, shape, settings)


def _with_original_facing(mesh: CardMesh, triangles: Ints) -> CardMesh:
    """With all faces oriented as the artist has left them, and normals on that side."""
    a, b, c = np.moveaxis(mesh.positions[triangles].astype(np.float64), 1, 0)
    outward, total = np.cross(b - a, c - a), np.zeros((len(mesh.positions), 3))
    for corner in range(3):
        np.add.at(total, triangles[:, corner], outward)
    return replace(mesh, triangles=triangles, normal=unit_or(total, mesh.normal, 1.0e-20))


def _uvs_on_tiles(edits: CardEdits, grid: AtlasGrid, tile: Ints) -> Floats:
    """UVs at the same places within their tiles of the current atlas, (triangle_count, 3, 2)."""
    uv, old = edits.surface.corner_uv, edits.record.grid
    assert uv is not None
    old_tile = piece_tiles(edits, old)
    is_same = (old_tile == tile) & (grid == old)
    one, two = (_rectangles(each, which) for each, which in ((old, old_tile), (grid, tile)))
    start, size = (each[edits.piece_of_triangle][:, None] for each in one)
    new_start, new_size = (each[edits.piece_of_triangle][:, None] for each in two)
    there = new_start + (uv - start) / size * new_size
    return np.where(is_same[edits.piece_of_triangle][:, None, None], uv, there).astype(np.float32)


def _rectangles(grid: AtlasGrid, tile: Ints) -> tuple[Floats, Floats]:
    """Origins and sizes of tiles in the texture, each (n, 2)."""
    low = grid.uv(tile, np.zeros(1), np.zeros(1)).astype(np.float64)
    high = grid.uv(tile, np.ones(1), np.ones(1)).astype(np.float64)
    return low, high - low


def _across(uv: Floats, grid: AtlasGrid, tile: Ints) -> Floats:
    """Places of vertices across their tiles, (vertex_count,) from 0 to 1."""
    start, size = _rectangles(grid, tile)
    across: Floats = np.clip((uv[:, 0] - start[:, 0]) / size[:, 0], 0.0, 1.0)
    return across


def _with_normals_of_volume(
    mesh: CardMesh, center: Floats, across: Floats, settings: CardSettings
) -> CardMesh:
    """With normals like those of made cards, see strip.py."""
    volume = volume_normals(mesh.positions, mesh.tangent, center)
    lean = settings.roundness * (2.0 * across - 1.0)
    volume = unit(volume + np.cross(mesh.tangent, volume) * lean[:, None])
    is_front = np.einsum("vi,vi->v", volume, mesh.normal) > 0.0
    return replace(mesh, normal=np.where(is_front[:, None], volume, mesh.normal))


def _strips(
    mesh: CardMesh, owner: Ints, across: Floats, shape: tuple[int, int], settings: CardSettings
) -> tuple[Strips, Floats]:
    """Each piece as a strip, for coarser levels: its edges cut at even steps along it; and the
    slope of its root edge, (piece_count,).

    Args:
        owner: (vertex_count,) the piece of each vertex.
        shape: pieces, and rows of a strip.
    """
    count, row_count = shape
    left, right = _edges(mesh, owner, across, count, row_count)
    across_card = right - left
    middle = (left + right) / 2.0
    tangent = tangents(middle)
    total = np.zeros((count, 3))
    np.add.at(total, owner, mesh.normal.astype(np.float64))
    facing = np.broadcast_to(unit_or(total, (0.0, 0.0, 1.0), _MIN_LENGTH)[:, None], middle.shape)
    side = across_card - tangent * np.einsum("cri,cri->cr", across_card, tangent)[..., None]
    side = unit_or(
        side, unit_or(np.cross(tangent, facing), (1.0, 0.0, 0.0), _MIN_LENGTH), _MIN_LENGTH
    )
    width = np.einsum("cri,cri->cr", across_card, side)
    ahead = np.einsum("ci,ci->c", across_card[:, 0], tangent[:, 0])
    slope = np.clip(ahead / np.maximum(width[:, 0], _MIN_LENGTH), -MAX_ROOT_SLOPE, MAX_ROOT_SLOPE)
    normal = np.cross(side, tangent)
    # a flipped card has its left edge on the right
    is_inward = np.einsum("cri,cri->c", normal, facing) < 0.0
    side[is_inward] *= -1.0
    normal[is_inward] *= -1.0
    slope[is_inward] *= -1.0
    behind = settings.bend * (1.0 if settings.column_count > 1 else 1.0 / 3.0)
    center = middle + normal * (behind * width)[..., None]
    parts = (each.astype(np.float32) for each in (center, tangent, normal, side))
    return Strips(CardFrames(*parts), width.astype(np.float32)), slope.astype(np.float32)


def _edges(
    mesh: CardMesh, owner: Ints, across: Floats, count: int, row_count: int
) -> tuple[Floats, Floats]:
    """The left and right ends of each piece at each row, two of (piece_count, row_count, 3) [m]."""
    corners = mesh.triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2)
    one, two = np.unique(np.sort(corners, axis=1), axis=0).T
    piece, low, high = owner[one], mesh.along[one], mesh.along[two]
    span = (high - low).astype(np.float64)
    is_level = np.abs(span) < 1.0e-6
    found = np.full((2, count, row_count, 3), np.nan)
    for row, along in enumerate(np.linspace(0.0, 1.0, row_count)):
        fraction = np.where(is_level, 0.0, (along - low) / np.where(is_level, 1.0, span))
        reaches = np.where(is_level, np.abs(low - along) < 1.0e-4, np.abs(fraction - 0.5) <= 0.5001)
        cut = np.flatnonzero(reaches)
        if not len(cut):
            continue
        part = np.clip(fraction[cut], 0.0, 1.0)[:, None]
        place = mesh.positions[one[cut]] * (1.0 - part) + mesh.positions[two[cut]] * part
        beside = across[one[cut]] * (1.0 - part[:, 0]) + across[two[cut]] * part[:, 0]
        order = np.lexsort((beside, piece[cut]))
        pieces, first = np.unique(piece[cut][order], return_index=True)
        last = np.append(first[1:], len(order)) - 1
        found[0, pieces, row], found[1, pieces, row] = place[order[first]], place[order[last]]
    return _filled_rows(found[0]), _filled_rows(found[1])


def _filled_rows(rows: Floats) -> Floats:
    """Rows where no edge was found, filled with the place of the nearest row that has one."""
    number = np.arange(rows.shape[1])
    for piece in np.flatnonzero(np.isnan(rows[..., 0]).any(axis=1)):
        there = np.flatnonzero(~np.isnan(rows[piece, :, 0]))
        nearest = there[np.abs(number[:, None] - there).argmin(axis=1)]
        rows[piece] = rows[piece, nearest]
    return rows


def _with_replaced(strips: Strips, numbers: Ints, changed: Strips, total: int) -> Strips:
    """All strips, with `changed` ones at these numbers, which may extend the list."""
    names = ("center", "tangent", "normal", "side")
    parts = []
    for name in names:
        values = getattr(strips.frames, name)
        values_of_all = np.zeros((total, *values.shape[1:]), np.float32)
        values_of_all[: len(values)] = values
        values_of_all[numbers] = getattr(changed.frames, name)
        parts.append(values_of_all)
    width = np.zeros((total, strips.width.shape[1]), np.float32)
    width[: len(strips)] = strips.width
    width[numbers] = changed.width
    return Strips(CardFrames(*parts), width)
