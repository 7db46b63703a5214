"""The nearest surface at the centre of each pixel, and passes for compositors from it: object,
strand, motion and normal.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from ..strands.catmull_rom import catmull_rom, catmull_rom_derivative
from ..strands.vectors import unit
from .camera import Camera
from .camera_window import view_depth
from .scene_snapshot import SceneSnapshot
from .snapshot import Snapshot

#: distance [m] of pixels without a surface, as in Blender's engines; and distance of the
#: background, so far away that only rotations of the camera move it
FAR_AWAY, _BACKGROUND = 1.0e10, 1.0e9


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest surface of each pixel. All arrays are (height, width), row 0 at the bottom.

    depth: of the depth buffer, in [0, 1]; 1 where there is no surface.
    mesh, groom: indices into those of the scene, -1 for none. At most one of them is not -1.
    strand, place: index of the groom's strand, -1 for none; and the place along its points, 0 at
        the first and 1 at the last, with equal steps from point to point.
    """

    depth: Floats
    mesh: Ints
    groom: Ints
    strand: Ints
    place: Floats

    def of_hair(self) -> Nearest:
        """The same where hair is nearest, and no surface elsewhere."""
        is_hair = self.groom >= 0
        return replace(
            self, depth=np.where(is_hair, self.depth, 1.0), mesh=np.full_like(self.mesh, -1)
        )

    def distances(self, camera: Camera) -> Floats:
        """Distances along the view [m]."""
        far = view_depth(camera, self.depth)
        return np.where(self.depth < 1.0, far, FAR_AWAY).astype(np.float32)

    def object_numbers(self, scene: SceneSnapshot) -> Floats:
        """Object numbers in the shape of `depth`, 0 where there is no surface."""
        found = np.zeros(self.depth.shape, np.float32)
        for indices, drawn in ((self.mesh, scene.meshes), (self.groom, scene.grooms)):
            numbers = np.array([0, *(each.number for each in drawn)], np.float32)
            found += numbers[indices + 1]
        return found

    def strand_numbers(self) -> Floats:
        """Numbers of strands in their groom from 1 on, in the shape of `depth`; 0 where there is no
        strand."""
        return (self.strand + 1).astype(np.float32)

    def on_strands(
        self, grooms: Sequence[Snapshot], meshes: Floats, *, slope: bool = False
    ) -> Floats:
        """Positions of the nearest strands, (height, width, 3) [m, world].

        Args:
            grooms: those of the scene, now or at another time.
            meshes: (height, width, 3), returned where no strand is nearest.
            slope: return the derivative along the strands instead.
        """
        found = np.array(meshes, np.float64)
        for index, groom in enumerate(grooms):
            here = (self.groom == index) & (self.strand >= 0)
            if here.any():
                curve = catmull_rom_derivative if slope else catmull_rom
                found[here] = curve(*_points_around(groom, self.strand[here], self.place[here]))
        return found

    def normals(self, scene: SceneSnapshot, camera: Camera, meshes: Floats) -> Floats:
        """Unit normals towards the eye, (height, width, 3), world space; 0 without a surface.

        The normal of a strand is the direction across it that is nearest to that towards the eye.

        Args:
            meshes: (height, width, 3), normals of the nearest meshes, of any length.
        """
        height, width = self.depth.shape
        to_eye = camera.eye[:3] - camera.eye[3] * unprojected(camera, self.depth)
        grooms = [groom.snapshot for groom in scene.grooms]
        along = unit(self.on_strands(grooms, np.zeros((height, width, 3)), slope=True))
        across = to_eye - along * (along * to_eye).sum(axis=2, keepdims=True)
        outward = np.where((meshes * to_eye).sum(axis=2, keepdims=True) < 0.0, -1.0, 1.0)
        is_strand, is_mesh = (self.strand >= 0)[..., None], (self.mesh >= 0)[..., None]
        found = np.where(is_strand, across, np.where(is_mesh, meshes * outward, 0.0))
        return unit(found).astype(np.float32)


