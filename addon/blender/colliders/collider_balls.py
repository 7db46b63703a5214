"""Many balls as one collider: empties shown as spheres, such as fitted sets."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ...arrays import Floats
from ...dynamics.colliders import Collider, SphereSetCollider
from ...dynamics.fitting.similarity import fit_similarity
from ...errors import HairloomError
from ...strands.affine import mean_scale, transform_points
from ..base.objects import Body, matrix_of
from .carriers import is_disabled
from .collider_parts import Track, is_invertible

#: A set is unchanged if its balls moved relative to each other by less than this fraction of the
#: largest radius.
_SET_TOLERANCE = 1.0e-3


@dataclass(frozen=True)
class Ball:
    """A ball that moves with an object. center: (3,), radius: object space [m]."""

    body: Body
    center: Floats
    radius: float


@dataclass
class BallsPart:
    """Balls that move together, as one collider.

    Its matrix is the similarity transform that fits the motion of the balls best. If a remainder is
    left, as on skin that deforms, a new set of balls is built.

    rest: (n, 4, 4) the objects' matrices at rest.
    """

    balls: list[Ball]
    rest: Floats
    track: Track = field(default_factory=Track)
    warnings: dict[str, str] = field(default_factory=dict)
    _set: SphereSetCollider | None = None
    _members: tuple[int, ...] = ()

    @classmethod
    def new(cls, balls: list[Ball], depsgraph: bpy.types.Depsgraph) -> BallsPart:
        return cls(balls, np.array([matrix_of(ball.body.resolve(), depsgraph) for ball in balls]))

    @property
    def name(self) -> str:
        return self.balls[0].body.handle.name

    @property
    def uid(self) -> int | None:
        return None

    def evaluate(self, depsgraph: bpy.types.Depsgraph) -> tuple[Collider, Floats]:
        chosen, matrices = self._usable(depsgraph)
        if not chosen:
            raise HairloomError(
                "this ball and those beside it are gone or hidden",
                place=self.name,
                remedy="Show them, or press Play again",
            )
        here = np.array(matrices)
        center = np.array([self.balls[i].center for i in chosen])
        radius = np.array([self.balls[i].radius for i in chosen])
        now = _markers(center, radius, here)
        fit = fit_similarity(_markers(center, radius, self.rest[chosen]), now)
        matrix = np.eye(4) if fit is None else fit.matrix
        size = np.cbrt(np.abs(np.linalg.det(here[:, :3, :3])))
        centers = transform_points(now[::4].astype(np.float32), np.linalg.inv(matrix))
        radii = radius * size / mean_scale(matrix)
        return self._set_of(centers, radii, tuple(chosen)), matrix

    def deformation(self) -> float:
        return 0.0

    def _usable(self, depsgraph: bpy.types.Depsgraph) -> tuple[list[int], list[Floats]]:
        """The indices of the balls that can be used, and their matrices."""
        self.warnings.clear()
        chosen, matrices = [], []
        for number, ball in enumerate(self.balls):
            obj, name = ball.body.handle.find(), ball.body.handle.name
            if obj is None or is_disabled(obj, depsgraph):
                self.warnings[name] = f"{name}: it is gone or hidden, so nothing collides with it."
            else:
                chosen.append(number)
                matrices.append(matrix_of(obj, depsgraph))
        are_usable = is_invertible(np.array(matrices).reshape(-1, 4, 4))
        for number in np.array(chosen, int)[~are_usable]:
            name = self.balls[number].body.handle.name
            self.warnings[name] = f"{name}: its scale is zero. Correct its scale."
        rows = np.flatnonzero(are_usable)
        return [chosen[i] for i in rows], [matrices[i] for i in rows]

    def _set_of(
        self, centers: Floats, radii: Floats, members: tuple[int, ...]
    ) -> SphereSetCollider:
        """A set of balls; the previous one if it differs by rounding only, since a new one has to
        build its grid."""
        previous = self._set
        if previous is not None and members == self._members:
            tolerance = _SET_TOLERANCE * float(radii.max())
            same = np.allclose(previous.centers, centers, rtol=0.0, atol=tolerance)
            if same and np.allclose(previous.radii, radii, rtol=1.0e-3, atol=0.0):
                return previous
        self._set, self._members = SphereSetCollider(centers, radii), members
        return self._set


def _markers(center: Floats, radius: Floats, matrix: Floats) -> Floats:
    """(4 n, 3) points that move with n balls: the centres and one point on each axis, which give
    the rotation even of a single ball."""
    local = center[:, None] + radius[:, None, None] * np.vstack([np.zeros(3), np.eye(3)])
    world: Floats = local @ np.moveaxis(matrix[:, :3, :3], 1, 2) + matrix[:, None, :3, 3]
    return world.reshape(-1, 3)
