"""Moving solids: the collider protocol, its path during a frame, and its poses on that path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...strands.vectors import dot_rows
from ..rigid_path import RigidMotion, RigidPath
from ..trajectory import curvature, value_at

#: A collider whose smallest scale is below this fraction of the largest is flat, as when it is
#: mirrored within a frame. Then it does not collide.
MIN_SCALE_RATIO = 1.0e-3
#: Lengths below this count as zero [m].
TINY = np.float32(1.0e-12)


class Collider(Protocol):
    """A solid in its own object space that provides signed distances (negative inside)."""

    @property
    def bounds(self) -> tuple[Floats, float]:
        """Center (3,) and radius [m] of a sphere around it."""

    @property
    def curve_radius(self) -> float:
        """Approximately the smallest radius of its convex parts [m]: a straight line of length c
        between two points outside of it enters it by no more than about c^2 / (8 curve_radius)."""

    def near(self, points: Floats, reach: Floats | float) -> Ints:
        """Indices of the points (3, n) that may be closer than `reach` [m], one or (n,) float32; a
        fast conservative test."""

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """Signed distance [m] (n,) at the points (3, n), and its gradient (3, n)."""


@dataclass(frozen=True, eq=False)
class PosedCollider:
    """A collider and its path during one frame.

    matrix_before, matrix_now: (4, 4) affine, object to world, at the frame's begin and end.
    matrix_earlier: (4, 4), the same one frame earlier, which bends its path, see
        `trajectory.curvature`; None: straight.
    earlier_ratio: duration of the frame before, over that of this one.
    deformation: maximum distance [m] that its surface has moved in the frame by a change of shape;
        points that this has swallowed are moved out at once.

    Raises:
        HairloomError: a matrix that is not finite or flattens the collider.
    """

    collider: Collider
    matrix_before: Floats
    matrix_now: Floats
    matrix_earlier: Floats | None = None
    earlier_ratio: float = 1.0
    deformation: float = 0.0

    def __post_init__(self) -> None:
        for name in ("matrix_before", "matrix_now", "matrix_earlier"):
            if getattr(self, name) is None:
                continue
            matrix = np.asarray(getattr(self, name), np.float64)
            object.__setattr__(self, name, matrix)
            if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
                raise _broken("its matrix is not a finite 4 by 4 matrix")
            if np.linalg.cond(matrix[:3, :3]) > 1.0e6:
                raise _broken("its scale is zero")

    def at_begin(self) -> PosedCollider:
        """The collider at rest in its place at the frame's begin."""
        return PosedCollider(self.collider, self.matrix_before, self.matrix_before)

    def at_end(self) -> PosedCollider:
        """The collider at rest in its place at the frame's end."""
        return PosedCollider(self.collider, self.matrix_now, self.matrix_now)

    def is_same_at_end(self, other: PosedCollider) -> bool:
        """Whether both are the same collider, at the same place at the frame's end."""
        is_same = self.collider is other.collider
        return is_same and np.array_equal(self.matrix_now, other.matrix_now)

    def matrix_at(self, moment: float) -> Floats:
        """Object to world (4, 4) float64 at `moment`, 0 the frame's begin and 1 its end."""
        before, displacement, bent = self._relative_matrices
        matrix = value_at(before, displacement, bent, moment)
        if self._arc is None:
            return matrix
        times = np.ravel(moment).tolist()
        places = [_matrix_of(self._arc.at(each)) for each in times]
        return np.reshape(places, (*np.shape(moment)[:-2], 4, 4)) @ matrix

    @cached_property
    def _arc(self) -> RigidPath | None:
        """Its rigid path; None if it turns too little for its arc to matter, or is mirrored."""
        others = (self.matrix_now, self.matrix_earlier)
        axes = [each[:3, :3] for each in others if each is not None]
        if all(np.array_equal(each, self.matrix_before[:3, :3]) for each in axes):
            return None
        now, earlier = (
            None if matrix is None else _rigid_between(self.matrix_before, matrix)
            for matrix in (self.matrix_now, self.matrix_earlier)
        )
        if now is None or (earlier is None and self.matrix_earlier is not None):
            return None
        path = RigidPath(now, earlier, self.earlier_ratio)
        return path if path.is_arc else None

    @cached_property
    def _relative_matrices(self) -> tuple[Floats, Floats, Floats | None]:
        """Its matrix at the begin, the change to the end, and its curvature, relative to `_arc`."""
        before, now, earlier = self.matrix_before, self.matrix_now, self.matrix_earlier
        if self._arc is not None:
            now = _matrix_of(self._arc.now.inverse) @ now
            if earlier is not None and self._arc.earlier is not None:
                earlier = _matrix_of(self._arc.earlier.inverse) @ earlier
        bent = None if earlier is None else curvature(earlier, before, now, self.earlier_ratio)
        return before, now - before, bent

    def poses(self, spans: list[tuple[float, float]]) -> list[Pose | None]:
        """Its pose after each substep; None where it is flat.

        Args:
            spans: begin and end of the substeps as fractions of the frame.
        """
        times: Any = np.array(spans).T[..., None, None]  # matrix_at also broadcasts over arrays
        before, now = self.matrix_at(times)
        center, radius = self.collider.bounds
        centers = (now[:, :3, :3] @ center + now[:, :3, 3]).astype(np.float32)
        scales = np.linalg.svd(now[:, :3, :3], compute_uv=False)
        is_flat = scales[:, -1] <= MIN_SCALE_RATIO * scales[:, 0]
        displacements = (now - before).astype(np.float32)
        now[is_flat] = np.eye(4)
        inverses = np.linalg.inv(now).astype(np.float32)
        travel = travels(now - before, center, radius)
        return [
            None
            if is_flat[i]
            else Pose(
                self.collider,
                inverses[i],
                displacements[i],
                centers[i],
                radius * largest,
                smallest,
                float(travel[i]),
                now[i],
                before[i],
                self.deformation,
            )
            for i, (largest, _, smallest) in enumerate(scales.tolist())
        ]


