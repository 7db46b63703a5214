"""How wide strands are: as their file says, or found from the groom where that cannot be hair.

A groom has far fewer strands than a body has hairs, so each strand represents many hairs. Where
widths are missing, or would leave the body bald or bury it, they are found from the spacing of the
strands, their lengths and their number alone. No unit of length is assumed: a groom that is a
thousand times as large has strands a thousand times as wide.

A head is the measure: about 120,000 hairs of 0.08 mm on 600 cm2 (Robbins 2012, Chemical and
Physical Behavior of Human Hair, chapter 9). Any groom gets the same cover of its area.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet
from ..strands.face import is_face_hair
from ..strands.nearest import nearest_points
from ..strands.result_cache import NO_CACHE, ResultCache
from .hairline import NEIGHBOURS, nearness_from_neighbours

#: Number of hairs on a head, and the width of one over the square root of the area they grow on.
_HAIRS, _HAIR = 120_000, 0.08 / 245.0
#: Minimum layers of hair over every place, as far as strands may be wide enough for it.
_LAYERS = 6.0
#: Maximum width of a strand, over the spacing of strands and over its length.
_OF_SPACING, _OF_LENGTH = 0.25, 1.0 / 15.0
#: The same over the length of brows and lashes, which are drawn hair by hair: a brow of 8 mm is
#: 0.13 mm wide.
_OF_FACE = 1.0 / 60.0
#: Maximum light that a strand blocks, over what its width blocks: a few guides alone do not stand
#: for all the hair.
_MAX_EXTINCTION = 6.0
#: Layers of strands at maximum width that cover the body; length over width from which on strands
#: look like hair (in a buzz cut of 12 mm they are 0.3 mm wide); and the factor by which strands may
#: fall short of either and still be enough.
_ENOUGH, _SLENDER, _LACKING = 4.0, 40.0, 1.1
#: Hair this many spacings long hangs in locks; a strand of it that represents more hairs than this
#: looks like a noodle from near.
_LONG, _MAX_HAIRS = 5.0, 3.5
#: Minimum number of strands that count as hair; and the ratio of the distances to the eighth and
#: the second neighbour above which roots are in a row: there it is 4, on an area 2.
_FEWEST, _MIN_ROW_RATIO = 3, 3.0
#: Width of a strand over its length where there is no spacing.
_ALONE = 1.0 / 500.0
#: A groom's own widths are kept from this fraction of the found widths on, up to this multiple of
#: them, or up to this fraction of the spacing of strands.
_TOO_THIN, _TOO_WIDE, _TOO_NEAR = 0.25, 2.0, 0.5
#: Number of strands that are measured, and of neighbours of each.
_SAMPLES, _NEIGHBOURS = 3000, 8
#: Fraction by which hair is finer at its border.
_FINER = 0.4
#: Limits of the spacing at a strand over the median spacing.
_MIN_SPACING_RATIO, _MAX_SPACING_RATIO = 0.5, 2.0

METHODS = (
    (
        "auto",
        "Automatic",
        "Use the groom's own widths if they are plausible for hair, else found widths",
    ),
    ("found", "Found", "Find widths from the spacing, length and number of the strands"),
    ("own", "Own", "Use the groom's own widths unchecked; 0.08 mm where it has none"),
)


@dataclass(frozen=True)
class Widths:
    """How wide the strands of a groom are, and what one of them represents.

    is_found: whether the widths were found, rather than being the groom's own.
    median: the width of the median strand where it is widest [m].
    hairs: how many hairs a strand represents.
    extinction: factor on the light that a strand blocks. It is above 1 where strands represent more
        hairs than they are wide, since wider ones would look like ribbons.
    reason: why they were found; empty where they were not, or where that was requested.
    spacing: how far apart strands are, which the hairs that they represent fill [m]; 0 where each
        represents only itself.
    """

    is_found: bool = False
    median: float = 0.0
    hairs: float = 1.0
    extinction: float = 1.0
    reason: str = ""
    spacing: float = 0.0

    @property
    def numbers(self) -> tuple[float, float, float, float, float]:
        return float(self.is_found), self.median, self.hairs, self.extinction, self.spacing

    @classmethod
    def of(cls, numbers: Floats, reason: str) -> Self:
        """The inverse of `numbers`, (5,); bakes of earlier versions have (4,), without spacing."""
        is_found, median, hairs, extinction, *spacing = numbers.tolist()
        return cls(bool(is_found), median, hairs, extinction, reason, *spacing)

    @property
    def line(self) -> str:
        """For the panel and the report."""
        width = f"{_length(self.median)} wide"
        if not self.is_found:
            return f"Strands are {width}, as the groom has them"
        why = f" ({self.reason})" if self.reason else ""
        stands = f", each for {self.hairs:,.0f} hairs" if self.hairs >= 1.5 else ""
        return f"Strands are {width}, found from the groom{why}{stands}"


def with_widths(
    strands: StrandSet,
    method: str = "auto",
    drawn_per_strand: float = 1.0,
    *,
    number: Ints | None = None,
    fineness: Floats | None = None,
    cache: ResultCache = NO_CACHE,
) -> tuple[StrandSet, Widths]:
    """The strands with widths by one of `METHODS`, in their own space.

    Args:
        drawn_per_strand: how many strands are drawn for each of these, itself included.
        number: (strand_count,) ascending, their numbers before any were left out, by which the
            measured ones are chosen, so that leaving one out hardly changes these. None: all.
        fineness: (strand_count,) factor on found widths; None: 1.
        cache: results of the last call.
    """
    if not strands.strand_count:
        return strands, Widths()
    own = 2.0 * np.maximum.reduceat(strands.radius, strands.offsets[:-1])
    median = float(np.median(own))
    if method == "own":
        return strands, Widths(False, median)
    number = np.arange(strands.strand_count) if number is None else number
    found = _find_hair_and_face_widths(strands, drawn_per_strand, number, cache)
    reason = "" if method == "found" else _implausible_reason(strands, median, found)
    if method == "auto" and not reason:
        return strands, Widths(False, median)
    if not found.spacing:
        reason = "from their lengths alone, since there is no space between them"
    width = found.width if fineness is None else found.width * fineness
    radius = np.repeat(0.5 * width, strands.point_counts)
    median = float(np.median(found.width))
    widths = Widths(True, median, found.hairs, found.extinction, reason, found.spacing)
    return replace(strands, radius=radius, has_widths=True), widths


def with_widths_of(strands: StrandSet, drawn: StrandSet) -> StrandSet:
    """The strands as wide at their roots as they are drawn.

    Args:
        drawn: the same strands with another number of points, after `with_widths`, which measures
            them by their points.
    """
    width = drawn.radius[drawn.offsets[:-1]]
    return replace(strands, radius=np.repeat(width, strands.point_counts), has_widths=True)


def is_long(strands: StrandSet) -> bool:
    """Whether hair is many times as long as the spacing of its strands."""
    return _Hair.of(strands).is_long


def strands_for_cover(strands: StrandSet) -> float:
    """How many strands must be drawn for each of these to cover the body and look like hair: 1
    where these do, and where they stand in a row, as lashes do.

    Doubling the strands halves the hairs that each represents, and divides their spacing by the
    root of two. So at a width of a quarter of their spacing, their layers grow by the root of two.
    """
    first = strands.offsets[:-1]
    if strands.strand_count < _FEWEST or _is_row(strands.points[first]):
        return 1.0
    hair = _Hair.of(strands)
    if not hair.middle:
        return 1.0
    length = np.maximum(hair.length, np.finfo(np.float32).tiny)
    finer = _find_widths(hair).hairs / _MAX_HAIRS if hair.is_long else 1.0
    layers = float(np.median(hair.widest * length / hair.apart**2))
    slender = float(np.median(length / hair.widest))
    lacking = max(_ENOUGH / max(layers, 1e-6), _SLENDER / slender)
    return max(lacking**2 if lacking > _LACKING else 1.0, finer)


@dataclass(frozen=True)
class _FoundWidths:
    """width: (strand_count,) [m]. spacing: the median distance of neighbours [m]; 0 without any."""

    width: Floats
    spacing: float
    hairs: float
    extinction: float


@dataclass(frozen=True)
class _Hair:
    """Measurements that decide the widths; all (strand_count,) [m].

    apart: how far strands are from their neighbours, at their roots or further out.
    border: how near they are to where the hair ends, 0 to 1.
    typical: lengths without extremes. of_head, of_layers: the width that gives the cover of a
    head, and some layers of hair. widest: as wide as a strand may be.
    middle: the median of `apart`; 0 if all strands are in one place, and the rest does not count.
    """

    length: Floats
    typical: Floats
    apart: Floats
    at_roots: Floats
    border: Floats
    middle: float

    @classmethod
    def of(
        cls,
        strands: StrandSet,
        number: Ints | None = None,
        cache: ResultCache = NO_CACHE,
        name: str = "",
    ) -> Self:
        """Args:
        number: see `with_widths`. cache: results of the last call with this name.
        """
        chosen = _sample_indices(np.arange(strands.strand_count) if number is None else number)

        def measured(at: Ints, where: str) -> _Measured:
            return _Measured(strands.points[at], chosen, cache, f"{name}, {where}")

        first, last = strands.offsets[:-1], strands.offsets[1:] - 1
        roots = measured(first, "roots")
        border = roots.spread(roots.border())
        length = strands.lengths()
        at_roots = roots.spacing()
        # the hair of a ponytail or a mohawk is wider apart further out
        middles, tips = measured((first + last) // 2, "middles"), measured(last, "tips")
        beyond = np.maximum(middles.spacing(), tips.spacing())
        apart = np.maximum(at_roots, beyond)
        typical = np.clip(length, *np.percentile(length, (25, 95)))
        # where most roots coincide, as in tufts, they do not tell how the hair is spread
        at_roots = _evened(at_roots if np.median(at_roots) else apart)
        # at the border neighbours are on one side only: half of the square that they give is bare
        at_roots *= np.sqrt(1.0 - 0.5 * border)
        middle = float(np.median(apart))
        return cls(length, typical, _evened(apart), at_roots, border, middle)

    @property
    def is_long(self) -> bool:
        """Whether it hangs in locks, rather than standing beside each other as fur does."""
        return self.middle > 0.0 and float(np.median(self.length / self.apart)) >= _LONG

    @property
    def extent(self) -> float:
        """The square root of the area that the hair grows on [m]."""
        return float(np.median(self.at_roots)) * len(self.length) ** 0.5

    @property
    def of_head(self) -> Floats:
        width: Floats = _HAIRS * _HAIR * self.at_roots**2 / self.extent
        return width

    @property
    def of_layers(self) -> Floats:
        width: Floats = _LAYERS * self.apart**2 / self.typical
        return width

    @property
    def widest(self) -> Floats:
        """As wide as a strand may be."""
        return np.minimum(_OF_SPACING * self.apart, _OF_LENGTH * self.typical)


def _find_hair_and_face_widths(
    strands: StrandSet, drawn_per_strand: float, number: Ints, cache: ResultCache
) -> _FoundWidths:
    """Found widths of hair. Those of brows and lashes are found separately, since they are short
    and grow close together however much hair is on the head.

    Args:
        drawn_per_strand: how many strands are drawn for each of these but brows and lashes.
    """
    is_face = is_face_hair(strands.group)
    if not is_face.any():
        return _find_widths(_Hair.of(strands, number, cache, "hair"), drawn_per_strand)
    face = _Hair.of(strands.take(np.flatnonzero(is_face)), None, cache, "face")
    of_face = _find_widths(face)
    of_face = replace(of_face, width=np.minimum(of_face.width, _OF_FACE * face.typical))
    if is_face.all():
        return of_face
    other = np.flatnonzero(~is_face)
    hair = _Hair.of(strands.take(other), number[other], cache, "hair")
    found = _find_widths(hair, drawn_per_strand)
    width = np.empty(strands.strand_count)
    width[~is_face], width[is_face] = found.width, of_face.width
    return replace(found, width=width)


def _find_widths(hair: _Hair, drawn_per_strand: float = 1.0) -> _FoundWidths:
    """Widths that give the cover of a head, and in short or spread hair a few layers of it.

    Args:
        drawn_per_strand: how many strands are drawn for each of these, evenly spread between them.
            The width that layers need is limited by the spacing of these, not of all that are
            drawn.
    """
    if hair.middle <= 0.0:
        return _FoundWidths(hair.length * _ALONE, 0.0, 1.0, 1.0)
    closer = drawn_per_strand**0.5
    of_head, of_layers = hair.of_head / drawn_per_strand, hair.of_layers / drawn_per_strand
    width = np.maximum(
        np.minimum(of_head, _OF_SPACING * hair.at_roots / closer),
        np.minimum(of_layers, _OF_SPACING * hair.apart),
    )
    width = np.minimum(width, _OF_LENGTH * hair.typical) * (1.0 - _FINER * hair.border)
    wanted = np.maximum(np.maximum(of_head, of_layers), width)
    length = hair.length
    extinction = min(float((wanted * length).sum() / (width * length).sum()), _MAX_EXTINCTION)
    hairs = float(np.median(wanted)) / (_HAIR * hair.extent)
    return _FoundWidths(width, hair.middle / closer, hairs, extinction)


def _evened(spacing: Floats) -> Floats:
    """The spacing without the extremes of borders and strays."""
    middle = np.median(spacing)
    evened: Floats = np.clip(spacing, _MIN_SPACING_RATIO * middle, _MAX_SPACING_RATIO * middle)
    return evened


def _sample_indices(number: Ints) -> Ints:
    """Indices of the strands that are measured, among strands of these numbers: all, or a random
    one in each of equally many steps, since hair may stand in rows.
    """
    if len(number) <= _SAMPLES:
        return np.arange(len(number))
    step = (number[-1] + 1) / _SAMPLES
    wanted = (np.arange(_SAMPLES) + np.random.default_rng(0).random(_SAMPLES)) * step
    return np.unique(np.searchsorted(number, wanted.astype(np.int64)))


class _Measured:
    """Places of strands (strand_count, 3) [m], a sample of which is measured among itself.

    So a groom gets the same widths from all of its strands as from a part of them. Among all,
    neighbours would also lie deeper, not only closer: a hundredth of a ponytail is spaced as on an
    area, and all of it as in a volume.

    Args:
        chosen: indices of the sample; all others get the values of the nearest strand in it.
        cache, name: see `ResultCache.nearest`.
    """

    def __init__(self, places: Floats, chosen: Ints, cache: ResultCache, name: str) -> None:
        self._places, self._chosen, self._cache, self._name = places, chosen, cache, name
        self._measured = places[chosen]

    def border(self) -> Floats:
        """How near the sample is to where the hair ends, see `nearness_to_border`."""
        return nearness_from_neighbours(self._measured, self._measured, *self._around)

    def spacing(self) -> Floats:
        """How far strands are from their neighbours here, (strand_count,) [m].

        It is the side of the square that each strand has to itself if neighbours are spread evenly.
        """
        neighbours = min(_NEIGHBOURS, len(self._measured) - 1)
        if neighbours < 1:
            return np.zeros(len(self._places))
        index, distance = self._around
        fraction = len(self._measured) / len(self._places)
        side = np.sqrt(np.pi * fraction / neighbours) * distance[:, neighbours]
        return self.spread(np.median(side[index[:, :_NEIGHBOURS]], axis=1))

    def spread(self, values: Floats) -> Floats:
        """Values of the sample, given to all strands from the nearest in it."""
        if len(self._chosen) == len(self._places):
            return values
        spread: Floats = values[self._nearest]
        return spread

    @cached_property
    def _around(self) -> tuple[Ints, Floats]:
        """The nearest neighbours of the sample within it, each itself first."""
        name, count = f"{self._name}, around", max(NEIGHBOURS, _NEIGHBOURS + 1)
        return self._cache.nearest(name, self._measured, self._measured, count)

    @cached_property
    def _nearest(self) -> Ints:
        """The nearest of the sample for each place."""
        near, _ = self._cache.nearest(f"{self._name}, all", self._places, self._measured, 1)
        return near[:, 0]


def _is_row(roots: Floats) -> bool:
    """Whether roots follow a line rather than fill an area."""
    if len(roots) <= _NEIGHBOURS:
        return False
    some = roots[:: max(len(roots) // _SAMPLES, 1)]
    gap = nearest_points(some, roots, _NEIGHBOURS + 1)[1][:, [2, _NEIGHBOURS]]
    gap = gap[gap[:, 0] > 0.0]
    return bool(len(gap)) and float(np.median(gap[:, 1] / gap[:, 0])) > _MIN_ROW_RATIO


def _implausible_reason(strands: StrandSet, own: float, found: _FoundWidths) -> str:
    """Why the groom's own widths cannot be hair; empty where they can."""
    if not strands.has_widths:
        return "it has none"
    wanted = float(np.median(found.width))
    if own < _TOO_THIN * wanted:
        return f"its own, {_length(own)}, would leave it bald"
    if own > max(_TOO_NEAR * found.spacing, _TOO_WIDE * wanted):
        return f"its own, {_length(own)}, would bury it"
    return ""


def _length(meters: float) -> str:
    """A length in the unit that makes its number readable."""
    for factor, unit in ((1.0, "m"), (1e2, "cm"), (1e3, "mm")):
        if meters * factor >= 1.0:
            return f"{meters * factor:.3g} {unit}"
    return f"{meters * 1e3:.2g} mm"