@dataclass(frozen=True, eq=False)
class SceneAtTime:
    """The objects of the current scene at another time.

    meshes: (vertex_count, 3) of each mesh at that time [m, world]. grooms: at that time.
    """

    camera: Camera
    meshes: tuple[Floats, ...]
    grooms: tuple[Snapshot, ...]

    @classmethod
    def of(cls, scene: SceneSnapshot, other_scene: SceneSnapshot, camera: Camera) -> SceneAtTime:
        """Objects that do not exist in `other_scene`, or have other points, stay where they are
        now."""
        meshes = {mesh.key: mesh.surface.positions for mesh in other_scene.meshes}
        grooms = {groom.key: groom.snapshot for groom in other_scene.grooms}
        return cls(
            camera,
            tuple(
                _if_same_shape(meshes.get(mesh.key), mesh.surface.positions)
                for mesh in scene.meshes
            ),
            tuple(_at_other_time(groom.snapshot, grooms.get(groom.key)) for groom in scene.grooms),
        )


def background(camera: Camera, depth: Floats) -> Floats:
    """Places far behind all surfaces, for pixels without one, (height, width, 3)."""
    behind = unprojected(camera, np.ones_like(depth))
    away = behind - camera.eye[:3]
    return behind if camera.eye[3] == 0.0 else camera.eye[:3] + _BACKGROUND * unit(away)


def motion(before: Floats, now: Floats, after: Floats) -> Floats:
    """Blender's Vector pass: the displacement of each pixel's content from now to the previous
    frame, and from the next frame to now, (height, width, 4) [pixels].

    Args:
        before, now, after: places in the picture at these times, (height, width, 2) [pixels].
    """
    return np.concatenate([before - now, now - after], axis=2).astype(np.float32)


def projected(camera: Camera, points: Floats, size: tuple[int, int]) -> Floats:
    """Places in a picture of this size, (height, width, 2) [pixels] from its lower left corner.

    Args:
        points: (height, width, 3) [m, world].
    """
    matrix = np.asarray(camera.projection, np.float64) @ np.asarray(camera.view, np.float64)
    clip = points @ matrix[:, :3].T + matrix[:, 3]
    away = clip[..., 3:]
    behind_eye = np.abs(away) < 1.0e-12
    return np.asarray((0.5 + 0.5 * clip[..., :2] / np.where(behind_eye, 1.0, away)) * size)


def unprojected(camera: Camera, depth: Floats) -> Floats:
    """Positions of the values of a depth buffer, (height, width, 3) [m, world]."""
    height, width = depth.shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    clip = np.stack([2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * depth - 1.0, np.ones_like(x)], axis=2)
    matrix = np.asarray(camera.projection, np.float64) @ np.asarray(camera.view, np.float64)
    found = clip @ np.linalg.inv(matrix).T
    return np.asarray(found[..., :3] / found[..., 3:])


def _points_around(groom: Snapshot, strand: Ints, place: Floats) -> tuple[list[Floats], Floats]:
    """The four points around places on strands, (n, 3) each, and the fraction between the middle
    two, (n, 1); strands are extended straight beyond their ends."""
    first = groom.layout.offsets[strand].astype(np.int64)
    last = groom.layout.counts[strand].astype(np.int64) - 1
    along = place.astype(np.float64) * last
    segment = np.minimum(along.astype(np.int64), last - 1)
    points = np.asarray(groom.points, np.float64)
    start, end = points[first + segment], points[first + segment + 1]
    before = points[first + np.maximum(segment - 1, 0)]
    after = points[first + np.minimum(segment + 2, last)]
    before = np.where((segment == 0)[:, None], 2.0 * start - end, before)
    after = np.where((segment == last - 1)[:, None], 2.0 * end - start, after)
    return [before, start, end, after], (along - segment)[:, None]


def _if_same_shape(other: Floats | None, current: Floats) -> Floats:
    return current if other is None or other.shape != current.shape else other


def _at_other_time(current: Snapshot, other: Snapshot | None) -> Snapshot:
    return current if other is None or not other.layout.has_same_counts(current.layout) else other
