"""The collider of one object: a shape, and its transform in each frame."""

from __future__ import annotations

from dataclasses import dataclass, field
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
from ...dynamics.settings import DynamicsSettings
from ...dynamics.trajectory import curvature
from ...strands import Surface
from ...strands.affine import moved
from .carriers import Carrier, scales_of
from .fields import field_of

#: A mesh that returns to its rest within this part of its extent is the same mesh.
_SAME_SHAPE = 1.0e-5
#: Axes whose lengths differ by less than this fraction count as equal.
_EVEN = 0.01


class Part(Protocol):
    """One collider of a groom.

    name: of the object that it is made of, or of one of them.
    uid: the object's session number, or None where it is made of several.
    track: where it was in the last two frames.
    warnings: object -> what the artist should know since it was last seen.
    """

    track: Track
    warnings: dict[str, str]

    @property
    def name(self) -> str: ...

    @property
    def uid(self) -> int | None: ...

    def now(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        """The collider, and its matrix (4, 4) to world space.

        Raises:
            HairloomError: it is gone, or it is another mesh.
        """


@dataclass
class Track:
    """Matrices (4, 4) of the frames before, None where there was none.

    duration: [s] of the last frame.
    """

    before: Floats | None = None
    earlier: Floats | None = None
    duration: float = 0.0

    def rest(self, matrix: Floats) -> None:
        self.before, self.earlier, self.duration = matrix, None, 0.0

    def go(self, collider: Collider, matrix: Floats, duration: float) -> PosedCollider:
        """The trajectory since the previous frame, by the same formula as the roots'."""
        if self.before is None:
            self.rest(matrix)
        assert self.before is not None
        bent = None
        if self.earlier is not None and duration:
            bent = curvature(self.earlier, self.before, matrix, self.duration / duration)
        posed = PosedCollider(collider, self.before, matrix, bent)
        self.earlier, self.before, self.duration = self.before, matrix, duration
        return posed


@dataclass
class FieldPart:
    """A mesh, as its signed distance in world space with the mesh at rest.

    surface: world space at rest; its field takes a second to build.
    """

    carrier: Carrier
    surface: Surface
    distance: DistanceField
    resolution: int
    track: Track = field(default_factory=Track)
    warnings: dict[str, str] = field(default_factory=dict)

    @classmethod
    def new(
        cls, carrier: Carrier, surface: Surface, settings: DynamicsSettings, *, blocking: bool
    ) -> FieldPart:
        """As `fields.field_of`."""
        made = field_of(surface, settings, place=carrier.body.handle.name, blocking=blocking)
        return cls(carrier, surface, made, settings.collider_resolution)

    @property
    def name(self) -> str:
        return self.carrier.body.handle.name

    @property
    def uid(self) -> int | None:
        return self.carrier.body.handle.uid

    def now(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        matrix = self.carrier.moved(depsgraph)
        self.warnings.clear()
        if self.carrier.bends:
            self.warnings[self.name] = (
                f"{self.name}: it bends by {self.carrier.bend * 1000.0:.0f} mm, which its rigid "
                "collider does not follow. Fit spheres to it."
            )
        return self.distance, matrix

    def is_of(self, surface: Surface, matrix: Floats, settings: DynamicsSettings) -> bool:
        """Whether it was made from this mesh, before `matrix` (4, 4) moved it from its rest."""
        if (
            self.resolution != settings.collider_resolution
            or self.surface.positions.shape != surface.positions.shape
            or self.surface.triangles.shape != surface.triangles.shape
        ):
            return False
        here = moved(self.surface.positions, matrix)
        extent = float(np.linalg.norm(np.ptp(here, axis=0)))
        tolerance = _SAME_SHAPE * extent + 1.0e-6 * float(np.abs(here).max(initial=0.0))
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

    def now(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        return self.shape, self.carrier.moved(depsgraph) @ self.base


def is_solid_scale(matrix: Floats) -> Bools:
    """Whether each matrix (..., 4, 4) is finite and its volume is not zero."""
    linear = matrix[..., :3, :3]
    is_finite = np.isfinite(matrix).all(axis=(-2, -1))
    linear = np.where(is_finite[..., None, None], linear, 0.0)
    size = np.linalg.svd(linear, compute_uv=False)
    result: Bools = size[..., 2] > 1.0e-6 * size[..., 0]
    return result


def is_round(matrix: Floats) -> bool:
    """Whether a matrix (4, 4) scales evenly, so that a ball stays a ball."""
    size = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(size[0] - size[2] <= _EVEN * size[0])


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


def used_box(surface: Surface) -> tuple[Floats, Floats]:
    """Lowest and highest corner, (3,) each, of the vertices that belong to faces."""
    used: Ints = np.unique(surface.triangles)
    return surface.positions[used].min(axis=0), surface.positions[used].max(axis=0)
