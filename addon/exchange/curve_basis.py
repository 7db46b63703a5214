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
class Mix:
    """Values as weighted sums of others.

    index: (count, terms), which values.
    weight: (count, terms) float32.
    """

    index: Ints
    weight: Floats

    def of(self, values: Floats) -> Floats:
        """(count, ...) from (others, ...)."""
        shape = (-1,) + (1,) * (values.ndim - 1)
        total = values[self.index[:, 0]] * self.weight[:, 0].reshape(shape)
        for term in range(1, self.index.shape[1]):
            total += values[self.index[:, term]] * self.weight[:, term].reshape(shape)
        return total


@dataclass(frozen=True)
class OnCurves:
    """Points on curves, and how their values follow from those in a file.

    offsets: (curve_count + 1,), curve c has the points offsets[c]:offsets[c + 1].
    vertex: values of points from those at control points; None: they are the same.
    varying: values of points from those at ends of segments; None: they are the same.
    varying_count: how many values of the latter kind there must be.
    is_unfit: (curve_count,) curves left without points, because their number of control points does
        not fit the basis; None: no curve.
    """

    offsets: Ints
    vertex: Mix | None
    varying: Mix | None
    varying_count: int
    is_unfit: Bools | None = None


def points_on_curves(basis: str, is_pinned: bool, counts: Ints) -> OnCurves:
    """The points on open curves.

    Args:
        basis: "linear", "catmullRom", "bspline" or "bezier".
        is_pinned: whether Catmull-Rom curves and B-splines reach to their first and last control
            points; else they end one segment before.
        counts: (curve_count,) control points of each curve, none negative.
    """
    offsets = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
    curve = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(offsets[-1]) - offsets[curve]
    if basis == "bezier":
        return _of_bezier(counts, offsets, curve, place)
    own = np.arange(offsets[-1])
    is_inner = (place > 0) & (place < counts[curve] - 1)
    if basis == "bspline":
        index = np.stack([np.maximum(own - 1, 0), own, np.minimum(own + 1, own[-1:])], axis=1)
        weight = np.where(is_inner[:, None], [1 / 6, 4 / 6, 1 / 6], [0.0, 1.0, 0.0])
        mix = Mix(index, weight.astype(np.float32))
    else:
        mix = Mix(own[:, None], np.ones((len(own), 1), np.float32))
    if is_pinned or basis == "linear":
        return OnCurves(offsets, mix if basis == "bspline" else None, None, len(own))
    inner_offsets = np.concatenate([[0], np.cumsum(np.maximum(counts - 2, 0))])
    inner = Mix(mix.index[is_inner], mix.weight[is_inner])
    is_unfit = (counts > 1) & (counts < 4)
    return OnCurves(
        inner_offsets,
        inner,
        None,
        int(inner_offsets[-1]),
        is_unfit if is_unfit.any() else None,
    )


def usable_basis(basis: str, counts: Ints) -> tuple[str, tuple[str, ...]]:
    """The basis to read curves with, and notes on it.

    Where most Bezier curves have a number of points that such curves cannot have, the file holds
    points on the curves, as Blender writes them for hair.
    """
    if basis != "bezier" or 2 * int(_are_bezier(counts).sum()) > len(counts):
        return basis, ()
    return "linear", (
        "its basis is bezier, but its numbers of points are those of curves through them",
    )


def unfit_curves(on_curves: OnCurves, basis: str) -> dict[str, Bools]:
    """Why curves cannot be used -> which, (curve_count,); for `clean`."""
    if on_curves.is_unfit is None:
        return {}
    return {f"a number of points that {basis} curves cannot have": on_curves.is_unfit}


def _are_bezier(counts: Ints) -> Bools:
    is_bezier: Bools = (counts >= 4) & (counts % 3 == 1)
    return is_bezier


def _of_bezier(counts: Ints, offsets: Ints, curve: Ints, place: Ints) -> OnCurves:
    """As many points as control points: every third of these, and two points between them."""
    is_sound = _are_bezier(counts)
    ends = (counts + 2) // 3  # one more than segments
    end_offsets = np.concatenate([[0], np.cumsum(ends)])
    own = np.flatnonzero(is_sound[curve])
    curve, place = curve[own], place[own]
    third = place % 3
    fraction = (third / 3).astype(np.float32)
    index = np.minimum((own - third)[:, None] + np.arange(4), offsets[1:][curve, None] - 1)
    end = end_offsets[curve] + place // 3
    next_end = np.minimum(end + 1, end_offsets[1:][curve] - 1)
    return OnCurves(
        np.concatenate([[0], np.cumsum(np.where(is_sound, counts, 0))]),
        Mix(index, _AT_THIRDS[third]),
        Mix(np.stack([end, next_end], axis=1), np.stack([1 - fraction, fraction], axis=1)),
        int(end_offsets[-1]),
        None if is_sound.all() else ~is_sound,
    )
