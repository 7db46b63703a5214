"""Leading strands out of the head once, at rest, in the same way as moving strands.

For children interpolated between strands on both sides of an ear, which go through it, and for fur
in the folds of its mesh.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import Bools, Floats, Ints, pieces_of_rows
from ..dynamics.colliders import DistanceField, PosedCollider, signed_distance
from ..dynamics.colliders.distance_field import MAX_UNCOVERED
from ..dynamics.colliders.winding import winding_number
from ..dynamics.settings import DynamicsSettings
from ..strands import StrandSet
from ..strands.arc_length import arc_lengths
from ..strands.closest_point import search_of
from .lead_out import Clearance, lead_out, points_outside_meshes

#: Maximum distance that a point keeps from the head, as a fraction of its distance from the root
#: along the strand.
LIFT = 0.3
#: A point counts as inside if it is still deeper in the head than this fraction of the distance
#: that strands keep.
DEEP = 0.5


def lead_out_at_rest(
    strands: StrandSet, head: DistanceField, length: float
) -> tuple[StrandSet, Bools]:
    """Strands led out of the head that they grow on, and which are outside, (strand_count,).

    Nothing leads out a few strands, as in a fold.

    Args:
        strands: in the space of the head.
        length: the hair's length [m]. Strands keep the distance from the head that moving hair of
            this length keeps by default.
    """
    max_distance = DynamicsSettings().radius_root * length
    posed = (PosedCollider(head, np.eye(4), np.eye(4)),)
    offsets, points = strands.offsets, strands.points.copy()
    distance, _ = signed_distance(points, posed, max_distance)
    along = arc_lengths(strands.points, offsets)
    wanted = np.minimum(max_distance, LIFT * along).astype(np.float32)
    wanted[offsets[:-1]] = -np.inf
    beside = points_outside_meshes(points, distance, posed, max_distance)
    wanted[beside] = -np.inf
    clearance = Clearance(max_distance, wanted, np.zeros(strands.strand_count, np.int32))
    carry = partial(_as_they_are, strands.points)
    lead_out(points, carry, offsets, posed, clearance)
    led = replace(strands, points=points)
    outside = beside[(points[beside] == strands.points[beside]).all(axis=1)]
    return led, ~are_inside(led, head, DEEP * max_distance, outside)


def are_inside(
    strands: StrandSet, head: DistanceField, deep: float, outside: Ints | None = None
) -> Bools:
    """Which strands (strand_count,) have a point deeper than `deep` [m] in the head's mesh.

    Args:
        outside: indices of points known to be outside; None: none.
    """
    posed = (PosedCollider(head, np.eye(4), np.eye(4)),)
    distance, _ = signed_distance(strands.points, posed, deep)
    if outside is not None:
        distance[outside] = np.inf
    inside = _inside(strands.points, head, distance, deep)
    found = np.zeros(strands.strand_count, bool)
    found[pieces_of_rows(inside, strands.offsets)] = True
    return found


def _as_they_are(points: Floats, index: Ints, _: Ints) -> Floats:
    """`CarryPoints` at rest: roots carry points to where they are."""
    return points[index]


def _inside(points: Floats, head: DistanceField, distance: Floats, deep: float) -> Ints:
    """The points (n,) that are deeper than `deep` in the head's mesh, not only in its field."""
    near = np.flatnonzero(distance < min(MAX_UNCOVERED * head.cell - deep, 0.0))
    if head.surface is None or not len(near):
        return near
    near = near[np.abs(winding_number(points[near], head.surface)) > 0.5]
    if not len(near):
        return near
    away = search_of(head.surface).closest(points[near], deep).distance
    return near[away > deep]
