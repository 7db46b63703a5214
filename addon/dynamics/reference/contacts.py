"""Scalar reference of `contacts`, for one guide and one CV at a time; see there for the method."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats
from ..colliders import PosedCollider
from ..colliders.posed import MIN_SCALE_RATIO, inverse_or_fallback
from ..constraints import PINNED_COUNT
from ..contacts import (
    ALLOWED_DEPTH,
    CONTACT_MARGIN,
    FAST_SEGMENTS,
    MAX_SEGMENT_WEIGHT,
    MAX_TRACE_STEPS,
    SEGMENT_POINTS,
    SEGMENT_RADIUS,
    TOUCH_DISTANCE,
    max_untraced_squared,
)
from ..settings import DynamicsSettings


@dataclass(frozen=True)
class Substep:
    """A substep: begin and end as fractions of the frame; its time and length [s]."""

    begin: float
    end: float
    time: float
    dt: float


@dataclass
class Plane:
    """One contact: CV `cv`, or a point of the segment that ends there, must keep
    normal . x >= offset; see `contacts.Contacts`.

    along: fraction of the segment; 1 is the CV itself. weights: displacement of the previous CV and
        of the CV, over that of the point.
    """

    cv: int
    normal: Floats
    offset: float
    origin: Floats
    leads_out: bool
    touch_distance: float  # [m]
    allowed_depth: float  # [m]
    path: float  # [m] that its point has moved, relative to the collider
    along: float = 1.0
    weights: tuple[float, float] = (0.0, 1.0)
    push: float = 0.0

    def point(self, x: Floats) -> Floats:
        result: Floats = x[self.cv - 1] + (x[self.cv] - x[self.cv - 1]) * self.along
        return result

    def gap(self, x: Floats) -> float:
        return self.offset - float(self.normal @ self.point(x))

    def push_of(self, x: Floats, friction: float) -> tuple[Floats, bool]:
        """The displacement of its point (3,) [m], and whether it touches."""
        here, missing = self.point(x), self.gap(x)
        push = max(missing, 0.0)
        self.push += push
        there = here + self.normal * push
        slip = there - self.origin
        slip = slip - self.normal * (self.normal @ slip)
        length = max(float(np.linalg.norm(slip)), 1.0e-9)
        there = there - slip * min(friction * push / length, 1.0)
        return there - here, bool(missing > -self.touch_distance) and self.leads_out

    def move(self, x: Floats, push: Floats) -> None:
        x[self.cv - 1] += push * self.weights[0]
        x[self.cv] += push * self.weights[1]

    def absorb(self, x: Floats, previous: Floats) -> None:
        """Remove the speed that pushing out has caused."""
        if self.push > 0.0:
            away = float(self.normal @ (self.point(x) - self.origin))
            self.move(previous, self.normal * max(away, 0.0))


def push_out(planes: list[list[Plane]], x: Floats, friction: float) -> dict[int, Floats]:
    """Push all CVs out to their planes, in place; returns the normals of CVs that touch.

    Args:
        planes: for each collider those of CVs, then for each collider those of segments. All planes
            of a list are evaluated at the same x.
    """
    of_cvs: dict[int, Floats] = {}
    of_segments: dict[int, Floats] = {}
    for group in planes:
        found = [(plane, *plane.push_of(x, friction)) for plane in group]
        uppers: dict[int, Floats] = {}
        lowers: dict[int, Floats] = {}
        for plane, push, touches in found:
            plane.move(x, push)
            if plane.along == 1.0:
                if touches:
                    of_cvs[plane.cv] = plane.normal
            elif touches and plane.push > 0.0:
                uppers[plane.cv] = plane.normal
                if plane.weights[0] > 0.0:
                    lowers[plane.cv - 1] = plane.normal
        of_segments |= uppers | lowers
    return of_segments | of_cvs


def are_too_deep(planes: list[list[Plane]], x: Floats) -> bool:
    """Whether any point is farther below its plane than allowed. x: (cv_count, 3) world [m]."""
    return any(plane.gap(x) > plane.allowed_depth for group in planes for plane in group)


@dataclass(frozen=True)
class SubstepCollider:
    """A collider in one substep."""

    posed: PosedCollider
    displacement: Floats  # of its matrix
    now: Floats
    inverse: Floats
    inverse_before: Floats
    scale: float  # the smallest
    max_untraced_squared: float  # [m^2], squared length of paths that need not be followed
    travel: float  # [m], upper limit of the motion of its points
    deformation: float  # [m]
    is_part: bool = False

    @classmethod
    def of(cls, posed: PosedCollider, substep: Substep, size: float) -> SubstepCollider | None:
        """The collider in a substep; None if it is flat."""
        before, now = posed.matrix_at(substep.begin), posed.matrix_at(substep.end)
        if np.linalg.cond(now[:3, :3]) >= 1.0 / MIN_SCALE_RATIO:
            return None
        scale = float(np.linalg.svd(now[:3, :3], compute_uv=False)[-1])
        limit = max_untraced_squared(posed.collider.curve_radius * scale, size)
        displacement, (center, reach) = now - before, posed.collider.bounds
        travel = float(np.linalg.norm(displacement[:3, :3] @ center + displacement[:3, 3]))
        travel += reach * float(np.linalg.norm(displacement[:3, :3]))
        inverses = np.linalg.inv(now), inverse_or_fallback(before, now)
        return cls(posed, displacement, now, *inverses, scale, limit, travel, posed.deformation)

    def part(self, number: int, count: int) -> SubstepCollider:
        """The collider in one of `count` parts of the substep."""
        begin, end = (
            self.inverse_before * (1.0 - fraction) + self.inverse * fraction
            for fraction in (number / count, (number + 1) / count)
        )
        return replace(
            self,
            displacement=self.displacement / count,
            now=np.linalg.inv(end),
            inverse=end,
            inverse_before=begin,
            deformation=self.deformation / count,
            is_part=True,
        )

    def is_sharp(self, spacing: float) -> bool:
        """Whether segments of this length [m] need planes, see `contacts.is_sharp`."""
        return spacing**2 > self.max_untraced_squared

    def local(self, x: Floats) -> Floats:
        result: Floats = (self.inverse @ np.append(x, 1.0))[:3]
        return result

    def origin(self, x: Floats, previous: Floats) -> Floats:
        """Where a point (3,) world [m] would be had it moved with the collider."""
        result: Floats = previous + (self.displacement @ np.append(self.local(x), 1.0))[:3]
        return result

    def distance_and_normal(self, local: Floats) -> tuple[float, Floats]:
        """Signed distance [m] and unit normal, world space."""
        found, gradient = self.posed.collider.distance(local[:, None])
        outward = self.inverse[:3, :3].T @ gradient[:, 0]
        steepness = float(np.linalg.norm(outward))
        return float(found[0]) / steepness, outward / steepness

    def traced(self, x: Floats, previous: Floats, radius: float) -> tuple[Floats, float, float]:
        """See `contacts._trace_paths`: normal and normal . x where the point's path meets the
        surface, and the point's distance before."""
        begin = (self.inverse_before @ np.append(previous, 1.0))[:3]
        path = self.local(x) - begin
        first, _ = self.distance_and_normal(begin)
        place = (
            self._fraction_at_surface(begin, path, first, min(radius, first))
            if first > 0.0
            else 0.0
        )
        local = begin + path * place
        distance, normal = self.distance_and_normal(local)
        there = (self.now @ np.append(local, 1.0))[:3]
        return normal, float(normal @ there) - distance, first

    def _fraction_at_surface(
        self, begin: Floats, path: Floats, first: float, target: float
    ) -> float:
        """The fraction of the path at which the distance falls to `target`; 1 if it does not."""
        length = float(np.linalg.norm(path)) * self.scale
        travelled, distance = 0.0, first
        for _ in range(MAX_TRACE_STEPS):
            step = max(distance - target, length / MAX_TRACE_STEPS)
            if travelled + step >= length:
                return 1.0
            local = begin + path * ((travelled + step) / length)
            found = float(self.posed.collider.distance(local[:, None])[0][0]) * self.scale
            if found < target:
                return (travelled + step * (distance - target) / (distance - found)) / length
            travelled, distance = travelled + step, found
        return 1.0


