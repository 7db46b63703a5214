"""The flow of hair under a brush: what a stroke has touched follows at once.

Curves that moved, and the children that they have a part in, are shaped again; each keeps its root,
its guides and their weights, its clump, its random numbers and its point count. So nothing else
changes, and what was found for the whole groom, such as ambient occlusion, stays. What it leaves
to `rig_flow.prepare`, which is to follow: points by need, children that are led out of the head or
change guides, widths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arrays import Floats, Ints
from .rig_flow import Grown, Rig
from .strands import StrandSet
from .strands.center_lines import center_lines
from .strands.needed_points import with_points
from .strands.resample import resample


def combed(rig: Rig, curves: StrandSet, number: Ints, *, is_animated: bool = False) -> Rig:
    """The rig with some of the artist's curves elsewhere.

    Args:
        curves: (n,) world space at rest, as they are now.
        number: (n,) ascending, which of the rig's own strands these are.
        is_animated: whether strands have kept their own points, see `rig_flow.prepare`.
    """
    strands, cv_count = rig.strands, rig.guide_grid.shape[1]
    points = strands.points.copy()
    counts, before = strands.point_counts[number], curves.point_counts
    is_even = before > counts if is_animated else before != counts
    _put(points, strands.offsets, number, with_points(curves, counts, is_even))
    guide_grid = rig.guide_grid.copy()
    guides = np.flatnonzero(np.isin(rig.guides, number))
    if len(guides):
        moved = curves.take(np.searchsorted(number, rig.guides[guides]))
        guide_grid[guides] = center_lines(moved, cv_count).grid
    grown, own = rig.grown, rig.own_count
    if grown is not None and own is not None:
        grown, touched = _grown(grown, strands, points, number)
        if len(touched):
            put_children(points, strands.offsets, grown, touched, own)
    return replace(rig, strands=replace(strands, points=points), guide_grid=guide_grid, grown=grown)


def _grown(grown: Grown, strands: StrandSet, points: Floats, number: Ints) -> tuple[Grown, Ints]:
    """The children's parents as they are now, and which of the rig's children they shape again.

    Args:
        strands: of the rig. points: theirs now; those of strands of these numbers have moved.
    """
    is_moved = np.isin(grown.parents, number)
    parents = np.flatnonzero(is_moved)
    if not len(parents):
        return grown, parents
    grid = grown.shapes.grid.copy()
    moved = _taken(strands, points, grown.parents[parents])
    grid[parents] = resample(moved, grid.shape[1]).grid
    shapes = replace(grown.shapes, points=grid.reshape(-1, 3))
    touched = np.flatnonzero(grown.growth.touched(is_moved)[grown.kept])
    return replace(grown, shapes=shapes), touched


def _taken(strands: StrandSet, points: Floats, chosen: Ints) -> StrandSet:
    """Some of the strands, with these points of all, without making a set of all."""
    counts = strands.point_counts[chosen]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    picked = np.arange(offsets[-1]) + np.repeat(strands.offsets[chosen] - offsets[:-1], counts)
    return strands.take(chosen).with_points(points[picked])


def put_children(points: Floats, offsets: Ints, grown: Grown, chosen: Ints, own: int) -> None:
    """Write some of a rig's children (n,) as they have grown, by as many points as they had.

    Args:
        chosen: numbers among the children whose growth ascends.
        own: how many strands come before them.
    """
    children = _strands(grown.growth.shapes(grown.shapes.grid, grown.kept[chosen]))
    counts = (offsets[1:] - offsets[:-1])[own + chosen]
    children = with_points(children, counts, children.point_counts != counts)
    _put(points, offsets, own + chosen, children)


def _strands(grid: Floats) -> StrandSet:
    """Of the points alone, (n, count, 3)."""
    count, points = grid.shape[1], grid.reshape(-1, 3)
    offsets = np.arange(len(grid) + 1) * count
    return StrandSet(points, offsets, np.ones(len(points)), np.zeros(len(grid), np.int32))


def _put(points: Floats, offsets: Ints, number: Ints, strands: StrandSet) -> None:
    """Write strands in place of those of these numbers, which have as many points."""
    first = np.repeat(offsets[number] - strands.offsets[:-1], strands.point_counts)
    points[first + np.arange(len(strands.points))] = strands.points
