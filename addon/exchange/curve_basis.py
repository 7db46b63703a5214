"""Points on curves, which strands consist of, from the control points of curves in files.

After the documentation of UsdGeomBasisCurves: the number of a curve's segments, and of its values
for each interpolation. Hair runs through its points, as linear and pinned Catmull-Rom curves do.
B-splines become the points between their segments, Bezier curves points at thirds of a segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints

#: A cubic Bezier segment's four weights at 0, 1/3 and 2/3 of it.
_AT_THIRDS = np.array([[27, 0, 0, 0], [8, 12, 6, 1], [1, 6, 12, 8]], np.float32) / 27.0


@dataclass(frozen=True)
class WeightedSum:
    """Values as weighted sums of others.

    index: (count, terms), which values.
    weight: (count, terms) float32.
    """

    index: Ints
    weight: Floats

    def apply(self, values: Floats) -> Floats:
        """(count, ...) from (others, ...)."""
        shape = (-1,) + (1,) * (values.ndim - 1)
        total = values[self.index[:, 0]] * self.weight[:, 0].reshape(shape)
        for term in range(1, self.index.shape[1]):
            total += values[self.index[:, term]] * self.weight[:, term].reshape(shape)
        return total


@dataclass(frozen=True)
class CurveSampling:
    """Points on curves, and how their values follow from those in a file.

    offsets: (curve_count + 1,), curve c has the points offsets[c]:offsets[c + 1].
    vertex: values of points from those at control points; None: they are the same.
    varying: values of points from those at ends of segments; None: they are the same.
    varying_count: how many values of the latter kind there must be.
    is_invalid: (curve_count,) curves left without points, because their number of control points
        does not fit the basis; None: no curve.
    """

    offsets: Ints
    vertex: WeightedSum | None
    varying: WeightedSum | None
    varying_count: int
    is_invalid: Bools | None = None


def points_on_curves(basis: str, is_pinned: bool, counts: Ints) -> CurveSampling:
    """The points on open curves.

    Args:
        basis: "linear", "catmullRom", "bspline" or "bezier".
        is_pinned: whether Catmull-Rom curves and B-splines reach to their first and last control
            points; else they end one segment before.
        counts: (curve_count,) control points of each curve, none negative.
    """
    offsets = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
    curve = np.repeat(np.arange(len(counts)), counts)
    number_on_curve = np.arange(offsets[-1]) - offsets[curve]
    if basis == "bezier":
        return _bezier_points(counts, offsets, curve, number_on_curve)
    point = np.arange(offsets[-1])
    is_inner = (number_on_curve > 0) & (number_on_curve < counts[curve] - 1)
    if basis == "bspline":
        index = np.stack(
            [np.maximum(point - 1, 0), point, np.minimum(point + 1, point[-1:])], axis=1
        )
        weight = np.where(is_inner[:, None], [1 / 6, 4 / 6, 1 / 6], [0.0, 1.0, 0.0])
        mix = WeightedSum(index, weight.astype(np.float32))
    else:
        mix = WeightedSum(point[:, None], np.ones((len(point), 1), np.float32))
    if is_pinned or basis == "linear":
        return CurveSampling(offsets, mix if basis == "bspline" else None, None, len(point))
    inner_offsets = np.concatenate([[0], np.cumsum(np.maximum(counts - 2, 0))])
    inner = WeightedSum(mix.index[is_inner], mix.weight[is_inner])
    is_invalid = (counts > 1) & (counts < 4)
    return CurveSampling(
        inner_offsets,
        inner,
        None,
        int(inner_offsets[-1]),
        is_invalid if is_invalid.any() else None,
    )


def usable_basis(basis: str, counts: Ints) -> tuple[str, tuple[str, ...]]:
    """The basis to read curves of these point counts, (curve_count,), with; and notes on it.

    Where most Bezier curves have a number of points that such curves cannot have, the file holds
    points on the curves, as Blender writes them for hair.
    """
    if basis != "bezier" or 2 * int(_are_bezier(counts).sum()) > len(counts):
        return basis, ()
    return "linear", (
        "its basis is bezier, but its numbers of points are those of curves through them",
    )


def invalid_curves(sampling: CurveSampling, basis: str) -> dict[str, Bools]:
    """Why curves cannot be used -> which, (curve_count,); for `clean`."""
    if sampling.is_invalid is None:
        return {}
    return {f"a number of points that {basis} curves cannot have": sampling.is_invalid}


def _are_bezier(counts: Ints) -> Bools:
    is_bezier: Bools = (counts >= 4) & (counts % 3 == 1)
    return is_bezier


def _bezier_points(
    counts: Ints, offsets: Ints, curve: Ints, number_on_curve: Ints
) -> CurveSampling:
    """As many points as control points: every third of these, and two points between them."""
    is_sound = _are_bezier(counts)
    ends = (counts + 2) // 3  # one more than segments
    end_offsets = np.concatenate([[0], np.cumsum(ends)])
    point = np.flatnonzero(is_sound[curve])
    curve, number_on_curve = curve[point], number_on_curve[point]
    third = number_on_curve % 3
    fraction = (third / 3).astype(np.float32)
    index = np.minimum((point - third)[:, None] + np.arange(4), offsets[1:][curve, None] - 1)
    end = end_offsets[curve] + number_on_curve // 3
    next_end = np.minimum(end + 1, end_offsets[1:][curve] - 1)
    return CurveSampling(
        np.concatenate([[0], np.cumsum(np.where(is_sound, counts, 0))]),
        WeightedSum(index, _AT_THIRDS[third]),
        WeightedSum(np.stack([end, next_end], axis=1), np.stack([1 - fraction, fraction], axis=1)),
        int(end_offsets[-1]),
        None if is_sound.all() else ~is_sound,
    )
