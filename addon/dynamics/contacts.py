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
from .constraints import PINNED, TINY, Touched, chosen, part_of
from .settings import DynamicsSettings

#: How far the length solve may move a CV after contacts were found, in sizes: `state.Rest.size`,
#: the median length of hair, or `cloth.state.Fabric.size`.
REACH = 0.008
#: Depth up to which lines may enter a collider undetected, in sizes: less than a CV's radius.
UNSEEN = 0.003
#: The points of segments that are tested, as fractions from one CV to the next.
BETWEEN = (0.25, 0.5, 0.75)
#: The radius of these points as a fraction of the CVs', so that hair on a round surface rests on
#: its CVs alone.
BETWEEN_RADIUS = np.float32(0.5)
#: Maximum number of steps along a path; the shortest step is the path's length over this number.
TRACE_STEPS = 12
#: The fraction of its distance that a point may lack before contacts and lengths are solved again;
#: maximum number of such rounds.
MAY_MISS, MORE_ROUNDS = np.float32(0.5), 10
#: A guide is advanced in parts of the substep if its root and a touching point both move farther
#: than FAST segments, relative to a collider. Number of parts; factor of `passes` in each.
FAST, PARTS, PART_PASSES = 0.5, 10, 2
#: Maximum factor of a push on a segment's free CV, if the other one, near the contact, is pinned.
MAX_WEIGHT = np.float32(2.0)
#: Distance from its plane below which a CV touches it, so that lengths do not push it in; in sizes.
SKIN = 4.0e-4


@dataclass(frozen=True)
class Contacts:
    """The contact planes of one collider, m of them.

    pose: of the collider.
    index: (m,) into the points that were tested.
    normal: (3, m) outwards, world. offset: (m,) [m]; points must keep normal . x >= offset.
    origin: (3, m) world [m], where the point would be now had it moved with the collider.
    is_out: (m,) whether the offset leads all the way out.
    skin: [m], the distance below which a point touches.
    push: (m,) [m], how far the point was pushed so far in this substep.
    slack: (m,) [m], how far it may be below its plane when the substep ends.
    """

    pose: Pose
    index: Ints
    normal: Floats
    offset: Floats
    origin: Floats
    is_out: Bools
    skin: np.float32
    push: Floats
    slack: Floats

    def push_out(self, position: Floats, friction: float) -> Bools:
        """Move points (3, n) out to their planes, in place; returns which contacts touch, (m,)."""
        here = self._here(position)
        gap = dot_rows(self.normal, here)
        np.subtract(self.offset, gap, out=gap)
        push = np.maximum(gap, np.float32(0.0))
        self.push[:] += push
        self._move(position, here, self._pushed(here, push, friction))
        return (gap > -self.skin) & self.is_out

    def absorb(self, position: Floats, previous: Floats) -> None:
        """Remove the speed that pushing out has caused: contacts do not bounce.

        Changes `previous` (3, n), so that no pushed point moves away from the collider.
        """
        moved = self._here(position)
        moved -= self.origin
        away = np.maximum(dot_rows(self.normal, moved), np.float32(0.0))
        away *= self.push > 0.0
        self._add(previous, self.normal * away)

    def far(self, position: Floats, farthest: float) -> Bools:
        """Which points (m,) have moved farther than this [m] in the substep, relative to the
        collider."""
        path = self._here(position)
        path -= self.origin
        result: Bools = dot_rows(path, path) > np.float32(farthest * farthest)
        return result

    def missing(self, position: Floats) -> Bools:
        """Which points (m,) are farther below their planes than `slack` allows."""
        gap = self.offset - dot_rows(self.normal, self._here(position))
        result: Bools = gap > self.slack
        return result

    def part(self, guides: Ints, guide_count: int) -> Contacts:
        """The contacts of some guides (n,), ascending, reindexed to these."""
        index, kept = part_of(self.index, guides, guide_count)
        return replace(
            self,
            index=index,
            normal=self.normal[:, kept],
            offset=self.offset[kept],
            origin=self.origin[:, kept],
            is_out=self.is_out[kept],
            push=self.push[kept],
            slack=self.slack[kept],
        )

    def note(self, part: Contacts, guides: Ints, guide_count: int) -> None:
        """Copy back the push of a `part` for these guides."""
        _, kept = part_of(self.index, guides, guide_count)
        self.push[kept] = part.push

    def touched(self, is_touching: Bools) -> Touched | None:
        """The free CVs that touch."""
        which = is_touching.nonzero()[0]  # faster than np.flatnonzero
        if not which.size:
            return None
        return Touched(self.index.take(which), chosen(self.normal, which))

    def _pushed(self, here: Floats, push: Floats, friction: float) -> Floats:
        """Where points (3, m) are moved to by a push (m,) [m] and friction."""
        there: Floats = here + self.normal * push
        if friction:
            slip = there - self.origin
            slip -= self.normal * dot_rows(self.normal, slip)
            length = np.maximum(np.sqrt(dot_rows(slip, slip)), TINY)
            slip *= np.minimum(push * np.float32(friction) / length, np.float32(1.0))
            there -= slip
        return there

    def _here(self, position: Floats) -> Floats:
        return chosen(position, self.index)

    def _move(self, position: Floats, here: Floats, there: Floats) -> None:
        del here
        for row, value in zip(position, there, strict=True):
            row[self.index] = value

    def _add(self, previous: Floats, displacement: Floats) -> None:
        for row, value in zip(previous, displacement, strict=True):
            row[self.index] += value


