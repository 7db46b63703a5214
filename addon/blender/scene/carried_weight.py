"""Settled hair hangs under its weight already, and would sag once more where the style does not
carry all of it: Sag Correction is 1 while it has settled, on all objects that share its curves."""

from __future__ import annotations

import bpy

from ..base.objects import objects_with

#: custom property of the object: its Sag Correction before
_BEFORE = "hairloom_combed_sag"


def carry_whole_weight(curves: bpy.types.Curves) -> tuple[str, ...]:
    """Curves have settled; what is said of the Sag Correction of their objects."""
    notes = []
    for hair in objects_with(curves):
        dynamics = hair.hairloom.dynamics
        before = dynamics.sag_compensation
        if before == 1.0:
            continue
        if _BEFORE not in hair:
            hair[_BEFORE] = before
        dynamics.sag_compensation = 1.0
        notes.append(
            f"{hair.name}: Sag Correction was {before:.2g} and is 1 now, as settled hair hangs "
            "under its weight already"
        )
    return tuple(notes)


def carry_as_before(curves: bpy.types.Curves) -> None:
    """The settled shape is gone."""
    for hair in objects_with(curves):
        before = hair.pop(_BEFORE, None)
        if before is not None:
            hair.hairloom.dynamics.sag_compensation = before
