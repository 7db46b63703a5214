"""Two strand sets as one."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Ints
from .colors import joined_colors
from .strand_set import StrandSet


def join_strands(one: StrandSet, other: StrandSet) -> StrandSet:
    """Both, concatenated; root data that only one of them has is dropped."""
    both: dict[str, Any] = {}
    for name in ("points", "radius", "group", "root_uv", "root_triangle", "root_barycentric"):
        parts = [getattr(one, name), getattr(other, name)]
        both[name] = None if any(part is None for part in parts) else np.concatenate(parts)
    seed = None
    if one.seed is not None or other.seed is not None:
        seed = np.concatenate([_seeds(one), _seeds(other)])
    return StrandSet(
        offsets=np.concatenate([one.offsets, other.offsets[1:] + one.offsets[-1]]),
        has_widths=one.has_widths and other.has_widths,
        color=joined_colors([one, other]),
        seed=seed,
        **both,
    )


def _seeds(strands: StrandSet) -> Ints:
    return np.zeros(strands.strand_count, np.int32) if strands.seed is None else strands.seed
