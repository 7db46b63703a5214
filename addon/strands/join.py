"""Two strand sets as one."""

from __future__ import annotations

from typing import Any

import numpy as np

from .colors import joined_colors
from .strand_set import StrandSet


def joined(one: StrandSet, other: StrandSet) -> StrandSet:
    """Both, one after the other; what only one of them knows of its roots is left out."""
    both: dict[str, Any] = {}
    for name in ("points", "radius", "group", "root_uv", "root_triangle", "root_barycentric"):
        parts = [getattr(one, name), getattr(other, name)]
        both[name] = None if any(part is None for part in parts) else np.concatenate(parts)
    return StrandSet(
        offsets=np.concatenate([one.offsets, other.offsets[1:] + one.offsets[-1]]),
        has_widths=one.has_widths and other.has_widths,
        color=joined_colors([one, other]),
        **both,
    )
