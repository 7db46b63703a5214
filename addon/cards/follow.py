"""Cards that ride on guides: bound at rest, carried as whole strips.

A card has a spine: the middles of its rows, which are its vertices at one place along it. It rides
as strands do, so it keeps its length, unless the curls that the card shows are stretched. Each row
turns with the spine there, by the least rotations from root to tip (Bishop 1975). So strips bend
without shear, rows keep their width, and only the turn of the root twists a card. Cards are led out
of colliders, see `contacts`.

Vectors are stored as planes here, (3, ...), which is several times as fast.

Limitation: guides that wind around each other do not twist the card between them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..arrays import Floats, Ints, piece_starts
from ..refine.ride import Riders, ride, turns_along
from ..strands import StrandSet
from ..strands.affine import transform_points
from ..strands.vectors import dot_rows, unit_rows
from .card_mesh import CardMesh
from .contacts import CardClearance, CardContacts
from .sort import card_of_vertex

#: Vertices this close to the first one along a card are in its first row.
_ROOT_ROW_TOLERANCE = 1.0e-4
#: Vectors shorter than this have no direction [m, or of unit vectors].
_MIN_LENGTH = 1.0e-12
#: Roots that have turned by less than this count as unturned.
_MIN_TURN = 1.0e-5


@dataclass(frozen=True, eq=False)
class CardBinding:
    """Data of cards and guides at rest with which the cards are placed later.

    mesh: at rest.
    guide, weight: (n, k) for each of n cards: indices of its guides, and weights of sum 1.
    rest_guides: (guide_count, cv_count, 3) [m] at rest.
    root_offset: (3, n) from the weighted mean of the guides' roots to the card's root [m].
    middle_vertices: (2, row_count) the vertices between which the middle of each row lies.
    spine: (row_count, 3) float32 [m] at rest, that of card c is spine[offsets[c]:offsets[c + 1]].
    riders: all spines on the guides.
    headings: (3, longest, n) unit directions of spines at their rows, the last one repeated.
    heading_index: (row_count,) index of the row in the flattened headings.
    row_of_vertex: (vertex_count,) the row of each vertex. arms: (3, vertex_count) from the row's
        middle [m].
    clearance_cache: cache of one entry: where the last motion with colliders began, and its
        clearance.
    """

    mesh: CardMesh
    guide: Ints
    weight: Floats
    rest_guides: Floats
    root_offset: Floats
    middle_vertices: Ints
    spine: Floats
    offsets: Ints
    riders: Riders
    headings: Floats
    heading_index: Ints
    row_of_vertex: Ints
    arms: Floats
    clearance_cache: list[tuple[Any, CardClearance]] = field(default_factory=list)

    @property
    def card_of_row(self) -> Ints:
        """(row_count,) the card of each row."""
        cards: Ints = self.heading_index % max(len(self.guide), 1)
        return cards

    def row_middles(self, positions: Floats) -> Floats:
        """The middles of all rows (row_count, 3) with vertices at these positions."""
        middles: Floats = positions[self.middle_vertices].mean(axis=0)
        return middles


def card_lines(mesh: CardMesh) -> tuple[Ints, Floats]:
    """The numbers of cards that have triangles, (n,), and the middles of these cards at the root, a
    third, two thirds and the tip, (n, 4, 3) [m].
    """
    owner, used = card_of_vertex(mesh), np.unique(mesh.card)
    count = int(used.max(initial=-1)) + 1
    first = np.full(count, np.inf, np.float32)
    np.minimum.at(first, owner, mesh.along)
    lines = np.empty((len(used), 4, 3), np.float32)
    for third in range(4):
        fraction = np.maximum(1.0 - np.abs(3.0 * mesh.along - third), 1.0e-6)
        if not third:
            fraction = mesh.along <= first[owner] + _ROOT_ROW_TOLERANCE
        whole = np.bincount(owner, weights=fraction, minlength=count)[used]
        for axis in range(3):
            placed = fraction * mesh.positions[:, axis]
            lines[:, third, axis] = (
                np.bincount(owner, weights=placed, minlength=count)[used] / whole
            )
    return used.astype(np.int32), lines


def bind_cards(
    mesh: CardMesh, guides: Floats, guide: Ints, weight: Floats, curl_slack: Floats | None = None
) -> CardBinding:
    """Bind cards to the guides that they ride on.

    Args:
        mesh: at rest, world space.
        guides: (guide_count, cv_count, 3) [m] at rest, CVs evenly along each.
        guide, weight: (n, k) for the cards of `card_lines`, in its order.
        curl_slack: (guide_count, cv_count - 1), see `center_lines.curl_slack`; None: no curls.
    """
    used = np.unique(mesh.card)
    number = np.zeros(int(used.max(initial=0)) + 1, np.int64)
    number[used] = np.arange(len(used))
    owner = number[card_of_vertex(mesh)]
    keys = np.stack([owner, mesh.along.view(np.int32)], axis=1)
    used_vertices = np.unique(mesh.triangles)
    unique_rows, unique_row = np.unique(keys[used_vertices], axis=0, return_inverse=True)
    rows, used_row = _with_doubled_rows(unique_rows, unique_row.reshape(-1))
    row_card, middle = (
        rows[:, 0],
        used_vertices[_middle_vertices(mesh.uv[used_vertices, 0], used_row, len(rows))],
    )
    row: Ints = np.zeros(len(owner), np.int64)  # of vertices without triangles any
    row[used_vertices] = used_row
    weights = _Weights(np.asarray(guide), np.asarray(weight, np.float32))
    spine = mesh.positions[middle].mean(axis=0)
    offsets: Ints = np.searchsorted(row_card, np.arange(len(used) + 1))
    longest = int(np.diff(offsets).max(initial=1))
    place = (np.arange(len(row_card)) - offsets[row_card]) * max(len(used), 1) + row_card
    grid = _padded_rows(offsets, longest)
    return CardBinding(
        mesh,
        weights.guide,
        weights.weight,
        np.asarray(guides, np.float32),
        spine[offsets[:-1]].T - _weighted_means(guides[:, :1], weights)[:, 0],
        middle,
        spine,
        offsets,
        _riders(spine, offsets, guides, weights, curl_slack),
        _headings(spine, offsets)[:, grid],
        place,
        row,
        np.ascontiguousarray((mesh.positions - (spine[row] if len(spine) else 0.0)).T),
    )


def follow_guides(
    binding: CardBinding, guides: Floats, turn: Floats, contacts: CardContacts | None = None
) -> CardMesh:
    """The cards at the guides' current positions; arrays that do not change are those of
    `binding.mesh`.

    Args:
        guides: (guide_count, cv_count, 3) [m] now.
        turn: (guide_count, 3, 3), rotation of each guide's root with the body since rest.
        contacts: the colliders that cards are led out of; None: none.
    """
    turns = np.asarray(turn, np.float32)
    if not len(binding.guide) or _is_at_rest(binding, guides, turns):
        return binding.mesh
    root_turns = turns[binding.guide[:, 0]]
    carried = _carried_spine(binding, guides, root_turns)
    spine = _ride_spines(binding, carried, np.asarray(guides, np.float32), turns)
    if contacts is not None:
        contacts.lead_spines(spine, carried, binding.offsets)
    frames = _frames(binding, spine, root_turns)
    # the scale of the root's turn
    size = np.cbrt(np.abs(np.linalg.det(root_turns)))[binding.card_of_row]
    vertex_frames = np.take(frames, binding.row_of_vertex, axis=2, mode="clip")
    positions = _rotated(vertex_frames, binding.arms)
    middles = spine[binding.row_of_vertex]
    positions += middles
    vertex_frames /= np.maximum(size, np.float32(_MIN_LENGTH))[binding.row_of_vertex]
    normal, tangent = (
        _rotated(vertex_frames, each.T) for each in (binding.mesh.normal, binding.mesh.tangent)
    )
    if contacts is not None:
        arms = _carried_arms(binding, root_turns)
        away = np.linalg.norm(spine - carried, axis=1)[binding.row_of_vertex]
        contacts.lead_arms(positions, (normal, tangent), middles, arms, away)
    return replace(binding.mesh, positions=positions, normal=normal, tangent=tangent)


def carried_cards(binding: CardBinding, guides: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """Spines (row_count, 3) and vertices (vertex_count, 3) as carried by their roots alone [m];
    arguments as of `follow_guides`."""
    root_turns = np.asarray(turn, np.float32)[binding.guide[:, 0]]
    spine = _carried_spine(binding, guides, root_turns)
    return spine, spine[binding.row_of_vertex] + _carried_arms(binding, root_turns)


def transformed_mesh(mesh: CardMesh, matrix: Floats) -> CardMesh:
    """Cards moved by an affine (4, 4) matrix; the same object for the identity."""
    if np.array_equal(matrix, np.eye(4)):
        return mesh
    turn = np.asarray(matrix, np.float64)[:3, :3]
    is_mirrored = np.linalg.det(turn) < 0.0
    linear = np.eye(4)
    linear[:3, :3] = turn
    normal, tangent = (transform_points(each, linear).T for each in (mesh.normal, mesh.tangent))
    return replace(
        mesh,
        positions=transform_points(mesh.positions, matrix),
        normal=unit_rows(normal).T,
        tangent=unit_rows(tangent).T,
        triangles=mesh.triangles[:, ::-1] if is_mirrored else mesh.triangles,
    )


@dataclass(frozen=True)
class _Weights:
    """See `refine.ride.Weights`."""

    guide: Ints
    weight: Floats


def _with_doubled_rows(rows: Ints, row: Ints) -> tuple[Ints, Ints]:
    """The rows (row_count, 2) and the row of each vertex, with the row of single-row cards doubled:
    a spine is a strand, of two points or more."""
    single = np.flatnonzero(np.bincount(rows[:, 0]) == 1)
    insert_at = np.searchsorted(rows[:, 0], single)
    shift = np.searchsorted(insert_at, np.arange(len(rows)))
    return np.insert(rows, insert_at + 1, rows[insert_at], axis=0), row + shift[row]


def _middle_vertices(across: Floats, row: Ints, count: int) -> Ints:
    """Each row's middle vertex across the card, twice, or the two beside its middle, (2, n). A row
    without vertices has those of the row before.

    Args:
        across: (m,) place of each vertex across its card. row: (m,) its row.
    """
    order, sizes = np.lexsort((across, row)), np.bincount(row, minlength=count)
    begins = piece_starts(sizes)
    begins, sizes = (np.where(sizes == 0, np.roll(of, 1), of) for of in (begins, sizes))
    return np.stack([order[begins + (sizes - 1) // 2], order[begins + sizes // 2]])


def _padded_rows(offsets: Ints, longest: int) -> Ints:
    """The rows of each card, the last one repeated, (longest, n)."""
    rows: Ints = np.minimum(offsets[:-1] + np.arange(longest)[:, None], offsets[1:] - 1)
    return rows


def _riders(
    spine: Floats, offsets: Ints, guides: Floats, weights: _Weights, curl_slack: Floats | None
) -> Riders:
    count = len(offsets) - 1
    strands = StrandSet(spine, offsets, np.zeros(len(spine)), np.zeros(count, int))
    return replace(Riders.of(strands, guides, weights, curl_slack), are_center_lines=True)


def _carried_spine(binding: CardBinding, guides: Floats, root_turns: Floats) -> Floats:
    """Spines as carried by their roots, (row_count, 3) float32.

    Args:
        root_turns: (n, 3, 3) rotation of each card's root.
    """
    weights = _Weights(binding.guide, binding.weight)
    root = _weighted_means(guides[:, :1], weights)[:, 0].T + np.einsum(
        "nij,jn->ni", root_turns, binding.root_offset
    )
    card = binding.card_of_row
    bone = binding.spine - binding.spine[binding.offsets[:-1]][card]
    planes = np.ascontiguousarray(root_turns.transpose(1, 2, 0))
    carried = _rotated(np.take(planes, card, axis=2), bone.T)
    carried += root[card]
    return carried


def _carried_arms(binding: CardBinding, root_turns: Floats) -> Floats:
    """Vectors from rows' middles to vertices as roots turn them, (vertex_count, 3)."""
    owner = binding.card_of_row[binding.row_of_vertex]
    return _rotated(np.ascontiguousarray(root_turns.transpose(1, 2, 0))[:, :, owner], binding.arms)


