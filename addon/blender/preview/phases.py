"""The phases of a preview, and the phase and action that each event leads to.

    REST       in its style, on its body
    WAITING    at rest; plays as soon as its hair and its colliders are made
    FREE       simulated by Play's clock
    TIMELINE   simulated by Blender's timeline, frame by frame
    DEFERRED   at rest while Blender plays; simulated as soon as its hair and colliders are made
    BAKED      a frame of its bake

A baked frame is shown from the bake. Otherwise the first frame starts from rest, the next frame is
one advance, and any other frame (scrubbing) is rest in that pose: its simulated shape depends on
all frames before it, which take too long to simulate while the playhead is dragged. Frames that
Blender's playback drops are advanced over in one go.
"""

from __future__ import annotations

from enum import Enum

Phase = Enum("Phase", "REST WAITING FREE TIMELINE DEFERRED BAKED")
Action = Enum("Action", "NONE BEGIN ADVANCE REST STOP SHOW")


class Event(Enum):
    """What happens to a preview."""

    PLAY = "Play is pressed, or what it has waited for is made"
    TICK = "Play's clock ticks"
    STOP = "Play is stopped, or its bake has changed"
    RESET = "it returns to its style, or its body has moved within the frame"
    FIRST = "the scene is at its first frame"
    NEXT = "the scene has advanced by a frame, or by several of which some were dropped"
    SAME = "the scene is still at the same frame"
    JUMP = "the scene is anywhere else"
    IS_BAKED = "the scene's frame is in its bake"
    NOT_READY = "its hair or a collider is still being made, and nobody waits"
    FAILED = "it cannot be simulated"


SIMULATED = frozenset((Phase.FREE, Phase.TIMELINE))

_ANY = {
    Event.PLAY: (Phase.FREE, Action.BEGIN),
    Event.STOP: (Phase.REST, Action.STOP),
    Event.FIRST: (Phase.TIMELINE, Action.BEGIN),
    Event.NEXT: (Phase.TIMELINE, Action.BEGIN),
    Event.JUMP: (Phase.REST, Action.REST),
    Event.IS_BAKED: (Phase.BAKED, Action.SHOW),
    Event.NOT_READY: (Phase.DEFERRED, Action.REST),
    Event.FAILED: (Phase.REST, Action.REST),
}
#: exceptions to `_ANY` for single phases, and events that only matter in these
_SPECIAL = {
    (Phase.FREE, Event.TICK): (Phase.FREE, Action.ADVANCE),
    (Phase.FREE, Event.NEXT): (Phase.TIMELINE, Action.ADVANCE),
    (Phase.TIMELINE, Event.NEXT): (Phase.TIMELINE, Action.ADVANCE),
    (Phase.TIMELINE, Event.JUMP): (Phase.TIMELINE, Action.REST),
    # Play waits at rest: only the body moves, and the hair follows that anyway
    (Phase.FREE, Event.NOT_READY): (Phase.WAITING, Action.NONE),
    # a bake leaves no velocities to continue from
    (Phase.BAKED, Event.SAME): (Phase.REST, Action.NONE),
    (Phase.BAKED, Event.RESET): (Phase.REST, Action.REST),
}


def next_phase(phase: Phase, event: Event) -> tuple[Phase, Action]:
    """The phase that an event leads to, and the action to take."""
    if event in _ANY:
        return _SPECIAL.get((phase, event), _ANY[event])
    action = Action.REST if event is Event.RESET else Action.NONE
    return _SPECIAL.get((phase, event), (phase, action))


def frame_event(
    before: int | None, now: int, first: int, *, is_played: bool, max_dropped: float
) -> tuple[Event, int]:
    """The event that a scene frame causes in a preview, and the number of frames to advance.

    Args:
        before: the frame of the hair; None: it has none.
        first: the frame at which playback begins.
        max_dropped: maximum number of frames ahead that count as dropped by playback.
    """
    if now == first:
        return Event.FIRST, 0
    ahead = 0 if before is None else now - before
    if before is None or not (ahead in (0, 1) or (is_played and 0 < ahead <= max_dropped)):
        return Event.JUMP, 0
    return (Event.NEXT, ahead) if ahead else (Event.SAME, 0)
