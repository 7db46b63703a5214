"""Conversion between a file's axes, right-handed with Y or Z up, and Blender's, with Z up."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError


def to_z_up(points: Floats, up: str) -> Floats:
    """From a file's axes to Blender's: (x, y, z) of a Y-up file is (x, -z, y).

    Args:
        points: (..., 3).
        up: "Y" or "Z".

    Raises:
        HairloomError: another up axis.
    """
    if _is_y_up(up):
        return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)
    return points


def from_z_up(points: Floats, up: str) -> Floats:
    """Points (..., 3) from Blender's axes to a file's, the inverse of `to_z_up`."""
    if _is_y_up(up):
        return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)
    return points


def _is_y_up(up: str) -> bool:
    if up not in ("Y", "Z"):
        raise HairloomError(f"'{up}' is not an up axis", place="up axis", remedy="Use Y or Z")
    return up == "Y"
