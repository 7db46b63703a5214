"""The hair's own colours: which are usable, and how missing ones are stored.

A strand has a colour at all of its points or at none. Without one its colours are NaN, and it is
drawn in the look's colour.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints
from .strand_set import StrandSet


def usable_colors(color: Floats, offsets: Ints) -> Floats:
    """The colours, but NaN along each strand that has one negative or not finite value.

    Args:
        color: (point_count, 3) scene-linear.
        offsets: (strand_count + 1,), as in `StrandSet`.
    """
    color = np.asarray(color, np.float32).reshape(-1, 3)
    if not color.size or (color.min() >= 0.0 and np.isfinite(np.vdot(color, color))):
        return color
    is_faulty = ~(np.isfinite(color) & (color >= 0.0)).all(axis=1)
    totals = np.concatenate([[0], np.cumsum(is_faulty)])
    is_without = totals[offsets[1:]] > totals[offsets[:-1]]
    colors = color.copy()
    colors[np.repeat(is_without, np.diff(offsets))] = np.nan
    return colors


def joined_colors(parts: Sequence[StrandSet]) -> Floats | None:
    """The colours of several sets, concatenated; None if no set has colours."""
    if all(part.color is None for part in parts):
        return None
    none = np.float32(np.nan)
    return np.concatenate(
        [np.full((p.point_count, 3), none) if p.color is None else p.color for p in parts]
    )


def color_notes(place: str, strands: StrandSet) -> tuple[str, ...]:
    """A warning if some strands of coloured hair have no colour; `place` names the hair."""
    if strands.color is None:
        return ()
    count = int(np.isnan(strands.color[strands.offsets[:-1], 0]).sum())
    if not count:
        return ()
    return (
        f"{place}: {count:,} of {strands.strand_count:,} strands have no usable colour, so they "
        "use the look's. Give their attribute color finite values of zero or more.",
    )
