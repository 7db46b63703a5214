"""CVs that are held by something else than the head: by hair ties, or by a surface.

A held CV follows the style's target, like the pinned CVs at the root, and colliders do not move it.
Only the length of the strand takes precedence: see `constraints.pin`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats, Ints
from .constraints import PINNED_COUNT


@dataclass(frozen=True, eq=False)
class HeldCvs:
    """is_held: (guide_count, cv_count); values of pinned CVs are ignored."""

    is_held: Bools

    @cached_property
    def rows(self) -> Floats:
        """`is_held` as (cv_count, guide_count) float32, 1 or 0; 0 for the pinned CVs."""
        rows = np.ascontiguousarray(self.is_held.T, np.float32)
        rows[:PINNED_COUNT] = 0.0
        rows.flags.writeable = False
        return rows

    def interpolated(self, values: Floats) -> Floats:
        """Values (guide_count, cv_count, 3) at pinned and held CVs, extended to all others: linear
        in between, constant beyond the last one."""
        lower, upper, weight = self._interpolation
        below, above = (np.take_along_axis(values, k[..., None], axis=1) for k in (lower, upper))
        result: Floats = below + weight[..., None] * (above - below)
        return result

    @cached_property
    def _interpolation(self) -> tuple[Ints, Ints, Floats]:
        """The pinned or held CVs before and after each CV, and the latter's weight."""
        known = self.is_held.copy()
        known[:, :PINNED_COUNT] = True
        cv = np.arange(known.shape[1])
        lower = np.maximum.accumulate(np.where(known, cv, 0), axis=1)
        upper = np.where(known, cv, len(cv))[:, ::-1]
        upper = np.minimum.accumulate(upper, axis=1)[:, ::-1]
        upper = np.where(upper < len(cv), upper, lower)
        weight = (cv - lower) / np.maximum(upper - lower, 1)
        return lower, upper, weight.astype(np.float32)
