"""How well roots fit a surface, and which unit or axes would make them fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..strands.closest_point import ClosestPointSearch

#: Median distance of the roots, as a fraction of the surface's diagonal, beyond which the groom
#: cannot belong to it; grooms that fit lie within 1 %.
IMPLAUSIBLE_DISTANCE = 0.15
#: The same beyond which the artist gets a note.
LOOSE_DISTANCE = 0.01
#: Factors between the units that grooms come in: powers of ten, inch and foot, to and from metres.
_UNIT_FACTORS = (*(10.0**n for n in range(-4, 5)), 0.0254, 0.3048, 1 / 0.0254, 1 / 0.3048)
_SAMPLED_ROOTS = 500
#: Another way to read roots must bring them this many times nearer than the way they were read.
_MIN_ADVANTAGE = 4.0


@dataclass(frozen=True)
class RootFit:
    """A way to read roots: its name, and the factor that brings them onto the surface.

    distance: median, as a fraction of the roots' own extent.
    """

    name: str
    factor: float
    distance: float


def fitting_factor(roots: Floats, search: ClosestPointSearch) -> float | None:
    """The factor between units that brings roots onto the surface, if one does and is not 1."""
    best = _best_fit("", roots, search, _UNIT_FACTORS)
    fits = best.distance <= IMPLAUSIBLE_DISTANCE
    return best.factor if fits and best.factor != 1.0 else None


def better_fit(readings: Mapping[str, Floats], search: ClosestPointSearch) -> RootFit | None:
    """The reading that lies clearly nearer to the surface than the first one, if one does.

    Args:
        readings: name -> roots, (root_count, 3); the first are the roots as they were read.
    """
    name, roots = next(iter(readings.items()))
    as_read = _best_fit(name, roots, search, (1.0,))
    fits = [_best_fit(name, roots, search, _UNIT_FACTORS) for name, roots in readings.items()]
    best = min(fits, key=lambda fit: fit.distance)
    if best.distance > IMPLAUSIBLE_DISTANCE or best.distance * _MIN_ADVANTAGE >= as_read.distance:
        return None
    return best


def _best_fit(
    name: str, roots: Floats, search: ClosestPointSearch, factors: Iterable[float]
) -> RootFit:
    """The factor that fits best. Distances are relative to the size of the scaled roots: roots that
    shrink to a point inside the head are near to it, but do not fit."""
    size = float(np.linalg.norm(np.ptp(roots, axis=0))) or 1.0
    sample = roots[:: -(-len(roots) // _SAMPLED_ROOTS)].astype(np.float64)
    fits = [
        RootFit(name, factor, float(np.median(search.closest(sample * factor).distance)))
        for factor in factors
    ]
    fits = [RootFit(name, fit.factor, fit.distance / (fit.factor * size)) for fit in fits]
    return min(fits, key=lambda fit: fit.distance)
