"""A parameter along the strand: five values from root to tip, joined by a smooth curve.

Monotone cubic interpolation (Fritsch and Carlson 1980, SIAM J. Numer. Anal. 17, 238): between two
values the curve stays within their range, so that no stiffness falls below zero.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: Where the values lie, from 0 at the root to 1 at the tip.
KNOT_POSITIONS = (0.0, 0.25, 0.5, 0.75, 1.0)

type Curve = tuple[float, ...]


def sample_curve(curve: Curve, position: Floats) -> Floats:
    """The curve's values at these places (n,), 0 at the root and 1 at the tip, (n,) float64."""
    knots, values = np.array(KNOT_POSITIONS), np.asarray(curve, np.float64)
    step = np.diff(knots)
    secant = np.diff(values) / step
    slope = _slopes(secant)
    position = np.clip(np.asarray(position, np.float64), 0.0, 1.0)
    left = np.clip(np.searchsorted(knots, position, side="right") - 1, 0, len(step) - 1)
    width = step[left]
    t = (position - knots[left]) / width
    blend = t * t * (3.0 - 2.0 * t)
    result: Floats = values[left] * (1.0 - blend) + values[left + 1] * blend
    result += width * t * (1.0 - t) * ((1.0 - t) * slope[left] - t * slope[left + 1])
    return result


def _slopes(secant: Floats) -> Floats:
    """Slopes at the knots: harmonic means inside, the secants at both ends."""
    slope = np.concatenate([secant[:1], np.zeros(len(secant) - 1), secant[-1:]])
    before, after = secant[:-1], secant[1:]
    has_same_sign = before * after > 0.0
    total = np.where(has_same_sign, before + after, 1.0)
    slope[1:-1] = np.where(has_same_sign, 2.0 * before * after / total, 0.0)
    return slope
