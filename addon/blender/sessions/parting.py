"""Comb hair away from its partings, as brushes would."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ...groom.parting_settings import PartingSettings
from ...groom.partings import Partings, comb_from_partings
from ..base.outcome import Outcome
from ..base.parts import Parts
from ..scene.partings import read_partings
from .combing import comb, surface_to_comb_on


def comb_parting(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, settings: PartingSettings
) -> Parts[Outcome]:
    """Let the curves of this hair lean away from its partings, before their modifiers.

    Raises:
        HairloomError: no usable hair, no surface, no parting, or it is linked from another file.
    """
    surface = surface_to_comb_on(hair, depsgraph)
    lines, unusable = read_partings(hair, depsgraph)
    if not len(lines):
        reason = " ".join(unusable).rstrip(".")
        raise HairloomError(
            f"it has no partings{f': {reason}' if reason else ''}",
            place=hair.name,
            remedy="Draw a curve on the surface and press Add Parting",
        )
    partings = Partings.of(lines, surface)
    done = yield from comb(
        hair,
        surface,
        depsgraph,
        lambda bound: comb_from_partings(bound, partings, surface, settings),
    )
    result = f"{hair.name}: {done.changed:,} of {done.all:,} curves lean away from its partings"
    return Outcome(result, done.dropped, unusable)
