"""How many of the scene's frames are due at a time."""

from __future__ import annotations

#: Further frames are dropped: catching up completely after a slow frame would make the next one
#: slower still.
MAX_FRAMES_PER_TICK = 4


class FrameClock:
    """Counts frames against a clock.

    Args:
        now: the clock's time [s].
    """

    def __init__(self, now: float) -> None:
        self._counted_until = now

    def due_frames(self, now: float, rate: float) -> int:
        """Whole frames that have become due since the last call, at a rate [1/s]."""
        frames = max(int((now - self._counted_until) * rate + 1.0e-6), 0)
        if frames > MAX_FRAMES_PER_TICK:
            frames, self._counted_until = MAX_FRAMES_PER_TICK, now
        else:
            self._counted_until += frames / rate
        return frames

    def skip(self, now: float) -> None:
        """Skip the time until now, as while hair is paused."""
        self._counted_until = now
