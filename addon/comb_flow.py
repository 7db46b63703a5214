"""The flow of hair under a comb: the rig follows each stroke of a brush at once.

Curves that moved, and children that are mixed from them, are shaped again. Each keeps its root,
guides and weights, clump, random numbers and point count. So nothing else changes, and results for
the whole groom, such as ambient occlusion, stay in use. Left to `rig_flow.prepare`, which has to
follow: the points that shapes need, children led out of the head, guides of children, and widths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arrays import Floats, Ints, rows_of_pieces
from .rig_flow import GrownChildren, Rig
from .strands import StrandSet
from .strands.center_lines import center_lines
from .strands.needed_points import with_points
from .strands.resample import resample


def combed_rig(
    rig: Rig, curves: StrandSet, curve_indices: Ints, *, is_animated: bool = False
) -> Rig:
    """The rig after some of the artist's curves have moved.

    Args:
        curves: the n curves that moved, world space at rest, as they are now.
        curve_indices: (n,) ascending, their indices among the rig's own strands.
        is_animated: whether strands have kept their own points, see `rig_flow.prepare`.
    """
    strands, cv_count = rig.strands, rig.guide_grid.shape[1]
    points = strands.points.copy()
    counts, before = strands.point_counts[curve_indices], curves.point_counts
    is_even = before > counts if is_animated else before != counts
    _write_strands(points, strands.offsets, curve_indices, with_points(curves, counts, is_even))
    guide_grid = rig.guide_grid.copy()
    guides = np.flatnonzero(np.isin(rig.guides, curve_indices))
    if len(guides):
        moved = curves.take(np.searchsorted(curve_indices, rig.guides[guides]))
        guide_grid[guides] = center_lines(moved, cv_count).grid
    grown, own = rig.grown_children, rig.own_count
    if grown is not None and own is not None:
        grown, touched = _with_moved_parents(grown, strands, points, curve_indices)
        if len(touched):
            write_children(points, strands.offsets, grown, touched, own)
    return replace(
        rig, strands=replace(strands, points=points), guide_grid=guide_grid, grown_children=grown
    )


def _with_moved_parents(
    grown: GrownChildren, strands: StrandSet, points: Floats, moved_strands: Ints
) -> tuple[GrownChildren, Ints]:
    """Children with their parents as these are now, and which of the rig's children to shape again.

    Args:
        strands: of the rig. points: of these strands now. moved_strands: the
            indices of those that have moved.
    """
    is_moved = np.isin(grown.parents, moved_strands)
    parents = np.flatnonzero(is_moved)
    if not len(parents):
        return grown, parents
    grid = grown.shapes.grid.copy()
    moved = _with_new_points(strands, points, grown.parents[parents])
    grid[parents] = resample(moved, grid.shape[1]).grid
    shapes = replace(grown.shapes, points=grid.reshape(-1, 3))
    touched = np.flatnonzero(grown.growth.touched(is_moved)[grown.rig_children])
    return replace(grown, shapes=shapes), touched


def _with_new_points(strands: StrandSet, points: Floats, chosen: Ints) -> StrandSet:
    """Some of the strands with new points; `points` are those of all strands."""
    return strands.take(chosen).with_points(points[rows_of_pieces(chosen, strands.offsets)])


def write_children(
    points: Floats, offsets: Ints, grown: GrownChildren, chosen: Ints, own_count: int
) -> None:
    """Write the shapes of some of a rig's children into `points`, with their old point counts.

    Args:
        chosen: (n,) indices among the rig's children, for which `grown.rig_children` ascends.
        own_count: the number of strands before the children.
    """
    children = _strands_of_grid(grown.growth.shapes(grown.shapes.grid, grown.rig_children[chosen]))
    counts = (offsets[1:] - offsets[:-1])[own_count + chosen]
    children = with_points(children, counts, children.point_counts != counts)
    _write_strands(points, offsets, own_count + chosen, children)


def _strands_of_grid(grid: Floats) -> StrandSet:
    """Strands of these points, (n, count, 3), with dummy radii and groups."""
    count, points = grid.shape[1], grid.reshape(-1, 3)
    offsets = np.arange(len(grid) + 1) * count
    return StrandSet(points, offsets, np.ones(len(points)), np.zeros(len(grid), np.int32))


def _write_strands(points: Floats, offsets: Ints, indices: Ints, strands: StrandSet) -> None:
    """Overwrite the strands of these numbers, which have the same point counts, in `points`."""
    points[rows_of_pieces(indices, offsets)] = strands.points
