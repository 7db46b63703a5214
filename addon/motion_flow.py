"""The flow of a groom in motion: rest shapes carried by roots, a frame of dynamics, all strands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .arrays import Floats, Ints
from .dynamics.blend import visible_guides
from .dynamics.clearance import GuideClearance, guide_clearance, max_clearance
from .dynamics.colliders import PosedCollider
from .dynamics.constraints import PINNED_COUNT
from .dynamics.force_fields import NO_FIELDS, ForceFields
from .dynamics.frame import Drive
from .dynamics.groom_rotation import fit_rotation, sample_roots
from .dynamics.held import HeldCvs
from .dynamics.neighbours import FrameSteps, NeighbourStyle, run_alone
from .dynamics.painted import PaintedGuides, simulated_fraction
from .dynamics.rigid_path import AT_REST, Carrier, KnownSubstep
from .dynamics.settings import DynamicsSettings
from .dynamics.state import DynamicsState, rows_of, start
from .dynamics.step import advance_in_steps as dynamics_steps
from .dynamics.step import grid_at_frame_end
from .groom.holds import Holds
from .groom.roots import RootFrames, carry_with_roots, root_frames, root_motions
from .refine.hold import hold_strands
from .refine.lead_out import (
    NO_DEFLECTIONS,
    NO_LED_OUT,
    Clearance,
    Deflections,
    LedOut,
    clearance_at,
    lead_out,
)
from .refine.ride import ride
from .rig_flow import Pose, Rig
from .strands.root_motions import RootMotions

#: About this many guides are sampled where the motion of the whole head matters.
JUMP_GUIDES = 64


@dataclass(frozen=True)
class FrameInput:
    """The input of one frame of motion.

    pose: at the frame's end.
    colliders: with their trajectories during the frame.
    gravity: (3,) [m/s^2], world space.
    duration: since the motion's pose [s].
    force_fields: of the scene.
    painted: factors of the settings at each guide; None: nothing is painted.
    time_scale: speed of the hair's time; 0: it is frozen.
    """

    pose: Pose
    colliders: tuple[PosedCollider, ...]
    settings: DynamicsSettings
    gravity: Floats
    duration: float
    force_fields: ForceFields = NO_FIELDS
    painted: PaintedGuides | None = None
    time_scale: float = 1.0

    @property
    def hair_time(self) -> float:
        """The hair's own duration [s]."""
        return self.duration * self.time_scale


@dataclass(frozen=True)
class Motion:
    """The state that one frame passes on to the next.

    guides: (guide_count, cv_count, 3) [m], simulated, with their roots in this pose.
    carried_guides: the same without dynamics: their rest shape carried by the roots.
    previous_carried_guides: `carried_guides` one frame earlier; None at the start.
    duration: of the last frame [s]; 0 at the start. hair_time: the same in the hair's own time.
    colliders: as they stand at the last frame's end.
    clearance: how far strands stay from colliders; None before there are any.
    guide_clearance: the same for guides.
    deflections: how leading out bent strands in the frame before.
    start_pose: the pose in which the motion began; the dynamics stores the style in that pose.
    """

    dynamics: DynamicsState
    guides: Floats
    carried_guides: Floats
    pose: Pose
    previous_carried_guides: Floats | None = None
    duration: float = 0.0
    hair_time: float = 0.0
    colliders: tuple[PosedCollider, ...] = ()
    clearance: Clearance | None = None
    guide_clearance: GuideClearance | None = None
    deflections: Deflections = NO_DEFLECTIONS
    start_pose: Pose | None = None

    def drive(self, frame: FrameInput, target: Floats, held: HeldCvs | None) -> Drive:
        """What acts in a frame that carries the guides to `target`, shaped like them [m]."""
        return Drive(
            self.carried_guides,
            target,
            frame.colliders,
            frame.gravity,
            self.previous_carried_guides if frame.duration else None,
            frame.force_fields,
            self.duration / frame.duration if frame.duration else 1.0,
            held,
            self.guide_clearance,
            simulated_fraction(frame.painted, frame.settings, len(target)),
            frame.painted,
        )


