"""Hair on a head that shakes, and a check that previewed hair swings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from grids import strand_grid

FRAME_S = 1.0 / 24.0  # [s]
#: distance that the head moves in each of FRAMES frames [m]
STEP, FRAMES = 0.03, 4


def key_x(obj: Any, x_by_frame: dict[int, float]) -> None:
    """Key an object's x [m] in these frames."""
    for frame, x in x_by_frame.items():
        obj.location.x = x
        obj.keyframe_insert("location", frame=frame)


def shake_head(hair: Any, head: Any, last: int, bake: Path, peak: int = 4) -> tuple[Any, Any]:
    """Key the head from frame 1 to `last` and set the hair up to be solved fast on the CPU."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, last
    key_x(head, {1: 0.0, peak: 0.1, last: -0.05})
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.bake.folder = str(bake)
    scene.frame_set(1)
    return hair, head


def play_frames(
    get_depsgraph: Callable[[], Any],
    frames: int,
    before_frame: Callable[[int], None] = lambda frame: None,
) -> None:
    """Let the preview play freely; `before_frame` is called before each frame."""
    from hairloom.addon.blender.preview import previews

    for frame in range(frames):
        before_frame(frame)
        bpy.context.view_layer.update()
        previews.advance(get_depsgraph(), 1.0 / 60.0)


def tips_lag(session: Any) -> bool:
    """Whether the tips lag behind a head that moves from rest, while the roots follow it."""
    from hairloom.addon.blender.preview import previews

    previews.rest(bpy.context.evaluated_depsgraph_get(), keep_playing=True)
    head, before = session.head.resolve(), strand_grid(session)
    for _ in range(FRAMES):
        head.location.x += STEP
        previews.advance(bpy.context.evaluated_depsgraph_get(), FRAME_S)
    offset = strand_grid(session) - before - [FRAMES * STEP, 0.0, 0.0]
    return bool(offset[:, -1, 0].mean() < -0.005 and np.abs(offset[:, 0]).max() < 1e-5)
