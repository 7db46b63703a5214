"""The trajectory of roots and colliders during one frame: smooth, through three known values.

    at(s) = before + (now - before) s + curvature s (s - 1),      s from 0 to 1 in the frame

is the parabola through the values one frame earlier, at the frame's begin and at its end. Its speed
is accurate to second order in the frame's duration, so that the motion of hair does not depend on
the frame rate; with straight lines hair would be jerked at each frame. Roots and colliders use the
same formula, so that they stay together.
"""

from __future__ import annotations

from ..arrays import Floats

#: Limits of the ratio of the durations of the frame before and this one: after a pause or hiccup it
#: says little about the speed.
_RATIO_LIMITS = (0.25, 4.0)


def curvature(earlier: Floats, before: Floats, now: Floats, ratio: float) -> Floats:
    """The quadratic term of the parabola through three values; same shape and unit as these.

    Args:
        earlier, before, now: values one frame earlier, at the frame's begin and at its end.
        ratio: duration of the frame before, over that of this one.
    """
    ratio = clamped_ratio(ratio)
    result: Floats = now - before
    result *= ratio
    result += earlier - before
    result /= ratio * (ratio + 1.0)
    return result


def clamped_ratio(ratio: float) -> float:
    """The ratio of durations as `curvature` uses it."""
    return min(max(ratio, _RATIO_LIMITS[0]), _RATIO_LIMITS[1])


def value_at(
    before: Floats, displacement: Floats, curvature: Floats | None, moment: float
) -> Floats:
    """The value at a moment of the frame, 0 its begin and 1 its end; any shape and unit."""
    number = before.dtype.type
    if curvature is None:
        return before + displacement * number(moment)
    here = curvature * number(moment - 1.0)
    here += displacement
    here *= number(moment)
    here += before
    return here
