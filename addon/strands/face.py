"""The group numbers of brows and lashes, wherever the strands come from."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Ints

#: group numbers that files are unlikely to use otherwise
BROWS, LASHES = 9001, 9002


def is_face_hair(group: Ints) -> Bools:
    """Which strands are brows or lashes, by their groups (strand_count,)."""
    return np.isin(group, (BROWS, LASHES))
