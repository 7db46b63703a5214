"""The clock of a simulation: how many fixed substeps are due, and how much time is left over."""

from __future__ import annotations

import math

from ..errors import HairloomError
from .settings import DynamicsSettings

#: A substep is due once all but this fraction of it has passed, so that 4 / 240 s makes one 60th.
_DUE = 1.0e-6


def due_substeps(
    time_left: float, duration: float, max_frame_time: float, dt: float
) -> tuple[float, int, float]:
    """The simulated duration [s], how many substeps are due, and the time left after them [s].

    Args:
        time_left: [s] of earlier frames that is not yet simulated.
        duration: [s] of this frame; at most `max_frame_time` of it is simulated.
        dt: [s] of a substep.

    Raises:
        HairloomError: a duration that is negative or not finite.
    """
    if not math.isfinite(duration) or duration < 0.0:
        raise HairloomError(
            f"a frame of {duration} seconds cannot be simulated",
            place=DynamicsSettings.title,
            remedy="Check the scene's frame rate",
        )
    duration = min(duration, max_frame_time)
    time = time_left + duration
    count = math.floor(time / dt + _DUE) if duration else 0
    left = time - count * dt
    return duration, count, 0.0 if left < _DUE * dt else left
