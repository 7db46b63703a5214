"""Curls that are drawn out: thinner where their guide is longer, wider where it is shorter.

A segment of a strand has a part along its guide and one across it. The part along goes with the
guide, and the part across takes what is left of the segment's length, which stays what it is. A
segment that would have to be longer than it is lies along the guide, and none gets much wider, so
that straight hair among curls stays straight. Vectors lie as planes, (3, n).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats
from ..strands.vectors import dot_rows

#: Guides may be off by this fraction of their length where nothing is to be seen of it; it is the
#: most that Length Tolerance can be.
SLACK = 0.02
#: From SLACK on strands catch up with their guides, this much faster than these.
CATCHING_UP = 1.5
#: The part across gets no larger than by this factor.
WIDEST = 1.25
#: Directions shorter than this are none.
SHORTEST = 1.0e-6


def guide_axes(rest: Floats, now: Floats, gives: Bools) -> Floats | None:
    """Of each segment of each guide its direction at rest, and by which fraction it is seen to be
    longer, (guide_count, cv_count - 1, 4) float32; None where none is longer or shorter.

    Args:
        rest, now: (guide_count, cv_count, 3) [m].
        gives: (guide_count, cv_count - 1), whether it is a part of a curl.
    """
    before, after = np.diff(rest, axis=1), np.diff(now, axis=1)
    length, later = (np.sqrt(np.einsum("gcx,gcx->gc", one, one)) for one in (before, after))
    has_length = length > 0.0
    ratio = np.divide(later, length, out=np.ones_like(length), where=gives & has_length)
    extension = seen(ratio - np.float32(1.0))
    if not extension.any():
        return None
    axes = np.zeros((*length.shape, 4), np.float32)
    np.divide(before, length[..., None], out=axes[..., :3], where=has_length[..., None])
    axes[..., 3] = extension
    return axes


def seen(extension: Floats) -> Floats:
    """What is seen of an extension, as fractions: none of what may be an error of the solver, and
    all of it from three times that on."""
    beyond = (np.abs(extension) - SLACK) * CATCHING_UP
    return np.copysign(np.clip(beyond, 0.0, np.abs(extension)), extension)


def drawn_out(segment: Floats, axis: Floats) -> Floats:
    """What drawing out adds to segments (3, n); none of them changes its length.

    Args:
        axis: (4, n), the direction of the guide, of any length, and its extension as above.
    """
    size = np.sqrt(dot_rows(axis[:3], axis[:3]))
    direction = axis[:3] / np.maximum(size, np.float32(SHORTEST))
    along = dot_rows(direction, segment)
    across = segment - direction * along
    squared, thick = dot_rows(segment, segment), dot_rows(across, across)
    # what is across is as much shorter, in squares, as what is along is longer
    left = thick - along * along * axis[3] * (np.float32(2.0) + axis[3])
    left = np.clip(left, 0.0, np.minimum(np.float32(WIDEST * WIDEST) * thick, squared))
    wanted = np.copysign(np.sqrt(squared - left), along)
    is_changed = (size > SHORTEST) & (thick > 0.0) & (axis[3] != 0.0)
    factor = np.sqrt(np.divide(left, thick, out=np.ones_like(left), where=is_changed))
    change = direction * (wanted - along)
    change += across * (factor - np.float32(1.0))
    change[:, ~is_changed] = 0.0
    return change
