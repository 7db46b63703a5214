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
_ROOT_ROW = 1.0e-4
#: Vectors shorter than this have no direction [m, or of unit vectors].
_SHORTEST = 1.0e-12
#: Roots that have turned by less than this count as unturned.
_UNTURNED = 1.0e-5


@dataclass(frozen=True, eq=False)
class CardBinding:
    """Data of cards and guides at rest with which the cards are placed later.

    mesh: at rest.
    guide, weight: (n, k) for each of n cards: indices of its guides, and weights of sum 1.
    guides: (guide_count, cv_count, 3) [m] at rest.
    root: (3, n) from the weighted mean of the guides' roots to the card's root [m].
    middle: (2, row_count) the vertices between which the middle of each row lies.
    spine: (row_count, 3) float32 [m] at rest, that of card c is spine[offsets[c]:offsets[c + 1]].
    riders: all spines on the guides.
    headings: (3, longest, n) unit directions of spines at their rows, the last one repeated.
    place: (row_count,) index of the row in the flattened headings.
    row: (vertex_count,) the row of each vertex. arms: (3, vertex_count) from the row's middle [m].
    met: cache of one entry: where the last motion with colliders began, and its clearance.
    """

    mesh: CardMesh
    guide: Ints
    weight: Floats
    guides: Floats
    root: Floats
    middle: Ints
    spine: Floats
    offsets: Ints
    riders: Riders
    headings: Floats
    place: Ints
    row: Ints
    arms: Floats
    met: list[tuple[Any, CardClearance]] = field(default_factory=list)

    @property
    def row_card(self) -> Ints:
        """(row_count,) the card of each row."""
        cards: Ints = self.place % max(len(self.guide), 1)
        return cards

    def lines(self, positions: Floats) -> Floats:
        """The middles of all rows (row_count, 3) with vertices at these positions."""
        middles: Floats = positions[self.middle].mean(axis=0)
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
            fraction = mesh.along <= first[owner] + _ROOT_ROW
        whole = np.bincount(owner, weights=fraction, minlength=count)[used]
        for axis in range(3):
            placed = fraction * mesh.positions[:, axis]
            lines[:, third, axis] = (
                np.bincount(owner, weights=placed, minlength=count)[used] / whole
            )
    return used.astype(np.int32), lines


