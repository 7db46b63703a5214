"""Blender's playback goes on without what is being made: hair, or the fields of its colliders.

    hair that is not made yet         Blender's own strands are shown, and the frames go on
    other hair is being made          the hair that is there plays on
    a collider that is not made yet   the hair goes with its body, at rest

It begins, from rest, at the frame at which all is there. The next round begins at the first frame,
and is then what a bake is. To make up for what was missed would take the bodies of all frames
before.

Steps of a single frame, scripts, bakes and renders wait, those of the viewport too: what they show
is exact.
"""

from __future__ import annotations

import bpy

from ..bakes import playback
from ..bakes.simulated import Simulated
from ..base import latest_job
from ..colliders import fields
from ..colliders.fields import NotMadeYetError
from ..sessions.session import Session

#: uids of what stands at rest while Blender plays
_late: set[int] = set()


def lacks_hair(session: Simulated) -> bool:
    """Whether the frame is to be shown before the groom is made."""
    is_made = not isinstance(session, Session) or session.is_made
    return not is_made and not _waits()


def begin(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Simulate it from here on, if it can be; else it is asked for again in the next frame.

    Raises:
        HairloomError: as `Simulated.play`.
    """
    if _waits():
        session.play(depsgraph)
        return
    try:
        if not fields.are_made():
            raise NotMadeYetError
        session.play(depsgraph, blocking=False)
    except NotMadeYetError:
        go_without(session, depsgraph)


def go_without(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """It goes with its body in this frame.

    Raises:
        HairloomError: as `Simulated.rest`.
    """
    _late.add(session.uid)
    session.rest(depsgraph)


def is_late(session: Simulated) -> bool:
    """Whether it stands at rest while Blender plays."""
    return session.uid in _late and not _waits()


def forget(uid: int) -> None:
    """It is previewed no longer, or moved by something else."""
    _late.discard(uid)


def _waits() -> bool:
    """Whether a frame is not left before all of its hair is there."""
    return latest_job.is_blocking() or not playback.is_played()
