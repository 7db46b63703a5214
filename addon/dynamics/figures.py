"""Figures of a motion: stretch of guides and strands, and how deep they are in colliders."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Self

import numpy as np

from ..arrays import Floats, Ints
from .colliders import PosedCollider
from .measure import (
    are_outside,
    deepest_penetration,
    length_changes,
    max_stretch,
    strand_depths,
)
from .state import DynamicsState

type Colliders = tuple[PosedCollider, ...]

#: Limits above which strands count as stretched, a fraction, and as inside a collider [m].
STRETCH_LIMIT, DEPTH_LIMIT = 0.01, 0.001


@dataclass(frozen=True)
class Figures:
    """Figures over several frames, with each guide and strand at its worst. Names as in reports.

    For stretch, segments and strands shorter than a hundredth of the median count as that long.

    stretch_max_percent: of a guide's segment, except in curls, which may stretch.
    penetration_max_mm: of a guide's CV, also if it was inside at rest.
    strands_stretch_*: change of length of strands as drawn; the worst, and the 99th percentile.
    strands_stretched_percent: strands that change by more than 1 %.
    strands_penetration_*: depth in colliders of strands as drawn, at points that were outside at
        rest.
    strands_inside_percent: strands that are deeper than 1 mm.
    """

    stretch_max_percent: float = 0.0
    penetration_max_mm: float = 0.0
    strands_stretch_max_percent: float = 0.0
    strands_stretch_p99_percent: float = 0.0
    strands_stretched_percent: float = 0.0
    strands_penetration_max_mm: float = 0.0
    strands_penetration_p99_mm: float = 0.0
    strands_inside_percent: float = 0.0

    @classmethod
    def of(cls, values: object) -> Self | None:
        """The figures from `as_dict` data of a file; None for None.

        Raises:
            ValueError: the data are something else.
        """
        if values is None:
            return None
        names = {field.name for field in fields(cls)}
        if not isinstance(values, dict) or set(values) != names:
            raise ValueError("its figures have other names")
        if not all(isinstance(value, int | float) for value in values.values()):
            raise ValueError("its figures are not numbers")
        if not all(math.isfinite(value) for value in values.values()):
            raise ValueError("its figures are not finite")
        return cls(**values)

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    @property
    def table(self) -> tuple[tuple[str, str, str, str], ...]:
        """Rows for a panel: for all strands the worst, the 99th percentile, and how many exceed 1 %
        or 1 mm; for guides the worst."""
        return (
            *_table("All Strands", tuple(asdict(self).values())[2:]),
            ("Guides", "Worst", "", ""),
            ("Stretch", _percent(self.stretch_max_percent), "", ""),
            ("Penetration", _length(self.penetration_max_mm), "", ""),
        )


@dataclass(frozen=True)
class CardFigures:
    """The figures of riding cards: stretch of their spines, penetration of their vertices."""

    cards_stretch_max_percent: float = 0.0
    cards_stretch_p99_percent: float = 0.0
    cards_stretched_percent: float = 0.0
    cards_penetration_max_mm: float = 0.0
    cards_penetration_p99_mm: float = 0.0
    cards_inside_percent: float = 0.0

    @classmethod
    def of_frames(cls, change: Floats, depth: Floats) -> Self:
        """The figures from each card's worst `length_changes` and `strand_depths`, (n,) each."""
        return cls(*map(_rounded, _statistics(change, depth)))

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    @property
    def table(self) -> tuple[tuple[str, str, str, str], ...]:
        """Rows for a panel, see `Figures.table`."""
        return _table("Cards", tuple(asdict(self).values()))


def blank_table(kind: type[Figures] | type[CardFigures]) -> tuple[tuple[str, ...], ...]:
    """The table of figures that are not measured yet, as large as that of measured ones."""
    rows = []
    for name, *values in kind().table:
        is_header = values[0] == "Worst"
        rows.append((name, *(each if is_header else each and "-" for each in values)))
    return tuple(rows)


def _table(name: str, spread: tuple[float, ...]) -> tuple[tuple[str, str, str, str], ...]:
    """The rows of a table for the result of `_statistics`."""
    stretch, depth = spread[:3], spread[3:]
    return (
        (name, "Worst", "99 %", "Over 1"),
        ("Stretch", _percent(stretch[0]), _percent(stretch[1]), _percent(stretch[2])),
        ("Penetration", _length(depth[0]), _length(depth[1]), _percent(depth[2])),
    )


def _statistics(change: Floats, depth: Floats) -> tuple[float, ...]:
    """The worst, the 99th percentile, and the percentage above the limit: of changes of length, as
    fractions, in percent, and of depths [m], in millimetres; all 0 without values."""
    if not len(change):
        return (0.0,) * 6
    return (
        100.0 * float(change.max()),
        100.0 * float(np.quantile(change, 0.99)),
        100.0 * float((change > STRETCH_LIMIT).mean()),
        1000.0 * float(depth.max()),
        1000.0 * float(np.quantile(depth, 0.99)),
        100.0 * float((depth > DEPTH_LIMIT).mean()),
    )


def _rounded(value: float) -> float:
    return round(float(value), 4) + 0.0  # without -0.0


def _percent(value: float) -> str:
    """A text such as "0.03 %"; values above 0 are not rounded to 0."""
    return "0 %" if not value else f"{value:.1f} %" if value >= 1.0 else f"{max(value, 0.01):.2f} %"


def _length(value: float) -> str:
    """A text such as "9.5 mm"."""
    return f"{value:,.1f} mm" if value < 1000.0 else f"{value / 1000.0:,.2f} m"


class FiguresCollector:
    """Collects figures frame by frame.

    Args:
        rest: the guides at rest.
        points: (point_count, 3) [m, world], all strands at rest.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        colliders: at rest.
    """

    def __init__(
        self, rest: DynamicsState, points: Floats, offsets: Ints, colliders: Colliders
    ) -> None:
        self._rest, self._offsets = rest, offsets
        self._were_outside = are_outside(points, colliders)
        self._stretch = self._penetration = 0.0
        self._change, self._depth = (np.zeros(len(offsets) - 1) for _ in range(2))

    def set_style(self, rest: DynamicsState) -> None:
        """Use the lengths of another style from the next frame on."""
        self._rest = rest

    def add_frame(
        self, points: Floats, rest_lengths: Floats, guides: Floats, colliders: Colliders
    ) -> None:
        """Add a frame.

        Args:
            points: all strands, (point_count, 3) [m, world].
            rest_lengths: (strand_count,) [m], the lengths that they should have.
            guides: (guide_count, cv_count, 3) [m, world].
        """
        position = np.ascontiguousarray(guides.transpose(2, 1, 0))
        now = replace(self._rest, position=position)
        self._stretch = max(self._stretch, max_stretch(now))
        self._penetration = max(self._penetration, deepest_penetration(now, colliders))
        changes = length_changes(points, self._offsets, rest_lengths)
        depths = strand_depths(points, self._offsets, colliders, self._were_outside)
        np.maximum(self._change, changes, out=self._change)
        np.maximum(self._depth, depths, out=self._depth)

    @property
    def figures(self) -> Figures:
        """The figures of all frames so far."""
        found = 100.0 * self._stretch, 1000.0 * self._penetration
        return Figures(*map(_rounded, (*found, *_statistics(self._change, self._depth))))
