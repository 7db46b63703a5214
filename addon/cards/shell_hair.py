"""Short hair from place to place: its shape, occlusion and colour, from which shells are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..strands import StrandSet
from ..strands.nearest import nearest_points

#: Value beyond all colours, for strands without one of their own.
_NO_COLOR = 4.0
#: Maximum number of strands that the hair is learnt from; numbers of neighbours that give the
#: length of hair at a place, and its other properties; quantile of the neighbours' lengths that
#: shells reach.
_MAX_SAMPLES, _NEIGHBOURS, _AVERAGED_NEIGHBOURS, _LONGEST = 20_000, 24, 12, 0.97


def interpolated_along(values: Floats, along: Floats) -> Floats:
    """Values (n, cv_count, c) of CVs interpolated at parts (n, m) of the strands, (n, m, c);
    extrapolated beyond 1."""
    place = along * (values.shape[1] - 1)
    low = np.clip(place.astype(np.int64), 0, values.shape[1] - 2)
    rows = np.arange(len(values))[:, None]
    first = values[rows, low]
    found: Floats = first + (values[rows, low + 1] - first) * (place - low)[..., None]
    return found


@dataclass(frozen=True, eq=False)
class ShortHair:
    """Strands over the length of the hair around each: from the skin to the outermost layer.

    roots: (n, 3) [m]. shift: (n, 2 layers + 1, 3) [m] from there, at the borders and middles of the
    slabs. occlusion: (n, layers) in their middles, NaN beyond the tip. reach: (n,) length of the
    hair there [m]. hue: (n, 3) the perceived colour; sqrt(_NO_COLOR) where it is the look's.
    """

    roots: Floats
    shift: Floats
    occlusion: Floats
    reach: Floats
    hue: Floats

    @classmethod
    def of(cls, strands: StrandSet, occlusion: Floats | None, layers: int) -> ShortHair:
        chosen = np.linspace(
            0, strands.strand_count - 1, min(strands.strand_count, _MAX_SAMPLES)
        ).astype(np.int64)
        grid = strands.grid[chosen].astype(np.float64)
        length = np.maximum(strands.lengths()[chosen], 1e-12)
        near = nearest_points(grid[:, 0], grid[:, 0], _NEIGHBOURS)[0]
        reach = np.quantile(length[near], _LONGEST, axis=1)
        station = np.linspace(0.0, 1.0, 2 * layers + 1)
        # shorter strands are extrapolated
        along = np.minimum((reach / length)[:, None] * station, 2.0)
        shift = interpolated_along(grid, along) - grid[:, :1]
        light: Floats = np.ones((len(chosen), layers))
        if occlusion is not None:
            within = along[:, 1::2]
            light = interpolated_along(occlusion[chosen][..., None], np.minimum(within, 1.0))[
                ..., 0
            ]
            light[within > 1.0] = np.nan
        hue = np.full((len(chosen), 3), _NO_COLOR)
        if strands.color_grid is not None:
            hue = np.nan_to_num(strands.color_grid[chosen].mean(axis=1), nan=_NO_COLOR)
        return cls(grid[:, 0], shift, light, reach, np.sqrt(np.maximum(hue, 0.0)))

    def average_around(self, places: Floats) -> ShortHair:
        """The mean hair around places (m, 3)."""
        near = nearest_points(places, self.roots, _AVERAGED_NEIGHBOURS)[0]
        shift, reach, hue = (part[near].mean(axis=1) for part in (self.shift, self.reach, self.hue))
        there = self.occlusion[near]
        reaches = np.isfinite(there)
        total = np.where(reaches, there, 0.0).sum(axis=1)
        light = total / np.maximum(reaches.sum(axis=1), 1)
        # where no neighbour reaches, as open as the most open one
        light = np.where(reaches.any(axis=1), light, np.nanmax(there, axis=(1, 2))[:, None])
        return ShortHair(places, shift, light, reach, hue)
