"""The scene of the dynamics benchmarks: combed guides on a ball that oscillates.

A UV sphere of radius 0.1 m goes 0.3 m to either side, once a second. It does not ease in: it has
its full speed of 1.9 m/s in the first frame, the hardest case.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np
from shaken import GRAVITY

from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.dynamics.colliders import Collider, PosedCollider
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.strands import StrandSet, Surface

RADIUS, SWAY, RATE, LENGTH = 0.1, 0.3, 1.0, 0.24  # [m], [m], [1/s], [m]


def new_head() -> bpy.types.Object:
    """The ball as a mesh object, at rest in the origin of an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, segments=48, ring_count=24)
    return bpy.context.object


def surface_of(head: bpy.types.Object) -> Surface:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_surface(head, depsgraph, need_uv=False, place=head.name)


def guides_on(surface: Surface, count: int, cv_count: int = 16) -> StrandSet:
    """Combed hair of the scalp, every strand of it a guide."""
    settings = GrowSettings(strand_count=count, cv_count=cv_count, length=LENGTH)
    # marked as having widths: finding them would require the extension to be registered
    return replace(grow(surface, settings, scalp_density(surface)), has_widths=True)


def sway(time: float) -> float:
    """The head's x [m] at a time [s]."""
    return float(SWAY * np.sin(2.0 * np.pi * RATE * time))


@dataclass(frozen=True)
class Shake:
    """Guides (guide_count, cv_count, 3) at rest on the head, and what pushes them."""

    grid: np.ndarray
    colliders: tuple[Collider, ...]

    def drives(self, fps: float, seconds: float) -> Iterator[Drive]:
        """A drive for each frame, with trajectories bent as by `motion_flow.advance`."""
        places = [sway(frame / fps) for frame in range(round(seconds * fps) + 1)]
        earlier, before = None, self._carried(places[0])
        for frame in range(1, len(places)):
            # as in motion_flow, a frame begins with the array of the style at the end of the last
            # frame
            now = self._carried(places[frame])
            yield self._drive((earlier, before, now), places[max(frame - 2, 0) : frame + 1])
            earlier, before = before, now

    def _carried(self, x: float) -> np.ndarray:
        return self.grid + np.array([x, 0.0, 0.0], np.float32)

    def _drive(self, targets: tuple[np.ndarray | None, ...], places: list[float]) -> Drive:
        """The drive between the last two places of the head; a third, earlier one bends it."""
        matrices = [_moved(x) for x in places]
        since = matrices[0] if len(places) == 3 else None
        colliders = tuple(
            PosedCollider(one, matrices[-2], matrices[-1], since) for one in self.colliders
        )
        earlier, before, now = targets
        assert before is not None and now is not None
        return Drive(before, now, colliders, GRAVITY, earlier)


def depth_in(surface: Surface) -> Callable[[np.ndarray], float]:
    """A function for the exact depth [m] of the deepest of points (n, 3) in this convex mesh."""
    normals = surface.triangle_normals().astype(np.float64)
    is_valid = np.linalg.norm(normals, axis=1) > 0.5
    normals, corner = normals[is_valid], surface.corners[is_valid, 0].astype(np.float64)
    offset = np.einsum("ij,ij->i", normals, corner)

    def deepest(points: np.ndarray) -> float:
        inside = points[np.linalg.norm(points, axis=1) < RADIUS]
        if not len(inside):
            return 0.0
        return max(0.0, float(-(inside @ normals.T - offset).max(axis=1).min()))

    return deepest


def _moved(x: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix
