"""The artist's changes of cards since they were made.

A record holds what was made: where each card lay, which tile it showed, and a print of its
vertices. Each face stores the number of its card. So there are four kinds of cards:

    unedited   the print of its piece is that on record: it is made again
    edited     it has a number, and its print is another one: it is kept
    deleted    it is on record, and no piece has its number: its place stays free
    own        a piece without a number, or a copy of another one: it is kept

A piece is a connected part of the mesh with one number. The record is in the space of the hair
object.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints, means_by
from ..strands import Surface
from ..strands.affine import transform_points
from ..strands.closest_point import search_of
from .atlas_grid import AtlasGrid
from .sort import connected_components
from .strip import Strips

#: Places along a card whose middles the record stores, beside the edge halfway, by which crossed
#: cards differ.
STATIONS = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
#: The print of a card that is not in the mesh as it was made, which no piece has; and of a new
#: card, until it is in the mesh.
NO_PRINT, UNPRINTED = 0, -1
#: Maximum distance of a card from the card on record that it belongs to, in usual gaps between
#: cards.
MAX_MATCH_DISTANCE = 2.0
#: The gap of a card alone, as a fraction of its length.
_SINGLE_CARD_GAP = 0.25
#: Constants of a hash that mixes bits (Steele, Lea and Flood 2014, "Fast splittable pseudorandom
#: number generators", the variant of Stafford).
_HASH_CONSTANTS = (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)


@dataclass(frozen=True, eq=False)
class CardRecord:
    """The record of the cards that were made, in a space that depends on its creator.

    places: (card_count, 5, 3) float32 [m] of each: its middle at `STATIONS`, and its edge halfway.
    tile: (card_count,) int32 tile of each. grid: of the atlas.
    prints: (card_count,) int32 prints, see `piece_prints`, or NO_PRINT, or UNPRINTED.
    represented_by: (card_count,) int32 the card that represents each: itself, an edited one, or the
        one that it was joined with.
    triangle: (card_count,) int32 of the head under the root; corners: (card_count, 3, 3) of it [m].
    triangle_count: of the head; 0 without one.
    """

    places: Floats
    tile: Ints
    grid: AtlasGrid
    prints: Ints
    represented_by: Ints
    triangle: Ints
    corners: Floats
    triangle_count: int

    def __len__(self) -> int:
        return len(self.places)

    @property
    def median_width(self) -> float:
        """Median width of cards halfway [m]."""
        half = self.places[:, 4] - (self.places[:, 1] + self.places[:, 2]) / 2.0
        return 2.0 * float(np.median(np.linalg.norm(half, axis=1))) if len(self) else 0.0

    @classmethod
    def of(cls, strips: Strips, tile: Ints, grid: AtlasGrid, head: Surface | None) -> CardRecord:
        """The record of new cards with these tiles, (card_count,), before they are in a mesh."""
        places, count = card_places(strips), len(strips)
        triangle: Ints = np.zeros(count, np.int32)
        corners = np.zeros((count, 3, 3), np.float32)
        triangle_count = 0 if head is None else len(head.triangles)
        if head is not None and triangle_count and count:
            triangle = search_of(head).closest(places[:, 0].astype(np.float64)).triangle
            corners = head.corners[triangle]
        return cls(
            places,
            np.asarray(tile, np.int32),
            grid,
            np.full(count, UNPRINTED, np.int32),
            np.arange(count, dtype=np.int32),
            triangle,
            corners,
            triangle_count,
        )

    def with_joined_cards(self, owner: Ints) -> CardRecord:
        """The record after some cards were joined with others in the mesh.

        Args:
            owner: (card_count or more,) the card in the mesh that represents each.
        """
        is_gone = owner[: len(self)] != np.arange(len(self))
        prints = np.where(is_gone, NO_PRINT, self.prints).astype(np.int32)
        return replace(self, prints=prints, represented_by=owner[self.represented_by])

    def moved(self, matrix: Floats) -> CardRecord:
        """The same in another space, by an affine (4, 4) matrix."""
        places, corners = (
            transform_points(each.reshape(-1, 3), matrix).reshape(each.shape).astype(np.float32)
            for each in (self.places, self.corners)
        )
        return replace(self, places=places, corners=corners)


@dataclass(frozen=True)
class EditCounts:
    """edited, deleted, added: cards that are kept as the artist left them.
    lost_edits, lost_deletions: those for which no new card was found: edited cards stay beside the
        others, deleted ones have nothing left to delete.
    """

    edited: int = 0
    deleted: int = 0
    added: int = 0
    lost_edits: int = 0
    lost_deletions: int = 0

    def __bool__(self) -> bool:
        return bool(self.edited or self.deleted or self.added)

    @property
    def summary(self) -> str:
        """Such as "3 edited, 1 deleted and 2 own cards"."""
        kinds = (self.edited, "edited"), (self.deleted, "deleted"), (self.added, "own")
        parts = [f"{count:,} {name}" for count, name in kinds if count]
        first = f"{', '.join(parts[:-1])} and " if parts[1:] else ""
        is_one = self.edited + self.deleted + self.added == 1
        return f"{first}{parts[-1]} {'card' if is_one else 'cards'}"

    @property
    def report_line(self) -> str:
        """Such as "3 edited and 2 own cards kept"; empty if there are none."""
        return f"{self.summary} kept" if self else ""


@dataclass(frozen=True, eq=False)
class CardEdits:
    """The changes that are kept when cards are made again, in the space of the record.

    record: of what was made.
    surface: the pieces that are kept, with UVs; no vertex is in two of them.
    piece_of_triangle: (triangle_count,) int32 which of them each triangle belongs to, from 0
        without gaps.
    card_of_piece: (piece_count,) int32 the card that each is; -1 for the artist's own.
    is_present: (card_count,) which cards on record have a piece, edited or not.
    matrix: (4, 4) to world space.
    notes: doubts, for the artist.
    """

    record: CardRecord
    surface: Surface
    piece_of_triangle: Ints
    card_of_piece: Ints
    is_present: Bools
    matrix: Floats
    notes: tuple[str, ...] = ()

    @property
    def edited_count(self) -> int:
        return int(np.count_nonzero(self.card_of_piece >= 0))

    @property
    def added_count(self) -> int:
        return int(np.count_nonzero(self.card_of_piece < 0))

    @property
    def is_deleted(self) -> Bools:
        """(card_count,) cards on record that have no piece and that no other card represents."""
        stands_alone = self.record.represented_by == np.arange(len(self.record))
        deleted: Bools = stands_alone & ~self.is_present
        return deleted

    @property
    def deleted_count(self) -> int:
        return int(np.count_nonzero(self.is_deleted))

    @property
    def counts(self) -> EditCounts:
        return EditCounts(self.edited_count, self.deleted_count, self.added_count)

    def __bool__(self) -> bool:
        return bool(self.counts)

    def has_same_edits(self, other: CardEdits | None) -> bool:
        """Whether the same is kept by both."""
        if other is None or len(self.record) != len(other.record):
            return False
        pairs = (
            (self.surface.positions, other.surface.positions),
            (self.surface.triangles, other.surface.triangles),
            (self.surface.corner_uv, other.surface.corner_uv),
            (self.card_of_piece, other.card_of_piece),
            (self.is_present, other.is_present),
            (self.record.places, other.record.places),
        )
        return all(np.array_equal(one, two) for one, two in pairs)  # type: ignore[arg-type]


def find_edits(
    surface: Surface, card_numbers: Ints | None, record: CardRecord, matrix: Floats
) -> CardEdits:
    """Find what the artist has changed of these cards.

    Args:
        surface: all triangles, with UVs, in the space of the record.
        card_numbers: (triangle_count,) the number of each triangle's card, -1 for the artist's own;
            None if the mesh no longer has the numbers.
        matrix: (4, 4) from that space to the world.
    """
    corner, piece = _pieces(surface.triangles, card_numbers)
    count = int(piece.max(initial=-1)) + 1
    prints = piece_prints(surface, piece)
    middle = _piece_centers(surface, piece, count)
    notes: tuple[str, ...] = ()
    if card_numbers is None:
        number = _recognised_cards(prints, middle, record)
        if count:
            notes = (
                "the numbers of its cards are missing, so cards were recognised by their places",
            )
    else:
        number = np.full(count, -1, np.int32)
        number[piece] = card_numbers
        number[number >= len(record)] = -1
    number, is_unedited = _without_copies(number, prints, middle, record)
    is_there = np.zeros(len(record), bool)
    is_there[number[number >= 0]] = True
    kept_pieces = np.flatnonzero(~is_unedited)
    new_piece = np.full(count, -1, np.int32)
    new_piece[kept_pieces] = np.arange(len(kept_pieces))
    chosen = new_piece[piece] >= 0
    assert surface.corner_uv is not None
    return CardEdits(
        record,
        _separate_pieces(surface, corner, chosen),
        new_piece[piece][chosen],
        number[kept_pieces],
        is_there,
        matrix,
        notes,
    )


def piece_prints(surface: Surface, piece: Ints) -> Ints:
    """A hash of each piece's vertices and UVs, (piece_count,).

    It does not depend on the order of vertices and faces, nor on how faces are cut into triangles.
    """
    assert surface.corner_uv is not None
    flat = np.column_stack(
        [surface.positions[surface.triangles.ravel()], surface.corner_uv.reshape(-1, 2)]
    )
    bits = np.ascontiguousarray(flat + np.float32(0.0), np.float32).view(np.uint32)
    key: Ints = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        key = _hashed((key + np.uint64(_HASH_CONSTANTS[0])) ^ column.astype(np.uint64))
    # a vertex counts once, however many triangles it has
    owner = np.repeat(piece, 3)
    _, first = np.unique(_hashed(key ^ owner.astype(np.uint64)), return_index=True)
    total = np.zeros(int(piece.max(initial=-1)) + 1, np.uint64)
    np.add.at(total, owner[first], key[first])
    found = (_hashed(total) & np.uint64(0x7FFFFFFF)).astype(np.int32)
    return np.where(found == NO_PRINT, NO_PRINT + 1, found).astype(np.int32)


def card_places(strips: Strips) -> Floats:
    """Where cards lie, see `CardRecord.places`, (card_count, 5, 3) float32 [m]."""
    last = strips.width.shape[1] - 1
    rows = [round(station * last) for station in STATIONS]
    half = last // 2
    frames = strips.frames
    edge = frames.center[:, half] + frames.side[:, half] * (0.5 * strips.width[:, half, None])
    return np.concatenate([frames.center[:, rows], edge[:, None]], axis=1).astype(np.float32)


def median_gap(places: Floats) -> float:
    """Median distance of a card from the nearest one, as `card_gaps` measures it [m]."""
    count = len(places)
    if count < 2:
        line = np.linalg.norm(np.diff(places[:, :4], axis=1), axis=2).sum(axis=1)
        return float(_SINGLE_CARD_GAP * line.max(initial=0.0))
    chosen = np.linspace(0, count - 1, min(count, 256)).astype(np.int64)
    gap = card_gaps(places[chosen], places)
    gap[np.arange(len(chosen)), chosen] = np.inf
    return float(np.median(gap.min(axis=1)))


def card_gaps(some: Floats, others: Floats) -> Floats:
    """Distances between cards, (n, m) [m]: root mean square over their places; roots count twice,
    as in `cluster_strands`."""
    weight = np.sqrt([2.0, 1.0, 1.0, 1.0, 1.0])[:, None] / np.sqrt(6.0)
    one, two = ((each.astype(np.float64) * weight).reshape(-1, 15) for each in (some, others))
    squared = (one**2).sum(axis=1)[:, None] + (two**2).sum(axis=1) - 2.0 * one @ two.T
    found: Floats = np.sqrt(np.maximum(squared, 0.0))
    return found


def _hashed(key: Ints) -> Ints:
    """A hash of 64 bits, each of which depends on all."""
    key = (key ^ (key >> np.uint64(30))) * np.uint64(_HASH_CONSTANTS[1])
    key = (key ^ (key >> np.uint64(27))) * np.uint64(_HASH_CONSTANTS[2])
    mixed: Ints = key ^ (key >> np.uint64(31))
    return mixed


def _pieces(triangles: Ints, card_numbers: Ints | None) -> tuple[Ints, Ints]:
    """(corners by vertex and card, (n, 3); the piece of each triangle, (n,)).

    Vertices that an artist has welded do not connect cards that were made separately.
    """
    if card_numbers is None:
        return triangles, connected_components(triangles)
    key = triangles.ravel().astype(np.int64) * (int(card_numbers.max(initial=-1)) + 2)
    key += np.repeat(card_numbers, 3).astype(np.int64) + 1
    _, corner = np.unique(key, return_inverse=True)
    corner = corner.reshape(-1, 3).astype(np.int32)
    return corner, connected_components(corner)


def _piece_centers(surface: Surface, piece: Ints, count: int) -> Floats:
    """The middle of the corners of each piece, (piece_count, 3) [m]."""
    at = surface.corners.reshape(-1, 3).astype(np.float64)
    return means_by(np.repeat(piece, 3), at, count)


def _distances_from_record(middle: Floats, record: CardRecord, number: Ints) -> Floats:
    """Distance of each piece from where its card was made [m]."""
    away: Floats = np.linalg.norm(middle - record.places[number, :4].mean(axis=1), axis=-1)
    return away


def _recognised_cards(prints: Ints, middle: Floats, record: CardRecord) -> Ints:
    """The card that each piece is, by its print, else by its place; -1 for none."""
    number = np.full(len(prints), -1, np.int32)
    if not len(record):
        return number
    order = np.argsort(record.prints, kind="stable")
    at = np.minimum(np.searchsorted(record.prints[order], prints), len(record) - 1)
    is_same = record.prints[order][at] == prints
    number[is_same] = order[at][is_same]
    free = np.setdiff1d(np.arange(len(record)), number)
    reach = MAX_MATCH_DISTANCE * median_gap(record.places)
    for piece in np.flatnonzero(number < 0):
        if not len(free):
            break
        away = np.linalg.norm(record.places[free, :4].mean(axis=1) - middle[piece], axis=1)
        if away.min() <= reach:
            number[piece] = free[away.argmin()]
            free = np.delete(free, away.argmin())
    return number


def _without_copies(
    number: Ints, prints: Ints, middle: Floats, record: CardRecord
) -> tuple[Ints, Bools]:
    """Numbers without duplicates, and which pieces are as they were made.

    Of several pieces with one number, the unedited one is the card, else the one nearest to where
    it was made. The others are copies and get -1.
    """
    numbered = np.flatnonzero(number >= 0)
    is_made = np.zeros(len(number), bool)
    is_made[numbered] = record.prints[number[numbered]] == prints[numbered]
    away = np.zeros(len(number))
    away[numbered] = _distances_from_record(middle[numbered], record, number[numbered])
    order = numbered[np.lexsort((away[numbered], ~is_made[numbered], number[numbered]))]
    first = np.unique(number[order], return_index=True)[1]
    cards = order[first]
    one = np.full(len(number), -1, np.int32)
    one[cards] = number[cards]
    return one, is_made & (one >= 0)


def _separate_pieces(surface: Surface, corner: Ints, chosen: Bools) -> Surface:
    """The chosen triangles, with vertices that no two pieces share.

    Args:
        corner: (triangle_count, 3) see `_pieces`.
    """
    assert surface.corner_uv is not None
    used, first, place = np.unique(corner[chosen], return_index=True, return_inverse=True)
    positions = surface.positions[surface.triangles[chosen].ravel()[first]]
    triangles = place.reshape(-1, 3).astype(np.int32)
    return Surface(positions.reshape(len(used), 3), triangles, surface.corner_uv[chosen])
