"""One prim of USD BasisCurves as strands in Blender's space, with the primvars that grooms have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Bools, Floats, Ints
from ...strands.affine import mean_scale, transform_points
from ...strands.clean import are_valid_widths
from ..curve_basis import CurveSampling, invalid_curves, points_on_curves, usable_basis
from ..read_motion import motion_end_note
from .usd_reader import Arrays

#: Where programs put the UVs of roots, Blender's among them; the first one found counts.
_ROOT_UVS = ("groom_root_uv", "surface_uv_coordinate", "st", "uv", "map1")


@dataclass(frozen=True)
class Curves:
    """The content of a prim; None: not known. Arrays are as in `Groom`.

    offsets: (curve_count + 1,).
    unusable: see `invalid_curves`.
    notes: what had to be changed or left out.
    times, positions: of a prim that moves its times (n,) [s], and the points at these,
        (n, point_count, 3); of a still one None and (1, point_count, 3).
    """

    name: str
    points: Floats
    offsets: Ints
    radius: Floats | None
    group: Ints | None
    group_name: list[str] | None
    root_uv: Floats | None
    color: Floats | None
    strand_id: Ints | None
    is_guide: Bools | None
    closest_guides: Ints | None
    guide_weights: Floats | None
    unusable: dict[str, Bools]
    notes: tuple[str, ...]
    times: Floats | None
    positions: Floats

    @property
    def curve_count(self) -> int:
        return len(self.offsets) - 1


class UnusableCurvesError(Exception):
    """Why nothing of a prim can be used."""


def read_prim(prim: Arrays, space: Floats) -> Curves:
    """The content of a prim as strands.

    Args:
        prim: the arrays of a prim, by the names of `usd_reader`.
        space: (4, 4), from the stage's space to Blender's, in metres.

    Raises:
        UnusableCurvesError: it has no curves, counts that do not fit, or is closed.
    """
    matrix = space @ prim["matrix"].T  # USD has row vectors
    points = _array(prim.get("points"), np.float32, 3)
    counts = _array(prim.get("counts"), np.int64)
    if points is None or counts is None or not len(points) or not len(counts):
        raise UnusableCurvesError("it has no curves")
    if counts.min() < 0 or int(counts.sum()) != len(points):
        raise UnusableCurvesError(
            f"its {len(counts):,} counts of points add up to {int(counts.sum()):,}, but it has "
            f"{len(points):,} points"
        )
    wrap, kind, basis, widths_interpolation = map(str, prim["traits"])
    if kind == "linear":
        basis = "linear"
    basis, basis_notes = usable_basis(basis, counts)
    if wrap == "periodic":
        raise UnusableCurvesError("its curves are closed")
    values = _Values(prim, points_on_curves(basis, wrap == "pinned", counts), counts)
    radius, notes = _radius(values, widths_interpolation, mean_scale(matrix))
    notes += basis_notes
    if values.sampling.vertex is not None:
        notes += (f"its {basis} curves were converted to points on the curves",)
    if "ended" in prim:
        notes += (motion_end_note(float(prim["ended"]), "another number of points"),)
    color = values.point_values("groom_color", 3)
    if color is None:
        color = values.point_values("displayColor", 3)
    ids = values.strand_values("groom_id", np.int32)
    guide = values.strand_values("groom_guide", np.int32)
    uvs = (values.strand_values(name, np.float32, 2) for name in _ROOT_UVS)
    placed = transform_points(values.at_points(points), matrix)
    times, positions = _motion(prim, values, space)
    return Curves(
        name=str(prim["name"]),
        points=placed,
        offsets=values.sampling.offsets,
        radius=radius,
        group=values.strand_values("groom_group_id", np.int32),
        group_name=values.strand_texts("groom_group_name"),
        root_uv=next((uv for uv in uvs if uv is not None), None),
        color=color,
        strand_id=ids,
        is_guide=None if guide is None else guide > 0,
        closest_guides=values.strand_values("groom_closest_guides", np.int32, 3),
        guide_weights=values.strand_values("groom_guide_weights", np.float32, 3),
        unusable=invalid_curves(values.sampling, basis),
        notes=notes + tuple(values.notes),
        times=times,
        positions=placed[None] if times is None else positions,
    )


def _motion(prim: Arrays, values: _Values, space: Floats) -> tuple[Floats | None, Floats]:
    """Times and the points at these; see `Curves`."""
    if len(prim.get("times", ())) < 2:
        return None, np.zeros((0, 0, 3), np.float32)
    positions = [
        transform_points(values.at_points(points), space @ matrix.T)  # USD has row vectors
        for points, matrix in zip(prim["motion"], prim["matrices"], strict=True)
    ]
    return prim["times"], np.array(positions, np.float32)


def _radius(
    values: _Values, interpolation: str, scale: float
) -> tuple[Floats | None, tuple[str, ...]]:
    """Half the widths [m], and notes on those that cannot be hair's."""
    widths = _array(values.prim.get("widths"), np.float32)
    if widths is None or not len(widths):
        return None, ("it has no widths",)
    radius = values.values_at_points(widths, interpolation, "widths")
    if radius is None:
        return None, ()
    with np.errstate(over="ignore", invalid="ignore"):
        radius = radius * np.float32(0.5 * scale)
    wrong = int((~are_valid_widths(radius, values.sampling.offsets)).sum())
    notes = (f"{wrong:,} widths are not plausible for hair and were replaced",) if wrong else ()
    return radius, notes