def carried_strands(rig: Rig, pose: Pose) -> Floats:
    """Rest shapes of all strands, each carried rigidly by its own root, (point_count, 3)."""
    strands = rig.strands
    return carry_with_roots(strands.points, strands.offsets, motions_of(rig, pose))


def carried_guides(rig: Rig, pose: Pose, precision: type = np.float32) -> Floats:
    """`carried_strands` for the guides, (guide_count, cv_count, 3)."""
    return _carried_guides(rig, motions_of(rig, pose, rig.guides), precision)


def _carried_guides(rig: Rig, motions: RootMotions, precision: type) -> Floats:
    grid: Floats = rig.guide_grid.astype(precision)
    offsets = np.arange(len(grid) + 1) * grid.shape[1]
    return carry_with_roots(grid.reshape(-1, 3), offsets, motions).reshape(grid.shape)


def motions_of(rig: Rig, pose: Pose, chosen: Ints | slice = slice(None)) -> RootMotions:
    """How the roots of some strands, indices (n,), have moved since rest."""
    if rig.head is None or pose.head_positions is None or rig.rest_frames is None:
        return RootMotions.of_matrix(pose.matrix)
    triangle, barycentric = rig.strands.root_triangle, rig.strands.root_barycentric
    assert triangle is not None and barycentric is not None
    now = root_frames(
        pose.head_positions, rig.head.triangles, triangle[chosen], barycentric[chosen]
    )
    rest = RootFrames(rig.rest_frames.origin[chosen], rig.rest_frames.rotation[chosen])
    return root_motions(rest, now)


def style_of_guides(rig: Rig, pose: Pose) -> Floats:
    """Rest shapes of the guides, carried by their roots and by what holds them, (guide_count,
    cv_count, 3)."""
    by_root = carried_guides(rig, pose)
    holds = held_guides(rig, pose)
    if holds is None or pose.anchors is None:
        return by_root
    return holds.carried(rig.guide_grid, by_root, pose.anchors)


def held_guides(rig: Rig, pose: Pose) -> Holds | None:
    """Where the guides are held in this pose; None: nowhere."""
    holds = None if rig.guide_holds is None else rig.guide_holds.where(pose.anchors)
    return None if holds is None or not len(holds.strand) else holds


def held_cvs(rig: Rig, pose: Pose) -> HeldCvs | None:
    """The held CVs, for the dynamics, with all CVs of brows and lashes, which follow the face."""
    holds = held_guides(rig, pose)
    if holds is None:
        return rig.held_face
    is_held = holds.held_cvs(*rig.guide_grid.shape[:2])
    return HeldCvs(is_held if rig.held_face is None else is_held | rig.held_face.is_held)


def begin(rig: Rig, pose: Pose) -> Motion:
    """Hair at rest in this pose."""
    guides = style_of_guides(rig, pose)
    state = start(guides, rig.curl_slack, rig.strands_per_guide)
    return Motion(state, guides, guides, pose, start_pose=pose)


def with_style(rig: Rig, motion: Motion) -> Motion:
    """A running motion whose guides now return to the shapes and lengths of this rig.

    Args:
        rig: of the same groom with its curves in other shapes, see `style_flow`.
    """
    state, start_pose = motion.dynamics, motion.start_pose or motion.pose
    style = start(style_of_guides(rig, start_pose), rig.curl_slack, rig.strands_per_guide)
    # so that distances, which settings give in fractions of it, stay as they are
    rest = replace(style.rest, size=state.rest.size)
    return replace(motion, dynamics=replace(state, rest=rest))


