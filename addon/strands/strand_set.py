"""`StrandSet`, the one model of hair: a ragged array of points, and attributes of strands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Floats, Ints, rows_of_ranges
from ..errors import HairloomError
from .affine import mean_scale, transform_points
from .arc_length import strand_lengths, uneven_length_fractions

#: Radius of hair without widths of its own, until `groom.widths` finds one.
DEFAULT_RADIUS = 4.0e-5  # [m], half of 0.08 mm, a typical human hair

#: Points of each strand that move with its root: the second gives the root's direction.
ROOT_POINTS = 2


@dataclass(frozen=True)
class StrandSet:
    """Strands from root to tip in one space (documented by its maker), validated on creation.

    points: (point_count, 3) float32 [m], strand by strand, root first.
    offsets: (strand_count + 1,) int32, strand s is points[offsets[s]:offsets[s + 1]].
    radius: (point_count,) float32 [m].
    group: (strand_count,) int32.
    root_uv: (strand_count, 2) float32, or None where no UVs are known.
    root_triangle: (strand_count,) int32, or None when unbound.
    root_barycentric: (strand_count, 3) float32, or None when unbound.
    color: (point_count, 3) float32 scene-linear, the hair's own; NaN at all points of strands that
        have none; None if no strand has any.
    seed: (strand_count,) int32, seeds the noise of each strand; 0 or None: by the strand's index.
    has_widths: whether the radii are the groom's own; otherwise they are `DEFAULT_RADIUS`.

    Raises:
        HairloomError: shapes that do not fit, a strand of fewer than two points, values that
            are not finite. Use `strands.clean` to make a set from untrusted curves.
    """

    points: Floats
    offsets: Ints
    radius: Floats
    group: Ints
    root_uv: Floats | None = None
    root_triangle: Ints | None = None
    root_barycentric: Floats | None = None
    color: Floats | None = None
    has_widths: bool = True
    seed: Ints | None = None

    def __post_init__(self) -> None:
        for name, dtype in _DTYPES.items():
            value = getattr(self, name)
            if value is not None:
                value = np.ascontiguousarray(value, dtype)
                value.flags.writeable = False
                object.__setattr__(self, name, value)
        self._check_shapes()
        if self.strand_count and self.point_counts.min() < 2:
            raise _broken("a strand has fewer than two points")
        if not np.isfinite(self.points).all():
            raise _broken("a point is not finite")

    def _check_shapes(self) -> None:
        if self.offsets.ndim != 1 or not len(self.offsets) or self.offsets[0] != 0:
            raise _broken("offsets must be a list that starts with 0")
        points, strands = int(self.offsets[-1]), self.strand_count
        expected = {
            "points": (points, 3),
            "radius": (points,),
            "group": (strands,),
            "root_uv": (strands, 2),
            "root_triangle": (strands,),
            "root_barycentric": (strands, 3),
            "color": (points, 3),
            "seed": (strands,),
        }
        for name, shape in expected.items():
            value = getattr(self, name)
            if value is not None and value.shape != shape:
                raise _broken(f"{name} has shape {value.shape} instead of {shape}")
        if (self.root_triangle is None) != (self.root_barycentric is None):
            raise _broken("root_triangle and root_barycentric must be given together")

    @property
    def strand_count(self) -> int:
        return len(self.offsets) - 1

    @property
    def point_count(self) -> int:
        return len(self.points)

    @property
    def point_counts(self) -> Ints:
        """Points of each strand, (strand_count,)."""
        return np.diff(self.offsets)

    @property
    def roots(self) -> Floats:
        """First point of each strand, (strand_count, 3) [m]."""
        return self.points[self.offsets[:-1]]

    @property
    def is_bound(self) -> bool:
        return self.root_triangle is not None

    @property
    def is_uniform(self) -> bool:
        """Whether all strands have the same number of points, so that `grid` works."""
        return self.strand_count == 0 or bool((self.point_counts == self.point_counts[0]).all())

    @property
    def grid(self) -> Floats:
        """The points as (strand_count, cv_count, 3); only for a uniform set."""
        if not self.is_uniform:
            raise _broken("the strands differ in point count; resample them first")
        cv_count = int(self.point_counts[0]) if self.strand_count else 2
        return self.points.reshape(self.strand_count, cv_count, 3)

    @property
    def color_grid(self) -> Floats | None:
        """The colours as (strand_count, cv_count, 3); only for a uniform set."""
        return None if self.color is None else self.color.reshape(self.grid.shape)

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner of all points, each (3,) [m]; zeros for an empty set."""
        if not self.point_count:
            return np.zeros(3, np.float32), np.zeros(3, np.float32)
        axes = self.points.T  # one by one: numpy is slow on rows of three
        low, high = [axis.min() for axis in axes], [axis.max() for axis in axes]
        return np.array(low), np.array(high)

    def lengths(self) -> Floats:
        """Arc length of each strand, (strand_count,) [m]."""
        return strand_lengths(self.points, self.offsets)

    @cached_property
    def uneven_length_fractions(self) -> Floats | None:
        """The fraction of its strand's length at each point, (point_count,); None if points are
        evenly spaced, see `arc_length.uneven_length_fractions`."""
        return uneven_length_fractions(self.points, self.offsets)

    def take(self, strands: Ints) -> StrandSet:
        """The strands with these indices, in this order."""
        counts = self.point_counts[strands]
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        picked = rows_of_ranges(self.offsets[:-1][strands], counts)
        per_strand: dict[str, Any] = {
            name: None if getattr(self, name) is None else getattr(self, name)[strands]
            for name in _PER_STRAND
        }
        return StrandSet(
            # take is three times as fast as indexing
            self.points.take(picked, axis=0),
            offsets,
            self.radius.take(picked),
            color=None if self.color is None else self.color.take(picked, axis=0),
            has_widths=self.has_widths,
            **per_strand,
        )

    def with_points(self, points: Floats) -> StrandSet:
        """The same strands with moved points, (point_count, 3) [m]."""
        return replace(self, points=points)

    def transformed(self, matrix: Floats) -> StrandSet:
        """Moved by an affine (4, 4) matrix; radii scale by the cube root of its volume change."""
        radius = self.radius * np.float32(mean_scale(matrix))
        return replace(self, points=transform_points(self.points, matrix), radius=radius)

    def iter_strands(self) -> Iterator[Floats]:
        """The points of each strand, for slow reference implementations and tests."""
        for start, end in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            yield self.points[start:end]


_DTYPES = {
    "points": np.float32,
    "offsets": np.int32,
    "radius": np.float32,
    "group": np.int32,
    "root_uv": np.float32,
    "root_triangle": np.int32,
    "root_barycentric": np.float32,
    "color": np.float32,
    "seed": np.int32,
}
_PER_STRAND = ("group", "root_uv", "root_triangle", "root_barycentric", "seed")
assert {*_DTYPES, "has_widths"} == {field.name for field in fields(StrandSet)}


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="strand data", remedy="Pass it through strands.clean")
