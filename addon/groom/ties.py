"""Finding where hair is held: by ties that it passes through, and at tips on a surface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints, pieces_of_rows
from ..strands import StrandSet, Surface
from ..strands.affine import transform_points
from ..strands.closest_point import ClosestPointSearch
from ..strands.strand_set import ROOT_POINTS
from .holds import Holds

#: A surface holds tips where its weight is at least this.
MIN_HOLDING_WEIGHT = 0.5


@dataclass(frozen=True, eq=False)
class Tie:
    """A ring or a ball that holds the strands which pass through it at rest.

    name: in messages.
    shape: (4, 4), to the world at rest from a space in which it is the disc x^2 + y^2 <= 1 in the
        plane z = 0, or the unit ball.
    """

    name: str
    shape: Floats
    is_ball: bool = False


@dataclass(frozen=True, eq=False)
class TipSurface:
    """A surface that holds the tips near to it; world space at rest.

    weight: (vertex_count,), it holds tips only where this is MIN_HOLDING_WEIGHT or more; None:
        everywhere.
    """

    name: str
    surface: Surface
    weight: Floats | None = None


@dataclass(frozen=True)
class Holders:
    """All that may hold a groom's hair."""

    ties: tuple[Tie, ...] = ()
    tip_surface: TipSurface | None = None

    def __bool__(self) -> bool:
        return bool(self.ties) or self.tip_surface is not None


NO_HOLDERS = Holders()


def find_holds(strands: StrandSet, holders: Holders, tip_distance: float = 0.0) -> Holds | None:
    """Where strands of any point counts are held; None where nothing may hold them.

    A tie holds a strand at one place: a ring where the strand first passes through it, a ball where
    the strand is nearest to its middle. The root determines the first two points, so no place is
    before the third, and strands of two points are never held. Of two places that share a point,
    the one nearer to the root counts.

    Args:
        tip_distance: tips nearer to their surface than this are held [m].
    """
    if not holders:
        return None
    tie_count = len(holders.ties)
    found: list[tuple[Ints, Floats, Ints]] = []
    for number, tie in enumerate(holders.ties):
        passing, places = _strands_passing(strands, tie)
        found.append((passing, places, np.full(len(passing), number)))
    if holders.tip_surface is not None:
        tips, triangle, barycentric = _tips_near(strands, holders.tip_surface, tip_distance)
        found.append((tips, strands.point_counts[tips] - 1.0, tie_count + np.arange(len(tips))))
    strand = np.concatenate([one[0] for one in found])
    place = np.concatenate([one[1] for one in found]).astype(np.float32)
    anchor = np.concatenate([one[2] for one in found]).astype(np.int32)
    order = np.lexsort((place, strand))
    strand, place, anchor = strand[order], place[order], anchor[order]
    kept = _without_shared_points(strand, place)
    holds = Holds(strand[kept], place[kept], anchor[kept], tie_count)
    if holders.tip_surface is None:
        return holds
    return replace(
        holds,
        surface=holders.tip_surface.surface,
        tip_triangle=triangle,
        tip_barycentric=barycentric,
    )


def unused_holder_notes(holds: Holds, holders: Holders) -> tuple[str, ...]:
    """Notes on ties and surfaces that hold no hair, each with a remedy."""
    busy = set(np.unique(np.minimum(holds.anchor, holds.tie_count)).tolist())
    notes = [
        f"No hair passes through the tie {tie.name}, so it holds none. Move it so that hair passes "
        "through it, then press Preview again."
        for number, tie in enumerate(holders.ties)
        if number not in busy
    ]
    surface = holders.tip_surface
    if surface is not None and holds.tie_count not in busy:
        notes.append(
            f"No tip is near {surface.name}, or near its part that holds tips, so it holds none. "
            "Raise Tip Distance, or move it and press Preview again."
        )
    return tuple(notes)


def _strands_passing(strands: StrandSet, tie: Tie) -> tuple[Ints, Floats]:
    """The strands that pass through a tie, ascending, and where along each."""
    local = transform_points(strands.points, np.linalg.inv(tie.shape)).astype(np.float64)
    begin, step = local[:-1], np.diff(local, axis=0)
    is_segment = _are_segments(strands)
    with np.errstate(divide="ignore", invalid="ignore"):
        if tie.is_ball:
            part = -(begin * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1.0e-30)
        else:
            part = np.where(
                (begin[:, 2] < 0.0) != (local[1:, 2] < 0.0), -begin[:, 2] / step[:, 2], np.nan
            )
    part = np.clip(part, 0.0, 1.0)
    here = begin + part[:, None] * step
    away = (here[:, : 3 if tie.is_ball else 2] ** 2).sum(axis=1)
    segment = np.flatnonzero(is_segment & (away <= 1.0))  # NaN is not
    strand = pieces_of_rows(segment, strands.offsets)
    nearness = away[segment] if tie.is_ball else segment
    order = np.lexsort((nearness, strand))
    strand, segment = strand[order], segment[order]
    first = np.flatnonzero(np.diff(strand, prepend=-1))
    strand, segment = strand[first], segment[first]
    # below 1, since the next point belongs to the next segment
    within = np.minimum(part[segment], np.float32(1.0 - 2.0**-12))
    place = segment - strands.offsets[strand] + within
    return strand, np.maximum(place, np.float32(ROOT_POINTS))


def _are_segments(strands: StrandSet) -> Bools:
    """Which of the steps between successive points are segments of strands that can be held."""
    are_segments = np.repeat(strands.point_counts > ROOT_POINTS, strands.point_counts)[:-1]
    are_segments[strands.offsets[1:-1] - 1] = False  # from a tip to the next root
    return are_segments


def _tips_near(strands: StrandSet, tips: TipSurface, distance: float) -> tuple[Ints, Ints, Floats]:
    """The strands whose tips are held, and the triangles and barycentric coordinates of these."""
    points = strands.points[strands.offsets[1:] - 1]
    low, high = tips.surface.bounds()
    is_near = ((points >= low - distance) & (points <= high + distance)).all(axis=1)
    is_near &= strands.point_counts > ROOT_POINTS
    near = np.flatnonzero(is_near)
    closest = ClosestPointSearch(tips.surface).closest(points[near], distance)
    kept = closest.distance <= distance
    if tips.weight is not None:
        of_corners = tips.weight[tips.surface.triangles[closest.triangle]]
        kept &= (of_corners * closest.barycentric).sum(axis=1) >= MIN_HOLDING_WEIGHT
    barycentric: Floats = closest.barycentric[kept].astype(np.float32)
    return near[kept], closest.triangle[kept], barycentric


def _without_shared_points(strand: Ints, place: Floats) -> Ints:
    """Indices of places that share no point with an earlier one, in order along each strand."""
    first, kept, last = np.floor(place), [], (-1, -1.0)
    shared = np.flatnonzero((np.diff(strand) == 0) & (np.diff(first) < 2.0))
    if not len(shared):
        return np.arange(len(strand))
    for number in range(len(strand)):
        if strand[number] == last[0] and first[number] < last[1] + 2.0:
            continue
        kept.append(number)
        last = int(strand[number]), float(first[number])
    return np.array(kept, np.int64)