@dataclass(frozen=True)
class SegmentContacts(Contacts):
    """Contacts of points on segments; `index` is that of the CV where the segment ends.

    stride: difference of the indices of successive CVs of a guide.
    along: (m,) fraction of the segment.
    weight_lower, weight_upper: (m,) displacement of the segment's CVs, over that of the point.
    """

    stride: int
    along: Floats
    weight_lower: Floats
    weight_upper: Floats

    def part(self, guides: Ints, guide_count: int) -> SegmentContacts:
        _, kept = part_of(self.index, guides, guide_count)
        own = super().part(guides, guide_count)
        assert isinstance(own, SegmentContacts)
        return replace(
            own,
            stride=len(guides),
            along=self.along[kept],
            weight_lower=self.weight_lower[kept],
            weight_upper=self.weight_upper[kept],
        )

    def touched(self, is_touching: Bools) -> Touched | None:
        """The free CVs of segments that touch; a CV between two of them gets the normal of the one
        that begins there."""
        which = (is_touching & (self.push > 0.0)).nonzero()[0]
        if not which.size:
            return None
        upper, normal = self.index.take(which), chosen(self.normal, which)
        free = (self.weight_lower.take(which) > 0.0).nonzero()[0]
        lower = Touched(upper.take(free) - self.stride, chosen(normal, free))
        return last_of([Touched(upper, normal), lower])

    def _here(self, position: Floats) -> Floats:
        lower = chosen(position, self.index - self.stride)
        here = chosen(position, self.index)
        here -= lower
        here *= self.along
        here += lower
        return here

    def _move(self, position: Floats, here: Floats, there: Floats) -> None:
        self._add(position, there - here)

    def _add(self, previous: Floats, displacement: Floats) -> None:
        lower = self.index - self.stride
        for row, value in zip(previous, displacement, strict=True):
            row[lower] += value * self.weight_lower
            row[self.index] += value * self.weight_upper