def needs_parts(
    solid: SubstepCollider, planes: list[Plane], x: Floats, previous: Floats, spacing: float
) -> bool:
    """Whether a guide with these planes is advanced in parts of the substep; see
    `contacts.fast_guides`."""
    root, farthest = PINNED_COUNT - 1, FAST_SEGMENTS * spacing
    is_root_fast = float(np.linalg.norm(x[root] - solid.origin(x[root], previous[root]))) > farthest
    return (
        solid.is_sharp(spacing) and is_root_fast and any(plane.path > farthest for plane in planes)
    )


def planes_of(
    solid: SubstepCollider,
    x: Floats,
    previous: Floats,
    held: list[bool],
    settings: DynamicsSettings,
    dt: float,
    size: float,
    clearance: Floats,
) -> tuple[list[Plane], list[Plane]]:
    """Planes for the CVs of x (cv_count, 3) near a collider, and for segments.

    Args:
        dt: [s], of the substep or its part. size: the hair's [m].
        clearance: (cv_count, 1 + len(SEGMENT_POINTS)) [m], upper limit of the distances to keep.
    """
    free = [cv for cv in range(PINNED_COUNT, len(x)) if not held[cv]]
    max_exit = settings.depenetration_speed * size * dt + solid.deformation
    is_sharp = solid.is_sharp(size / (len(x) - 1))
    of_cvs, of_segments = [], []
    for cv in free:
        along = cv / (len(x) - 1)
        radius = size * (settings.radius_root * (1.0 - along) + settings.radius_tip * along)
        own = min(radius, float(clearance[cv, 0]))
        plane = _plane_of_cv(solid, cv, x, previous, own, max_exit, size, is_sharp)
        if plane is not None:
            of_cvs.append(plane)
        if is_sharp:
            is_previous_free = cv > PINNED_COUNT and not held[cv - 1]
            wanted = np.minimum(radius * float(SEGMENT_RADIUS), clearance[cv, 1:]).tolist()
            plane = _plane_between(
                solid, cv, x, previous, own, wanted, max_exit, size, is_previous_free
            )
            if plane is not None:
                of_segments.append(plane)
    return of_cvs, of_segments


