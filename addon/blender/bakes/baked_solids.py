"""The colliders of a baked groom to and from arrays, so that cards are led out of the same ones.

    mesh_0_positions, mesh_0_triangles, ...  meshes at rest, once; distance fields are rebuilt
    solids          (k, 4) int32: kind, mesh, first row and row count of each collider; rows
                    are those of solid_shapes for meshes, of solid_balls for others
    solid_matrices  (k, 4, 4) to world space
    solid_balls     (n, 4) float32: centre and radius of balls; a capsule has two
    solid_shapes    (m, 3) float32: vertices of deformed meshes, in the space of the mesh

The same arrays with the prefix `start_` hold the colliders where the motion began.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from ...arrays import Floats
from ...dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from ...dynamics.colliders.deformed_field import DeformedField
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...rig_flow import MotionStart, Pose, Solids
from ...strands import Surface
from ..colliders.fields import NotReadyError, field_of
from .simulation import Arrays

_BALL, _CAPSULE, _BALLS, _MESH = range(4)
_START_PREFIX = "start_"
#: arrays whose length may differ between frames
VARIABLE_LENGTH = frozenset({"solids", "solid_matrices", "solid_balls", "solid_shapes"})


def solid_constants(
    start: MotionStart, meshes: Sequence[Surface], settings: DynamicsSettings
) -> Arrays:
    """The arrays that all frames share.

    Args:
        meshes: those of all mesh colliders, at rest.
    """
    arrays: Arrays = {
        "max_clearance": np.array(start.max_clearance),
        "collider_resolution": np.array(settings.collider_resolution),
        f"{_START_PREFIX}matrix": np.asarray(start.pose.matrix, np.float64),
    }
    for name, array in (("head", start.pose.head_positions), ("anchors", start.pose.anchors)):
        if array is not None:
            arrays[_START_PREFIX + name] = array
    for number, mesh in enumerate(meshes):
        arrays[f"mesh_{number}_positions"] = mesh.positions
        arrays[f"mesh_{number}_triangles"] = mesh.triangles
    found = solid_arrays(start.colliders, meshes)
    return arrays | {_START_PREFIX + name: array for name, array in found.items()}


def solid_arrays(colliders: Sequence[PosedCollider], meshes: Sequence[Surface]) -> Arrays:
    """The arrays of colliders at the end of their frame; meshes as for `solid_constants`."""
    solids: list[tuple[int, int, int, int]] = []
    balls: list[Floats] = [np.zeros((0, 4))]
    shapes: list[Floats] = [np.zeros((0, 3))]
    for posed in colliders:
        collider = posed.collider
        if isinstance(collider, DistanceField):
            number, shape = _mesh_and_shape(collider, meshes)
            solids.append((_MESH, number, sum(map(len, shapes)), len(shape)))
            shapes.append(shape)
            continue
        if isinstance(collider, SphereCollider):
            kind, rows = _BALL, _rows([collider.center], [collider.radius])
        elif isinstance(collider, CapsuleCollider):
            kind, rows = _CAPSULE, _rows([collider.start, collider.end], [collider.radius] * 2)
        else:
            assert isinstance(collider, SphereSetCollider)
            kind, rows = _BALLS, _rows(collider.centers, collider.radii)
        solids.append((kind, 0, sum(map(len, balls)), len(rows)))
        balls.append(rows)
    matrices = [posed.matrix_now for posed in colliders]
    return {
        "solids": np.array(solids, np.int32).reshape(-1, 4),
        "solid_matrices": np.array(matrices, np.float64).reshape(-1, 4, 4),
        "solid_balls": np.concatenate(balls).astype(np.float32),
        "solid_shapes": np.concatenate(shapes).astype(np.float32),
    }


def _rows(centers: Sequence[Floats] | Floats, radii: Sequence[float] | Floats) -> Floats:
    """Balls, (n, 4)."""
    return np.concatenate([np.asarray(centers), np.asarray(radii)[:, None]], axis=1)


def interpolated_solids(frame: Arrays, there: Arrays, fraction: float) -> Arrays:
    """The arrays of `solid_arrays`, linearly interpolated between two frames; those of the first
    one where a collider was added or removed."""
    if "solids" not in frame or not np.array_equal(frame["solids"], there["solids"]):
        return frame
    moving = VARIABLE_LENGTH - {"solids"}
    return frame | {name: frame[name] + (there[name] - frame[name]) * fraction for name in moving}


def _mesh_and_shape(field: DistanceField, meshes: Sequence[Surface]) -> tuple[int, Floats]:
    """The number of the mesh that a field was made from, and its vertices, none if at rest."""
    assert field.surface is not None, "fields of scenes know their meshes"
    shape = field.surface.positions
    alike = (
        (float(np.abs(mesh.positions - shape).max(initial=0.0)), number)
        for number, mesh in enumerate(meshes)
        if mesh.positions.shape == shape.shape
    )
    away, number = min(alike)
    return number, shape if away else shape[:0]


@dataclass(frozen=True, eq=False)
class BakedSolids:
    """The colliders of a bake; distance fields are made when a frame first needs them.

    constants: those of the bake.
    """

    constants: Arrays

    @classmethod
    def of(cls, constants: Arrays) -> Self | None:
        """None for a bake without colliders, or of a version that did not keep them."""
        return cls(constants) if f"{_START_PREFIX}solids" in constants else None

    def at(self, frame: Arrays, *, blocking: bool) -> Solids | None:
        """The colliders of a frame; None where it has none.

        Args:
            blocking: False: there are no colliders until all fields are made.
        """
        return _FrameSolids(self, frame, blocking) if "solids" in frame else None

    @cached_property
    def motion_start(self) -> MotionStart:
        """Where the motion began.

        Raises:
            HairloomError: the bake is damaged, or a mesh cannot be a collider.
        """
        known = self.constants
        try:
            own = {name: known[_START_PREFIX + name] for name in VARIABLE_LENGTH}
            head, anchors = (known.get(_START_PREFIX + name) for name in ("head", "anchors"))
            pose = Pose(head, known[f"{_START_PREFIX}matrix"], anchors)
            max_clearance = float(known["max_clearance"])
        except (KeyError, ValueError, TypeError) as error:
            raise _damaged(error) from error
        return MotionStart(pose, self.colliders(own, blocking=True), max_clearance)

    def colliders(self, frame: Arrays, *, blocking: bool) -> tuple[PosedCollider, ...]:
        """The colliders where they are in a frame.

        Raises:
            HairloomError: as `motion_start`.
            NotReadyError: a field is being made, and the call is not blocking.
        """
        try:
            solids, matrices = frame["solids"].tolist(), frame["solid_matrices"]
            return tuple(
                PosedCollider(self._collider(row, frame, blocking), matrix, matrix)
                for row, matrix in zip(solids, matrices, strict=True)
            )
        except (KeyError, ValueError, IndexError) as error:
            raise _damaged(error) from error

    def _collider(self, row: list[int], frame: Arrays, blocking: bool) -> Collider:
        kind, mesh, first, count = row
        if kind == _MESH:
            shape = frame["solid_shapes"][first : first + count]
            bent = self._deformable_field(mesh, blocking)
            return bent.at(shape) if count else bent.field
        rows = frame["solid_balls"][first : first + count]
        if kind == _BALL:
            return SphereCollider(rows[0, :3], float(rows[0, 3]))
        if kind == _CAPSULE:
            return CapsuleCollider(rows[0, :3], rows[1, :3], float(rows[0, 3]))
        return SphereSetCollider(rows[:, :3], rows[:, 3])

    def _deformable_field(self, number: int, blocking: bool) -> DeformedField:
        """The field of a mesh that may deform."""
        if number not in self._fields:
            named = (self.constants[f"mesh_{number}_{name}"] for name in ("positions", "triangles"))
            surface = Surface(*named)
            settings = DynamicsSettings(
                collider_resolution=int(self.constants["collider_resolution"])
            )
            field = field_of(surface, settings, place="bake", blocking=blocking)
            self._fields[number] = DeformedField(field, surface)
        return self._fields[number]

    @cached_property
    def _fields(self) -> dict[int, DeformedField]:
        return {}


@dataclass(frozen=True, eq=False)
class _FrameSolids:
    """Implements `Solids`."""

    bake: BakedSolids
    frame: Arrays
    is_blocking: bool

    @property
    def motion_start(self) -> MotionStart:
        return self.bake.motion_start

    @cached_property
    def colliders(self) -> tuple[PosedCollider, ...]:
        try:
            return self.bake.colliders(self.frame, blocking=self.is_blocking)
        except NotReadyError:
            return ()


def _damaged(error: Exception) -> HairloomError:
    return HairloomError(f"its colliders are damaged ({error})", place="bake", remedy="Bake again")
