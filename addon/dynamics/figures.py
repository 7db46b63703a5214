"""Figures of a motion: how far guides and strands stretch, and how deep in colliders they are."""

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

#: What counts as stretched, a fraction, and as inside [m].
STRETCHED, INSIDE = 0.01, 0.001


@dataclass(frozen=True)
class Figures:
    """Of some frames, each guide and each strand by its worst one. Reports have the same names.

    Segments and strands shorter than a hundredth of the median one count as that long in stretches.

    stretch_max_percent: of a guide's segment, but of no curl's, for these may stretch.
    penetration_max_mm: of a guide's point, also where it was inside at rest.
    strands_stretch_*: change of length of all strands as drawn; the worst, and the 99th percentile.
    strands_stretched_percent: how many change by more than 1 %.
    strands_penetration_*: how deep all strands as drawn are where they were outside at rest.
    strands_inside_percent: how many are deeper than 1 mm.
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
        """As `as_dict` gives them, from a file; None where it has none.

        Raises:
            ValueError: they are something else.
        """
        if values is None:
            return None
        names = {field.name for field in fields(cls)}
        if not isinstance(values, dict) or set(values) != names:
            raise ValueError("its figures are others")
        if not all(isinstance(value, int | float) for value in values.values()):
            raise ValueError("its figures are no numbers")
        if not all(math.isfinite(value) for value in values.values()):
            raise ValueError("its figures are not finite")
        return cls(**values)

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    @property
    def table(self) -> tuple[tuple[str, str, str, str], ...]:
        """For a panel: of all strands the worst, the 99th percentile, and how many are over 1 % or
        1 mm; of guides the worst."""
        return (
            *_table("All Strands", tuple(asdict(self).values())[2:]),
            ("Guides", "Worst", "", ""),
            ("Stretch", _percent(self.stretch_max_percent), "", ""),
            ("Penetration", _length(self.penetration_max_mm), "", ""),
        )


@dataclass(frozen=True)
class CardFigures:
    """The same of cards that ride: of their middle lines, and of their vertices."""

    cards_stretch_max_percent: float = 0.0
    cards_stretch_p99_percent: float = 0.0
    cards_stretched_percent: float = 0.0
    cards_penetration_max_mm: float = 0.0
    cards_penetration_p99_mm: float = 0.0
    cards_inside_percent: float = 0.0

    @classmethod
    def of_frames(cls, change: Floats, depth: Floats) -> Self:
        """Each card by its worst frame, see `length_changes` and `strand_depths`."""
        return cls(*map(_rounded, _spread(change, depth)))

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    @property
    def table(self) -> tuple[tuple[str, str, str, str], ...]:
        """For a panel, as `Figures.table`."""
        return _table("Cards", tuple(asdict(self).values()))


def blank_table(kind: type[Figures] | type[CardFigures]) -> tuple[tuple[str, ...], ...]:
    """The table of what nobody has measured yet, as large as that of any figures of this kind."""
    rows = []
    for name, *values in kind().table:
        is_header = values[0] == "Worst"
        rows.append((name, *(each if is_header else each and "-" for each in values)))
    return tuple(rows)


def _table(name: str, spread: tuple[float, ...]) -> tuple[tuple[str, str, str, str], ...]:
    """The rows of a table for what `_spread` gives."""
    stretch, depth = spread[:3], spread[3:]
    return (
        (name, "Worst", "99 %", "Over 1"),
        ("Stretch", _percent(stretch[0]), _percent(stretch[1]), _percent(stretch[2])),
        ("Penetration", _length(depth[0]), _length(depth[1]), _percent(depth[2])),
    )


def _spread(change: Floats, depth: Floats) -> tuple[float, ...]:
    """The worst, the 99th percentile and how many are over the limit: of changes of length, a
    fraction, and of depths [m], in percent and millimetres; 0 of nothing."""
    if not len(change):
        return (0.0,) * 6
    return (
        100.0 * float(change.max()),
        100.0 * float(np.quantile(change, 0.99)),
        100.0 * float((change > STRETCHED).mean()),
        1000.0 * float(depth.max()),
        1000.0 * float(np.quantile(depth, 0.99)),
        100.0 * float((depth > INSIDE).mean()),
    )


def _rounded(value: float) -> float:
    return round(float(value), 4) + 0.0  # without -0.0


def _percent(value: float) -> str:
    """Such as "0.03 %": two digits, but 0 only where it is nothing."""
    return "0 %" if not value else f"{value:.1f} %" if value >= 1.0 else f"{max(value, 0.01):.2f} %"


def _length(value: float) -> str:
    """Such as "9.5 mm"."""
    return f"{value:,.1f} mm" if value < 1000.0 else f"{value / 1000.0:,.2f} m"


class Measure:
    """What is found frame after frame.

    Args:
        rest: the guides at rest.
        points: (point_count, 3) [m, world], all strands at rest.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        colliders: as they stand then.
    """

    def __init__(
        self, rest: DynamicsState, points: Floats, offsets: Ints, colliders: Colliders
    ) -> None:
        self._rest, self._offsets = rest, offsets
        self._were_outside = are_outside(points, colliders)
        self._stretch = self._penetration = 0.0
        self._change, self._depth = (np.zeros(len(offsets) - 1) for _ in range(2))

    def take_style(self, rest: DynamicsState) -> None:
        """Guides have these lengths from the next frame on."""
        self._rest = rest

    def add(
        self, points: Floats, rest_lengths: Floats, guides: Floats, colliders: Colliders
    ) -> None:
        """Take another frame into account.

        Args:
            points: all strands, (point_count, 3) [m, world].
            rest_lengths: (strand_count,) [m], which they should have.
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
        """Of all frames so far."""
        found = 100.0 * self._stretch, 1000.0 * self._penetration
        return Figures(*map(_rounded, (*found, *_spread(self._change, self._depth))))
