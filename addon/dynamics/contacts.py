"""Contacts: found once per substep or part of it, solved as planes in turn with lengths.

A CV near a collider gets the plane of the nearest surface, moved out by the CV's own radius, which
grows from root to tip (the "pearl" configuration of Nguyen and Donnelly 2005). The plane's demand
is limited: a CV goes no deeper than it was, relative to the moving collider, and is moved out no
faster than `depenetration_speed`. So hair that starts inside comes out slowly instead of exploding.

Segments and paths need more care if a collider is sharply curved for their length: a straight line
of length c between two points outside of a ball of radius R enters it by no more than c^2 / 8 R.

    a segment    gets a plane too, at the deepest of some points between its CVs; its push is
                 distributed to both of them
    a CV's path  in a substep, relative to the moving collider, is followed until it meets the
                 surface (sphere tracing, Hart 1996), and gets the plane there. So nothing passes
                 through thin colliders, however fast either of them is

Friction is Coulomb's, on positions (Macklin et al. 2014, "Unified Particle Physics", section 6.1):
the slip against the collider's own motion is reduced by up to mu times the push.

Limitations: in a substep, each CV and each segment gets one plane per collider; between colliders
that touch each other the last one wins.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.vectors import dot_rows
from .colliders import Pose, transform_points
from .colliders.posed import near_points, world_distance
from .constraints import PINNED_COUNT, TINY, TouchingCvs, select_guides, take_columns
from .settings import DynamicsSettings

#: How far the length solve may move a CV after contacts were found, in sizes: `state.Rest.size`,
#: the median length of hair, or `cloth.state.Fabric.size`.
CONTACT_MARGIN = 0.008
#: Depth up to which lines may enter a collider undetected, in sizes: less than a CV's radius.
MAX_UNDETECTED_DEPTH = 0.003
#: The points of segments that are tested, as fractions from one CV to the next.
SEGMENT_POINTS = (0.25, 0.5, 0.75)
#: The radius of these points as a fraction of the CVs', so that hair on a round surface rests on
#: its CVs alone.
SEGMENT_RADIUS = np.float32(0.5)
#: Maximum number of steps along a path; the shortest step is the path's length over this number.
MAX_TRACE_STEPS = 12
#: The fraction of its distance that a point may lack before contacts and lengths are solved again;
#: maximum number of such rounds.
ALLOWED_DEPTH, MAX_EXTRA_ROUNDS = np.float32(0.5), 10
#: A guide is advanced in parts of the substep if its root and a touching point both move farther
#: than FAST_SEGMENTS segments, relative to a collider. Number of parts; factor of `passes` in each.
FAST_SEGMENTS, PART_COUNT, PART_PASS_FACTOR = 0.5, 10, 2
#: Maximum factor of a push on a segment's free CV, if the other one, near the contact, is pinned.
MAX_SEGMENT_WEIGHT = np.float32(2.0)
#: Distance from its plane below which a CV touches it, so that lengths do not push it in; in sizes.
TOUCH_DISTANCE = 4.0e-4


@dataclass(frozen=True)
class Contacts:
    """The contact planes of one collider, m of them.

    pose: of the collider.
    index: (m,) into the points that were tested.
    normal: (3, m) outwards, world. offset: (m,) [m]; points must keep normal . x >= offset.
    origin: (3, m) world [m], where the point would be now had it moved with the collider.
    leads_out: (m,) whether the offset leads all the way out.
    touch_distance: [m], the distance below which a point touches.
    push: (m,) [m], how far the point was pushed so far in this substep.
    allowed_depth: (m,) [m], how far it may be below its plane when the substep ends.
    """

    pose: Pose
    index: Ints
    normal: Floats
    offset: Floats
    origin: Floats
    leads_out: Bools
    touch_distance: np.float32
    push: Floats
    allowed_depth: Floats

    def push_out(self, position: Floats, friction: float) -> Bools:
        """Move points (3, n) out to their planes, in place; returns which contacts touch, (m,)."""
        here = self._contact_points(position)
        gap = dot_rows(self.normal, here)
        np.subtract(self.offset, gap, out=gap)
        push = np.maximum(gap, np.float32(0.0))
        self.push[:] += push
        self._move_points(position, here, self._pushed_positions(here, push, friction))
        return (gap > -self.touch_distance) & self.leads_out

    def absorb(self, position: Floats, previous: Floats) -> None:
        """Remove the speed that pushing out has caused: contacts do not bounce.

        Changes `previous` (3, n), so that no pushed point moves away from the collider.
        """
        moved = self._contact_points(position)
        moved -= self.origin
        away = np.maximum(dot_rows(self.normal, moved), np.float32(0.0))
        away *= self.push > 0.0
        self._displace_points(previous, self.normal * away)

    def have_moved_farther(self, position: Floats, distance: float) -> Bools:
        """Which points (m,) have moved farther than this [m] in the substep, relative to the
        collider."""
        path = self._contact_points(position)
        path -= self.origin
        result: Bools = dot_rows(path, path) > np.float32(distance * distance)
        return result

    def are_too_deep(self, position: Floats) -> Bools:
        """Which points (m,) are farther below their planes than `allowed_depth` allows."""
        gap = self.offset - dot_rows(self.normal, self._contact_points(position))
        result: Bools = gap > self.allowed_depth
        return result

    def part(self, guides: Ints, guide_count: int) -> Contacts:
        """The contacts of some guides (n,), ascending, reindexed to these."""
        index, selected = select_guides(self.index, guides, guide_count)
        return replace(
            self,
            index=index,
            normal=self.normal[:, selected],
            offset=self.offset[selected],
            origin=self.origin[:, selected],
            leads_out=self.leads_out[selected],
            push=self.push[selected],
            allowed_depth=self.allowed_depth[selected],
        )

    def copy_push_from(self, part: Contacts, guides: Ints, guide_count: int) -> None:
        """Copy back the push of a `part` for these guides, as in `part`."""
        _, selected = select_guides(self.index, guides, guide_count)
        self.push[selected] = part.push

    def touching_cvs(self, is_touching: Bools) -> TouchingCvs | None:
        """The free CVs that touch, given which contacts (m,) do; None if none does."""
        which = is_touching.nonzero()[0]  # faster than np.flatnonzero
        if not which.size:
            return None
        return TouchingCvs(self.index.take(which), take_columns(self.normal, which))

    def _pushed_positions(self, here: Floats, push: Floats, friction: float) -> Floats:
        """Where points (3, m) are moved to by a push (m,) [m] and friction."""
        target: Floats = here + self.normal * push
        if friction:
            slip = target - self.origin
            slip -= self.normal * dot_rows(self.normal, slip)
            length = np.maximum(np.sqrt(dot_rows(slip, slip)), TINY)
            slip *= np.minimum(push * np.float32(friction) / length, np.float32(1.0))
            target -= slip
        return target

    def _contact_points(self, position: Floats) -> Floats:
        return take_columns(position, self.index)

    def _move_points(self, position: Floats, here: Floats, target: Floats) -> None:
        del here
        for row, value in zip(position, target, strict=True):
            row[self.index] = value

    def _displace_points(self, previous: Floats, displacement: Floats) -> None:
        for row, value in zip(previous, displacement, strict=True):
            row[self.index] += value


@dataclass(frozen=True)
class SegmentContacts(Contacts):
    """Contacts of points on segments; `index` is that of the CV where the segment ends.

    stride: difference of the indices of successive CVs of a guide.
    fraction: (m,) fraction of the segment.
    weight_lower, weight_upper: (m,) displacement of the segment's CVs, over that of the point.
    """

    stride: int
    fraction: Floats
    weight_lower: Floats
    weight_upper: Floats

    def part(self, guides: Ints, guide_count: int) -> SegmentContacts:
        _, selected = select_guides(self.index, guides, guide_count)
        base = super().part(guides, guide_count)
        assert isinstance(base, SegmentContacts)
        return replace(
            base,
            stride=len(guides),
            fraction=self.fraction[selected],
            weight_lower=self.weight_lower[selected],
            weight_upper=self.weight_upper[selected],
        )

    def touching_cvs(self, is_touching: Bools) -> TouchingCvs | None:
        """The free CVs of segments that touch; a CV between two of them gets the normal of the one
        that begins there."""
        which = (is_touching & (self.push > 0.0)).nonzero()[0]
        if not which.size:
            return None
        upper, normal = self.index.take(which), take_columns(self.normal, which)
        free = (self.weight_lower.take(which) > 0.0).nonzero()[0]
        lower = TouchingCvs(upper.take(free) - self.stride, take_columns(normal, free))
        return join_touching([TouchingCvs(upper, normal), lower])

    def _contact_points(self, position: Floats) -> Floats:
        lower = take_columns(position, self.index - self.stride)
        here = take_columns(position, self.index)
        here -= lower
        here *= self.fraction
        here += lower
        return here

    def _move_points(self, position: Floats, here: Floats, target: Floats) -> None:
        self._displace_points(position, target - here)

    def _displace_points(self, previous: Floats, displacement: Floats) -> None:
        lower = self.index - self.stride
        for row, value in zip(previous, displacement, strict=True):
            row[lower] += value * self.weight_lower
            row[self.index] += value * self.weight_upper


def find_contacts(
    position: Floats,
    previous: Floats,
    radius: Floats,
    poses: list[Pose],
    max_exit: float,
    size: float,
    spacing: float = 0.0,
) -> list[Contacts]:
    """Planes for all points near a collider.

    Args:
        position, previous: (3, n) float32 world [m], a substep apart.
        radius: (n,) float32 [m], the distance that each point keeps; -inf: it has no contacts.
        poses: of the colliders at the substep's end.
        max_exit: how far [m] a point that is inside may be moved out in this substep.
        size: of the hair or cloth [m].
        spacing: [m] of CVs along a guide; 0 for points without segments.
    """
    found = (
        _contacts_with(pose, position, previous, radius, max_exit, size, spacing) for pose in poses
    )
    return [contacts for contacts in found if len(contacts.index)]


def find_segment_contacts(
    position: Floats,
    previous: Floats,
    radius: Floats,
    segment_radius: Floats,
    poses: list[Pose],
    max_exit: float,
    size: float,
    guide_count: int,
) -> list[SegmentContacts]:
    """Planes for the segments of guides near colliders that are sharp for them.

    Args:
        position, previous, radius, poses, max_exit, size: as in `find_contacts`, of all CVs in the
            order (cv_count, guide_count).
        segment_radius: (len(SEGMENT_POINTS), n) float32 [m], the distance that points of the
            segment that ends at a CV keep.
    """
    cv_count = position.shape[1] // guide_count
    spacing = spacing_of(size, cv_count)
    found = (
        _segment_contacts_with(
            pose, position, previous, radius, segment_radius, max_exit, size, guide_count
        )
        for pose in poses
        if cv_count > PINNED_COUNT and is_sharp(pose, spacing, size)
    )
    return [contacts for contacts in found if len(contacts.index)]


def spacing_of(size: float, cv_count: int) -> float:
    """The distance [m] between successive CVs of hair of this size [m]."""
    return size / (cv_count - 1)


def is_sharp(pose: Pose, spacing: float, size: float) -> bool:
    """Whether a segment of this length [m] could enter the collider between its CVs."""
    return spacing * spacing > max_untraced_squared(pose.collider.curve_radius * pose.scale, size)


def needs_tracing(travel: float, limit: float, is_sharp: bool) -> bool:
    """Whether paths of points are followed: if segments collide, or if the collider's `travel` [m]
    in the substep exceeds the length of paths that need not be followed (squared `limit` [m^2])."""
    return is_sharp or travel * travel > limit


def max_untraced_squared(curve_radius: float, size: float) -> float:
    """The squared length [m^2] of paths that need not be followed at a radius of curvature [m]."""
    return 8.0 * curve_radius * MAX_UNDETECTED_DEPTH * size


def cv_radius(settings: DynamicsSettings, cv_count: int, size: float) -> Floats:
    """Collision radius [m] of the free CVs, (cv_count - 2,), linear along the guide."""
    along = np.linspace(0.0, 1.0, cv_count)[PINNED_COUNT:]
    radius = settings.radius_root + (settings.radius_tip - settings.radius_root) * along
    return (size * radius).astype(np.float32)


@lru_cache(maxsize=8)
def all_cv_radii(
    settings: DynamicsSettings, cv_count: int, guide_count: int, size: float
) -> Floats:
    """`cv_radius` of all CVs of guides, (cv_count * guide_count,); -inf for the pinned ones."""
    pinned = np.full(PINNED_COUNT, -np.inf, np.float32)
    radius = np.repeat(np.concatenate([pinned, cv_radius(settings, cv_count, size)]), guide_count)
    radius.flags.writeable = False
    return radius


def fast_guides(contacts: list[Contacts], position: Floats, previous: Floats, size: float) -> Ints:
    """Guides, ascending, that are advanced in parts of the substep: they meet, with segments, a
    collider that moves fast relative to their roots, and are not dragged along yet.

    Args:
        position, previous: (3, cv_count, n) world [m], a substep apart. size: of the hair [m].
    """
    (_, cv_count, guide_count), here = position.shape, position.reshape(3, -1)
    spacing = spacing_of(size, cv_count)
    farthest, root = FAST_SEGMENTS * spacing, PINNED_COUNT - 1
    found = [np.zeros(0, np.int64)]
    for one in contacts:
        if is_sharp(one.pose, spacing, size):
            is_fast = _relative_travel(one.pose, position[:, root], previous[:, root]) > farthest
            guides = one.index[one.have_moved_farther(here, farthest)] % guide_count
            found.append(guides[is_fast.take(guides)])
    return np.unique(np.concatenate(found))


def touching_cvs(contacts: list[Contacts], touching: list[Bools]) -> TouchingCvs | None:
    """Free CVs that touch, each with the normal of the last collider that it touches itself, or
    else that its segments touch; None if none does."""
    of_points: list[TouchingCvs] = []
    of_segments: list[TouchingCvs] = []
    for one, which in zip(contacts, touching, strict=True):
        found = one.touching_cvs(which)
        if found is not None:
            (of_segments if isinstance(one, SegmentContacts) else of_points).append(found)
    return join_touching(of_segments + of_points)


def join_touching(found: list[TouchingCvs]) -> TouchingCvs | None:
    """All of them joined; for CVs that occur several times, the last one."""
    if len(found) < 2:
        return found[0] if found else None
    index = np.concatenate([one.index for one in found])[::-1]
    normal = np.concatenate([one.normal for one in found], axis=1)[:, ::-1]
    index, last = np.unique(index, return_index=True)
    return TouchingCvs(index, normal[:, last])


def _contacts_with(
    pose: Pose,
    position: Floats,
    previous: Floats,
    radius: Floats,
    max_exit: float,
    size: float,
    spacing: float,
) -> Contacts:
    is_sharp_here = is_sharp(pose, spacing, size)
    margin: Floats | float = CONTACT_MARGIN * size
    if is_sharp_here:  # points that are out now may have passed through
        margin = _relative_travel(pose, position, previous) + margin
    index, local, reach = near_points(pose, position, radius, margin)
    distance, normal = world_distance(pose, local)

    close = (distance < reach).nonzero()[0]
    index, distance = index.take(close), distance.take(close)
    local, normal = take_columns(local, close), take_columns(normal, close)
    here, before = take_columns(position, index), take_columns(previous, index)
    origin = transform_points(pose.displacement, local)
    origin += before
    path = here - origin
    allowed = distance - dot_rows(normal, path)
    height = dot_rows(normal, here)
    height -= distance
    own_radius = radius.take(index)
    limit = max_untraced_squared(pose.collider.curve_radius * pose.scale, size)
    if needs_tracing(pose.travel, limit, is_sharp_here):
        is_long = (dot_rows(path, path) > np.float32(limit)).nonzero()[0]
        traced = _trace_paths(
            pose,
            take_columns(before, is_long),
            take_columns(local, is_long),
            own_radius.take(is_long),
        )
        normal[:, is_long], height[is_long], allowed[is_long] = traced
    allowed += np.float32(max_exit + pose.deformation)
    offset = np.minimum(own_radius, allowed)
    offset += height
    if is_sharp_here:
        near = (offset - dot_rows(normal, here) > -np.float32(CONTACT_MARGIN * size)).nonzero()[0]
        index, normal, offset = index.take(near), take_columns(normal, near), offset.take(near)
        origin, allowed, own_radius = (
            take_columns(origin, near),
            allowed.take(near),
            own_radius.take(near),
        )
    leads_out = allowed >= (0.0 if pose.is_part else own_radius)
    touch_distance, allowed_depth = (
        np.float32(TOUCH_DISTANCE * size),
        _allowed_depth(own_radius, leads_out, size),
    )
    push = np.zeros_like(offset)
    return Contacts(
        pose, index, normal, offset, origin, leads_out, touch_distance, push, allowed_depth
    )


def _allowed_depth(radius: Floats, is_out: Bools, size: float) -> Floats:
    slack = np.maximum(radius * ALLOWED_DEPTH, np.float32(2.0 * TOUCH_DISTANCE * size))
    slack[~is_out] = np.inf
    return slack


def _segment_contacts_with(
    pose: Pose,
    position: Floats,
    previous: Floats,
    radius: Floats,
    segment_radius: Floats,
    max_exit: float,
    size: float,
    guide_count: int,
) -> SegmentContacts:
    first = PINNED_COUNT * guide_count
    middle, middle_before = (
        (rows[:, first:] + rows[:, first - guide_count : -guide_count]) * np.float32(0.5)
        for rows in (position, previous)
    )
    segment = position[:, first:] - position[:, first - guide_count : -guide_count]
    reach = _relative_travel(pose, middle, middle_before)
    reach += radius[first:] + np.float32(CONTACT_MARGIN * size)
    reach += np.sqrt(dot_rows(segment, segment)) * np.float32(0.5)
    upper, _, _ = near_points(pose, middle, reach)
    upper += first
    lower = upper - guide_count
    count, fraction = len(upper), np.repeat(np.array(SEGMENT_POINTS, np.float32), len(upper))
    here, before = (
        _segment_points(take_columns(rows, lower), take_columns(rows, upper))
        for rows in (position, previous)
    )
    own_radius = np.tile(radius.take(upper), len(SEGMENT_POINTS))
    local = transform_points(pose.inverse, here)
    origin = transform_points(pose.displacement, local)
    origin += before
    normal, height, allowed = _trace_paths(pose, before, local, own_radius)
    allowed += np.float32(max_exit + pose.deformation)
    wanted_distance = segment_radius.take(upper, axis=1).ravel()
    offset = np.minimum(wanted_distance, allowed)
    offset += height
    # the point of each segment that is deepest below its plane
    depth = offset - dot_rows(normal, here)
    deepest = depth.reshape(len(SEGMENT_POINTS), count).argmax(axis=0) * count + np.arange(count)
    deepest = deepest[depth.take(deepest) > -CONTACT_MARGIN * size]
    fraction, offset, allowed = fraction.take(deepest), offset.take(deepest), allowed.take(deepest)
    upper = upper.take(deepest % max(count, 1))
    weight_lower = (np.float32(1.0) - fraction) * (radius.take(upper - guide_count) > -np.inf)
    scale = weight_lower * weight_lower + fraction * fraction
    leads_out = allowed >= (0.0 if pose.is_part else wanted_distance.take(deepest))
    return SegmentContacts(
        pose,
        upper,
        take_columns(normal, deepest),
        offset,
        take_columns(origin, deepest),
        leads_out,
        np.float32(TOUCH_DISTANCE * size),
        np.zeros_like(offset),
        _allowed_depth(wanted_distance.take(deepest), leads_out, size),
        guide_count,
        fraction,
        weight_lower / scale,
        np.minimum(fraction / scale, MAX_SEGMENT_WEIGHT),
    )


def _segment_points(lower: Floats, upper: Floats) -> Floats:
    """Points (3, k n) between points (3, n) at the fractions SEGMENT_POINTS."""
    path = upper - lower
    return np.concatenate([lower + path * np.float32(along) for along in SEGMENT_POINTS], axis=1)


def _relative_travel(pose: Pose, position: Floats, previous: Floats) -> Floats:
    """How far [m] points (3, n) have moved in the substep relative to the collider, (n,)."""
    origin = transform_points(pose.displacement, transform_points(pose.inverse, position))
    origin += previous
    origin -= position
    result: Floats = np.sqrt(dot_rows(origin, origin))
    return result


def _trace_paths(
    pose: Pose, before: Floats, local: Floats, radius: Floats
) -> tuple[Floats, Floats, Floats]:
    """Follow the paths of points until they come within their radius (n,) [m], or end.

    Args:
        before: (3, n) world [m], where the points were. local: (3, n) object space, where they are.

    Returns:
        The normal (3, n) there; normal . x (n,) [m] of the surface there; and the distance of the
        points from the surface before, (n,) [m]: all in world space at the substep's end.
    """
    begin = transform_points(pose.inverse_before, before)
    first, _ = world_distance(pose, begin)
    scale = np.float32(pose.scale)  # the smallest scale: steps that are too short do no harm
    path = local - begin
    length = np.sqrt(dot_rows(path, path))
    length *= scale
    min_step = length * np.float32(1.0 / MAX_TRACE_STEPS)
    target = np.minimum(radius, first)
    path_fraction = (first > 0.0).astype(
        np.float32
    )  # fraction of the path; 0 for points starting inside
    active = ((first > 0.0) & (length > TINY)).nonzero()[0]
    travelled, distance = np.zeros_like(length), first.copy()
    for _ in range(MAX_TRACE_STEPS):
        if not active.size:
            break
        free_distance = distance.take(active) - target.take(active)
        step = np.maximum(free_distance, min_step.take(active))
        next_travelled = travelled.take(active) + step
        is_on_path = next_travelled < length.take(active)
        active, next_travelled, step, free_distance = (
            active[is_on_path],
            next_travelled[is_on_path],
            step[is_on_path],
            free_distance[is_on_path],
        )
        points = take_columns(begin, active) + take_columns(path, active) * (
            next_travelled / length.take(active)
        )
        next_distance = pose.collider.distance(points)[0] * scale
        is_hit = next_distance < target.take(active)
        # interpolated between the last two steps, as if the distance changed linearly
        approach = np.minimum((free_distance - (next_distance - target.take(active))), np.inf)
        hit_travelled = next_travelled - step + step * free_distance / np.maximum(approach, TINY)
        hit = is_hit.nonzero()[0]
        path_fraction[active[hit]] = hit_travelled[hit] / length.take(active[hit])
        travelled[active], distance[active] = next_travelled, next_distance
        active = active[~is_hit]
    points = begin + path * path_fraction
    distance, normal = world_distance(pose, points)
    surface = dot_rows(normal, transform_points(pose.matrix, points))
    surface -= distance
    return normal, surface, first
