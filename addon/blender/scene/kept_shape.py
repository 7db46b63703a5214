"""A shape that curves had, kept in an attribute of their points: a tool can be taken back."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Bools, Floats
from ..base.attributes import read_attribute, set_attribute
from .curves import curve_offsets, curve_points, put_points


@dataclass(frozen=True)
class KeptShape:
    """The shape from before one tool.

    attribute: of the points: where they were, object space [m].
    done: custom property of the curves: a digest of what the tool made of them.
    """

    attribute: str
    done: str

    def is_there(self, hair: bpy.types.Object) -> bool:
        """Whether there is a shape to go back to."""
        return self.attribute in hair.data.attributes

    def before(self, hair: bpy.types.Object) -> Floats | None:
        """The shape, (point_count, 3); None if anything has changed the curves since the tool."""
        curves = hair.data
        if curves.get(self.done) != _digest(curve_points(curves)):
            return None
        kept: Floats | None = read_attribute(curves, self.attribute, "POINT", 3)
        return kept

    def keep(self, hair: bpy.types.Object) -> None:
        """The tool is about to change the curves. What it has changed last, and nothing else since,
        goes back to the shape from before both times."""
        if self.before(hair) is None:
            set_attribute(hair.data, self.attribute, "POINT", curve_points(hair.data))

    def seal(self, hair: bpy.types.Object) -> None:
        """The tool has changed the curves."""
        hair.data[self.done] = _digest(curve_points(hair.data))

    def back(self, hair: bpy.types.Object) -> bool:
        """Give curves their kept shape, and those that were drawn since none; whether there was
        one."""
        curves = hair.data
        kept = read_attribute(curves, self.attribute, "POINT", 3)
        if kept is None:
            return False
        points, offsets = curve_points(curves), curve_offsets(curves)
        is_known = np.repeat(_have_extent(kept, offsets), np.diff(offsets))
        points[is_known] = kept[is_known]
        put_points(curves, points)
        curves.attributes.remove(curves.attributes[self.attribute])
        curves.pop(self.done, None)
        return True


def _digest(points: Floats) -> str:
    return hashlib.blake2b(points.tobytes(), digest_size=16).hexdigest()


def _have_extent(points: Floats, offsets: np.ndarray) -> Bools:
    """Curves (curve_count,) whose points are not all the same: Blender gives new ones zeros."""
    if len(offsets) < 2:
        return np.zeros(0, bool)
    low, high = (find.reduceat(points, offsets[:-1], axis=0) for find in (np.minimum, np.maximum))
    is_extended: Bools = (high > low).any(axis=1)
    return is_extended