def _rigid_between(before: Floats, now: Floats) -> RigidMotion | None:
    """The rigid part of the motion from one matrix to another; None if it mirrors.

    It moves the object's origin exactly; any other difference is a change of shape.
    """
    motion = now[:3, :3] @ np.linalg.inv(before[:3, :3])
    left, _, right = np.linalg.svd(motion)
    rotation = left @ right
    if np.linalg.det(rotation) < 0.0:
        return None
    return RigidMotion(rotation, now[:3, 3] - rotation @ before[:3, 3])


def _matrix_of(place: RigidMotion) -> Floats:
    """The (4, 4) matrix of a rigid motion."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = place.rotation, place.shift
    return matrix


@dataclass(frozen=True)
class Pose:
    """A collider at the end of a substep.

    inverse: (4, 4) float32, world to object. displacement: (4, 4) float32, change of the matrix
        from object to world in the substep.
    center, radius: (3,) float32 world [m], and [m], of a bounding sphere.
    scale: the smallest scale of the matrix in any direction.
    travel: [m], upper limit of the distance that any of its points moves in the substep.
    matrix, matrix_before: (4, 4) float64, object to world at the substep's end and begin.
    deformation: see `PosedCollider`.
    is_part: whether it is at the end of a part of the substep, see `part`.
    """

    collider: Collider
    inverse: Floats
    displacement: Floats
    center: Floats
    radius: float
    scale: float
    travel: float
    matrix: Floats
    matrix_before: Floats
    deformation: float = 0.0
    is_part: bool = False

    @cached_property
    def inverse_before(self) -> Floats:
        """(4, 4) float32, world to object at the substep's begin; see `inverse_or_fallback`."""
        return inverse_or_fallback(self.matrix_before, self.matrix).astype(np.float32)

    def part(self, number: int, count: int) -> Pose:
        """The pose at the end of one of `count` equal parts of the substep.

        Its inverse matrix is interpolated linearly, which is accurate as it turns little.
        """
        begin, end = (self._inverse_at((number + more) / count) for more in (0, 1))
        matrix, before = np.linalg.inv(end), np.linalg.inv(begin)
        return replace(
            self,
            inverse=end.astype(np.float32),
            displacement=self.displacement / np.float32(count),
            radius=self.radius + self.travel,
            matrix=matrix,
            matrix_before=before,
            deformation=self.deformation / count,
            is_part=True,
        )

    def _inverse_at(self, fraction: float) -> Floats:
        begin, end = (
            inverse_or_fallback(self.matrix_before, self.matrix),
            np.linalg.inv(self.matrix),
        )
        result: Floats = begin * (1.0 - fraction) + end * fraction
        return result


