"""What all tools share that comb the curves of one hair object, before their modifiers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...arrays import Floats, pieces_of_rows
from ...errors import HairloomError
from ...groom.roots import bind_roots
from ...refine.lead_out_at_rest import lead_out_at_rest
from ...strands import StrandSet, Surface
from ..base.objects import check_curves_editable, head_of
from ..base.parts import Part, Parts
from ..colliders.fields import head_field_of
from ..scene.curves import read_original_curves, write_original_curves
from ..scene.shape_backup import ShapeBackup
from ..scene.surfaces import read_surface


@dataclass(frozen=True)
class Combed:
    """changed, all: numbers of curves. dropped: reason -> number of curves that cannot be used."""

    changed: int
    all: int
    dropped: dict[str, int]


def surface_to_comb_on(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Surface:
    """The surface of the hair, in world space.

    Raises:
        HairloomError: it has no usable surface, or as `check_curves_editable`.
    """
    check_curves_editable(hair, depsgraph)
    head = head_of(hair)
    if head is None:
        raise HairloomError(
            "it has no surface to comb it along",
            place=hair.name,
            remedy="Set Surface in its Data properties",
        )
    return read_surface(head, depsgraph, need_uv=False, place=head.name)


def comb(
    hair: bpy.types.Object,
    surface: Surface,
    depsgraph: bpy.types.Depsgraph,
    points_of: Callable[[StrandSet], Floats],
    begin: Floats | None = None,
    *,
    backup: ShapeBackup | None = None,
) -> Parts[Combed]:
    """Move the points of the hair's curves; curves that change are led out of the surface.

    Args:
        points_of: from strands in world space, bound to the surface, to their new points.
        begin: (point_count, 3) object space, the points to begin with; None: the present ones.
        backup: keeps the shape from before.

    Raises:
        HairloomError: no usable curves.
    """
    own = read_original_curves(hair, depsgraph, begin)
    place, count = hair.name, own.strands.strand_count

    def work() -> tuple[Floats, int]:
        bound = bind_roots(own.strands, surface, place=place).strands
        points = points_of(bound)
        is_changed = np.zeros(count, bool)
        other = np.flatnonzero((points != bound.points).any(axis=1))
        is_changed[pieces_of_rows(other, bound.offsets)] = True
        changed, solid = np.flatnonzero(is_changed), head_field_of(surface)
        if solid is not None and len(changed):
            some = replace(bound, points=points.copy()).take(changed)
            led, _ = lead_out_at_rest(some, solid, float(np.median(bound.lengths())))
            points[np.repeat(is_changed, bound.point_counts)] = led.points
        return points, len(changed)

    points, changed = yield Part(f"Combing {count:,} curves", work)
    if backup is not None:
        backup.save(hair)
    write_original_curves(hair, own, points, depsgraph)
    if backup is not None:
        backup.mark_result(hair)
    return Combed(changed, count, own.dropped)
