"""Which CVs are held by something else than the head: by hair ties, or by a surface.

A held CV goes where the style's target goes, as the pinned CVs at the root do, and colliders do not
move it. Only its length along the strand counts for more: see `constraints.pin`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats, Ints
from .constraints import PINNED


@dataclass(frozen=True, eq=False)
class Held:
    """is_held: (guide_count, cv_count). What it says of pinned CVs counts for nothing."""

    is_held: Bools

    @cached_property
    def rows(self) -> Floats:
        """The same as (cv_count, guide_count) float32, 1 or 0; 0 for the pinned CVs."""
        rows = np.ascontiguousarray(self.is_held.T, np.float32)
        rows[:PINNED] = 0.0
        rows.flags.writeable = False
        return rows

    def spread(self, values: Floats) -> Floats:
        """Values of pinned and held CVs, (guide_count, cv_count, 3), carried on to all others: in
        between they change evenly, and stay as they are beyond the last one."""
        lower, upper, weight = self._between
        below, above = (np.take_along_axis(values, k[..., None], axis=1) for k in (lower, upper))
        result: Floats = below + weight[..., None] * (above - below)
        return result

    @cached_property
    def _between(self) -> tuple[Ints, Ints, Floats]:
        """For each CV the pinned or held ones before and behind it, and the latter's weight."""
        known = self.is_held.copy()
        known[:, :PINNED] = True
        cv = np.arange(known.shape[1])
        lower = np.maximum.accumulate(np.where(known, cv, 0), axis=1)
        upper = np.where(known, cv, len(cv))[:, ::-1]
        upper = np.minimum.accumulate(upper, axis=1)[:, ::-1]
        upper = np.where(upper < len(cv), upper, lower)
        weight = (cv - lower) / np.maximum(upper - lower, 1)
        return lower, upper, weight.astype(np.float32)
