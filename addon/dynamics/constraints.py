"""Segments keep their length: Newton's method on all length constraints of a guide at once.

For each segment j between CV j and CV j + 1, s_j = x_{j+1} - x_j, the constraint is |s_j| = l_j.
One Newton step solves  (J W J^T) lambda = |s_j| - l_j  and moves x by  -W J^T lambda  (Goldenthal
et al. 2007, "Efficient Simulation of Inextensible Cloth", fast projection). On a chain the matrix
is tridiagonal, so a step is exact up to the curvature of the constraint and costs as much as two
relaxations. Each row and each unknown is scaled by its |s_j|, which avoids unit vectors:

    A_jj    =  s_j . (W_j + W_{j+1}) s_j          W_c = 0 for the pinned CVs,
    A_j,j+1 = -s_j . W_{j+1} s_{j+1}              else I - b n n^T
    right_j =  |s_j| (|s_j| - l_j)

where n is the normal of the collider that CV c touches, or zero. So a CV in contact is 1 / (1 - b)
times heavier across the surface: it slides along it, and keeping lengths does not push it in. W of
a held CV is nearly 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.strand_set import ROOT_POINTS
from ..strands.vectors import dot_rows
from .banded import solve_tridiagonal

#: CVs of each guide that the head carries: the second gives the root's direction (TressFX).
PINNED_COUNT = ROOT_POINTS
#: b above. At 1 a segment perpendicular to a collider could not change its length at all; at 0.98
#: hair with its root deep inside a collider trembled, at 0.9 it does not.
CONTACT_WEIGHT = np.float32(0.9)
#: 1 - W of a held CV. Not quite 1, as the lengths of a straight guide between two fixed ends have
#: no solution; after the solve the CV is put back to its place.
HELD_WEIGHT = np.float32(0.99)
#: Number of sweeps back and forth that shorten guides with held CVs.
HELD_SWEEPS = 4
#: Lengths below this count as zero [m].
TINY = np.float32(1.0e-12)
_TINY_SQUARED = TINY * TINY
#: Accuracy of segment lengths, as a fraction of the hair's length: float32 rounds world coordinates
#: that are several times larger than that.
ROUNDING = 4.0e-6


@dataclass(frozen=True)
class TouchingCvs:
    """Free CVs that touch a collider; they are few, so lists are faster here than whole grids.

    index: (m,) ascending, into (cv_count, guide_count) in C order.
    normal: (3, m) unit, outwards, world.
    """

    index: Ints
    normal: Floats

    def part(self, guides: Ints, guide_count: int) -> TouchingCvs:
        """The part for some guides (n,), ascending, reindexed to these."""
        index, positions = select_guides(self.index, guides, guide_count)
        return TouchingCvs(index, self.normal[:, positions])


def select_guides(index: Ints, guides: Ints, guide_count: int) -> tuple[Ints, Ints]:
    """Select indices of some guides (n,), ascending, from indices (m,) into (cv_count, guide_count)
    in C order.

    Returns:
        The indices (k,) into (cv_count, n), and which of the m these are, (k,).
    """
    cv, guide = np.divmod(index, guide_count)
    place = np.searchsorted(guides, guide)
    selected = np.flatnonzero(guides.take(place, mode="clip") == guide)
    return cv[selected] * len(guides) + place[selected], selected


def pin(position: Floats, targets: Floats, length: Floats, held: Floats | None) -> None:
    """Put the pinned CVs where the head carries them, and held ones where their ties do, as if they
    had infinite mass.

    A held CV stays within reach of the previous held one, by the length of the strand between them.
    Two that are neighbours keep exactly that length.

    Args:
        position, targets: (3, cv_count, guide_count) world [m].
        length: (cv_count - 1, guide_count) [m].
        held: see `held.HeldCvs.rows`; None if no CV is held.
    """
    position[:, :PINNED_COUNT] = targets[:, :PINNED_COUNT]
    if held is None:
        return
    anchor, reach = targets[:, PINNED_COUNT - 1], np.zeros_like(length[0])
    for cv in range(PINNED_COUNT, position.shape[1]):
        reach = reach + length[cv - 1]
        is_held = held[cv] > 0.0
        if not is_held.any():
            continue
        displacement = targets[:, cv] - anchor
        ratio = reach / np.maximum(np.sqrt(dot_rows(displacement, displacement)), TINY)
        if cv > PINNED_COUNT:  # else the pinned CV is its neighbour
            ratio = np.where(held[cv - 1] > 0.0, ratio, np.minimum(ratio, np.float32(1.0)))
        anchor = np.where(is_held, anchor + displacement * ratio, anchor)
        np.copyto(position[:, cv], anchor, where=is_held)
        reach[is_held] = 0.0


def keep_lengths(
    position: Floats, length: Floats, touching: TouchingCvs | None, held: Floats | None
) -> None:
    """Bring all segments of `position` towards their lengths, in place.

    One Newton step, exact up to the rotation of segments that it causes.

    Args:
        position: (3, cv_count, guide_count) world [m], in C order.
        length: (cv_count - 1, guide_count) [m].
        touching: None if nothing touches.
        held: see `pin`.
    """
    if position.shape[1] > PINNED_COUNT:
        _newton_step(position, length[1:], touching, held)


def spring_step(position: Floats, target: Floats, compliance: Floats, held: Floats | None) -> None:
    """One implicit step of springs along the segments, in place.

    Args:
        position: (3, cv_count, guide_count) world [m], in C order.
        target: (cv_count - PINNED_COUNT, guide_count) [m], the length that each segment is drawn
            to.
        compliance: in the shape of `target`, over dt^2, for CVs of mass 1; 0 is rigid.
    """
    _newton_step(position, target, None, held, compliance)


def relax_lengths(position: Floats, length: Floats, held: Floats | None, sweeps: int) -> None:
    """Bring segments towards their lengths by `sweeps` relaxations from root to tip, in place.

    Each segment moves both of its ends by half of its error, or a single free end by all of it
    (Jakobsen 2001). Arrays as of `keep_lengths`.
    """
    last = position.shape[1] - 1
    for _ in range(sweeps):
        for cv in range(PINNED_COUNT, last + 1):
            segment = position[:, cv] - position[:, cv - 1]
            now = np.sqrt(dot_rows(segment, segment))
            segment *= (now - length[cv - 1]) / np.maximum(now, TINY)
            lower: Floats | np.float32 = np.float32(0.0 if cv == PINNED_COUNT else 0.5)
            upper: Floats | np.float32 = np.float32(1.0) - lower
            if held is not None:
                free_lower = np.float32(cv > PINNED_COUNT) * (np.float32(1.0) - held[cv - 1])
                free_upper = np.float32(1.0) - held[cv]
                free = np.maximum(free_lower + free_upper, np.float32(1.0))
                lower, upper = free_lower / free, free_upper / free
            position[:, cv - 1] += segment * lower
            position[:, cv] -= segment * upper


def hold_within_reach(position: Floats, length: Floats, held: Floats | None) -> None:
    """Bring each CV within reach of the last pinned one, in place.

    Neither its straight distance nor that along the strand exceeds the strand's length there (Kim,
    Chentanez and Mueller 2012, "Long Range Attachments"). Arrays as of `keep_lengths`.
    """
    root = position[:, PINNED_COUNT - 1 : PINNED_COUNT]
    displacement = position[:, PINNED_COUNT:] - root
    reach = np.cumsum(length[PINNED_COUNT - 1 :], axis=0)
    displacement *= np.minimum(
        reach / np.maximum(np.sqrt(dot_rows(displacement, displacement)), TINY), np.float32(1.0)
    )
    displacement += root
    position[:, PINNED_COUNT:] = displacement
    shorten_segments(position, length, held)


def shorten_segments(position: Floats, length: Floats, held: Floats | None) -> None:
    """Shorten segments that are too long, in place, from root to tip.

    That shortens zigzags, which long-range attachments alone allow.

    Guides with held CVs are shortened back and forth, first from these towards the root; if both
    constraints conflict, lengths take precedence over the places of held CVs. Arrays as of
    `keep_lengths`.
    """
    before = None if held is None else position.copy()
    is_due = np.ones(position.shape[2], bool)
    for _ in range(1 if held is None else HELD_SWEEPS):
        if held is not None and before is not None:
            np.copyto(position, before, where=held > 0.0)
            for cv, is_moved in _towards_root(held):
                near = _within_distance(position[:, cv], position[:, cv + 1], length[cv])
                np.copyto(position[:, cv], near, where=is_moved)
        for cv in range(PINNED_COUNT, position.shape[1]):
            near = _within_distance(position[:, cv], position[:, cv - 1], length[cv - 1])
            np.copyto(position[:, cv], near, where=is_due)
        is_due = np.zeros(0, bool) if held is None else held.any(axis=0)


def _within_distance(point: Floats, other: Floats, farthest: Floats) -> Floats:
    """Points (3, n) pulled to no more than a distance (n,) [m] from others (3, n)."""
    offset = point - other
    offset *= np.minimum(
        farthest / np.maximum(np.sqrt(dot_rows(offset, offset)), TINY), np.float32(1.0)
    )
    offset += other
    return offset


def _towards_root(held: Floats) -> Iterator[tuple[int, Bools]]:
    """CVs from the second last towards the root, each with the guides (guide_count,) that are held
    somewhere beyond it but not there."""
    is_beyond = np.zeros(held.shape[1], bool)
    for cv in range(len(held) - 2, PINNED_COUNT - 1, -1):
        is_beyond |= held[cv + 1] > 0.0
        yield cv, is_beyond & (held[cv] == 0.0)


def finish_lengths(
    position: Floats,
    length: Floats,
    touching: TouchingCvs | None,
    held: Floats | None,
    tolerance: float,
    iterations: int,
    size: float,
) -> None:
    """Repeat Newton steps, for the guides that need it, until no segment is off by more than
    `tolerance`.

    Few guides do, and only when they are jerked around. One that is still off after `iterations`
    steps is rebuilt from its directions, see `_rebuilt`.

    Args:
        size: of the hair [m], see `state.Rest`.
    """
    if position.shape[1] <= PINNED_COUNT:
        return
    guide = _guides_off_length(position, length, tolerance, size)
    for _ in range(iterations if guide.size else 0):
        some, some_length = position.take(guide, axis=2), length.take(guide, axis=1)
        touching_part = None if touching is None else touching.part(guide, length.shape[1])
        some_held = None if held is None else held[:, guide]
        _newton_step(some, some_length[1:], touching_part, some_held)
        position[:, :, guide] = some
        guide = guide[_guides_off_length(some, some_length, tolerance, size)]
        if not guide.size:
            return
    if guide.size:
        some_held = None if held is None else held[:, guide]
        position[:, :, guide] = _rebuilt(position[:, :, guide], length[:, guide], some_held)


def _rebuilt(position: Floats, length: Floats, held: Floats | None) -> Floats:
    """Guides rebuilt from the root on with the directions of their segments and exact lengths
    (follow the leader).

    Guides with held CVs are first rebuilt from these towards the root, as in FABRIK (Aristidou and
    Lasenby 2011); if both constraints conflict, lengths take precedence.
    """
    if held is not None:
        direction, _ = directions(position)
        for cv, is_moved in _towards_root(held):
            place = position[:, cv + 1] - direction[:, cv] * length[cv]
            np.copyto(position[:, cv], place, where=is_moved)
    direction, _ = directions(position[:, PINNED_COUNT - 1 :])
    displacement = np.cumsum(direction * length[PINNED_COUNT - 1 :], axis=1)
    position[:, PINNED_COUNT:] = position[:, PINNED_COUNT - 1 : PINNED_COUNT] + displacement
    return position


def _guides_off_length(position: Floats, length: Floats, tolerance: float, size: float) -> Ints:
    """Guides with a segment that is off by more than this fraction of its length, and ROUNDING."""
    segment = position[:, PINNED_COUNT:] - position[:, PINNED_COUNT - 1 : -1]
    error = dot_rows(segment, segment)
    np.sqrt(error, out=error)
    error -= length[PINNED_COUNT - 1 :]
    np.abs(error, out=error)
    allowed = length[PINNED_COUNT - 1 :] * np.float32(tolerance)
    allowed += np.float32(ROUNDING * size)
    off: Ints = (error > allowed).any(axis=0).nonzero()[0]
    return off


def _newton_step(
    position: Floats,
    length: Floats,
    touching: TouchingCvs | None,
    held: Floats | None,
    compliance: Floats | None = None,
) -> None:
    segment, squared = segments(position[:, 1:])
    diagonal, off_diagonal = chain_matrix(segment, squared)
    right = np.sqrt(squared)
    right *= length
    np.subtract(squared, right, out=right)
    if held is not None:
        before, held_weight = position[:, PINNED_COUNT:].copy(), HELD_WEIGHT * held[PINNED_COUNT:]
        diagonal -= held_weight * squared
        diagonal[1:] -= held_weight[:-1] * squared[1:]
        off_diagonal *= np.float32(1.0) - held_weight[:-1]
    if compliance is not None:
        diagonal += compliance * squared
    if touching is None:
        solve_tridiagonal(diagonal, off_diagonal, right)
    else:
        _solve_and_slide(position, segment, (diagonal, off_diagonal, right), touching)
    segment *= right
    position[:, PINNED_COUNT:] -= minus_next(segment)
    if held is not None:
        np.copyto(position[:, PINNED_COUNT:], before, where=held[PINNED_COUNT:] > 0.0)


def _solve_and_slide(
    position: Floats, segment: Floats, system: tuple[Floats, Floats, Floats], touching: TouchingCvs
) -> None:
    """Solve with the weight of contacts, and undo the part of the motion that goes into them.

    Args:
        system: diagonal, off-diagonal and right side; the last becomes the solution.
    """
    diagonal, off_diagonal, right = (part.reshape(-1) for part in system)
    rows, normal, guide_count = segment.reshape(3, -1), touching.normal, segment.shape[2]
    upper = touching.index - PINNED_COUNT * guide_count  # the segment that ends at the CV
    count = upper.searchsorted(off_diagonal.size)  # without tips, where no segment begins
    inner, lower = upper[:count], upper[:count] + guide_count  # the segment that begins there
    along_upper = dot_rows(normal, take_columns(rows, upper))
    along_lower = dot_rows(normal[:, :count], take_columns(rows, lower))
    heavy_upper, heavy_lower = CONTACT_WEIGHT * along_upper, CONTACT_WEIGHT * along_lower
    diagonal[upper] -= heavy_upper * along_upper
    diagonal[lower] -= heavy_lower * along_lower
    off_diagonal[inner] += heavy_upper[:count] * along_lower
    solve_tridiagonal(*system)
    heavy_upper *= right.take(upper)
    heavy_upper[:count] -= heavy_lower * right.take(lower)
    for row, value in zip(position.reshape(3, -1), normal * heavy_upper, strict=True):
        row[touching.index] += value


def segments(position: Floats) -> tuple[Floats, Floats]:
    """Segments (3, n - 1, guide_count) [m] and their squared length, never zero [m^2]."""
    segment = position[:, 1:] - position[:, :-1]
    squared = dot_rows(segment, segment)
    squared += _TINY_SQUARED
    return segment, squared


def chain_matrix(segment: Floats, squared: Floats) -> tuple[Floats, Floats]:
    """A of guides without contacts: its diagonal (n, guide_count) and off-diagonal.

    Args:
        segment, squared: see `segments`, from the last pinned CV to the tip.
    """
    diagonal = squared + squared
    diagonal[0] = squared[0]  # the last pinned CV does not move
    off_diagonal = dot_rows(segment[:, 1:], segment[:, :-1])
    return diagonal, np.negative(off_diagonal, out=off_diagonal)


def minus_next(rows: Floats) -> Floats:
    """Each of (3, n, guide_count) minus the next one, the last as it is: J^T."""
    result = np.empty_like(rows)
    np.subtract(rows[:, :-1], rows[:, 1:], out=result[:, :-1])
    result[:, -1:] = rows[:, -1:]
    return result


def directions(position: Floats) -> tuple[Floats, Floats]:
    """Unit direction (3, n - 1, guide_count) and length [m] (n - 1, guide_count) of segments."""
    segment = position[:, 1:] - position[:, :-1]
    length = _length(segment)
    segment /= length
    return segment, length


def _length(vector: Floats) -> Floats:
    """Length over the first axis, never zero; the term added is below rounding above 1e-8 m."""
    squared = dot_rows(vector, vector)
    squared += _TINY_SQUARED
    length: Floats = np.sqrt(squared, out=squared)
    return length


def unit(vector: Floats) -> Floats:
    """`vectors.unit_rows` in fewer operations, for use in each substep; see `_length`."""
    result: Floats = vector / _length(vector)
    return result


def take_columns(rows: Floats, index: Ints) -> Floats:
    """The chosen columns (3, m) of rows (3, n); fastest if these are contiguous."""
    return rows.take(index, axis=1, mode="clip")
