"""Cards that ride on guides: bound at rest, carried as whole strips.

A card has a bone: the mixture of its guides at rest, moved to its root. It rides as strands do, so
it keeps its length, unless the curls that the card shows are drawn out. It has a frame that does
not twist from root to tip (Bishop 1975). A row of the card (its vertices at one place along it)
keeps its place in that frame. So strips bend and do not shear, a row stays as wide as it was, and
nothing twists but what the root turns.

Vectors lie as planes here, (3, ...): that is several times as fast.

Limitation: guides that wind around each other do not twist the card between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from ..refine.ride import Riders, ride
from ..strands import StrandSet
from ..strands.affine import moved
from ..strands.vectors import cross_rows, dot_rows, unit_rows
from .card_mesh import CardMesh
from .sort import card_of_vertex

#: How far along a card its first row may reach.
_ROOT_ROW = 1.0e-4
#: Vectors shorter than this [m, or of unit ones] have no direction.
_SHORTEST = 1.0e-12
#: Added to 1 + cos between two ways, which is 0 where the second is the first reversed.
_REVERSED = 1.0e-6


@dataclass(frozen=True, eq=False)
class CardBinding:
    """What of cards and guides at rest is needed to place the cards later.

    mesh: at rest.
    guide, weight: (n, k) for each of n cards: indices of its guides, and weights of sum 1.
    guides: (guide_count, cv_count, 3) [m] at rest.
    root: (3, n) from the mixture of the guides' roots to the card's root [m].
    bone: (3, cv_count, n) from its root [m] at rest. riders: all bones on the guides.
    heading, side: (3, n) unit vectors of the bone's first frame at rest.
    row: (vertex_count,) which row each vertex lies in.
    row_card, row_cv: (row_count,) the card of each row, and the CV before it; row_share: how far
        it lies towards the next one.
    local: (3, 3, vertex_count) in the frame of the row at rest: the way from the bone [m], the
        normal, and the tangent.
    """

    mesh: CardMesh
    guide: Ints
    weight: Floats
    guides: Floats
    root: Floats
    bone: Floats
    riders: Riders
    heading: Floats
    side: Floats
    row: Ints
    row_card: Ints
    row_cv: Ints
    row_fraction: Floats
    local: Floats


def card_lines(mesh: CardMesh) -> tuple[Ints, Floats]:
    """The card numbers that have triangles, (n,), and the middles of these cards at the root, a
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
    """Tie cards to the guides that they ride on.

    Args:
        mesh: at rest, world space.
        guides: (guide_count, cv_count, 3) [m] at rest, CVs evenly along each.
        guide, weight: (n, k) for the cards of `card_lines`, in its order.
        room: (guide_count, cv_count - 1), see `center_lines.curl_room`; None: no curls.
    """
    used, lines = card_lines(mesh)
    mixed = _mixed(guides, guide, weight)
    root = lines[:, 0].T - mixed[:, 0]
    bone = mixed + root[:, None]
    place = np.zeros(int(used.max(initial=0)) + 1, np.int64)
    place[used] = np.arange(len(used))
    owner = place[card_of_vertex(mesh)]
    rows, row = np.unique(
        np.stack([owner, mesh.along.view(np.int32)], axis=1), axis=0, return_inverse=True
    )
    along = np.ascontiguousarray(rows[:, 1], np.int32).view(np.float32)
    at = np.clip(along, 0.0, 1.0) * (bone.shape[1] - 1)
    before = np.minimum(at.astype(np.int64), bone.shape[1] - 2)
    headings = _headings(bone)
    side = _across(headings[:, 0])
    binding = CardBinding(
        mesh,
        guide,
        np.asarray(weight, np.float32),
        np.asarray(guides, np.float32),
        root,
        bone - bone[:, :1],
        _riders(bone, guides, _Weights(guide, np.asarray(weight, np.float32)), room),
        headings[:, 0],
        side,
        row.reshape(-1),
        rows[:, 0].astype(np.int64),
        before,
        (at - before).astype(np.float32),
        np.zeros((3, 3, 0), np.float32),
    )
    places, frame = _rows(binding, bone, headings, side, np.ones(len(used), np.float32))
    arms = mesh.positions.T - places[:, binding.row]
    vectors = np.stack([arms, mesh.normal.T, mesh.tangent.T])
    local = np.einsum("fav,cav->cfv", frame[:, :, binding.row], vectors)
    return replace(binding, local=local.astype(np.float32))


