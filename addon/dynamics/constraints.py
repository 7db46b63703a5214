"""Segments keep their length: Newton's method on all length constraints of a guide at once.

For each segment j between CV j and CV j + 1 with unit direction d_j, the constraint is
|x_{j+1} - x_j| = l_j. One Newton step solves  (J W J^T) lambda = |x_{j+1} - x_j| - l_j  and moves
x by  -W J^T lambda  (Goldenthal et al. 2007, "Efficient Simulation of Inextensible Cloth", fast
projection). On a chain the matrix is tridiagonal, so a step is exact up to the curvature of the
constraint and costs as much as two relaxations:

    A_jj    =  d_j . (W_j + W_{j+1}) d_j          W_c = 0 for the pinned CVs,
    A_j,j+1 = -d_j . W_{j+1} d_{j+1}              else I - b n n^T

where n is the normal of the collider that CV c touches, or zero. So a CV in contact is 1 / (1 - b)
times heavier across the surface and slides along it, and keeping the length does not push it in.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .banded import solve_tridiagonal

#: CVs of each guide that the head carries: the second gives the root's direction (TressFX).
PINNED = 2
#: b above. At 1 a segment that stands straight on a collider could not change its length at all;
#: at 0.98 hair with its root deep inside of a collider was seen to tremble, at 0.9 not.
CONTACT_WEIGHT = np.float32(0.9)
#: Lengths below this count as zero [m].
TINY = np.float32(1.0e-9)


def pin(position: Floats, carried: Floats) -> None:
    """Put the pinned CVs where the head carries them; they have infinite mass."""
    position[:, :PINNED] = carried[:, :PINNED]


def keep_lengths(position: Floats, length: Floats, normal: Floats | None) -> None:
    """Bring all segments of `position` (3, cv_count, guide_count) towards their length, in place.

    One Newton step; exact but for the turn of the segments that it makes.

    Args:
        length: (cv_count - 1, guide_count) [m].
        normal: (3, cv_count - 2, guide_count) unit normal at each free CV that touches a
            collider, zero at the others; None where nothing touches.
    """
    if position.shape[1] > PINNED:
        _newton_step(position, length[1:], normal)


def finish_lengths(
    position: Floats, length: Floats, normal: Floats | None, tolerance: float, iterations: int
) -> None:
    """Go on, with the guides that need it, until no segment is off by more than `tolerance`.

    Few guides do, and only when they are jerked around. One that is still off after `iterations`
    Newton steps is laid out anew from the root with its segments' directions (follow the leader).
    """
    if position.shape[1] <= PINNED:
        return
    guide = _off_length(position, length, tolerance)
    for _ in range(iterations if guide.size else 0):
        some, some_length = position[:, :, guide], length[:, guide]
        _newton_step(some, some_length[1:], None if normal is None else normal[:, :, guide])
        position[:, :, guide] = some
        guide = guide[_off_length(some, some_length, tolerance)]
        if not guide.size:
            return
    if guide.size:
        some = position[:, :, guide]
        direction, _ = directions(some[:, 1:])
        some[:, PINNED:] = some[:, 1:2] + np.cumsum(direction * length[1:, guide], axis=1)
        position[:, :, guide] = some


def _off_length(position: Floats, length: Floats, tolerance: float) -> Ints:
    """Guides of which a segment is off by more than this share of its length."""
    _, error = directions(position[:, 1:])
    error -= length[1:]
    np.abs(error, out=error)
    off: Ints = np.flatnonzero((error > length[1:] * np.float32(tolerance)).any(axis=0))
    return off


def _newton_step(position: Floats, length: Floats, normal: Floats | None) -> None:
    direction, error = directions(position[:, 1:])
    error -= length
    diagonal, beside = chain_matrix(direction)
    if normal is None:
        solve_tridiagonal(diagonal, beside, error)
        direction *= error
        move = direction
        move[:, :-1] -= direction[:, 1:]
        position[:, PINNED:] -= move
        return
    lower = dot(normal[:, :-1], direction[:, 1:])  # of each segment but the first, at its root end
    upper = dot(normal, direction)  # of each segment, at its tip end
    beside += CONTACT_WEIGHT * (upper[:-1] * lower)
    diagonal -= CONTACT_WEIGHT * (upper * upper)
    diagonal[1:] -= CONTACT_WEIGHT * (lower * lower)
    solve_tridiagonal(diagonal, beside, error)
    direction *= error
    direction[:, :-1] -= direction[:, 1:]
    across = dot(normal, direction)
    across *= CONTACT_WEIGHT
    direction -= normal * across
    position[:, PINNED:] -= direction


def chain_matrix(direction: Floats) -> tuple[Floats, Floats]:
    """A of a guide without contacts: its diagonal (n, guide_count), and the one beside it.

    Args:
        direction: (3, n, guide_count) of the segments from the last pinned CV to the tip.
    """
    diagonal = np.full(direction.shape[1:], 2.0, np.float32)
    diagonal[0] = 1.0  # the last pinned CV does not move
    beside = dot(direction[:, 1:], direction[:, :-1])
    return diagonal, np.negative(beside, out=beside)


def directions(position: Floats) -> tuple[Floats, Floats]:
    """Unit direction (3, n - 1, guide_count) and length [m] (n - 1, guide_count) of segments."""
    segment = position[:, 1:] - position[:, :-1]
    length = dot(segment, segment)
    np.sqrt(length, out=length)
    segment /= np.maximum(length, TINY)
    return segment, length


def dot(one: Floats, two: Floats) -> Floats:
    """Dot products over the first axis, which is x, y, z."""
    total = one[0] * two[0]
    scratch = one[1] * two[1]
    total += scratch
    total += np.multiply(one[2], two[2], out=scratch)
    return total
