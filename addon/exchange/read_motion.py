"""The motion of a file's curves objects as that of one groom."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from .groom import ReadMotion, bracket_times

#: Times nearer to each other than this [s] are one.
_SAME_TIME = 1.0e-5
#: Times beyond this [s] are after Blender's last frame, at any frame rate.
_LATEST = 2.0e6


def join_motions(
    parts: Sequence[tuple[Floats | None, Floats]],
) -> tuple[Floats, Floats] | None:
    """Times and points of all parts, (n,) and (n, point_count, 3); None where none moves, since
    programs also write still hair at each frame.

    Args:
        parts: of each its times, (k,), or None if it is still and k is 1; and its points at these,
            (k, own_count, 3).
    """
    known = [times for times, _ in parts if times is not None and len(times) > 1]
    if not known or not all(np.isfinite(times).all() for times in known):
        return None
    all_times = np.unique(np.concatenate(known))
    times = all_times[np.append(True, np.diff(all_times) > _SAME_TIME)]
    positions = np.concatenate([_positions_at(times, *part) for part in parts], axis=1)
    is_still = np.array_equal(positions[1:], np.broadcast_to(positions[:1], positions[1:].shape))
    return None if is_still else (times, positions)


def _positions_at(times: Floats, own_times: Floats | None, positions: Floats) -> Floats:
    """The points of a part at the times of all parts."""
    if own_times is None or len(own_times) < 2:
        return np.repeat(positions[:1], len(times), axis=0)
    if len(own_times) == len(times) and np.allclose(own_times, times, rtol=0.0, atol=_SAME_TIME):
        return positions
    left, fraction = bracket_times(own_times, times)
    near, far = positions[left], positions[left + 1]
    mixed: Floats = near + (far - near) * fraction[:, None, None]
    return mixed


def valid_motion(times: Floats, positions: Floats) -> tuple[ReadMotion | None, str]:
    """The motion before the first time that no scene has or at which a point is not finite, and a
    note on that.

    Args:
        times: (n,) [s]. positions: (n, point_count, 3) [m].
    """
    is_finite, is_near = np.isfinite(positions).all(axis=(1, 2)), np.abs(times) < _LATEST
    is_sound = is_finite & is_near
    count = len(times) if is_sound.all() else int(is_sound.argmin())
    note = ""
    if count < len(times):
        reason = (
            "points that are not numbers"
            if is_near[count]
            else "a time outside the range of a scene"
        )
        note = motion_end_note(float(times[count]), reason)
    return (ReadMotion(times[:count], positions[:count]) if count > 1 else None), note


def motion_end_note(seconds: float, reason: str) -> str:
    return f"at {seconds:g} s it has {reason}, so its motion ends before that"
