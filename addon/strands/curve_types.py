"""Curves of other types than Catmull-Rom: from control points to the points that Blender draws.

Strands are smooth curves through their points, like Catmull-Rom curves. So curves of other types
are replaced by points on them: Bezier curves and NURBS by the points that Blender evaluates,
polygons by more points where their corners are sharp. Knots of NURBS follow Blender's modes, see
its `curve_nurbs.cc`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..arrays import Bools, Floats, Ints


class CurveType(IntEnum):
    """The type of a curve, numbered as in Blender."""

    CATMULL_ROM = 0
    POLY = 1
    BEZIER = 2
    NURBS = 3


class KnotMode(IntEnum):
    """Where the knots of a NURBS curve lie; numbered as in Blender."""

    NORMAL = 0
    ENDPOINT = 1
    BEZIER = 2
    ENDPOINT_BEZIER = 3
    CUSTOM = 4


#: How far a smooth curve strays from a polygon at a corner, over the length of a piece times the
#: difference of the unit directions there.
_ROUNDING = 2.0 / 27.0
#: A polygon may be rounded by this fraction of its length. So hair keeps its points after Blender's
#: Resample Curve, which makes polygons of all curves.
_MAX_ROUNDING = 2.0e-3
#: Maximum number of pieces that a segment of a polygon is cut into.
_MAX_PIECES = 64


@dataclass(frozen=True, eq=False)
class CurveShapes:
    """What determines curves beside their control points.

    kind: (curve_count,) of `CurveType`.
    resolution: (curve_count,) pieces of each segment of a Bezier or NURBS curve.
    order: (curve_count,), NURBS only, one more than the degree.
    knots: (curve_count,) of `KnotMode`.
    weight: (point_count,), NURBS only.
    left, right: (point_count, 3) Bezier handles, in the space of the points.
    """

    kind: Ints
    resolution: Ints
    order: Ints
    knots: Ints
    weight: Floats
    left: Floats
    right: Floats


@dataclass(frozen=True, eq=False)
class _CurveBatch:
    """Curves that are evaluated by the same matrix.

    inner: (n, count) indices of control points. outer: (n, samples) indices of evaluated points.
    basis: (samples, count) the weights of the control points' values at each sample.
    weight: (n, count) NURBS weights of the control points; None: all 1.
    """

    inner: Ints
    outer: Ints
    basis: Floats
    weight: Floats | None = None

    def of(self, values: Floats) -> Floats:
        """(n, samples, width) from values of control points (point_count, width)."""
        some = values[self.inner].astype(np.float64)
        if self.weight is None:
            return np.asarray(self.basis @ some)
        whole = self.basis @ self.weight[..., None]
        return np.asarray((self.basis @ (some * self.weight[..., None])) / whole)


@dataclass(frozen=True, eq=False)
class EvaluatedCurves:
    """Evaluated curves.

    points: (point_count, 3) on the curves. offsets: (curve_count + 1,), where each curve begins.
    """

    points: Floats
    offsets: Ints
    _parts: tuple[_CurveBatch, ...]

    def of(self, values: Floats) -> Floats:
        """Values at these points, (point_count, ...) float32, from those at control points."""
        flat = values.reshape(len(values), -1)
        found = np.empty((self.offsets[-1], flat.shape[1]), np.float32)
        for part in self._parts:
            found[part.outer] = part.of(flat)
        return found.reshape(-1, *values.shape[1:])


def evaluate_curves(points: Floats, offsets: Ints, shapes: CurveShapes) -> EvaluatedCurves:
    """Open curves as Blender draws them.

    Args:
        points: (point_count, 3) control points. offsets: (curve_count + 1,), where each curve
            begins.
    """
    counts = np.diff(offsets)
    is_nurbs = (shapes.kind == CurveType.NURBS) & _have_knots(counts, shapes)
    kind = np.where((shapes.kind == CurveType.NURBS) & ~is_nurbs, CurveType.POLY, shapes.kind)
    pieces = np.where(kind == CurveType.CATMULL_ROM, 1, np.maximum(shapes.resolution, 1))
    is_poly = kind == CurveType.POLY
    pieces[is_poly] = _piece_counts(points, offsets)[is_poly]
    pieces[counts < 2] = 1
    order, knots = (np.where(is_nurbs, each, 0) for each in (shapes.order, shapes.knots))
    traits = np.stack([kind, counts, pieces, order, knots], axis=1)
    unique, which = np.unique(traits, axis=0, return_inverse=True)
    bases = [_basis(*row) for row in unique.tolist()]
    sizes = np.array([len(basis) for basis in bases], np.int64)[which.ravel()]
    outer = np.concatenate([[0], np.cumsum(sizes)])
    found = np.empty((outer[-1], 3), np.float32)
    parts = []
    for number, (row, basis) in enumerate(zip(unique.tolist(), bases, strict=True)):
        chosen = np.flatnonzero(which.ravel() == number)
        inner_rows = offsets[chosen, None] + np.arange(row[1])
        outer_rows = outer[chosen, None] + np.arange(len(basis))
        weight = shapes.weight[inner_rows] if row[0] == CurveType.NURBS else None
        part = _CurveBatch(inner_rows, outer_rows, basis, weight)
        parts.append(part)
        if row[0] == CurveType.BEZIER and row[1] > 1:
            found[outer_rows] = _bezier_points(points, shapes, inner_rows, row[2])
        else:
            found[outer_rows] = part.of(points)
    return EvaluatedCurves(found, outer, tuple(parts))


def _have_knots(counts: Ints, shapes: CurveShapes) -> Bools:
    """Which NURBS curves have enough points; Blender draws the others as polygons."""
    order = shapes.order
    needs_more = shapes.knots == KnotMode.BEZIER
    return (order >= 2) & (counts >= order + needs_more)


def _piece_counts(points: Floats, offsets: Ints) -> Ints:
    """The number of pieces that each segment of a polygon is cut into, (curve_count,), so that a
    smooth curve through their ends rounds corners by no more than _MAX_ROUNDING of its length."""
    counts, found = np.diff(offsets), np.ones(len(offsets) - 1, np.int64)
    for count in np.unique(counts[counts > 2]).tolist():
        chosen = np.flatnonzero(counts == count)
        edge = np.diff(points[offsets[chosen, None] + np.arange(count)].astype(np.float64), axis=1)
        length = np.linalg.norm(edge, axis=2)
        edge /= np.maximum(length, 1.0e-30)[..., None]
        corner = np.linalg.norm(np.diff(edge, axis=1), axis=2)
        beside = np.maximum(length[:, 1:], length[:, :-1])
        allowed = _MAX_ROUNDING * np.maximum(length.sum(axis=1), 1.0e-30)
        needed = _ROUNDING * (corner * beside).max(axis=1) / allowed
        found[chosen] = np.ceil(np.nan_to_num(needed, posinf=1.0)).clip(1, _MAX_PIECES)
    return found


def _basis(kind: int, count: int, pieces: int, order: int, knots: int) -> Floats:
    """The weights of `count` control points at each sample of a curve, (samples, count)."""
    if kind == CurveType.NURBS:
        return _nurbs_basis(count, pieces, order, knots)
    if count < 2:
        return np.eye(count)
    place = np.linspace(0.0, count - 1.0, (count - 1) * pieces + 1)
    before = np.minimum(place.astype(np.int64), count - 2)
    basis, row = np.zeros((len(place), count)), np.arange(len(place))
    basis[row, before] = 1.0 - (place - before)
    basis[row, before + 1] = place - before
    return basis


def _bezier_points(points: Floats, shapes: CurveShapes, inner: Ints, pieces: int) -> Floats:
    """Points (n, samples, 3) on Bezier curves with these control points (n, count)."""
    u = np.linspace(0.0, 1.0, pieces + 1)[:-1, None]
    v = 1.0 - u
    corners = (
        points[inner[:, :-1]],
        shapes.right[inner[:, :-1]],
        shapes.left[inner[:, 1:]],
        points[inner[:, 1:]],
    )
    weights = (v**3, 3.0 * u * v**2, 3.0 * u**2 * v, u**3)
    found = sum(
        weight * corner[:, :, None].astype(np.float64)
        for weight, corner in zip(weights, corners, strict=True)
    )
    grid = np.asarray(found).reshape(len(inner), -1, 3)
    return np.concatenate([grid, points[inner[:, -1:]]], axis=1)


def _nurbs_basis(count: int, pieces: int, order: int, mode: int) -> Floats:
    """B-spline basis functions (samples, count), with `pieces` samples per non-empty knot span."""
    knots = _knot_vector(count, order, mode)
    ends = np.unique(knots[order - 1 : count + 1])
    inside = ends[:-1, None] + np.diff(ends)[:, None] * np.arange(pieces) / pieces
    place = np.append(inside.ravel(), ends[-1])
    # the last sample belongs to the span before it: Cox and de Boor's spans exclude their ends
    span = np.searchsorted(knots, place, side="right") - 1
    span[-1] = np.searchsorted(knots, ends[-1], side="left") - 1
    basis = np.zeros((len(place), len(knots) - 1))
    basis[np.arange(len(place)), span] = 1.0
    for degree in range(1, order):
        near, far = knots[degree:-1] - knots[: -degree - 1], knots[degree + 1 :] - knots[1:-degree]
        rise = (place[:, None] - knots[: -degree - 1]) / np.where(near > 0.0, near, 1.0)
        fall = (knots[degree + 1 :] - place[:, None]) / np.where(far > 0.0, far, 1.0)
        basis = rise * (near > 0.0) * basis[:, :-1] + fall * (far > 0.0) * basis[:, 1:]
    return basis


def _knot_vector(count: int, order: int, mode: int) -> Floats:
    """The knots of an open curve, (count + order,), in one of Blender's modes."""
    is_bezier = mode in (KnotMode.BEZIER, KnotMode.ENDPOINT_BEZIER)
    reaches_ends = mode in (KnotMode.ENDPOINT, KnotMode.ENDPOINT_BEZIER)
    repeated = order - 1 if is_bezier else 1
    left = order if reaches_ends else min(2, repeated) if is_bezier else 1
    knots, current = np.empty(count + order), 0.0
    last = count if reaches_ends else count + order
    for number in range(last):
        knots[number] = current
        left -= 1
        if not left:
            current, left = current + 1.0, repeated
    knots[last:] = current
    return knots