def find_contacts(
    position: Floats,
    previous: Floats,
    radius: Floats,
    poses: list[Pose],
    led_out: float,
    size: float,
    spacing: float = 0.0,
) -> list[Contacts]:
    """Planes for all points near a collider.

    Args:
        position, previous: (3, n) float32 world [m], a substep apart.
        radius: (n,) float32 [m], the distance that each point keeps; -inf: it has no contacts.
        poses: of the colliders at the substep's end.
        led_out: how far [m] a point that is inside may be moved out in this substep.
        size: of the hair or cloth [m].
        spacing: [m] of CVs along a guide; 0 for points without segments.
    """
    found = (
        _contacts_with(pose, position, previous, radius, led_out, size, spacing) for pose in poses
    )
    return [contacts for contacts in found if len(contacts.index)]


def find_between(
    position: Floats,
    previous: Floats,
    radius: Floats,
    between: Floats,
    poses: list[Pose],
    led_out: float,
    size: float,
    guide_count: int,
) -> list[SegmentContacts]:
    """Planes for the segments of guides near colliders that are sharp for them.

    Args:
        position, previous, radius, poses, led_out, size: as in `find_contacts`, of all CVs in the
            order (cv_count, guide_count).
        between: (len(BETWEEN), n) float32 [m], the distance that points of the segment that ends at
            a CV keep.
    """
    cv_count = position.shape[1] // guide_count
    spacing = spacing_of(size, cv_count)
    found = (
        _between_with(pose, position, previous, radius, between, led_out, size, guide_count)
        for pose in poses
        if cv_count > PINNED and is_sharp(pose, spacing, size)
    )
    return [contacts for contacts in found if len(contacts.index)]


def spacing_of(size: float, cv_count: int) -> float:
    """The distance [m] between successive CVs of hair of this size [m]."""
    return size / (cv_count - 1)


def is_sharp(pose: Pose, spacing: float, size: float) -> bool:
    """Whether a segment of this length [m] could enter the collider between its CVs."""
    return spacing * spacing > short_squared(pose.collider.curve_radius * pose.scale, size)


def is_followed(travel: float, limit: float, sharp: bool) -> bool:
    """Whether paths of points are followed: if segments collide, or if the collider's `travel` [m]
    in the substep exceeds the length of paths that need not be followed (squared `limit` [m^2])."""
    return sharp or travel * travel > limit


def short_squared(curve_radius: float, size: float) -> float:
    """The squared length [m^2] of paths that need not be followed at a radius of curvature [m]."""
    return 8.0 * curve_radius * UNSEEN * size


def cv_radius(settings: DynamicsSettings, cv_count: int, size: float) -> Floats:
    """Collision radius [m] of the free CVs, (cv_count - 2,), linear along the guide."""
    along = np.linspace(0.0, 1.0, cv_count)[PINNED:]
    radius = settings.radius_root + (settings.radius_tip - settings.radius_root) * along
    return (size * radius).astype(np.float32)


@lru_cache(maxsize=8)
def radius_of_all(
    settings: DynamicsSettings, cv_count: int, guide_count: int, size: float
) -> Floats:
    """`cv_radius` of all CVs of guides, (cv_count * guide_count,); -inf for the pinned ones."""
    pinned = np.full(PINNED, -np.inf, np.float32)
    radius = np.repeat(np.concatenate([pinned, cv_radius(settings, cv_count, size)]), guide_count)
    radius.flags.writeable = False
    return radius


def hurried_guides(
    contacts: list[Contacts], position: Floats, previous: Floats, size: float
) -> Ints:
    """Guides, ascending, that are advanced in parts of the substep: they meet, with segments, a
    collider that moves fast relative to their roots, and are not dragged along yet.

    Args:
        position, previous: (3, cv_count, n) world [m], a substep apart. size: of the hair [m].
    """
    (_, cv_count, guide_count), here = position.shape, position.reshape(3, -1)
    spacing = spacing_of(size, cv_count)
    farthest, root = FAST * spacing, PINNED - 1
    found = [np.zeros(0, np.int64)]
    for one in contacts:
        if is_sharp(one.pose, spacing, size):
            is_fast = _travel(one.pose, position[:, root], previous[:, root]) > farthest
            guides = one.index[one.far(here, farthest)] % guide_count
            found.append(guides[is_fast.take(guides)])
    return np.unique(np.concatenate(found))