def _ride_spines(binding: CardBinding, carried: Floats, guides: Floats, turns: Floats) -> Floats:
    """The spines as they ride, (row_count, 3)."""
    rest = binding.rest_guides
    by_root = guides[:, :1] + np.einsum("gij,gcj->gci", turns, rest - rest[:, :1])
    return ride(carried, binding.riders, by_root, guides)


def _frames(binding: CardBinding, spine: Floats, root_turns: Floats) -> Floats:
    """Rotation of each row since rest, (3, 3, row_count): first that of its root, then that of its
    spine, (row_count, 3)."""
    planes = np.ascontiguousarray(root_turns.transpose(1, 2, 0))
    before = np.stack([_row_products(row, binding.headings) for row in planes])
    length = np.sqrt(dot_rows(before, before))
    before /= np.maximum(length, np.float32(_MIN_LENGTH))
    grid = _padded_rows(binding.offsets, before.shape[1])
    turn = turns_along(before, _headings(spine, binding.offsets)[:, grid])
    x, y, z, w = turn.reshape(4, -1)[:, binding.heading_index]
    turned = np.empty((3, 3, len(spine)), np.float32)
    for axis, (a, b, c) in enumerate(((x, y, z), (y, z, x), (z, x, y))):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        turned[axis, axis] = 1.0 - 2.0 * (b * b + c * c)
        turned[axis, one] = 2.0 * (a * b - w * c)
        turned[axis, two] = 2.0 * (a * c + w * b)
    of_rows = np.take(planes, binding.card_of_row, axis=2)
    for row in turned:
        row[:] = [_row_products(row, column) for column in of_rows.transpose(1, 0, 2)]
    return turned


