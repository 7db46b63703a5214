"""Strands that ride on their guides: they turn like their guides, and keep shape and length.

The rotation of a guide's segment since rest is that of the segment before it, followed by the
smallest rotation that completes it: so no twist is added from root to tip (Bishop 1975), and where
a guide does not bend, nothing turns. A segment of a strand takes the rotations of its three guides
at the same distance from the root, blended as quaternions. The strand is its own segments, turned
like this and joined from the root on; if guides leave their roots, the strand's root follows. So
lengths are kept whatever the guides do, strands whose guides turn rigidly turn rigidly, and a coil
keeps its shape on a guide that bends. For curled guides that are drawn out, see `curls`.

Vectors are stored as planes, (3, n), and quaternions as (4, n), w last: that is several times as
fast. Strands of similar point counts are moved together as (3, point_count, strand_count), so that
values of a strand broadcast over its points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet
from ..strands.arc_length import segment_lengths
from ..strands.blocks import Block, blocks_of
from ..strands.center_lines import center_lines
from ..strands.root_motions import RootMotions
from ..strands.vectors import cross_rows, dot_rows
from .curls import change_by_extension, guide_axes

#: Segments shorter than this [m] have no direction, so they turn like the one before them.
MIN_SEGMENT_LENGTH = 1.0e-12
#: A rotation between two directions is a full reversal if w of its quaternion, before it is
#: normalized, is smaller than this.
REVERSAL_LIMIT = 1.0e-6
#: Quaternions with a larger real part turn by less than a right angle, so that any two of them, and
#: their blends, lie in the same hemisphere.
SMALL = 0.7072


class Weights(Protocol):
    """The guides of each strand.

    guide: (strand_count, 3), indices into the guides. weight: (strand_count, 3), sum 1.
    """

    @property
    def guide(self) -> Ints: ...

    @property
    def weight(self) -> Floats: ...


@dataclass(frozen=True, eq=False)
class Riders:
    """Strands and the guides they ride on, as they are at rest; constant.

    offsets: (strand_count + 1,), strand s is points offsets[s]:offsets[s + 1].
    weights: of all strands.
    blocks: all strands, grouped by similar point counts, and where they ride.
    reach: (strand_count,) float32, the length of each centre line as a fraction of its strand's.
    segments_per_meter: (guide_count,) float32 [1/m], of each guide.
    can_extend: (guide_count, cv_count - 1), which segments of guides are curls that may be drawn
        out;
        None: none.
    are_center_lines: whether these strands are centre lines themselves, which stretch as their
        guides do.
    """

    offsets: Ints
    weights: Weights
    blocks: tuple[tuple[Block, RidePositions], ...]
    reach: Floats
    segments_per_meter: Floats
    can_extend: Bools | None = None
    are_center_lines: bool = False

    @classmethod
    def of(
        cls, strands: StrandSet, guides: Floats, weights: Weights, room: Floats | None = None
    ) -> Riders:
        """Bind strands to guides.

        Args:
            strands: at rest.
            guides: (guide_count, cv_count, 3) [m] at rest, CVs evenly along each; centre lines.
            room: (guide_count, cv_count - 1), see `center_lines.curl_slack`; None: no curls.
        """
        lengths = np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1, dtype=np.float64)
        per_meter = (guides.shape[1] - 1) / np.maximum(lengths, MIN_SEGMENT_LENGTH)
        # a curl advances along its guide as fast as its own centre line does
        reach = center_lines(strands, guides.shape[1]).lengths()
        reach /= np.maximum(strands.lengths(), np.float32(MIN_SEGMENT_LENGTH))
        stations = _middles(strands.points, strands.offsets)
        stations *= np.repeat(reach, strands.point_counts)
        can_extend = None if room is None else room > 0.0
        per_meter = per_meter.astype(np.float32)
        blocks = tuple(
            (block, RidePositions.of(block, stations, per_meter, weights, guides.shape[1] - 1))
            for block in blocks_of(strands.offsets)
        )
        return cls(strands.offsets, weights, blocks, reach, per_meter, can_extend)


@dataclass(frozen=True, eq=False)
class RidePositions:
    """Where the segments of a block's strands ride on their guides.

    guide, weight: (3, n), the guides of each strand, and their weights.
    before, fraction: (3, count - 1, n), the last guide segment whose middle is before the place
        where the strand's segment rides, numbered over all guides, and how far that place is on the
        way to the middle of the next one.
    """

    guide: Ints
    weight: Floats
    before: Ints
    fraction: Floats

    @classmethod
    def of(
        cls, block: Block, stations: Floats, per_meter: Floats, weights: Weights, segments: int
    ) -> RidePositions:
        """Args:
        stations: (point_count,) float32 [m], how far along its guides each segment rides.
        per_meter: see `Riders.segments_per_meter`. segments: of a guide.
        """
        guide = np.ascontiguousarray(weights.guide[block.strands].T, np.int64)
        weight = np.ascontiguousarray(weights.weight[block.strands].T, np.float32)
        place = block.planes(stations)[:-1] * per_meter[guide][:, None]
        place -= np.float32(0.5)
        np.clip(place, np.float32(0.0), np.float32(segments - 1), out=place)
        whole = np.trunc(place)
        place -= whole
        before = whole.astype(np.int32)
        before += (guide * segments).astype(np.int32)[:, None]
        return cls(guide, weight, before, place)

    def each(self) -> Iterator[tuple[Floats, Ints, Floats]]:
        """Weight (n,), `before` and `fraction` (count - 1, n), for each of the three guides."""
        return zip(self.weight, self.before, self.fraction, strict=True)


def _middles(points: Floats, offsets: Ints) -> Floats:
    """Distance from the root along the strand [m] of the middle of the segment that begins at each
    point, (point_count,) float32; values of tips are meaningless.
    """
    ends = segment_lengths(points, offsets)
    reached = np.cumsum(ends)
    reached -= np.repeat(reached[offsets[:-1]], np.diff(offsets))
    begins = np.append(ends[1:], 0.0)[: len(ends)]
    return (reached + 0.5 * begins).astype(np.float32)


def ride(
    points: Floats,
    riders: Riders,
    guide_rest: Floats,
    guide_now: Floats,
    motions: RootMotions | None = None,
) -> Floats:
    """Strands turned with their guides, (point_count, 3) float32, all in one space [m].

    Guides at rest leave every strand, bit for bit, where its root carries it.

    Args:
        points: (point_count, 3), strands at rest.
        guide_rest: (guide_count, cv_count, 3), guides carried by their own roots.
        guide_now: (guide_count, cv_count, 3), guides as simulated.
        motions: of the strands' roots since rest; None: none, or already applied to `points`.
    """
    points = np.asarray(points, np.float32)
    moved = np.empty_like(points)
    if not len(moved):
        return moved
    turns = guide_turns(guide_rest, guide_now)
    table, is_small = _with_steps(turns.transpose(2, 1, 0)), (turns[3] > SMALL).all(axis=0)
    axes = (
        None if riders.can_extend is None else guide_axes(guide_rest, guide_now, riders.can_extend)
    )
    axes = None if axes is None else _with_steps(axes)
    shifts = np.asarray(guide_now[:, 0] - guide_rest[:, 0], np.float32)
    have_left = bool(shifts.any())
    for block, seats in riders.blocks:
        rest = block.planes(points)
        if motions is not None:  # the same, bit for bit, as `groom.roots.carry_with_roots`
            rest += motions.displacement(rest, block.strands)
        change, edge = np.empty_like(rest), rest[:, 1:] - rest[:, :-1]
        change[:, 0] = 0.0
        if have_left:
            for guide, weight in zip(seats.guide, seats.weight, strict=True):
                change[:, 0] += weight * shifts[guide].T
        wide = (~is_small[seats.guide].all(axis=0)).nonzero()[0]
        change[:, 1:] = _turned(edge, riders.are_center_lines, seats, table, wide, axes)
        _sum(change)
        change += rest
        block.write(moved, change)
    return moved


def guide_turns(rest: Floats, now: Floats) -> Floats:
    """How each segment of each guide has turned, (4, cv_count - 1, guide_count) float32
    quaternions; exactly (0, 0, 0, 1) where it has not.

    Args:
        rest, now: (guide_count, cv_count, 3) [m].
    """
    return turns_along(_directions(rest), _directions(now))


def turns_along(before: Floats, after: Floats) -> Floats:
    """The turns of successive directions, (4, m, n), from (3, m, n) unit vectors, or 0 for none."""
    has_none = ~(before.any(axis=0) & after.any(axis=0))
    turns = np.empty((4, *before.shape[1:]), np.float32)
    turn = np.zeros((4, before.shape[2]), np.float32)
    turn[3] = 1.0
    for number in range(before.shape[1]):
        # the smallest rotation from where the previous turn brings this direction to where it is
        here = before[:, number] + turn_change(turn, before[:, number])
        turn = _product(minimal_rotation(here, after[:, number], has_none[number]), turn)
        turns[:, number] = turn
    return turns


def minimal_rotation(one: Floats, other: Floats, has_none: Bools) -> Floats:
    """The quaternions (4, n) of the smallest rotations between unit vectors (3, n); the identity
    where `has_none` (n,): one of them has no direction.
    """
    # from the difference, so that equal vectors give exactly the identity
    change = other - one
    turn = np.empty((4, one.shape[1]), np.float32)
    turn[:3] = cross_rows(one, change)
    turn[3] = np.float32(2.0) - np.float32(0.5) * dot_rows(change, change)
    is_reversed = turn[3] < REVERSAL_LIMIT
    if is_reversed.any():
        back = one[:, is_reversed]
        axis = np.zeros_like(back)
        axis[np.abs(back).argmin(axis=0), np.arange(back.shape[1])] = 1.0
        turn[:3, is_reversed] = cross_rows(back, axis)
        turn[3, is_reversed] = 0.0
    if has_none.any():
        turn[:, has_none] = np.array([[0.0], [0.0], [0.0], [1.0]], np.float32)
    turn /= np.sqrt(_dot(turn, turn))
    return turn


def turn_change(turn: Floats, vector: Floats) -> Floats:
    """The change of vectors (3, n) by the rotations of quaternions (4, n) of any length."""
    axis, real = turn[:3], turn[3]
    across = cross_rows(axis, vector)
    change = cross_rows(axis, across)
    across *= real
    change += across
    change *= np.float32(2.0) / _dot(turn, turn)
    return change


def _directions(grid: Floats) -> Floats:
    """Unit vectors along segments, (3, cv_count - 1, guide_count) float32; 0 for no length."""
    edge = np.ascontiguousarray(np.diff(grid, axis=1).transpose(2, 1, 0), np.float32)
    length = np.sqrt(dot_rows(edge, edge))
    is_short = length < MIN_SEGMENT_LENGTH
    edge /= np.where(is_short, np.float32(1.0), length)
    edge[:, is_short] = 0.0
    return edge


def _dot(one: Floats, other: Floats) -> Floats:
    """Dot products of quaternions (4, ...)."""
    return np.asarray(np.einsum("i...,i...->...", one, other))


def _product(left: Floats, right: Floats) -> Floats:
    """Quaternions (4, n) that turn by `right` first, then by `left`."""
    product = np.empty_like(right)
    product[:3] = cross_rows(left[:3], right[:3])
    product[:3] += left[3] * right[:3] + right[3] * left[:3]
    product[3] = left[3] * right[3] - dot_rows(left[:3], right[:3])
    return product


def _with_steps(values: Floats) -> Floats:
    """Values of segments (guide_count, segment_count, 4), followed by the difference to the next
    segment's, (guide_count, segment_count, 8)."""
    table = np.zeros((*values.shape[:2], 8), np.float32)
    table[..., :4] = values
    table[:, :-1, 4:] = table[:, 1:, :4] - table[:, :-1, :4]
    return table


