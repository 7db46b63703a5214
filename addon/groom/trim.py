"""Trim: strands end where they first leave a shape.

A shape is a closed mesh or a plane, which is unbounded or as large as a flat mesh. A plane's inside
is the side with most of the roots. A shape does not cut strands whose roots are outside of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..arrays import Bools, Floats
from ..strands import StrandSet, Surface
from ..strands.arc_length import first_point_at_arc_length
from ..strands.catmull_rom import even_points_on_curve
from ..strands.crossings import first_crossings

#: Number of pieces that each segment is divided into to find where it leaves a shape.
_PIECES = 8
#: Strands cut at once, to bound the memory of their pieces.
_CHUNK = 4096
#: A mesh is flat where it is no thicker than this fraction of its extent.
_FLAT = 1.0e-4


class Shape(Protocol):
    """A shape that cuts. All in the space of the strands."""

    def has_inside(self, roots: Floats) -> Bools:
        """Which roots (n, 3) are inside, (n,); needs the roots of all strands, since a plane's
        inside is where most of them are."""
        ...

    def exit_positions(self, lines: Floats) -> Floats:
        """Where lines (n, count, 3) that start inside first leave it, (n,) in segments from their
        start; infinite where they do not."""
        ...


@dataclass(frozen=True, eq=False)
class Plane:
    """origin: (3,) [m]. normal: (3,) unit. faces: as far as it reaches; None: without bounds."""

    origin: Floats
    normal: Floats
    faces: Surface | None = None

    def has_inside(self, roots: Floats) -> Bools:
        is_before = self._height(roots) >= 0.0
        return is_before if 2 * is_before.sum() >= len(roots) else ~is_before

    def exit_positions(self, lines: Floats) -> Floats:
        if self.faces is not None:
            return first_crossings(lines, self.faces)
        height = self._height(lines)
        is_through = (height[:, 1:] >= 0.0) != (height[:, :1] >= 0.0)
        number = is_through.argmax(axis=1)[:, None]
        before, after = (
            np.take_along_axis(height, each, axis=1)[:, 0] for each in (number, number + 1)
        )
        passed = is_through.any(axis=1)
        place = np.full(len(lines), np.inf)
        np.divide(before, before - after, out=place, where=passed)
        return place + number[:, 0]

    def _height(self, points: Floats) -> Floats:
        return np.asarray((points.astype(np.float64) - self.origin) @ self.normal)


def plane_of_flat_mesh(surface: Surface) -> Plane | None:
    """The plane that a mesh lies in, as far as it reaches; None where it is not flat."""
    places = surface.positions[np.unique(surface.triangles)].astype(np.float64)
    origin = places.mean(axis=0)
    _, extent, axes = np.linalg.svd(places - origin, full_matrices=False)
    is_flat = len(extent) == 3 and extent[2] <= _FLAT * extent[0] and extent[1] > 0.0
    return Plane(origin, axes[2], surface) if is_flat else None


@dataclass(frozen=True, eq=False)
class Trimmed:
    """points: (point_count, 3) float32 [m]. is_trimmed: (strand_count,), is shorter than before.
    is_outside: (strand_count,), has its root outside of all shapes."""

    points: Floats
    is_trimmed: Bools
    is_outside: Bools


def trim_strands(strands: StrandSet, shapes: Sequence[Shape]) -> Trimmed:
    """Strands cut where they first leave a shape that their root is in; they keep their point
    counts, in the same proportions along the rest of their curve."""
    points = strands.points.copy()
    inside = np.array([shape.has_inside(strands.roots) for shape in shapes])
    inside = inside.reshape(len(shapes), strands.strand_count)
    is_trimmed = np.zeros(strands.strand_count, bool)
    for count in np.unique(strands.point_counts).tolist():
        of_count = np.flatnonzero(strands.point_counts == count)
        for start in range(0, len(of_count), _CHUNK):
            some = of_count[start : start + _CHUNK]
            places = strands.offsets[some, None] + np.arange(count)
            fine = even_points_on_curve(strands.points[places], (count - 1) * _PIECES + 1)
            left = np.full(len(some), np.inf)
            for shape, of_shape in zip(shapes, inside[:, some], strict=True):
                within = np.flatnonzero(of_shape)
                left[within] = np.minimum(left[within], shape.exit_positions(fine[within]))
            is_cut = np.isfinite(left)
            is_trimmed[some] = is_cut
            points[places[is_cut]] = _cut_at(fine[is_cut], left[is_cut])
    return Trimmed(points, is_trimmed, ~inside.any(axis=0))


def _cut_at(fine: Floats, left: Floats) -> Floats:
    """Every _PIECES-th of the points (n, count, 3), moved along their lines: the last one to `left`
    segments from the start, the others by arc length in proportion."""
    step = np.linalg.norm(np.diff(fine.astype(np.float64), axis=1), axis=2)
    reached = np.concatenate([np.zeros((len(fine), 1)), np.cumsum(step, axis=1)], axis=1)
    own = reached[:, ::_PIECES]
    end = _at(reached, left[:, None])[:, 0]
    wanted = own * (end / np.maximum(own[:, -1], 1.0e-30))[:, None]
    offsets = np.arange(len(fine) + 1) * fine.shape[1]
    far = first_point_at_arc_length(reached.ravel(), offsets, wanted) - offsets[:-1, None]
    segment = np.clip(far - 1, 0, fine.shape[1] - 2)
    before, after = (np.take_along_axis(reached, segment + k, axis=1) for k in (0, 1))
    span = after - before
    part = np.divide(wanted - before, span, out=np.zeros_like(wanted), where=span > 0.0)
    place = segment + np.clip(part, 0.0, 1.0)
    place[:, -1] = left  # exactly: the last point is the one on the shape
    axes = (np.ascontiguousarray(fine[..., axis]) for axis in range(3))
    return np.stack([_at(axis, place) for axis in axes], axis=-1)


def _at(values: Floats, place: Floats) -> Floats:
    """Values of points (n, count) at places (n, k) in segments."""
    segment = np.clip(place.astype(np.int64), 0, values.shape[1] - 2)
    before, after = (np.take_along_axis(values, segment + k, axis=1) for k in (0, 1))
    return np.asarray(before + (place - segment) * (after - before))
