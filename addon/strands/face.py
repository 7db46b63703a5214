"""Brows and lashes among the groups of strands, wherever the strands come from."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Ints

#: numbers of groups that files hardly use for anything else
BROWS, LASHES = 9001, 9002


def is_face_hair(group: Ints) -> Bools:
    """Which strands are brows or lashes, by their groups (strand_count,)."""
    return np.isin(group, (BROWS, LASHES))