class _Values:
    """A prim's primvars for each strand or each of its points, whatever their interpolation."""

    def __init__(self, prim: Arrays, sampling: CurveSampling, counts: Ints) -> None:
        self.prim = prim
        self.sampling = sampling
        self.notes: list[str] = []
        self._counts = counts
        self._point_count = int(counts.sum())

    def at_points(self, values: Floats) -> Floats:
        """Points of curves from control points."""
        mix = self.sampling.vertex
        with np.errstate(over="ignore", invalid="ignore"):
            return values if mix is None else mix.apply(values)

    def point_values(self, name: str, width: int) -> Floats | None:
        values, interpolation = self._flat(name, np.float32, width)
        return None if values is None else self.values_at_points(values, interpolation, name)

    def values_at_points(self, values: Floats, interpolation: str, name: str) -> Floats | None:
        """Values at each point; None, with a note, if their number does not fit."""
        sampling = self.sampling
        expected = self._expected(interpolation)
        if len(values) == 1 or interpolation == "constant":
            return np.repeat(values[:1], sampling.offsets[-1], axis=0)
        if len(values) != expected:
            self._unfit(name, len(values), expected, interpolation)
            return None
        if interpolation == "uniform":
            return np.repeat(values, np.diff(sampling.offsets), axis=0)
        if interpolation == "vertex":
            return self.at_points(values)
        return values if sampling.varying is None else sampling.varying.apply(values)

    def strand_values(self, name: str, dtype: type, width: int = 1) -> NDArray[Any] | None:
        """Values of each strand; of its root where there are more."""
        values, interpolation = self._flat(name, dtype, width)
        if values is None:
            return None
        rows = self._rows(name, len(values), interpolation)
        return None if rows is None else values[rows]

    def strand_texts(self, name: str) -> list[str] | None:
        texts, interpolation = self._flattened(name)
        if texts is None or texts.ndim != 1:
            return None
        names = [str(each) for each in texts]
        rows = self._rows(name, len(names), interpolation) if names else None
        return None if rows is None else [names[row] for row in rows.tolist()]

    def _rows(self, name: str, length: int, interpolation: str) -> Ints | None:
        """The index of the value of each strand."""
        if length == 1 or interpolation == "constant":
            return np.zeros(len(self._counts), np.int64)
        expected = self._expected(interpolation)
        if length != expected or not self._counts.all():
            self._unfit(name, length, expected, interpolation)
            return None
        if interpolation == "uniform":
            return np.arange(length)
        if interpolation == "vertex":
            return np.cumsum(self._counts) - self._counts
        ends = np.maximum(self._counts - self._lost_ends(), 0)
        return np.minimum(np.cumsum(ends) - ends, length - 1)

    def _lost_ends(self) -> Ints:
        """Control points of each curve that are no end of a segment."""
        if self.sampling.varying is None:
            return self._counts - np.diff(self.sampling.offsets)
        return self._counts - (self._counts + 2) // 3

    def _expected(self, interpolation: str) -> int:
        if interpolation == "uniform":
            return len(self._counts)
        return self._point_count if interpolation == "vertex" else self.sampling.varying_count

    def _flat(self, name: str, dtype: type, width: int) -> tuple[NDArray[Any] | None, str]:
        values, interpolation = self._flattened(name)
        array = _array(values, dtype, width)
        return (array if array is not None and len(array) else None), interpolation

    def _flattened(self, name: str) -> tuple[NDArray[Any] | None, str]:
        """A primvar without its indices, and its interpolation."""
        values = self.prim.get(f"primvar/{name}")
        return values, "" if values is None else str(self.prim[f"interpolation/{name}"])

    def _unfit(self, name: str, count: int, expected: int, interpolation: str) -> None:
        self.notes.append(
            f"its {name} were left out: {count:,} values where '{interpolation}' needs {expected:,}"
        )


def _array(array: NDArray[Any] | None, dtype: type, width: int = 1) -> NDArray[Any] | None:
    """(count,) or (count, width), or None for values of another shape or kind."""
    if array is None or array.dtype.kind not in "biuf":
        return None
    if array.ndim == (0 if width == 1 else 1):
        array = array[None]
    with np.errstate(invalid="ignore", over="ignore"):
        array = array.astype(dtype, copy=False)
    return array if array.shape[1:] == ((width,) if width > 1 else ()) else None
