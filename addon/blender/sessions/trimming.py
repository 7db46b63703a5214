"""Cut hair by its trim shapes; can be undone, and repeated with other shapes."""

from __future__ import annotations

from functools import partial

import bpy

from ...errors import HairloomError
from ...groom.trim import trim_strands
from ..base.objects import check_curves_editable
from ..base.outcome import Outcome
from ..base.parts import Part, Parts
from ..scene.curves import read_original_curves, write_original_curves
from ..scene.shape_backup import BEFORE_TRIM
from ..scene.trim_shapes import read_shapes, trim_shapes_of


def trim_to_shapes(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Parts[Outcome]:
    """Cut the curves of this hair where they leave its trim shapes, before their modifiers. If
    nothing has changed the hair since it was last trimmed, it begins again from the shape before.

    Raises:
        HairloomError: no usable hair, no shape, or it is linked from another file.
    """
    check_curves_editable(hair, depsgraph)
    shapes, unusable = read_shapes(trim_shapes_of(hair), depsgraph)
    if not shapes:
        reason = " ".join(unusable).rstrip(".")
        raise HairloomError(
            f"it has no trim shape{f': {reason}' if reason else ''}",
            place=hair.name,
            remedy="Select a closed mesh, a flat one or an Empty together with the hair",
        )
    own = read_original_curves(hair, depsgraph, BEFORE_TRIM.read_if_unchanged(hair))
    title = f"Trimming {own.strands.strand_count:,} curves"
    cut = yield Part(title, partial(trim_strands, own.strands, shapes))
    BEFORE_TRIM.save(hair)
    write_original_curves(hair, own, cut.points, depsgraph)
    BEFORE_TRIM.mark_result(hair)
    trimmed_count = int(cut.is_trimmed.sum())
    left, outside = len(cut.is_trimmed) - trimmed_count, int(cut.is_outside.sum())
    result = f"{hair.name}: {trimmed_count:,} curves trimmed, {left:,} left unchanged"
    if outside:
        result += f", {outside:,} of them with roots outside"
    return Outcome(result, own.dropped, unusable)
