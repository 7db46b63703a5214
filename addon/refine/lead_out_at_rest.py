"""Children that were mixed from strands on both sides of an ear go through it, and fur through the
folds of its mesh: such are led out once, at rest, as moving strands are."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..dynamics.colliders import DistanceField, PosedCollider, signed_distance
from ..dynamics.colliders.distance_field import UNCOVERED
from ..dynamics.colliders.winding import winding_number
from ..dynamics.settings import DynamicsSettings
from ..strands import StrandSet
from ..strands.arc_length import reached
from ..strands.closest_point import search_of
from .lead_out import Clearance, beside_meshes, lead_out

#: How far a point keeps from the head at most, as a part of its distance along the strand.
LIFT = 0.3
#: What is deeper in the head afterwards, as a part of the distance that is kept, is inside.
DEEP = 0.5


def led_out_at_rest(
    strands: StrandSet, head: DistanceField, length: float
) -> tuple[StrandSet, Bools]:
    """Strands outside of the head that they grow on, and which (strand_count,) are: a few of them,
    as in a fold, nothing leads out.

    Args:
        strands: in the space of the head.
        length: the hair's [m]; they keep as far from the head as moving hair does by default.
    """
    kept = DynamicsSettings().radius_root * length
    posed = (PosedCollider(head, np.eye(4), np.eye(4)),)
    offsets, points = strands.offsets, strands.points.copy()
    distance, _ = signed_distance(points, posed, kept)
    along = reached(strands.points, offsets)
    wanted = np.minimum(kept, LIFT * along).astype(np.float32)
    wanted[offsets[:-1]] = -np.inf
    beside = beside_meshes(points, distance, posed, kept)
    wanted[beside] = -np.inf
    clearance = Clearance(kept, wanted, np.zeros(strands.strand_count, np.int32))
    carry = partial(_as_they_are, strands.points)
    lead_out(points, carry, offsets, posed, clearance)
    led = replace(strands, points=points)
    outside = beside[(points[beside] == strands.points[beside]).all(axis=1)]
    return led, ~are_inside(led, head, DEEP * kept, outside)


def are_inside(
    strands: StrandSet, head: DistanceField, deep: float, outside: Ints | None = None
) -> Bools:
    """Which strands (strand_count,) have a point in the head itself that is deeper than this.

    Args:
        outside: points that are known not to be in it; None: none is.
    """
    posed = (PosedCollider(head, np.eye(4), np.eye(4)),)
    distance, _ = signed_distance(strands.points, posed, deep)
    if outside is not None:
        distance[outside] = np.inf
    inside = _inside(strands.points, head, distance, deep)
    found = np.zeros(strands.strand_count, bool)
    found[np.searchsorted(strands.offsets, inside, side="right") - 1] = True
    return found


def _as_they_are(points: Floats, index: Ints, _: Ints) -> Floats:
    """At rest, roots carry points to where they are."""
    return points[index]


def _inside(points: Floats, head: DistanceField, distance: Floats, deep: float) -> Ints:
    """The points (n,) that are deeper in the head itself than `deep`, not only in its grid."""
    near = np.flatnonzero(distance < min(UNCOVERED * head.cell - deep, 0.0))
    if head.surface is None or not len(near):
        return near
    near = near[np.abs(winding_number(points[near], head.surface)) > 0.5]
    if not len(near):
        return near
    away = search_of(head.surface).closest(points[near], deep).distance
    return near[away > deep]