def touched_by(contacts: list[Contacts], touching: list[Bools]) -> Touched | None:
    """Free CVs that touch, each with the normal of the last collider that it touches itself, or
    else that its segments touch; None if none does."""
    own: list[Touched] = []
    between: list[Touched] = []
    for one, which in zip(contacts, touching, strict=True):
        found = one.touched(which)
        if found is not None:
            (between if isinstance(one, SegmentContacts) else own).append(found)
    return last_of(between + own)


def last_of(found: list[Touched]) -> Touched | None:
    """All of them joined; for CVs that occur several times, the last one."""
    if len(found) < 2:
        return found[0] if found else None
    index = np.concatenate([one.index for one in found])[::-1]
    normal = np.concatenate([one.normal for one in found], axis=1)[:, ::-1]
    index, last = np.unique(index, return_index=True)
    return Touched(index, normal[:, last])


def _contacts_with(
    pose: Pose,
    position: Floats,
    previous: Floats,
    radius: Floats,
    led_out: float,
    size: float,
    spacing: float,
) -> Contacts:
    sharp = is_sharp(pose, spacing, size)
    beyond: Floats | float = REACH * size
    if sharp:  # points that are out now may have passed through
        beyond = _travel(pose, position, previous) + beyond
    index, local, reach = near_points(pose, position, radius, beyond)
    distance, normal = world_distance(pose, local)

    close = (distance < reach).nonzero()[0]
    index, distance = index.take(close), distance.take(close)
    local, normal = chosen(local, close), chosen(normal, close)
    here, before = chosen(position, index), chosen(previous, index)
    origin = transform_points(pose.displacement, local)
    origin += before
    path = here - origin
    reached = distance - dot_rows(normal, path)
    height = dot_rows(normal, here)
    height -= distance
    own_radius = radius.take(index)
    limit = short_squared(pose.collider.curve_radius * pose.scale, size)
    if is_followed(pose.travel, limit, sharp):
        long = (dot_rows(path, path) > np.float32(limit)).nonzero()[0]
        some = _followed(pose, chosen(before, long), chosen(local, long), own_radius.take(long))
        normal[:, long], height[long], reached[long] = some
    reached += np.float32(led_out + pose.swelling)
    offset = np.minimum(own_radius, reached)
    offset += height
    if sharp:
        kept = (offset - dot_rows(normal, here) > -np.float32(REACH * size)).nonzero()[0]
        index, normal, offset = index.take(kept), chosen(normal, kept), offset.take(kept)
        origin, reached, own_radius = (
            chosen(origin, kept),
            reached.take(kept),
            own_radius.take(kept),
        )
    is_out = reached >= (0.0 if pose.is_part else own_radius)
    skin, slack = np.float32(SKIN * size), _slack(own_radius, is_out, size)
    push = np.zeros_like(offset)
    return Contacts(pose, index, normal, offset, origin, is_out, skin, push, slack)


def _slack(radius: Floats, is_out: Bools, size: float) -> Floats:
    slack = np.maximum(radius * MAY_MISS, np.float32(2.0 * SKIN * size))
    slack[~is_out] = np.inf
    return slack