def _rotated(frame: Floats, local: Floats) -> Floats:
    """Vectors (3, n) turned by matrices (3, 3, n), (n, 3)."""
    vectors = np.empty((local.shape[1], 3), np.float32)
    for axis in range(3):
        vectors[:, axis] = _row_products(frame[axis], local)
    return vectors


def _row_products(row: Floats, vectors: Floats) -> Floats:
    """One row of matrices (3, n) times vectors (3, ..., n): (..., n). Faster than einsum."""
    value: Floats = row[0] * vectors[0]
    value += row[1] * vectors[1]
    value += row[2] * vectors[2]
    return value


def _weighted_means(guides: Floats, weights: _Weights) -> Floats:
    """Weighted means of guides, (3, cv_count, n) float32."""
    grid = np.ascontiguousarray(np.asarray(guides, np.float32).transpose(2, 1, 0))
    mixed = np.zeros((*grid.shape[:2], len(weights.guide)), np.float32)
    for column in range(weights.guide.shape[1]):
        mixed += grid[:, :, weights.guide[:, column]] * weights.weight[:, column]
    return mixed


def _headings(spine: Floats, offsets: Ints) -> Floats:
    """Unit directions from root to tip at the rows, (3, row_count), as in strands.frames; 0 where
    there is none."""
    step = np.zeros((3, len(spine) + 1), np.float32)
    step[:, 1:-1] = np.diff(spine, axis=0).T
    step[:, offsets] = 0.0  # from one card to the next
    headings = step[:, 1:] + step[:, :-1]
    length = np.sqrt(dot_rows(headings, headings))
    is_short = length < _MIN_LENGTH
    headings /= np.where(is_short, np.float32(1.0), length)
    headings[:, is_short] = 0.0
    return headings


def _is_at_rest(binding: CardBinding, guides: Floats, turns: Floats) -> bool:
    """Whether guides are exactly at rest, and roots have hardly turned."""
    if not np.array_equal(guides, binding.rest_guides):
        return False
    return bool(np.abs(turns - np.eye(3, dtype=np.float32)).max(initial=0.0) < _MIN_TURN)