def _turned(
    edge: Floats,
    are_center_lines: bool,
    seats: RidePositions,
    table: Floats,
    wide: Ints,
    axes: Floats | None,
) -> Floats:
    """The change of segments (3, count - 1, n) by turning and drawing out; may overwrite `edge`.

    Args:
        wide: which of the strands have a guide that turns by a right angle or more.
    """
    blend: Floats | None = None
    axis = None if axes is None else np.zeros((4, *edge.shape[1:]), np.float32)
    for weight, before, fraction in seats.each():
        turn = _between(table, before, fraction)
        turn *= weight
        if axes is not None and axis is not None:
            here = _between(axes, before, fraction)
            here *= weight
            axis += here
        if blend is None:
            blend = turn
            continue
        if len(wide):  # q and -q are the same rotation: choose the nearer
            some = turn[..., wide]
            turn[..., wide] = some * np.copysign(np.float32(1.0), _dot(some, blend[..., wide]))
        blend += turn
    assert blend is not None
    if len(wide):  # opposite turns that cancel out become the identity
        some = blend[..., wide]
        blend[3][:, wide] += _dot(some, some) < REVERSAL_LIMIT
    if axis is None or not axis[3].any():
        return turn_change(blend, edge)
    drawn = edge * axis[3] if are_center_lines else change_by_extension(edge, axis)
    edge += drawn
    drawn += turn_change(blend, edge)
    return drawn


def _between(table: Floats, before: Ints, fraction: Floats) -> Floats:
    """Values (4, ...) interpolated between rows of a table and the next ones, see `_with_steps`."""
    rows = table.reshape(-1, 8).take(before.ravel(), axis=0, mode="clip")
    near: Floats = np.ascontiguousarray(rows.T).reshape(8, *before.shape)
    value = near[4:]
    value *= fraction
    value += near[:4]
    return value


def _sum(change: Floats) -> None:
    """Running sums along the second axis of (3, count, n), in place."""
    if change.shape[1] > change.shape[2]:
        np.cumsum(change, axis=1, out=change)
        return
    for point in range(1, change.shape[1]):
        change[:, point] += change[:, point - 1]