def follow_guides(binding: CardBinding, guides: Floats, turn: Floats) -> CardMesh:
    """The cards where their guides are now; what does not move is the same arrays.

    Args:
        guides: (guide_count, cv_count, 3) [m] now.
        turn: (guide_count, 3, 3), how the body has turned each guide's root since rest.
    """
    if not len(binding.guide):
        return binding.mesh
    turns = np.asarray(turn, np.float32)
    first = turns[binding.guide[:, 0]]
    volume = np.linalg.det(first)
    bone = _ridden(binding, np.asarray(guides, np.float32), turns)
    headings = _headings(bone)
    was = unit_rows(np.einsum("nij,jn->in", first, binding.heading))
    side = np.einsum("nij,jn->in", first, binding.side)
    side = _perpendicular(_turned(side, was, headings[:, 0]), headings[:, 0])
    places, frame = _rows(binding, bone, headings, side, np.sign(volume))
    at = np.take(places, binding.row, axis=1, mode="clip")
    frame = np.take(frame, binding.row, axis=2, mode="clip")
    size = np.cbrt(np.abs(volume))[binding.row_card][binding.row]
    arms, normal, tangent = (_placed(frame, local) for local in binding.local)
    positions = np.multiply(arms, size[:, None], out=arms)
    positions += at.T
    return replace(binding.mesh, positions=positions, normal=normal, tangent=tangent)


def moved_mesh(mesh: CardMesh, matrix: Floats) -> CardMesh:
    """Cards moved by an affine (4, 4) matrix; the same object for no motion."""
    if np.array_equal(matrix, np.eye(4)):
        return mesh
    turn = np.asarray(matrix, np.float64)[:3, :3]
    is_mirrored = np.linalg.det(turn) < 0.0
    linear = np.eye(4)
    linear[:3, :3] = turn
    normal, tangent = (moved(each, linear).T for each in (mesh.normal, mesh.tangent))
    return replace(
        mesh,
        positions=moved(mesh.positions, matrix),
        normal=unit_rows(normal).T,
        tangent=unit_rows(tangent).T,
        triangles=mesh.triangles[:, ::-1] if is_mirrored else mesh.triangles,
    )


@dataclass(frozen=True)
class _Weights:
    """See `refine.ride.Weights`."""

    guide: Ints
    weight: Floats


def _riders(bone: Floats, guides: Floats, weights: _Weights, room: Floats | None) -> Riders:
    """Bones (3, cv_count, n) on their guides."""
    _, cv_count, count = bone.shape
    points = bone.transpose(2, 1, 0).reshape(-1, 3)
    offsets = np.arange(count + 1) * cv_count
    strands = StrandSet(points, offsets, np.zeros(len(points)), np.zeros(count, int))
    return replace(Riders.of(strands, guides, weights, room), are_lines=True)


def _ridden(binding: CardBinding, guides: Floats, turns: Floats) -> Floats:
    """The bones now, (3, cv_count, n)."""
    first = turns[binding.guide[:, 0]]
    root = _mixed(guides[:, :1], binding.guide, binding.weight)[:, 0]
    root += np.einsum("nij,jn->in", first, binding.root)
    carried = np.einsum("nij,jcn->nci", first, binding.bone) + root.T[:, None]
    rest = binding.guides
    by_root = guides[:, :1] + np.einsum("gij,gcj->gci", turns, rest - rest[:, :1])
    ridden = ride(carried.reshape(-1, 3), binding.riders, by_root, guides)
    return np.ascontiguousarray(ridden.reshape(carried.shape).transpose(2, 1, 0))


def _placed(frame: Floats, local: Floats) -> Floats:
    """Vectors in frames (3, 3, n) as they are in the world, (n, 3)."""
    vectors = np.empty((local.shape[1], 3), np.float32)
    for axis in range(3):
        part = frame[0, axis] * local[0]
        part += frame[1, axis] * local[1]
        part += frame[2, axis] * local[2]
        vectors[:, axis] = part
    return vectors


