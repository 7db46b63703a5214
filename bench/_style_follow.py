"""How far drawn hair is from its animated style with simulation off, and what that costs."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from _moving_curves import LONGER, SIDE, apart, move_by_nodes

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.curves import read_curves, write_curves
from hairloom.addon.strands import StrandSet

FRAMES, CURVES, CHILDREN, POINTS = 24, 300, 4000, 16
#: Settings of children that are plain means of the curves around them, so that their motion is
#: known.
PLAIN = {"clump": 0.0, "frizz": 0.0, "length_variation": 0.0, "baby_hair": 0.0}


def style_follow() -> dict[str, object]:
    """Curves on a plane that turns; nodes move them sideways and lengthen them.

    The curves are compared with Blender's evaluation. Children move as far as the curves around
    them.
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    hair, scene = _hair(), bpy.context.scene
    settings, times = hair.hairloom.dynamics, {}
    settings.influence = 0.0
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    hair.hairloom.bake.follows = True
    max_error = max(_error(session, frame) for frame in range(1, FRAMES + 1))
    count, device = session.rig.strands.strand_count, session.solver.device
    settings.influence = 1.0
    for kind in ("animated", "read once"):
        settings.animated_style = kind == "animated"
        session.read_again(bpy.context.evaluated_depsgraph_get())
        took = []
        for frame in range(1, FRAMES + 1):
            scene.frame_set(frame)
            took.append(session.times.milliseconds("simulation"))
        times[kind] = float(np.median(took[2:]))
    previews.end()
    return {
        "style_follow_mm": round(1e3 * max_error, 5),
        "style_strands": count,
        "style_device": device,
        "style_frame_ms": round(times["animated"], 2),
        "style_frame_read_once_ms": round(times["read once"], 2),
    }


def _hair() -> Any:
    random, along = np.random.default_rng(5), np.linspace(0.0, 1.0, POINTS)[:, None]
    roots = random.uniform(-0.09, 0.09, (CURVES, 1, 3)) * [1.0, 1.0, 0.0]
    lean = random.uniform(-0.03, 0.03, (CURVES, 1, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.12]
    strands = StrandSet(
        (roots + along * lean).reshape(-1, 3),
        np.arange(CURVES + 1) * POINTS,
        np.full(CURVES * POINTS, 5e-5),
        np.zeros(CURVES, np.int32),
    )
    bpy.ops.mesh.primitive_grid_add(size=0.2, x_subdivisions=20, y_subdivisions=20)
    head, scene = bpy.context.object, bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    for frame, turn in ((1, 0.0), (FRAMES, 1.0)):
        head.rotation_euler.x = turn
        head.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    hair = write_curves("Hair", strands, head, bpy.context.collection)
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", CHILDREN
    for name, value in PLAIN.items():
        setattr(children, name, value)
    hair.hairloom.dynamics.animated_style = True
    move_by_nodes(hair)
    return hair


def _error(session: Any, frame: int) -> float:
    """The largest error of drawn strands in a frame [m]."""
    bpy.context.scene.frame_set(frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown, rest = session.strands, session.groom.rig.strands
    curves = read_curves(session.hair.resolve(), depsgraph).strands
    first = rest.offsets[CURVES]
    grid = rest.points[first:].reshape(rest.strand_count - CURVES, -1, 3)
    along = np.linspace(0.0, 1.0, grid.shape[1])[:, None]
    bowed = grid + along**2 * (frame - 1.0) * np.array([SIDE, 0.0, LONGER])
    matrix = np.array(session.head.resolve().evaluated_get(depsgraph).matrix_world)
    children = bowed.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    of_children = float(np.linalg.norm(shown[first:] - children, axis=1).max())
    return max(apart(shown, rest.offsets[: CURVES + 1], curves), of_children)
