"""Hair that Rendered mode draws, made beside the window's work: until it is there the picture has
what was drawn before, or none. Renders wait for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...errors import HairloomError
from ..base.redraw import redraw_views
from ..base.thread_work import ThreadWork

#: What is being made is looked for this often [s].
_ASKING_TIME = 0.1


class HairNotMadeYetError(Exception):
    """There is nothing to be shown; ask again when `is_done` says so."""


@dataclass(frozen=True, eq=False)
class _Making:
    """One groom on its way, and the values that it is made from."""

    made_from: tuple[Any, ...]
    work: ThreadWork[Any]


_makings: dict[int, _Making] = {}


def made[T](uid: int, made_from: tuple[Any, ...], make: Callable[[], T]) -> T | None:
    """What a thread has made last, maybe of earlier values; what it is to make of these begins once
    that is done. None where nothing was done since the last call.

    Args:
        uid: session number of the hair.
        make: needs arrays alone.

    Raises:
        HairloomError: it cannot be made of these values.
    """
    making, result = _makings.get(uid), None
    if making is not None and making.work.is_done:
        del _makings[uid]
        is_latest = alike(making.made_from, made_from)
        try:
            result = making.work.result()
        except HairloomError:
            if is_latest:
                raise
        if is_latest:
            return result
    if uid not in _makings:
        _makings[uid] = _Making(made_from, ThreadWork(lambda _: make(), "hair in Rendered mode"))
        if not bpy.app.timers.is_registered(_tell):
            bpy.app.timers.register(_tell, first_interval=_ASKING_TIME)
    return result


def is_pending(uid: int) -> bool:
    """Whether hair is being made of other values than what is shown."""
    return uid in _makings


def is_done(uid: int) -> bool:
    """Whether to ask for this hair again."""
    return uid not in _makings or _makings[uid].work.is_done


def drop(uid: int) -> None:
    """What is shown is what is wanted: nobody waits any more for other hair of this groom."""
    if uid in _makings:
        _makings.pop(uid).work.give_up()


def forget_but(uids: set[int]) -> None:
    """Nobody waits any more for other hair than this, by session number."""
    for uid in set(_makings) - uids:
        drop(uid)


def forget() -> None:
    """Nobody waits for any hair."""
    forget_but(set())
    if bpy.app.timers.is_registered(_tell):
        bpy.app.timers.unregister(_tell)


def alike(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two lists of values, arrays among them, are the same."""
    return len(one) == len(other) and all(
        np.array_equal(a, b)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray)
        else not isinstance(a, np.ndarray) and not isinstance(b, np.ndarray) and a == b
        for a, b in zip(one, other, strict=True)
    )


def _tell() -> float | None:
    """A timer of Blender's: views that are drawn again ask for what has been made."""
    if any(making.work.is_done for making in _makings.values()):
        redraw_views()
    is_pending = any(not making.work.is_done for making in _makings.values())
    return _ASKING_TIME if is_pending else None