def _between_with(
    pose: Pose,
    position: Floats,
    previous: Floats,
    radius: Floats,
    between: Floats,
    led_out: float,
    size: float,
    guide_count: int,
) -> SegmentContacts:
    first = PINNED * guide_count
    middle, middle_before = (
        (rows[:, first:] + rows[:, first - guide_count : -guide_count]) * np.float32(0.5)
        for rows in (position, previous)
    )
    segment = position[:, first:] - position[:, first - guide_count : -guide_count]
    reach = _travel(pose, middle, middle_before)
    reach += radius[first:] + np.float32(REACH * size)
    reach += np.sqrt(dot_rows(segment, segment)) * np.float32(0.5)
    upper, _, _ = near_points(pose, middle, reach)
    upper += first
    lower = upper - guide_count
    count, along = len(upper), np.repeat(np.array(BETWEEN, np.float32), len(upper))
    here, before = (
        _mixed(chosen(rows, lower), chosen(rows, upper)) for rows in (position, previous)
    )
    own_radius = np.tile(radius.take(upper), len(BETWEEN))
    local = transform_points(pose.inverse, here)
    origin = transform_points(pose.displacement, local)
    origin += before
    normal, height, reached = _followed(pose, before, local, own_radius)
    reached += np.float32(led_out + pose.swelling)
    wanted = between.take(upper, axis=1).ravel()
    offset = np.minimum(wanted, reached)
    offset += height
    # the point of each segment that is deepest below its plane
    missing = offset - dot_rows(normal, here)
    which = missing.reshape(len(BETWEEN), count).argmax(axis=0) * count + np.arange(count)
    which = which[missing.take(which) > -REACH * size]
    along, offset, reached = along.take(which), offset.take(which), reached.take(which)
    upper = upper.take(which % max(count, 1))
    weight_lower = (np.float32(1.0) - along) * (radius.take(upper - guide_count) > -np.inf)
    scale = weight_lower * weight_lower + along * along
    is_out = reached >= (0.0 if pose.is_part else wanted.take(which))
    return SegmentContacts(
        pose,
        upper,
        chosen(normal, which),
        offset,
        chosen(origin, which),
        is_out,
        np.float32(SKIN * size),
        np.zeros_like(offset),
        _slack(wanted.take(which), is_out, size),
        guide_count,
        along,
        weight_lower / scale,
        np.minimum(along / scale, MAX_WEIGHT),
    )


def _mixed(lower: Floats, upper: Floats) -> Floats:
    """Points (3, k n) between points (3, n) at the fractions BETWEEN."""
    path = upper - lower
    return np.concatenate([lower + path * np.float32(along) for along in BETWEEN], axis=1)


def _travel(pose: Pose, position: Floats, previous: Floats) -> Floats:
    """How far [m] points (3, n) have moved in the substep relative to the collider, (n,)."""
    origin = transform_points(pose.displacement, transform_points(pose.inverse, position))
    origin += previous
    origin -= position
    result: Floats = np.sqrt(dot_rows(origin, origin))
    return result


def _followed(
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
    least = length * np.float32(1.0 / TRACE_STEPS)
    target = np.minimum(radius, first)
    place = (first > 0.0).astype(np.float32)  # fraction of the path; 0 for points starting inside
    going = ((first > 0.0) & (length > TINY)).nonzero()[0]
    gone, distance = np.zeros_like(length), first.copy()
    for _ in range(TRACE_STEPS):
        if not going.size:
            break
        room = distance.take(going) - target.take(going)
        step = np.maximum(room, least.take(going))
        ahead = gone.take(going) + step
        there = ahead < length.take(going)
        going, ahead, step, room = going[there], ahead[there], step[there], room[there]
        points = chosen(begin, going) + chosen(path, going) * (ahead / length.take(going))
        found = pose.collider.distance(points)[0] * scale
        met = found < target.take(going)
        # interpolated between the last two steps, as if the distance changed linearly
        back = np.minimum((room - (found - target.take(going))), np.inf)
        exact = ahead - step + step * room / np.maximum(back, TINY)
        hit = met.nonzero()[0]
        place[going[hit]] = exact[hit] / length.take(going[hit])
        gone[going], distance[going] = ahead, found
        going = going[~met]
    points = begin + path * place
    distance, normal = world_distance(pose, points)
    surface = dot_rows(normal, transform_points(pose.matrix, points))
    surface -= distance
    return normal, surface, first
