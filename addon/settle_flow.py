"""The flow of settling: combed hair falls onto what it collides with, and keeps that shape.

Limitations: strands do not push each other, so that hair lies as deep as its guides were combed.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from . import motion_flow
from .arrays import Bools, Floats
from .dynamics.colliders import DistanceField, PosedCollider
from .dynamics.painted import PaintedGuides
from .dynamics.settings import DynamicsSettings
from .dynamics.settle_settings import SettleSettings
from .groom.settings import GuideSettings
from .motion_flow import FrameInput
from .refine.lead_out_at_rest import lead_out_at_rest
from .rig_flow import Pose, Rig
from .strands import StrandSet
from .strands.arc_length import length_fractions, segment_lengths
from .strands.vectors import unit

#: At most this many curves are simulated; the others ride on them.
_MAX_GUIDES = 4096
#: Duration of a frame [s], and how many there are at least before hair counts as at rest.
_FRAME, _MIN_FRAMES = 1.0 / 24.0, 12
#: Hair is at rest where no CV moves farther in a frame than this fraction of the hair's length.
_REST_MOTION = 1.0e-4
#: Limits of the CVs that guides have.
_MIN_CVS, _MAX_CVS = 8, 64


def settle_guide_settings(strands: StrandSet, own: GuideSettings) -> GuideSettings:
    """Settings that simulate all curves, with the median of their point counts."""
    typical = int(np.median(strands.point_counts)) if strands.strand_count else own.cv_count
    cv_count = min(max(typical, own.cv_count, _MIN_CVS), _MAX_CVS)
    guide_count = min(max(strands.strand_count, 1), _MAX_GUIDES)
    return GuideSettings(guide_count=guide_count, cv_count=cv_count, tip_distance=own.tip_distance)


def settle(
    rig: Rig,
    pose: Pose,
    colliders: tuple[PosedCollider, ...],
    own: DynamicsSettings,
    settings: SettleSettings,
    gravity: Floats,
    painted: PaintedGuides | None = None,
) -> Generator[float, None, Floats]:
    """All strands after they have fallen, (point_count, 3) [m]; yields progress, 0 to 1.

    Args:
        pose, colliders: at rest, where they stay.
        own: the hair's dynamics.
        gravity: (3,) [m/s^2], world space.
        painted: factors of its dynamics at each guide; those that hide motion are ignored.
    """
    falling = settings.falling(own)
    max_rest_motion = _REST_MOTION * float(np.median(rig.rest_lengths))
    motion = motion_flow.begin(rig, pose)
    frame_count = round(settings.seconds / _FRAME)
    seen = None if painted is None else painted.without_display_factors()
    frame = FrameInput(pose, colliders, falling, gravity, _FRAME, painted=seen)
    for number in range(frame_count):
        before = motion.guides
        motion = motion_flow.advance(rig, motion, frame)
        yield (number + 1) / frame_count
        if (
            number >= _MIN_FRAMES
            and np.abs(motion.guides - before).max(initial=0.0) < max_rest_motion
        ):
            break
    return motion_flow.strands_and_led(rig, motion)[0]


def settled_curves(
    curves: StrandSet, rig: Rig, fallen: Floats, head: DistanceField | None
) -> tuple[StrandSet, Bools]:
    """The artist's curves in their fallen shapes, each segment as long as it was, and which of them
    are outside of the head, (strand_count,).

    Args:
        curves: as combed, bound to the head if there is one.
        fallen: (point_count, 3) [m], the rig's strands.
    """
    length = segment_lengths(curves.points, curves.offsets)
    place = length_fractions(curves.points, curves.offsets)
    known = length_fractions(rig.strands.points, rig.strands.offsets)
    # strand n takes 2 n to 2 n + 1, so that one interpolation serves all strands
    wanted = place + 2.0 * np.repeat(np.arange(curves.strand_count), curves.point_counts)
    there = known + 2.0 * np.repeat(np.arange(curves.strand_count), rig.strands.point_counts)
    points = np.stack([np.interp(wanted, there, fallen[:, axis]) for axis in range(3)], axis=1)
    first = curves.offsets[:-1]
    points[first] = curves.points[first]
    direction = unit(np.diff(points, axis=0, prepend=points[:1]))
    for number in range(1, int(curves.point_counts.max(initial=1))):
        at = first[curves.point_counts > number] + number
        points[at] = points[at - 1] + direction[at] * length[at, None]
    settled = replace(curves, points=points.astype(np.float32))
    if head is None:
        return settled, np.ones(curves.strand_count, bool)
    return lead_out_at_rest(settled, head, float(np.median(curves.lengths())))
