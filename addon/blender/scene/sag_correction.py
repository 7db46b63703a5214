"""Sag Correction of settled hair.

Settled hair hangs under its weight already, and would sag a second time if the style did not carry
all of it. So Sag Correction is 1 while hair is settled, on all objects that share its curves.
"""

from __future__ import annotations

import bpy

from ..base.objects import objects_using

#: custom property of the object: its Sag Correction before it was settled
_EARLIER_SAG_CORRECTION = "hairloom_combed_sag"


def set_full_sag_correction(curves: bpy.types.Curves) -> tuple[str, ...]:
    """Set Sag Correction to 1 on all objects with these settled curves; returns notes on it."""
    notes = []
    for hair in objects_using(curves):
        dynamics = hair.hairloom.dynamics
        before = dynamics.sag_compensation
        if before == 1.0:
            continue
        if _EARLIER_SAG_CORRECTION not in hair:
            hair[_EARLIER_SAG_CORRECTION] = before
        dynamics.sag_compensation = 1.0
        notes.append(
            f"{hair.name}: Sag Correction was {before:.2g} and is 1 now, as settled hair hangs "
            "under its weight already"
        )
    return tuple(notes)


def restore_sag_correction(curves: bpy.types.Curves) -> None:
    """Restore Sag Correction, once the settled shape is gone."""
    for hair in objects_using(curves):
        before = hair.pop(_EARLIER_SAG_CORRECTION, None)
        if before is not None:
            hair.hairloom.dynamics.sag_compensation = before
