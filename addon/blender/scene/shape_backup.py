"""Shapes of curves from before a tool, saved in attributes of their points to undo the tool."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Bools, Floats
from ...errors import HairloomError
from ..base.attributes import read_attribute, set_attribute
from ..base.digests import digest
from ..base.objects import check_shape_editable
from .curves import curve_offsets, curve_points, move_curves
from .sag_correction import restore_sag_correction

#: custom property of the curves: the attributes of their saved shapes, the earliest first
_ORDER = "hairloom_shape_backups"


@dataclass(frozen=True)
class ShapeBackup:
    """The shape from before one tool.

    attribute: name of the point attribute with the positions before, object space [m].
    result_digest: custom property of the curves with a digest of the shape that the tool made.
    tool_label: label of the tool's button.
    """

    attribute: str
    result_digest: str
    tool_label: str

    def exists(self, hair: bpy.types.Object) -> bool:
        """Whether there is a shape to go back to."""
        return self.attribute in hair.data.attributes

    def read_if_unchanged(self, hair: bpy.types.Object) -> Floats | None:
        """The shape, (point_count, 3); None if anything has changed the curves since the tool."""
        curves = hair.data
        if curves.get(self.result_digest) != digest(curve_points(curves).tobytes()):
            return None
        shape: Floats | None = read_attribute(curves, self.attribute, "POINT", 3)
        return shape

    def save(self, hair: bpy.types.Object) -> None:
        """Store the shape, before the tool changes the curves.

        If only this tool has changed them since it was last used, the shape from before that use
        stays.
        """
        if self.read_if_unchanged(hair) is None:
            set_attribute(hair.data, self.attribute, "POINT", curve_points(hair.data))
            others = (each for each in _backup_order(hair.data) if each != self.attribute)
            hair.data[_ORDER] = " ".join((*others, self.attribute))

    def mark_result(self, hair: bpy.types.Object) -> None:
        """Store the digest of the shape that the tool has made."""
        hair.data[self.result_digest] = digest(curve_points(hair.data).tobytes())

    def restore(self, hair: bpy.types.Object) -> bool:
        """Restore the saved shape; curves that were drawn since do not change. Shapes that other
        tools have saved since then are deleted, as they are later than the restored one.

        Returns whether other changes, made since the tool was used, were lost.

        Raises:
            HairloomError: there is no such shape, or it is linked from another file.
        """
        check_shape_editable(hair)
        curves, is_changed = hair.data, self.read_if_unchanged(hair) is None
        shape = read_attribute(curves, self.attribute, "POINT", 3)
        if shape is None:
            raise HairloomError(
                "there is no earlier shape to restore",
                place=hair.name,
                remedy=f"Press {self.tool_label} first",
            )
        points, offsets = curve_points(curves), curve_offsets(curves)
        has_backup = np.repeat(_have_extent(shape, offsets), np.diff(offsets))
        points[has_backup] = shape[has_backup]
        move_curves(curves, points)
        order = _backup_order(curves)
        place = order.index(self.attribute) if self.attribute in order else len(order)
        for name in {self.attribute, *order[place:]}.intersection(curves.attributes.keys()):
            curves.attributes.remove(curves.attributes[name])
        curves[_ORDER] = " ".join(order[:place])
        if not BEFORE_SETTLE.exists(hair):
            restore_sag_correction(curves)
        return is_changed


BEFORE_SETTLE = ShapeBackup("hairloom_combed", "hairloom_settled", "Settle")
BEFORE_TRIM = ShapeBackup("hairloom_before_trim", "hairloom_trimmed", "Trim to Shape")
BEFORE_FLOW = ShapeBackup("hairloom_before_flow", "hairloom_flowed", "Comb Along Flow")
SHAPE_BACKUPS = (BEFORE_SETTLE, BEFORE_TRIM, BEFORE_FLOW)


def _backup_order(curves: bpy.types.Curves) -> list[str]:
    """The names of the attributes with saved shapes, the latest last."""
    return str(curves.get(_ORDER, "")).split()


def _have_extent(points: Floats, offsets: np.ndarray) -> Bools:
    """Mask (curve_count,) of curves whose points differ: those of new curves are all zero."""
    if len(offsets) < 2:
        return np.zeros(0, bool)
    low, high = (find.reduceat(points, offsets[:-1], axis=0) for find in (np.minimum, np.maximum))
    is_extended: Bools = (high > low).any(axis=1)
    return is_extended