def travels(displacement: Floats, center: Floats, radius: float) -> Floats:
    """Upper limit of the distance [m] that any point of a ball moves, (n,), by changes of a matrix
    (n, 4, 4)."""
    linear = displacement[:, :3, :3]
    shift = linear @ center + displacement[:, :3, 3]
    turn = np.sqrt(np.einsum("nij,nij->n", linear, linear))
    result: Floats = np.sqrt(np.einsum("ni,ni->n", shift, shift)) + radius * turn
    return result


def inverse_or_fallback(matrix: Floats, other: Floats) -> Floats:
    """The inverse of a matrix (4, 4), or of the other one, which is not flat, if the first is flat
    or turned relative to it by a right angle or more: interpolating both inverses could then give a
    flat one."""
    turn = np.linalg.eigvals(np.linalg.inv(other)[:3, :3] @ matrix[:3, :3])
    is_near = turn.real.min() > MIN_SCALE_RATIO * np.abs(turn).max()
    result: Floats = np.linalg.inv(matrix if is_near else other)
    return result


def poses_through(
    colliders: tuple[PosedCollider, ...], spans: list[tuple[float, float]]
) -> list[list[Pose]]:
    """The poses of all colliders after each substep, without those that are flat then."""
    found = [posed.poses(spans) for posed in colliders]
    return [
        [pose for pose in (poses[number] for poses in found) if pose is not None]
        for number in range(len(spans))
    ]


def near_points(
    pose: Pose, position: Floats, reach: Floats, margin: Floats | float = 0.0
) -> tuple[Ints, Floats, Floats]:
    """Points (3, n) world that may be within `reach` (n,) plus `margin`, one or (n,), [m].

    Tests a bounding sphere first, then `Collider.near`.

    Returns:
        Their indices (m,), their places in object space (3, m), and reach plus beyond (m,) [m].
    """
    offset = position - pose.center[:, None]
    farthest = pose.radius + float(reach.max()) + float(np.max(margin))
    index = (dot_rows(offset, offset) < np.float32(farthest * farthest)).nonzero()[0]
    reach = reach.take(index)
    reach += np.float32(margin) if np.ndim(margin) == 0 else np.take(margin, index)
    local = transform_points(pose.inverse, position.take(index, axis=1, mode="clip"))
    kept = pose.collider.near(local, reach / np.float32(pose.scale))
    return index.take(kept), local.take(kept, axis=1, mode="clip"), reach.take(kept)


def world_distance(pose: Pose, local: Floats, min_gradient: float = 0.0) -> tuple[Floats, Floats]:
    """Signed distance (n,) [m] and unit normal outwards (3, n), in world space, at points (3, n) in
    object space.

    The gradient is transformed by the inverse transposed, and its length is the scale of the
    distance along it.

    Args:
        min_gradient: minimum length of the gradient in object space: a sampled one is short where
            two sides of the collider are equally near, and distances would have no bound there.
    """
    distance, gradient = pose.collider.distance(local)
    normal = np.einsum("ji,jn->in", pose.inverse[:3, :3], gradient)
    scale = np.maximum(np.sqrt(dot_rows(normal, normal)), TINY)
    normal /= scale
    if min_gradient:
        length = np.sqrt(dot_rows(gradient, gradient))
        scale *= np.maximum(np.float32(min_gradient) / np.maximum(length, TINY), np.float32(1.0))
    distance /= scale
    return distance, normal


def transform_points(matrix: Floats, points: Floats) -> Floats:
    """Points (3, n) moved by an affine (4, 4) matrix, float32, without BLAS."""
    rows = np.asarray(matrix, np.float32)
    result: Floats = np.einsum("ij,jn->in", rows[:3, :3], points)
    result += rows[:3, 3:]
    return result


def _broken(problem: str) -> HairloomError:
    return HairloomError(
        problem, place="collider", remedy="Apply or correct the collider's transform"
    )
