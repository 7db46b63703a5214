"""Hair combed away from its partings, as brushes would."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...errors import HairloomError
from ...groom.parting_settings import PartingSettings
from ...groom.partings import Partings, combed_away
from ...groom.roots import bind_roots
from ...refine.lead_out_at_rest import led_out_at_rest
from ..base.outcome import Outcome
from ..colliders.fields import solid_of
from ..scene.curves import read_own_curves, write_own_curves
from ..scene.source import read_source


def comb_parting(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, settings: PartingSettings
) -> Outcome:
    """Let the curves of this hair lean away from its partings, before their modifiers.

    Raises:
        HairloomError: no hair that can be used, no surface, no parting, or it is linked from
            another file.
    """
    if not hair.data.is_editable:
        raise HairloomError(
            "it is linked from another file", place=hair.name, remedy="Make it local in Blender"
        )
    source, own = read_source(hair, depsgraph), read_own_curves(hair, depsgraph)
    if source.head is None:
        raise HairloomError(
            "it has no surface, so it has no partings",
            place=hair.name,
            remedy="Set Surface in its Data properties",
        )
    if source.partings is None:
        reason = " ".join(source.parting_warnings)
        raise HairloomError(
            f"it has no partings{f' ({reason})' if reason else ''}",
            place=hair.name,
            remedy="Draw a curve on the surface and press Add Parting",
        )
    bound = bind_roots(own.strands, source.head, place=hair.name).strands
    partings = Partings.of(source.partings, source.head)
    points = combed_away(bound, partings, source.head, settings)
    is_turned = np.zeros(bound.strand_count, bool)
    changed = np.flatnonzero((points != bound.points).any(axis=1))
    is_turned[np.searchsorted(bound.offsets, changed, side="right") - 1] = True
    turned, solid = np.flatnonzero(is_turned), solid_of(source.head)
    if solid is not None and len(turned):
        length = float(np.median(bound.lengths()))
        some = replace(bound, points=points.copy()).take(turned)
        led, _ = led_out_at_rest(some, solid, length)
        points[np.repeat(is_turned, bound.point_counts)] = led.points
    write_own_curves(hair, own, points, depsgraph)
    result = f"{hair.name}: {len(turned):,} of {bound.strand_count:,} curves lean from its partings"
    return Outcome(result, own.dropped, source.warnings)
