"""How many of the scene's frames are due by the clock."""

from __future__ import annotations

#: Maximum number of frames per tick. Further ones are dropped: to catch up completely after a slow
#: frame would make the next one slower still.
MAX_AT_ONCE = 4


class FrameClock:
    """Counts frames against a clock.

    Args:
        now: the clock's time [s].
    """

    def __init__(self, now: float) -> None:
        self._done_until = now

    def due(self, now: float, rate: float) -> int:
        """Whole frames that have become due since the last call, at a rate [1/s]."""
        frames = max(int((now - self._done_until) * rate + 1.0e-6), 0)
        if frames > MAX_AT_ONCE:
            frames, self._done_until = MAX_AT_ONCE, now
        else:
            self._done_until += frames / rate
        return frames

    def skip(self, now: float) -> None:
        """Leave out the time until now, as while hair is held."""
        self._done_until = now
