"""Settled hair hangs under its weight already, and would sag once more where the style does not
carry all of it: Sag Correction is 1 while it has settled."""

from __future__ import annotations

import bpy

#: custom property of the object: its Sag Correction before
_BEFORE = "hairloom_combed_sag"


def carry_whole_weight(hair: bpy.types.Object) -> tuple[str, ...]:
    """Hair has settled; what is said of its Sag Correction."""
    dynamics = hair.hairloom.dynamics
    if dynamics.sag_compensation == 1.0:
        return ()
    before = dynamics.sag_compensation
    if _BEFORE not in hair:
        hair[_BEFORE] = before
    dynamics.sag_compensation = 1.0
    return (
        f"{hair.name}: Sag Correction was {before:.2g} and is 1 now, as settled hair hangs under "
        "its weight already",
    )


def carry_as_before(hair: bpy.types.Object) -> None:
    """The settled shape is gone."""
    before = hair.pop(_BEFORE, None)
    if before is not None:
        hair.hairloom.dynamics.sag_compensation = before
