"""Every phase of a preview, and what each event makes of it.

    REST       in its style, on its body
    WAITING    the same; it plays as soon as its hair and its colliders are made
    FREE       simulated by Play's clock
    TIMELINE   simulated by Blender's timeline, frame by frame
    DEFERRED   at rest while Blender plays; simulated as soon as its hair and colliders are made
    BAKED      a frame of its bake

A frame that is baked is shown from its bake. Else the first frame rests there, one frame on is one
advance, and anywhere else (scrubbing) is rest in that pose: how the hair would hang there depends
on all frames before it, which nobody wants to wait for while dragging the playhead. Where Blender
plays and drops frames, they are advanced by in one go.
"""

from __future__ import annotations

from enum import Enum

Phase = Enum("Phase", "REST WAITING FREE TIMELINE DEFERRED BAKED")
Action = Enum("Action", "NONE BEGIN ADVANCE REST STOP SHOW")


class Event(Enum):
    """What happens to a preview."""

    PLAY = "Play is pressed, or what it has waited for is made"
    TICK = "Play's clock goes on"
    STOP = "Play is stopped, or its bake has changed"
    RESET = "it is put back into its style, or its body has moved within the frame"
    FIRST = "the scene is at its first frame"
    NEXT = "the scene has gone on by a frame, or by some that were dropped"
    SAME = "the scene is at the frame where it was"
    JUMP = "the scene is anywhere else"
    IS_BAKED = "the scene's frame is in its bake"
    UNMADE = "its hair or a collider is still being made, and nobody waits"
    FAILED = "it cannot be simulated"


SIMULATED = frozenset((Phase.FREE, Phase.TIMELINE))

_ANY = {
    Event.PLAY: (Phase.FREE, Action.BEGIN),
    Event.STOP: (Phase.REST, Action.STOP),
    Event.FIRST: (Phase.TIMELINE, Action.BEGIN),
    Event.NEXT: (Phase.TIMELINE, Action.BEGIN),
    Event.JUMP: (Phase.REST, Action.REST),
    Event.IS_BAKED: (Phase.BAKED, Action.SHOW),
    Event.UNMADE: (Phase.DEFERRED, Action.REST),
    Event.FAILED: (Phase.REST, Action.REST),
}
#: in place of what any phase does
_SPECIAL = {
    (Phase.FREE, Event.TICK): (Phase.FREE, Action.ADVANCE),
    (Phase.FREE, Event.NEXT): (Phase.TIMELINE, Action.ADVANCE),
    (Phase.TIMELINE, Event.NEXT): (Phase.TIMELINE, Action.ADVANCE),
    (Phase.TIMELINE, Event.JUMP): (Phase.TIMELINE, Action.REST),
    # Play waits at rest: nothing moves but its body, which it follows anyway
    (Phase.FREE, Event.UNMADE): (Phase.WAITING, Action.NONE),
    # a bake leaves no motion to go on from
    (Phase.BAKED, Event.SAME): (Phase.REST, Action.NONE),
    (Phase.BAKED, Event.RESET): (Phase.REST, Action.REST),
}


def next_phase(phase: Phase, event: Event) -> tuple[Phase, Action]:
    """Where an event leads, and what is to be done."""
    if event in _ANY:
        return _SPECIAL.get((phase, event), _ANY[event])
    action = Action.REST if event is Event.RESET else Action.NONE
    return _SPECIAL.get((phase, event), (phase, action))


def frame_event(
    before: int | None, now: int, first: int, *, is_played: bool, longest: float
) -> tuple[Event, int]:
    """What a frame of the scene is to a preview, and the frames by which it is ahead.

    Args:
        before: the frame that the hair stands at, None for none.
        first: the frame at which playback begins.
        longest: frames that may be dropped in playback.
    """
    if now == first:
        return Event.FIRST, 0
    ahead = 0 if before is None else now - before
    if before is None or not (ahead in (0, 1) or (is_played and 0 < ahead <= longest)):
        return Event.JUMP, 0
    return (Event.NEXT, ahead) if ahead else (Event.SAME, 0)