def bind_cards(
    mesh: CardMesh, guides: Floats, guide: Ints, weight: Floats, room: Floats | None = None
) -> CardBinding:
    """Bind cards to the guides that they ride on.

    Args:
        mesh: at rest, world space.
        guides: (guide_count, cv_count, 3) [m] at rest, CVs evenly along each.
        guide, weight: (n, k) for the cards of `card_lines`, in its order.
        room: (guide_count, cv_count - 1), see `center_lines.curl_slack`; None: no curls.
    """
    used = np.unique(mesh.card)
    number = np.zeros(int(used.max(initial=0)) + 1, np.int64)
    number[used] = np.arange(len(used))
    owner = number[card_of_vertex(mesh)]
    keys = np.stack([owner, mesh.along.view(np.int32)], axis=1)
    drawn = np.unique(mesh.triangles)
    own_rows, own_row = np.unique(keys[drawn], axis=0, return_inverse=True)
    rows, row_drawn = _with_ends(own_rows, own_row.reshape(-1))
    row_card, middle = rows[:, 0], drawn[_middles(mesh.uv[drawn, 0], row_drawn, len(rows))]
    row: Ints = np.zeros(len(owner), np.int64)  # of vertices without triangles any
    row[drawn] = row_drawn
    weights = _Weights(np.asarray(guide), np.asarray(weight, np.float32))
    spine = mesh.positions[middle].mean(axis=0)
    offsets: Ints = np.searchsorted(row_card, np.arange(len(used) + 1))
    longest = int(np.diff(offsets).max(initial=1))
    place = (np.arange(len(row_card)) - offsets[row_card]) * max(len(used), 1) + row_card
    grid = _padded(offsets, longest)
    return CardBinding(
        mesh,
        weights.guide,
        weights.weight,
        np.asarray(guides, np.float32),
        spine[offsets[:-1]].T - _mixed(guides[:, :1], weights)[:, 0],
        middle,
        spine,
        offsets,
        _riders(spine, offsets, guides, weights, room),
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
    first = turns[binding.guide[:, 0]]
    carried = _carried_spine(binding, guides, first)
    spine = _ridden(binding, carried, np.asarray(guides, np.float32), turns)
    if contacts is not None:
        contacts.lead_spines(spine, carried, binding.offsets)
    frames = _frames(binding, spine, first)
    # the scale of the root's turn
    size = np.cbrt(np.abs(np.linalg.det(first)))[binding.row_card]
    of_vertices = np.take(frames, binding.row, axis=2, mode="clip")
    positions = _placed(of_vertices, binding.arms)
    middles = spine[binding.row]
    positions += middles
    of_vertices /= np.maximum(size, np.float32(_SHORTEST))[binding.row]
    normal, tangent = (
        _placed(of_vertices, each.T) for each in (binding.mesh.normal, binding.mesh.tangent)
    )
    if contacts is not None:
        arms = _carried_arms(binding, first)
        away = np.linalg.norm(spine - carried, axis=1)[binding.row]
        contacts.lead_arms(positions, (normal, tangent), middles, arms, away)
    return replace(binding.mesh, positions=positions, normal=normal, tangent=tangent)


def carried_cards(binding: CardBinding, guides: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """Spines (row_count, 3) and vertices (vertex_count, 3) as carried by their roots alone [m];
    arguments as of `follow_guides`."""
    first = np.asarray(turn, np.float32)[binding.guide[:, 0]]
    spine = _carried_spine(binding, guides, first)
    return spine, spine[binding.row] + _carried_arms(binding, first)


def moved_mesh(mesh: CardMesh, matrix: Floats) -> CardMesh:
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


def _with_ends(rows: Ints, row: Ints) -> tuple[Ints, Ints]:
    """The rows (row_count, 2) and the row of each vertex, with the row of single-row cards doubled:
    a spine is a strand, of two points or more."""
    single = np.flatnonzero(np.bincount(rows[:, 0]) == 1)
    at = np.searchsorted(rows[:, 0], single)
    shift = np.searchsorted(at, np.arange(len(rows)))
    return np.insert(rows, at + 1, rows[at], axis=0), row + shift[row]


def _middles(across: Floats, row: Ints, count: int) -> Ints:
    """Each row's middle vertex across the card, twice, or the two beside its middle, (2, n). A row
    without vertices has those of the row before.

    Args:
        across: (m,) place of each vertex across its card. row: (m,) its row.
    """
    order, sizes = np.lexsort((across, row)), np.bincount(row, minlength=count)
    begins = piece_starts(sizes)
    begins, sizes = (np.where(sizes == 0, np.roll(of, 1), of) for of in (begins, sizes))
    return np.stack([order[begins + (sizes - 1) // 2], order[begins + sizes // 2]])


def _padded(offsets: Ints, longest: int) -> Ints:
    """The rows of each card, the last one repeated, (longest, n)."""
    rows: Ints = np.minimum(offsets[:-1] + np.arange(longest)[:, None], offsets[1:] - 1)
    return rows


def _riders(
    spine: Floats, offsets: Ints, guides: Floats, weights: _Weights, room: Floats | None
) -> Riders:
    count = len(offsets) - 1
    strands = StrandSet(spine, offsets, np.zeros(len(spine)), np.zeros(count, int))
    return replace(Riders.of(strands, guides, weights, room), are_center_lines=True)


def _carried_spine(binding: CardBinding, guides: Floats, first: Floats) -> Floats:
    """Spines as carried by their roots, (row_count, 3) float32.

    Args:
        first: (n, 3, 3) rotation of each card's root.
    """
    weights = _Weights(binding.guide, binding.weight)
    root = _mixed(guides[:, :1], weights)[:, 0].T + np.einsum("nij,jn->ni", first, binding.root)
    card = binding.row_card
    bone = binding.spine - binding.spine[binding.offsets[:-1]][card]
    planes = np.ascontiguousarray(first.transpose(1, 2, 0))
    carried = _placed(np.take(planes, card, axis=2), bone.T)
    carried += root[card]
    return carried


def _carried_arms(binding: CardBinding, first: Floats) -> Floats:
    """Vectors from rows' middles to vertices as roots turn them, (vertex_count, 3)."""
    owner = binding.row_card[binding.row]
    return _placed(np.ascontiguousarray(first.transpose(1, 2, 0))[:, :, owner], binding.arms)


def _ridden(binding: CardBinding, carried: Floats, guides: Floats, turns: Floats) -> Floats:
    """The spines as they ride, (row_count, 3)."""
    rest = binding.guides
    by_root = guides[:, :1] + np.einsum("gij,gcj->gci", turns, rest - rest[:, :1])
    return ride(carried, binding.riders, by_root, guides)


def _frames(binding: CardBinding, spine: Floats, first: Floats) -> Floats:
    """Rotation of each row since rest, (3, 3, row_count): first that of its root, then that of its
    spine, (row_count, 3)."""
    planes = np.ascontiguousarray(first.transpose(1, 2, 0))
    before = np.stack([_row_times(row, binding.headings) for row in planes])
    length = np.sqrt(dot_rows(before, before))
    before /= np.maximum(length, np.float32(_SHORTEST))
    grid = _padded(binding.offsets, before.shape[1])
    turn = turns_along(before, _headings(spine, binding.offsets)[:, grid])
    x, y, z, w = turn.reshape(4, -1)[:, binding.place]
    turned = np.empty((3, 3, len(spine)), np.float32)
    for axis, (a, b, c) in enumerate(((x, y, z), (y, z, x), (z, x, y))):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        turned[axis, axis] = 1.0 - 2.0 * (b * b + c * c)
        turned[axis, one] = 2.0 * (a * b - w * c)
        turned[axis, two] = 2.0 * (a * c + w * b)
    of_rows = np.take(planes, binding.row_card, axis=2)
    for row in turned:
        row[:] = [_row_times(row, column) for column in of_rows.transpose(1, 0, 2)]
    return turned


def _placed(frame: Floats, local: Floats) -> Floats:
    """Vectors (3, n) turned by matrices (3, 3, n), (n, 3)."""
    vectors = np.empty((local.shape[1], 3), np.float32)
    for axis in range(3):
        vectors[:, axis] = _row_times(frame[axis], local)
    return vectors


def _row_times(row: Floats, vectors: Floats) -> Floats:
    """One row of matrices (3, n) times vectors (3, ..., n): (..., n). Faster than einsum."""
    value: Floats = row[0] * vectors[0]
    value += row[1] * vectors[1]
    value += row[2] * vectors[2]
    return value


def _mixed(guides: Floats, weights: _Weights) -> Floats:
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
    is_short = length < _SHORTEST
    headings /= np.where(is_short, np.float32(1.0), length)
    headings[:, is_short] = 0.0
    return headings


def _is_at_rest(binding: CardBinding, guides: Floats, turns: Floats) -> bool:
    """Whether guides are exactly at rest, and roots have hardly turned."""
    if not np.array_equal(guides, binding.guides):
        return False
    return bool(np.abs(turns - np.eye(3, dtype=np.float32)).max(initial=0.0) < _UNTURNED)
