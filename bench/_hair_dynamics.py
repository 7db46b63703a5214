"""Blender 5.2's own "Hair Dynamics" node group, which the dynamics are compared with.

From the assets that Blender ships; mode "Physics (Experimental)", because its default mode,
"Animation", simulates nothing; surface collision on, because ours collides too; everything else as
shipped: 10 substeps of 15 constraint steps a frame.
"""

from __future__ import annotations

import time

import bpy
import numpy as np
from _blender_nodes import shipped_node_group

from hairloom.addon.blender.scene.curves import write_curves
from hairloom.addon.strands import StrandSet

GROUP = "Hair Dynamics"
ASSETS = "assets/nodes/geometry_nodes_dynamics_assets.blend"


class HairDynamics:
    """The strands as hair curves on a head that is animated, simulated by Blender."""

    def __init__(self, head: bpy.types.Object, strands: StrandSet) -> None:
        self._head, self._scene = head, bpy.context.scene
        self.hair = write_curves("Peer", strands, head, self._scene.collection)
        self._shape = strands.grid.shape
        self._length = _segments(strands.grid)
        self._modifier = self.hair.modifiers.new(GROUP, "NODES")
        self._modifier.node_group = shipped_node_group(GROUP, ASSETS)
        inputs = self._modifier.properties.inputs
        inputs.Socket_44.value = "Physics (Experimental)"  # Mode
        inputs.Socket_15.value = True  # Surface Collision
        self.hair.update_tag()

    def play(self, frame_count: int, warm_up: int) -> tuple[list[float], float]:
        """Milliseconds of each frame after the warm-up, and the worst stretch of all frames.

        The time of a frame is that of `scene.frame_set`, which evaluates everything. Without the
        modifier the same takes well under 0.1 ms, so nothing is subtracted.
        """
        times, stretch = [], 0.0
        self._scene.frame_set(0)
        for frame in range(1, frame_count + 1):
            begin = time.perf_counter()
            self._scene.frame_set(frame)
            times.append((time.perf_counter() - begin) * 1000.0)
            # both simulations pin the first two CVs
            change = np.abs(_segments(self._points()) / self._length - 1.0)[:, 1:]
            stretch = max(stretch, float(change.max()))
        return times[warm_up:], stretch

    def idle_ms(self, frame_count: int) -> float:
        """The same frames without the modifier, median milliseconds."""
        self._modifier.show_viewport = False
        times, _ = self.play(frame_count, 0)
        self._modifier.show_viewport = True
        return float(np.median(times))

    def remove(self) -> None:
        bpy.data.objects.remove(self.hair)

    def _points(self) -> np.ndarray:
        """The evaluated points of this frame, (strand_count, cv_count, 3), object space."""
        evaluated = self.hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.empty(self._shape, np.float32)
        evaluated.data.position_data.foreach_get("vector", points.ravel())
        return points


def animate(head: bpy.types.Object, places: list[float], fps: int) -> None:
    """Key the head's x [m], frame after frame from 0."""
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = fps, 0, len(places)
    for frame, x in enumerate(places):
        head.location.x = x
        head.keyframe_insert("location", index=0, frame=frame)


def _segments(grid: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(grid, axis=1), axis=2)