def _plane_of_cv(
    solid: SubstepCollider,
    cv: int,
    x: Floats,
    previous: Floats,
    radius: float,
    max_exit: float,
    size: float,
    is_sharp: bool,
) -> Plane | None:
    distance, normal = solid.distance_and_normal(solid.local(x[cv]))
    origin = solid.origin(x[cv], previous[cv])
    path = x[cv] - origin
    travel = float(np.linalg.norm(path)) if is_sharp else 0.0
    if distance >= radius + CONTACT_MARGIN * size + travel:
        return None
    surface, start_distance = float(normal @ x[cv]) - distance, distance - float(normal @ path)
    if (
        is_sharp or solid.travel**2 > solid.max_untraced_squared
    ) and path @ path > solid.max_untraced_squared:
        normal, surface, start_distance = solid.traced(x[cv], previous[cv], radius)
    allowed = start_distance + max_exit
    offset = surface + min(radius, allowed)
    if is_sharp and offset - normal @ x[cv] <= -CONTACT_MARGIN * size:
        return None
    leads_out = allowed >= (0.0 if solid.is_part else radius)
    allowed_depth = (
        max(radius * float(ALLOWED_DEPTH), 2.0 * TOUCH_DISTANCE * size) if leads_out else np.inf
    )
    travelled = float(np.linalg.norm(path))
    return Plane(
        cv, normal, offset, origin, leads_out, TOUCH_DISTANCE * size, allowed_depth, travelled
    )


def _plane_between(
    solid: SubstepCollider,
    cv: int,
    x: Floats,
    previous: Floats,
    radius: float,
    distances: list[float],
    max_exit: float,
    size: float,
    is_previous_free: bool,
) -> Plane | None:
    """The plane of the deepest of the points of the segment that ends at a CV.

    Args:
        radius: of that CV [m]. distances: distances that the points keep [m].
        is_previous_free: whether the previous CV is free too.
    """
    deepest: Plane | None = None
    for along, wanted in zip(SEGMENT_POINTS, distances, strict=True):
        here, before = (rows[cv - 1] + (rows[cv] - rows[cv - 1]) * along for rows in (x, previous))
        normal, surface, start_distance = solid.traced(here, before, radius)
        offset = surface + min(wanted, start_distance + max_exit)
        lower = (1.0 - along) * is_previous_free
        scale = lower * lower + along * along
        weights = lower / scale, min(along / scale, float(MAX_SEGMENT_WEIGHT))
        leads_out = start_distance + max_exit >= (0.0 if solid.is_part else wanted)
        allowed_depth = (
            max(wanted * float(ALLOWED_DEPTH), 2.0 * TOUCH_DISTANCE * size) if leads_out else np.inf
        )
        origin = solid.origin(here, before)
        travelled = float(np.linalg.norm(here - origin))
        plane = Plane(
            cv,
            normal,
            offset,
            origin,
            leads_out,
            TOUCH_DISTANCE * size,
            allowed_depth,
            travelled,
            along,
            weights,
        )
        if deepest is None or plane.gap(x) > deepest.gap(x):
            deepest = plane
    return deepest if deepest is not None and deepest.gap(x) > -CONTACT_MARGIN * size else None