def advance(rig: Rig, motion: Motion, frame: FrameInput, led: LedOut = NO_LED_OUT) -> Motion:
    """One frame of motion without other grooms: roots follow the head, the dynamics moves the rest.

    Args:
        led: see `steps`.
    """
    return run_alone(steps(rig, motion, frame, led))


def steps(
    rig: Rig, motion: Motion, frame: FrameInput, led: LedOut = NO_LED_OUT
) -> FrameSteps[Motion]:
    """`advance` with other grooms, see `dynamics.neighbours`.

    Args:
        led: the strands of `motion` that were led out of colliders; the next frame's leading out
            starts from how these were bent.
    """
    settings, hair_time = frame.settings, frame.hair_time
    target = style_of_guides(rig, frame.pose)
    motion = with_clearance(rig, motion, frame.colliders, settings, frame.painted)
    drive = motion.drive(frame, target, held_cvs(rig, frame.pose))
    state = yield from dynamics_steps(motion.dynamics, drive, settings, hair_time)
    guides, before = grid_at_frame_end(state, drive, settings, hair_time), motion.carried_guides
    return Motion(
        state,
        guides,
        target,
        frame.pose,
        before,
        frame.duration,
        hair_time,
        frame.colliders,
        motion.clearance,
        motion.guide_clearance,
        led.deflections,
        motion.start_pose,
    )


