"""Unit and axes of a file, and conversion from and to Blender's: metres, Z up, right-handed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from .axes import from_z_up, to_z_up


@dataclass(frozen=True)
class FileSpace:
    """How a file's numbers relate to Blender's.

    up: "Y" or "Z".
    units_per_metre: the file's units in a metre: 100 where it is in centimetres.
    is_mirrored: Blender's y points the other way, so that the file is left-handed, as Unreal is.
    """

    up: str = "Z"
    units_per_metre: float = 1.0
    is_mirrored: bool = False

    def to_file(self, points: Floats) -> Floats:
        """Points (..., 3) [m] in the file's space, float32."""
        turned = from_z_up(self._mirrored(points), self.up)
        return np.asarray(turned, np.float32) * np.float32(self.units_per_metre)

    def from_file(self, points: Floats) -> Floats:
        """Points (..., 3) [m], the inverse of `to_file`; exact where the unit is the metre."""
        metres = np.asarray(points, np.float32) / np.float32(self.units_per_metre)
        return self._mirrored(to_z_up(metres, self.up))

    def _mirrored(self, points: Floats) -> Floats:
        return points * np.array([1.0, -1.0, 1.0], np.float32) if self.is_mirrored else points
