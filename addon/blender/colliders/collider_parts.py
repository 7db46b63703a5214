"""The collider of one object: a shape, and its transform in each frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import bpy
import numpy as np

from ...arrays import Bools, Floats, Ints
from ...dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
)
from ...dynamics.colliders.deformed_field import DeformedField
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...strands import Surface
from ...strands.affine import mean_scale, transform_points
from .carriers import Carrier, scales_of
from .fields import field_of

#: A mesh counts as the same if it differs from its rest by less than this fraction of its extent.
_SHAPE_TOLERANCE = 1.0e-5
#: Distance that counts as near the tracked vertices, in radii of a ball around them.
_NEAR_RADII = 3.0
#: A scale is even if its axes' lengths differ by less than this fraction.
_EVEN_TOLERANCE = 0.01


class Part(Protocol):
    """One collider of a groom.

    name: of its object, or of the first one.
    uid: the object's session number, or None if it consists of several objects.
    track: its matrices in the last two frames.
    warnings: object -> a warning for the artist, from the last call of `evaluate`.
    """

    track: Track
    warnings: dict[str, str]

    @property
    def name(self) -> str: ...

    @property
    def uid(self) -> int | None: ...

    def evaluate(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        """The collider in its present shape, and its matrix (4, 4) to world space; does not change
        `track`.

        Raises:
            HairloomError: it is gone, or it is another mesh.
        """

    def deformation(self) -> float:
        """`PosedCollider.deformation` since the last call of this."""


@dataclass
class Track:
    """Matrices (4, 4) of the last two frames, None where there was none.

    duration: [s] of the last frame.
    """

    before: Floats | None = None
    earlier: Floats | None = None
    duration: float = 0.0

    def reset(self, matrix: Floats) -> None:
        self.before, self.earlier, self.duration = matrix, None, 0.0

    def advance(
        self, collider: Collider, matrix: Floats, duration: float, deformation: float = 0.0
    ) -> PosedCollider:
        """The trajectory since the previous frame, with the same formula as for roots.

        Args:
            matrix: (4, 4), object to world, now.
            duration: of the frame [s].
        """
        if self.before is None:
            self.reset(matrix)
        assert self.before is not None
        earlier, ratio = None, 1.0
        if self.earlier is not None and duration:
            earlier, ratio = self.earlier, self.duration / duration
        posed = PosedCollider(collider, self.before, matrix, earlier, ratio, deformation)
        self.earlier, self.before, self.duration = self.before, matrix, duration
        return posed


@dataclass(frozen=True, eq=False)
class _LastShape:
    """A mesh when last evaluated. positions: (vertex_count, 3) [m] in its own space. scale: of that
    space."""

    positions: Floats
    scale: float


@dataclass
class FieldPart:
    """A mesh, as its signed distance in world space with the mesh at rest.

    surface: world space at rest; its field takes a second to build. If the mesh deforms, the field
    is updated around the vertices that have moved, which takes some hundredths of a second.
    """

    carrier: Carrier
    surface: Surface
    distance: DistanceField
    resolution: int
    track: Track = field(default_factory=Track)
    warnings: dict[str, str] = field(default_factory=dict)
    _last_shape: _LastShape | None = None
    _previous_positions: Floats | None = None
    _deformed_field: DeformedField | None = None
    _last_field: tuple[Floats, DistanceField] | None = None

    @classmethod
    def new(
        cls, carrier: Carrier, surface: Surface, settings: DynamicsSettings, *, blocking: bool
    ) -> FieldPart:
        """Raises and blocks as `fields.field_of`."""
        made = field_of(surface, settings, place=carrier.body.handle.name, blocking=blocking)
        return cls(carrier, surface, made, settings.collider_resolution)

    @property
    def name(self) -> str:
        return self.carrier.body.handle.name

    @property
    def uid(self) -> int | None:
        return self.carrier.body.handle.uid

    def evaluate(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        matrix, shape = (
            _checked_matrix(self.carrier.motion_from_rest(depsgraph), self.name),
            self.carrier.shape,
        )
        if shape is None:
            self._last_shape = None
            return self.distance, matrix
        local = transform_points(shape, np.linalg.inv(matrix)).astype(np.float32)
        self._last_shape = _LastShape(local, mean_scale(matrix))
        if self._deformed_field is None:
            self._deformed_field = DeformedField(self.distance, self.surface)
        if self._last_field is None or not np.array_equal(self._last_field[0], local):
            self._last_field = local, self._deformed_field.at(local)
        return self._last_field[1], matrix

    def deformation(self) -> float:
        before, now = self._previous_positions, self._last_shape
        self._previous_positions = None if now is None else now.positions
        if now is None:
            return 0.0
        path = now.positions - (self.surface.positions if before is None else before)
        path = path[self._is_near_tracked]
        return float(np.sqrt(np.einsum("ij,ij->i", path, path).max(initial=0.0))) * now.scale

    def take_deformed_field(self, other: FieldPart) -> None:
        """Take over the field of a part that was made from the same mesh, in its last shape."""
        self._deformed_field, self._last_field = other._deformed_field, other._last_field

    @cached_property
    def _is_near_tracked(self) -> Bools:
        """(vertex_count,) whether vertices are near the tracked ones, since the motion of hands,
        for example, does not matter to hair on a head."""
        tracked = self.carrier.rest
        if not len(tracked):
            return np.ones(len(self.surface.positions), bool)
        middle = tracked.mean(axis=0)
        reach = _NEAR_RADII * float(np.linalg.norm(tracked - middle, axis=1).max())
        result: Bools = np.linalg.norm(self.surface.positions - middle, axis=1) <= reach
        return result

    def was_made_from(self, surface: Surface, matrix: Floats, settings: DynamicsSettings) -> bool:
        """Whether this part was made from this mesh at rest, which `matrix` (4, 4) has moved."""
        if (
            self.resolution != settings.collider_resolution
            or self.surface.positions.shape != surface.positions.shape
            or self.surface.triangles.shape != surface.triangles.shape
        ):
            return False
        here = transform_points(self.surface.positions, matrix)
        extent = float(np.linalg.norm(np.ptp(here, axis=0)))
        tolerance = _SHAPE_TOLERANCE * extent + 1.0e-6 * float(np.abs(here).max(initial=0.0))
        return np.allclose(here, surface.positions, rtol=0.0, atol=tolerance)


@dataclass
class ShapePart:
    """A ball or a capsule in its own space. base: (4, 4), from that space to world at rest."""

    carrier: Carrier
    shape: SphereCollider | CapsuleCollider
    base: Floats
    track: Track = field(default_factory=Track)
    warnings: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.carrier.body.handle.name

    @property
    def uid(self) -> int | None:
        return self.carrier.body.handle.uid

    def evaluate(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        return self.shape, _checked_matrix(
            self.carrier.motion_from_rest(depsgraph), self.name
        ) @ self.base

    def deformation(self) -> float:
        return 0.0


def _checked_matrix(matrix: Floats, name: str) -> Floats:
    """The matrix, if it has a volume.

    Raises:
        HairloomError: it scales an axis to zero.
    """
    if not is_invertible(matrix):
        raise HairloomError("its scale is zero", place=name, remedy="Correct its scale")
    return matrix


def is_invertible(matrix: Floats) -> Bools:
    """Whether each matrix (..., 4, 4) is finite and its volume is not zero."""
    linear = matrix[..., :3, :3]
    is_finite = np.isfinite(matrix).all(axis=(-2, -1))
    linear = np.where(is_finite[..., None, None], linear, 0.0)
    size = np.linalg.svd(linear, compute_uv=False)
    result: Bools = size[..., 2] > 1.0e-6 * size[..., 0]
    return result


def is_evenly_scaled(matrix: Floats) -> bool:
    """Whether a matrix (4, 4) scales evenly, so that a ball stays a ball."""
    size = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(size[0] - size[2] <= _EVEN_TOLERANCE * size[0])


def capsule_of(low: Floats, high: Floats, matrix: Floats) -> tuple[CapsuleCollider, Floats]:
    """The capsule along a box's longest side, and its base (4, 4), without the object's scale.

    Args:
        low, high: (3,) corners of the box in object space.
        matrix: (4, 4) object to world; its scale is applied, so that the ends stay round.
    """
    scale = scales_of(matrix)
    half, middle = (high - low) * scale / 2.0, (high + low) * scale / 2.0
    longest = int(half.argmax())
    radius = float(np.delete(half, longest).max())
    to_end = np.zeros(3)
    to_end[longest] = half[longest] - radius
    base = matrix @ np.diag([*(1.0 / scale), 1.0])
    return CapsuleCollider(middle - to_end, middle + to_end, radius), base


def face_bounds(surface: Surface) -> tuple[Floats, Floats]:
    """Lowest and highest corner, (3,) each, of the vertices that belong to faces."""
    used: Ints = np.unique(surface.triangles)
    return surface.positions[used].min(axis=0), surface.positions[used].max(axis=0)