def has_jumped(
    rig: Rig, motion: Motion, pose: Pose, settings: DynamicsSettings, duration: float
) -> bool:
    """Whether the head has jumped, as at a cut: since the motion's pose it has moved much farther
    than in the frame before, or has turned far.

    False in the frame after a jump, since the speed before is not known.
    """
    is_first = not motion.duration
    if (motion.previous_carried_guides is None and not is_first) or not len(rig.guides):
        return False
    chosen = np.arange(0, len(rig.guides), max(len(rig.guides) // JUMP_GUIDES, 1))
    roots = rig.guide_grid[chosen, :PINNED_COUNT]
    offsets = np.arange(len(chosen) + 1) * roots.shape[1]
    motions = motions_of(rig, pose, rig.guides[chosen])
    now = carry_with_roots(roots.reshape(-1, 3), offsets, motions).reshape(-1, 3).astype(np.float64)
    before = motion.carried_guides[chosen, :PINNED_COUNT].reshape(-1, 3).astype(np.float64)
    here = before.mean(axis=0)
    displacement = now.mean(axis=0) - here
    if motion.previous_carried_guides is not None:
        previous = motion.previous_carried_guides[chosen, :PINNED_COUNT].reshape(-1, 3).mean(axis=0)
        displacement = displacement - (here - previous) * (duration / motion.duration)
    extent = float(np.linalg.norm(np.ptp(rig.guide_grid.reshape(-1, 3), axis=0)))
    if 0.0 < settings.jump_distance * extent < float(np.linalg.norm(displacement)):
        return True
    turn = fit_rotation((before - here).T, np.ascontiguousarray(now.T))
    angle = math.acos(min(max((float(np.trace(turn)) - 1.0) / 2.0, -1.0), 1.0))
    return 0.0 < settings.jump_turn < angle


def advance_rigidly(rig: Rig, motion: Motion, frame: FrameInput) -> Motion:
    """A frame without dynamics: each guide moves rigidly with its root.

    After a jump hair has no velocity; frozen hair keeps the one that it had. Where guides show less
    than all of their simulation, the rest of them follows the style.
    """
    pose, is_frozen = frame.pose, not frame.time_scale
    target, state = style_of_guides(rig, pose), motion.dynamics
    turn = root_turns(rig, pose) @ np.linalg.pinv(root_turns(rig, motion.pose))
    root = state.grid[:, :1]

    def moved_rigidly(rows: Floats) -> Floats:
        grid = rows.transpose(2, 1, 0)
        moved = np.einsum("nij,nkj->nki", turn, grid - root) + target[:, :1]
        return rows_of(moved.astype(np.float32), "dynamics")

    position = moved_rigidly(state.position)
    previous = moved_rigidly(state.previous) if is_frozen else position
    carried = AT_REST
    if is_frozen:
        roots = Carrier.through(sample_roots(motion.carried_guides), sample_roots(target))
        before, now = (place.rotated(roots.path.now.rotation) for place in state.root_places.places)
        # hair goes to where its roots are at the frame's end
        begun = replace(before, shift=before.shift - now.shift)
        carried = KnownSubstep((begun, replace(now, shift=np.zeros(3))))
    state = replace(
        state, position=position, previous=previous, styles=(), push=None, root_places=carried
    )
    simulated = simulated_fraction(frame.painted, frame.settings, len(target))
    return Motion(
        state,
        visible_guides(state.grid, target, simulated),
        target,
        pose,
        None,
        motion.duration if is_frozen else frame.duration,
        frame.hair_time,
        frame.colliders,
        motion.clearance,
        motion.guide_clearance,
        start_pose=motion.start_pose,
    )


def neighbour_style(rig: Rig, pose: Pose, source: Rig) -> NeighbourStyle:
    """The groom's style in this pose, as other grooms see it.

    Args:
        source: the same groom as it was read, where its style is animated.
    """
    return NeighbourStyle(partial(style_of_guides, rig, pose), source.hair_of_guides, source)


def bounding_sphere(rig: Rig, pose: Pose) -> tuple[Floats, float]:
    """A sphere around all guides in this pose, however they swing: middle (3,) and radius [m]."""
    if not len(rig.guides):
        return np.zeros(3), 0.0
    chosen = np.arange(0, len(rig.guides), max(len(rig.guides) // JUMP_GUIDES, 1))
    offsets = np.arange(len(chosen) + 1) * PINNED_COUNT
    motions = motions_of(rig, pose, rig.guides[chosen])
    at_rest = rig.guide_grid[chosen, :PINNED_COUNT]
    now = carry_with_roots(at_rest.reshape(-1, 3), offsets, motions).reshape(at_rest.shape)
    first, last = (float(np.linalg.norm(np.diff(grid, axis=1))) for grid in (at_rest, now))
    middle, radius = rig.rest_sphere
    moved = (now[:, 0].astype(np.float64) - at_rest[:, 0]).mean(axis=0)
    return middle + moved, radius * (last / first if first else 1.0)


def with_clearance(
    rig: Rig,
    motion: Motion,
    colliders: tuple[PosedCollider, ...],
    settings: DynamicsSettings,
    painted: PaintedGuides | None = None,
) -> Motion:
    """The motion with clearances from colliders, which are computed in the first frame with any.

    Guides stay as far away as their radius says, and strands as far as guides do at their roots,
    but neither farther than they were at the start of that frame: guides in their style, strands
    where their roots carried them. Where nothing is simulated, strands get no clearance and follow
    their style.
    """
    simulated, size = (
        simulated_fraction(painted, settings, len(rig.guides)),
        motion.dynamics.rest.size,
    )
    max_distance, reach = settings.radius_root * size, max_clearance(settings, size)
    before = tuple(posed.at_begin() for posed in colliders)
    strands, guides = motion.clearance, motion.guide_clearance
    if simulated is not None and not simulated.any():
        strands = None
    elif colliders and (strands is None or strands.max_distance != max_distance):
        strands = strand_clearance(rig, motion.pose, before, max_distance)
    if colliders and (guides is None or guides.max_distance != reach):
        guides = guide_clearance(motion.carried_guides, before, reach)
    return replace(motion, clearance=strands, guide_clearance=guides)


def strand_clearance(
    rig: Rig, pose: Pose, colliders: tuple[PosedCollider, ...], max_distance: float
) -> Clearance:
    """How far strands stay from still colliders, measured where their roots carry them now.

    Args:
        max_distance: the largest such distance [m].
    """
    # an unmoved rig's points are what `carried_strands` would return, bit for bit
    points = rig.strands.points if _is_unmoved(rig, pose) else carried_strands(rig, pose)
    return clearance_at(points, rig.strands.offsets, colliders, max_distance)


def strands_and_led(rig: Rig, motion: Motion) -> tuple[Floats, LedOut]:
    """All strands at this moment of a running motion, (point_count, 3) [m], and those of them that
    were led out of colliders."""
    pose, offsets = motion.pose, rig.strands.offsets
    points, motions = _ridden_strands(rig, pose, motion.guides)
    if motion.clearance is None:
        return held_strands(rig, pose, points), NO_LED_OUT
    carry = partial(motions.carried, rig.strands.points)
    deflections = motion.deflections.decayed(motion.hair_time, offsets)
    led, deflections = lead_out(
        points, carry, offsets, motion.colliders, motion.clearance, deflections
    )
    points = held_strands(rig, pose, points)
    return points, LedOut.of(led, points, offsets, deflections)


def strands_at(rig: Rig, pose: Pose, guides_now: Floats, led: LedOut = NO_LED_OUT) -> Floats:
    """All strands riding on guides, (point_count, 3) [m], world space.

    Args:
        guides_now: (guide_count, cv_count, 3) [m], simulated or baked, world space.
        led: strands that were led out of colliders.
    """
    points = _ridden_strands(rig, pose, guides_now)[0]
    points = held_strands(rig, pose, points)
    led.put(points, rig.strands.offsets)
    return points


def _ridden_strands(rig: Rig, pose: Pose, guides_now: Floats) -> tuple[Floats, RootMotions]:
    """All strands riding on guides, and how their roots have moved."""
    motions = motions_of(rig, pose)
    # in the guides' own precision, so that guides that only their roots move turn by exactly 0
    by_roots = _carried_guides(rig, motions.take(rig.guides), guides_now.dtype.type)
    return ride(rig.strands.points, rig.riders, by_roots, guides_now, motions), motions


def strands_at_rest(rig: Rig, pose: Pose) -> Floats:
    """All strands in their style, (point_count, 3) [m], world space."""
    if rig.holds is None and _is_unmoved(rig, pose):
        return rig.strands.points  # as `carried_strands` would, bit for bit
    if held_guides(rig, pose) is None:
        return held_strands(rig, pose, carried_strands(rig, pose))  # guides at rest move nothing
    return strands_at(rig, pose, style_of_guides(rig, pose))


def _is_unmoved(rig: Rig, pose: Pose) -> bool:
    """Whether the body is where it was when the rig was made."""
    if rig.head is None or pose.head_positions is None:
        return np.array_equal(pose.matrix, np.eye(4))
    return np.array_equal(pose.head_positions, rig.head.positions)


def held_strands(rig: Rig, pose: Pose, points: Floats) -> Floats:
    """Strands (point_count, 3) that ride, brought to where they are held; in place."""
    holds = None if rig.holds is None else rig.holds.where(pose.anchors)
    if holds is None or pose.anchors is None or not len(holds.strand):
        return points
    hold_strands(points, rig.strands.points, rig.strands.offsets, holds, pose.anchors)
    return points


def root_turns(rig: Rig, pose: Pose) -> Floats:
    """How the body has turned the root of each guide since rest, (guide_count, 3, 3)."""
    count, frames = len(rig.guides), rig.rest_frames
    if rig.head is None or pose.head_positions is None or frames is None:
        return np.broadcast_to(pose.matrix[:3, :3], (count, 3, 3))
    triangle, barycentric = rig.strands.root_triangle, rig.strands.root_barycentric
    assert triangle is not None and barycentric is not None
    now = root_frames(
        pose.head_positions, rig.head.triangles, triangle[rig.guides], barycentric[rig.guides]
    )
    turns: Floats = now.rotation @ frames.rotation[rig.guides].transpose(0, 2, 1)
    return turns
