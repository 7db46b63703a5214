"""Stretching curls: they get thinner where their guide is longer, wider where it is shorter.

A segment of a strand has a component along its guide and one across it. The former scales with the
guide; the latter is scaled so that the segment keeps its length. A segment too short for that lies
along the guide, and none gets much wider, so that straight hair among curls stays straight. Vectors
are stored as planes, (3, n).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats
from ..strands.vectors import dot_rows

#: Extensions up to this fraction may be errors of the solver and are not shown; it is the maximum
#: of Length Tolerance.
EXTENSION_TOLERANCE = 0.02
#: Beyond the tolerance the shown extension grows by this factor until it has caught up with the
#: guide's.
EXTENSION_GAIN = 1.5
#: Maximum factor by which the component across the guide grows.
MAX_WIDENING = 1.25
#: Axes shorter than this have no direction.
MIN_AXIS_LENGTH = 1.0e-6


def guide_axes(rest: Floats, now: Floats, can_extend: Bools) -> Floats | None:
    """The direction at rest of each segment of each guide, xyz, and the fraction by which it is
    shown longer, w, (guide_count, cv_count - 1, 4) float32; None if none is longer or shorter.

    Args:
        rest, now: (guide_count, cv_count, 3) [m].
        can_extend: (guide_count, cv_count - 1), whether the segment is a part of a curl.
    """
    before, after = np.diff(rest, axis=1), np.diff(now, axis=1)
    length, later = (np.sqrt(np.einsum("gcx,gcx->gc", one, one)) for one in (before, after))
    has_length = length > 0.0
    ratio = np.divide(later, length, out=np.ones_like(length), where=can_extend & has_length)
    extension = visible_extension(ratio - np.float32(1.0))
    if not extension.any():
        return None
    axes = np.zeros((*length.shape, 4), np.float32)
    np.divide(before, length[..., None], out=axes[..., :3], where=has_length[..., None])
    axes[..., 3] = extension
    return axes


def visible_extension(extension: Floats) -> Floats:
    """The shown part of an extension, as fractions: none up to EXTENSION_TOLERANCE, which may be an
    error of the solver, and all of it from three times that on."""
    beyond = (np.abs(extension) - EXTENSION_TOLERANCE) * EXTENSION_GAIN
    return np.copysign(np.clip(beyond, 0.0, np.abs(extension)), extension)


def change_by_extension(segment: Floats, axis: Floats) -> Floats:
    """The change of segments (3, n) by stretching; all keep their lengths.

    Args:
        axis: (4, n), see `guide_axes`; the direction may have any length.
    """
    size = np.sqrt(dot_rows(axis[:3], axis[:3]))
    direction = axis[:3] / np.maximum(size, np.float32(MIN_AXIS_LENGTH))
    along = dot_rows(direction, segment)
    across = segment - direction * along
    squared, across_squared = dot_rows(segment, segment), dot_rows(across, across)
    # the square of the part across loses what the square of the part along gains
    new_squared = across_squared - along * along * axis[3] * (np.float32(2.0) + axis[3])
    new_squared = np.clip(
        new_squared,
        0.0,
        np.minimum(np.float32(MAX_WIDENING * MAX_WIDENING) * across_squared, squared),
    )
    new_along = np.copysign(np.sqrt(squared - new_squared), along)
    is_changed = (size > MIN_AXIS_LENGTH) & (across_squared > 0.0) & (axis[3] != 0.0)
    factor = np.sqrt(
        np.divide(
            new_squared,
            across_squared,
            out=np.ones_like(new_squared),
            where=is_changed,
        )
    )
    change = direction * (new_along - along)
    change += across * (factor - np.float32(1.0))
    change[:, ~is_changed] = 0.0
    return change
