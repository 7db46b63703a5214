"""The way of roots and colliders during one frame: smooth, from three moments that are known.

    way(s) = before + (now - before) s + bow s (s - 1),      s from 0 to 1 in the frame

is the parabola through where a thing was a frame earlier, at the frame's begin and at its end. Its
speed is right to second order in the frame's duration, so that hair does not feel the frame rate;
a straight way gives it a jerk at each frame. Roots and colliders go by the same formula, so that
they stay together.
"""

from __future__ import annotations

from ..arrays import Floats

#: A pause or a hiccup between two frames says little about the speed: the ratio of the durations
#: of the frame before and this one is held within these.
_RATIO = (0.25, 4.0)


def bow(earlier: Floats, before: Floats, now: Floats, ratio: float) -> Floats:
    """The bow of the way through three moments; same shape and unit as these.

    Args:
        earlier, before, now: values one frame earlier, at the frame's begin and at its end.
        ratio: duration of the frame before, over that of this one.
    """
    ratio = held_ratio(ratio)
    result: Floats = now - before
    result *= ratio
    result += earlier - before
    result /= ratio * (ratio + 1.0)
    return result


def held_ratio(ratio: float) -> float:
    """The ratio of durations that a bow is made with."""
    return min(max(ratio, _RATIO[0]), _RATIO[1])


def at(before: Floats, way: Floats, bow: Floats | None, moment: float) -> Floats:
    """Where a thing is at a moment of the frame, 0 its begin and 1 its end."""
    number = before.dtype.type
    if bow is None:
        return before + way * number(moment)
    here = bow * number(moment - 1.0)
    here += way
    here *= number(moment)
    here += before
    return here
