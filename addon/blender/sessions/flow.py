"""Comb hair along its strokes; can be undone, and repeated with other strokes."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ...groom.flow import comb_along_strokes
from ...groom.flow_settings import FlowSettings
from ..base.outcome import Outcome
from ..base.parts import Parts
from ..scene.shape_backup import BEFORE_FLOW
from ..scene.strokes import read_strokes
from .combing import comb, surface_to_comb_on


def comb_flow(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, settings: FlowSettings
) -> Parts[Outcome]:
    """Let the curves of this hair follow its strokes, before their modifiers. If nothing has
    changed the hair since it was last combed so, it begins again from the shape before that.

    Raises:
        HairloomError: no usable hair, no surface, no stroke, or it is linked from another file.
    """
    surface = surface_to_comb_on(hair, depsgraph)
    lines, unusable = read_strokes(hair, depsgraph)
    if not lines:
        reason = " ".join(unusable).rstrip(".")
        raise HairloomError(
            f"it has no strokes{f': {reason}' if reason else ''}",
            place=hair.name,
            remedy="Draw a curve on the surface and press Add Stroke",
        )
    done = yield from comb(
        hair,
        surface,
        depsgraph,
        lambda bound: comb_along_strokes(bound, lines, surface, settings),
        BEFORE_FLOW.read_if_unchanged(hair),
        backup=BEFORE_FLOW,
    )
    result = f"{hair.name}: {done.changed:,} of {done.all:,} curves follow its strokes"
    return Outcome(result, done.dropped, unusable)
