"""The pose of a groom's surface in Blender's current evaluation."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...rig_flow import Pose
from ...strands.affine import without_scale
from ..base.objects import Body
from .surfaces import read_positions


def read_pose(
    hair: Body, head: Body | None, vertex_count: int | None, depsgraph: bpy.types.Depsgraph
) -> Pose:
    """The head's vertices and its transform since rest; without a head, the hair object's, without
    its scale, as moving hair keeps its size.

    Args:
        vertex_count: of the head that the hair was bound to.

    Raises:
        HairloomError: hair or head is gone, a position is not finite, or the number of vertices
            has changed.
    """
    hair.resolve()
    if head is None:
        matrix = hair.motion_from_rest(depsgraph)
        check_finite(hair.handle.name, matrix)
        return Pose(None, without_scale(matrix, hair.rest[:3, 3]))
    obj = head.resolve()
    positions = read_positions(obj, depsgraph, place=obj.name)
    if len(positions) != vertex_count:
        raise HairloomError(
            f"its mesh now has {len(positions):,} vertices instead of {vertex_count or 0:,}, so "
            "the hair is no longer attached",
            place=obj.name,
            remedy="Press Preview again",
        )
    check_finite(obj.name, positions)
    return Pose(positions, head.motion_from_rest(depsgraph))


def check_finite(place: str, values: Floats) -> None:
    """Refuse positions of any shape that a driver or modifier has made infinite or NaN.

    Raises:
        HairloomError: one of them is.
    """
    if not np.isfinite(values).all():
        raise HairloomError(
            "its position is not a finite number",
            place=place,
            remedy="Fix the driver, constraint or modifier that moves it",
        )
