"""How wide strands are: as their file says, or found from the groom where that cannot be hair.

A groom has far fewer strands than a body has hairs, so each strand stands for many of them. Where
widths are missing, or would leave the body bald or bury it, they are found from the spacing of the
strands, their lengths and their number alone. No unit of length is assumed: a groom that is a
thousand times as large has strands a thousand times as wide.

A head is the measure: about 100,000 hairs of 0.08 mm on 600 cm2 (Robbins 2012, Chemical and
Physical Behavior of Human Hair, chapter 9). Any groom is given the cover that this is for its area.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet
from .nearest import nearest_points

#: of a head: how many hairs, and the width of one in terms of the root of the area they grow on.
_HAIRS, _HAIR = 100_000, 0.08 / 245.0
#: Layers of hair that lie over every place, at least, wherever that is wide enough to do so.
_LAYERS = 6.0
#: The widest strand: a quarter of the spacing, and in terms of its own length.
_OF_SPACING, _OF_LENGTH = 0.25, 1.0 / 15.0
#: Most that a strand blocks of the light, in terms of what its width does: a few guides alone are
#: not all the hair.
_MAX_EXTINCTION = 6.0
#: Without any spacing, a strand's width in terms of its length.
_ALONE = 1.0 / 500.0
#: Own widths are believed from this part of what is found on, up to this multiple of it, or up to
#: this part of the spacing of strands.
_TOO_THIN, _TOO_WIDE, _TOO_NEAR = 0.25, 2.0, 0.5
#: Strands whose neighbours are looked at, and how many neighbours.
_SAMPLES, _NEIGHBOURS = 1500, 8
#: Narrowest and widest of a groom's strands in terms of the median.
_LEAST, _MOST = 0.5, 2.0

METHODS = (
    ("auto", "Automatic", "The groom's own widths where they can be hair, else found widths"),
    ("found", "Found", "Widths found from the spacing, length and number of the strands"),
    ("own", "Own", "The groom's own widths, whatever they are; 0.08 mm where it has none"),
)


@dataclass(frozen=True)
class Widths:
    """How wide the strands of a groom are, and what one of them stands for.

    is_found: whether the widths were found, rather than being the groom's own.
    median: the width of the median strand at its root [m].
    hairs: how many hairs a strand stands for.
    extinction: factor on the light that a strand blocks. It is above 1 where few strands stand for
        more hairs than it could be wide without looking like a ribbon.
    reason: why they were found; empty where they were not, or were asked for.
    """

    is_found: bool = False
    median: float = 0.0
    hairs: float = 1.0
    extinction: float = 1.0
    reason: str = ""

    @property
    def numbers(self) -> tuple[float, float, float, float]:
        return float(self.is_found), self.median, self.hairs, self.extinction

    @classmethod
    def of(cls, numbers: Floats, reason: str) -> Self:
        """Those that `numbers` were of."""
        is_found, median, hairs, extinction = numbers.tolist()
        return cls(bool(is_found), median, hairs, extinction, reason)

    @property
    def line(self) -> str:
        """For the panel and the report."""
        width = f"{_length(self.median)} wide"
        if not self.is_found:
            return f"Strands are {width}, as the groom has them"
        why = f" ({self.reason})" if self.reason else ""
        stands = f", each for {self.hairs:,.0f} hairs" if self.hairs >= 1.5 else ""
        return f"Strands are {width}, found from the groom{why}{stands}"


def with_widths(strands: StrandSet, method: str = "auto") -> tuple[StrandSet, Widths]:
    """The strands as wide as `METHODS` says, all in one space."""
    if not strands.strand_count:
        return strands, Widths()
    own = 2.0 * strands.radius[strands.offsets[:-1]]
    median = float(np.median(own))
    if method == "own":
        return strands, Widths(False, median)
    found = _found(strands)
    reason = "" if method == "found" else _why_not(strands, median, found)
    if method == "auto" and not reason:
        return strands, Widths(False, median)
    if not found.spacing:
        reason = "from their lengths alone, since there is no space between them"
    radius = np.repeat(0.5 * found.width, strands.point_counts)
    widths = Widths(True, float(np.median(found.width)), found.hairs, found.extinction, reason)
    return replace(strands, radius=radius, has_widths=True), widths


def as_wide(strands: StrandSet, drawn: StrandSet) -> StrandSet:
    """The strands as wide at their roots as they are drawn.

    Args:
        drawn: the same strands with another number of points, after `with_widths`, which measures
            them by their points.
    """
    width = drawn.radius[drawn.offsets[:-1]]
    return replace(strands, radius=np.repeat(width, strands.point_counts), has_widths=True)


@dataclass(frozen=True)
class _Found:
    """width: (strand_count,) [m]. spacing: the median distance of neighbours [m]; 0 without any."""

    width: Floats
    spacing: float
    hairs: float
    extinction: float


def _found(strands: StrandSet) -> _Found:
    """Widths that give the cover of a head, and in short or spread hair a few layers of it."""
    length = strands.lengths()
    first, last = strands.offsets[:-1], strands.offsets[1:] - 1
    at_roots = _spacing(strands, first)
    # the hair of a ponytail or a mohawk is wider apart further out
    beyond = np.maximum(_spacing(strands, (first + last) // 2), _spacing(strands, last))
    apart = np.maximum(at_roots, beyond)
    middle = float(np.median(apart))
    if middle <= 0.0:
        return _Found(length * _ALONE, 0.0, 1.0, 1.0)
    # where most roots coincide, as in tufts, they do not tell how the hair is spread
    at_roots, apart = _evened(at_roots if np.median(at_roots) else apart), _evened(apart)
    typical = np.clip(length, *np.percentile(length, (25, 95)))
    extent = float(np.median(at_roots)) * strands.strand_count**0.5
    of_head = _HAIRS * _HAIR * at_roots**2 / extent
    of_layers = _LAYERS * apart**2 / typical
    width = np.maximum(
        np.minimum(of_head, _OF_SPACING * at_roots), np.minimum(of_layers, _OF_SPACING * apart)
    )
    width = np.minimum(width, _OF_LENGTH * typical)
    wanted = np.maximum(np.maximum(of_head, of_layers), width)
    extinction = min(float((wanted * length).sum() / (width * length).sum()), _MAX_EXTINCTION)
    return _Found(width, middle, float(np.median(wanted)) / (_HAIR * extent), extinction)


def _evened(spacing: Floats) -> Floats:
    """Without extremes, which borders and strays have."""
    middle = np.median(spacing)
    evened: Floats = np.clip(spacing, _LEAST * middle, _MOST * middle)
    return evened


def _spacing(strands: StrandSet, at: Ints) -> Floats:
    """How far strands are from their neighbours at these points of theirs, (strand_count,) [m].

    It is the side of the square that a strand has for itself if its neighbours are spread evenly.
    """
    count, places = strands.strand_count, strands.points[at]
    neighbours = min(_NEIGHBOURS, count - 1)
    if not neighbours:
        return np.zeros(count)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _SAMPLES)).astype(np.int64))
    reach = nearest_points(places[chosen], places, neighbours + 1)[1][:, -1]
    spacing = _smoothed(np.sqrt(np.pi / neighbours) * reach, places[chosen])
    if len(chosen) == count:
        return spacing
    near, _ = nearest_points(places, places[chosen], 1)
    return spacing[near[:, 0]]


def _smoothed(values: Floats, places: Floats) -> Floats:
    """The median of each place and its neighbours, (n,)."""
    near, _ = nearest_points(places, places, min(_NEIGHBOURS, len(places)))
    smooth: Floats = np.median(values[near], axis=1)
    return smooth


def _why_not(strands: StrandSet, own: float, found: _Found) -> str:
    """Why the groom's own widths cannot be hair; empty where they can."""
    if not strands.has_widths:
        return "it brings none"
    wanted = float(np.median(found.width))
    if own < _TOO_THIN * wanted:
        return f"its own, {_length(own)}, would leave it bald"
    if own > max(_TOO_NEAR * found.spacing, _TOO_WIDE * wanted):
        return f"its own, {_length(own)}, would bury it"
    return ""


def _length(meters: float) -> str:
    """In the unit that gives a number one can read."""
    for factor, unit in ((1.0, "m"), (1e2, "cm"), (1e3, "mm")):
        if meters * factor >= 1.0:
            return f"{meters * factor:.3g} {unit}"
    return f"{meters * 1e3:.2g} mm"
