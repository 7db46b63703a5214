"""The flow of an animated style: curves that shape keys, modifiers, nodes or a cache move are the
style of each frame.

A rig is at rest, so the curves of a frame are brought back to rest. Children, guides and weights,
roots on the head and occlusion stay those of the rig, and all that moves a rig works as usual. The
curves may have been moved by their object alone, or may already follow their surface, as Blender's
own hair nodes make them. Each of the two is undone, and the result with roots nearer to those of
the rig is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arrays import Floats
from .comb_flow import combed_rig
from .motion_flow import motions_of
from .refine.ride import ride
from .rig_flow import Pose, Rig
from .strands import StrandSet
from .strands.root_motions import RootMotions


def curves_at_rest(rig: Rig, curves: StrandSet, pose: Pose, to_rest: Floats) -> StrandSet:
    """The artist's own curves of this moment, brought back to where the rig is.

    Args:
        curves: all of them, world space now.
        pose: where the body is now.
        to_rest: (4, 4) from where the hair's object is now to where it was at rest.
    """
    is_there = np.allclose(to_rest, np.eye(4))
    by_object = curves if is_there else curves.transformed(to_rest)
    if rig.head is None:
        return by_object
    by_surface = carried_to_rest(curves, motions_of(rig, pose, slice(curves.strand_count)))
    return min(by_object, by_surface, key=lambda strands: _mean_root_distance(rig, strands))


def rig_with_style(rig: Rig, curves: StrandSet) -> Rig:
    """The rig with another style.

    Args:
        curves: all of the artist's own, at rest.
    """
    now = combed_rig(rig, curves, np.arange(curves.strand_count), is_animated=True)
    return now if rig.grown_children is not None else _with_children_riding(rig, now)


def _with_children_riding(rig: Rig, now: Rig) -> Rig:
    """The rig of this moment with its children riding on guides, since a bake does not store how
    they have grown."""
    if not rig.child_count:
        return now
    first = rig.strands.offsets[rig.own_count]
    still = RootMotions.of_matrix(np.eye(4))
    ridden = ride(rig.strands.points, rig.riders, rig.guide_grid, now.guide_grid, still)
    points = np.concatenate([now.strands.points[:first], ridden[first:]])
    return replace(now, strands=now.strands.with_points(points))


def carried_to_rest(strands: StrandSet, motions: RootMotions) -> StrandSet:
    """Strands that follow their roots, brought back to rest; inverse of
    `groom.roots.carry_with_roots`."""
    strand = np.repeat(np.arange(strands.strand_count), strands.point_counts)
    turn = motions.turn.transpose(2, 0, 1).astype(np.float64) + np.eye(3)
    shift, origin = (each.T.astype(np.float64) for each in (motions.shift, motions.origin))
    turned = strands.points - (shift + origin)[strand]
    local = np.einsum("nij,nj->ni", np.linalg.inv(turn)[strand], turned)
    return replace(strands, points=(local + origin[strand]).astype(np.float32))


def _mean_root_distance(rig: Rig, strands: StrandSet) -> float:
    """How far roots are from those of the rig, on average [m]."""
    own = rig.strands.roots[: strands.strand_count]
    return float(np.linalg.norm(strands.roots - own, axis=1).mean())
