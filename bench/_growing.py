"""Hair on the built-in head whose settings are edited while it is previewed.

Times run, as in the window but without its drawing, from the edit of a setting until the snapshot
for the next redraw has the new curves.
"""

from __future__ import annotations

import time

import bpy
import numpy as np

from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.setup.hairstyles import add_head

STRANDS = 4095
#: settings that an artist drags, each with successive values of the slider
EDITS = {
    "length": (0.255, 0.26, 0.265, 0.27),
    "droop": (0.46, 0.47, 0.48, 0.49),
    "wave": (0.0065, 0.007, 0.0075, 0.008),
    "volume": (0.02, 0.021, 0.022, 0.023),
}


def edited() -> dict[str, float]:
    """Medians of all edits [ms]: until the hair follows, and the growth alone; and the slowest."""
    head = run_parts(add_head(bpy.context.collection, "light"))
    head.select_set(True)
    bpy.context.view_layer.objects.active = head
    bpy.ops.hairloom.add_groom(strand_count=STRANDS, plays=False)
    hair = bpy.context.object
    session, own = previews.session_of(hair), hair.data.hairloom.grow
    assert session is not None
    took, growth = [], []
    for name, values in EDITS.items():
        for value in values:
            before, began = session.rig.strands.points, time.perf_counter()
            setattr(own, name, value)
            growth.append(time.perf_counter() - began)
            bpy.context.view_layer.update()
            took.append(time.perf_counter() - began)
            assert session.rig.strands.points is not before, "the hair does not follow"
        scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
    return {
        "grow_edit_ms": 1000.0 * float(np.median(took)),
        "grow_edit_slowest_ms": 1000.0 * max(took),
        "grow_ms": 1000.0 * float(np.median(growth)),
    }