def _rows(
    binding: CardBinding, bone: Floats, headings: Floats, side: Floats, hand: Floats
) -> tuple[Floats, Floats]:
    """Places of all rows (3, row_count), and their frames: way, side and up, (3, 3, row_count).

    Args:
        bone, headings: (3, cv_count, n). side: (3, n) at the root.
        hand: (n,) -1 for mirrored cards.
    """
    heading = unit_rows(_on_rows(headings, binding))
    across = _perpendicular(_on_rows(_transported(headings, side), binding), heading)
    up = cross_rows(heading, across) * hand[binding.row_card].astype(np.float32)
    return _on_rows(bone, binding), np.stack([heading, across, up])


def _on_rows(of_cvs: Floats, binding: CardBinding) -> Floats:
    """Values (3, cv_count, n) of bones at the rows of their cards, straight between CVs."""
    flat = of_cvs.reshape(3, -1)
    count = of_cvs.shape[2]
    before = binding.row_cv * count + binding.row_card
    values = np.take(flat, before, axis=1, mode="clip")
    further = np.take(flat, before + count, axis=1, mode="clip")
    further -= values
    further *= binding.row_fraction
    values += further
    return values


def _transported(headings: Floats, side: Floats) -> Floats:
    """The side at the root carried along without twist, (3, cv_count, n), as
    strands.frames.transported_normals does.
    """
    sides = np.empty_like(headings)
    sides[:, 0] = side
    for cv in range(1, headings.shape[1]):
        turned = _turned(sides[:, cv - 1], headings[:, cv - 1], headings[:, cv])
        sides[:, cv] = _perpendicular(turned, headings[:, cv])
    return sides


def _turned(vector: Floats, one: Floats, other: Floats) -> Floats:
    """Vectors across `one`, by the least turn that takes `one` to `other`: v - (v . b)(a + b) /
    (1 + a . b), which is Rodrigues' formula for them; (3, n) each.
    """
    fraction = dot_rows(vector, other) / (1.0 + dot_rows(one, other) + np.float32(_REVERSED))
    return vector - (one + other) * fraction


def _mixed(guides: Floats, guide: Ints, weight: Floats) -> Floats:
    """Guides mixed, (3, cv_count, n) float32."""
    grid = np.ascontiguousarray(np.asarray(guides, np.float32).transpose(2, 1, 0))
    mixed = np.zeros((*grid.shape[:2], len(guide)), np.float32)
    for column in range(guide.shape[1]):
        mixed += grid[:, :, guide[:, column]] * np.asarray(weight[:, column], np.float32)
    return mixed


def _headings(bone: Floats) -> Floats:
    """Unit directions from root to tip at the CVs, (3, cv_count, n): those of strands.frames."""
    step = bone[:, 1:] - bone[:, :-1]
    headings = np.concatenate([step[:, :1], step[:, 1:] + step[:, :-1], step[:, -1:]], axis=1)
    length = np.sqrt(dot_rows(headings, headings))
    is_short = length < _SHORTEST
    headings /= np.maximum(length, np.float32(_SHORTEST))
    if is_short.any():
        headings[:, 0, is_short[0]] = np.array([[0.0], [0.0], [1.0]], np.float32)
        for cv in range(1, headings.shape[1]):
            headings[:, cv, is_short[cv]] = headings[:, cv - 1, is_short[cv]]
    return headings


def _perpendicular(vector: Floats, heading: Floats) -> Floats:
    """The unit part across unit vectors, (3, n); any one across where they are parallel."""
    across = vector - heading * dot_rows(vector, heading)
    length = np.sqrt(dot_rows(across, across))
    is_short = length < np.float32(1.0e-5)
    across /= np.maximum(length, np.float32(1.0e-5))
    if is_short.any():
        across[:, is_short] = _across(heading[:, is_short])
    return across


def _across(heading: Floats) -> Floats:
    """Unit vectors across unit vectors, (3, n)."""
    axis = np.zeros_like(heading)
    axis[np.abs(heading).argmin(axis=0), np.arange(heading.shape[1])] = 1.0
    return unit_rows(axis - heading * dot_rows(axis, heading))
