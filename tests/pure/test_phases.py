"""The table of a preview's phases and events, which Play, the timeline and bakes follow.

The module is loaded from its file, since the rooms around it need Blender.
"""

from __future__ import annotations

import importlib.util
import itertools
from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "addon/blender/preview/phases.py"
_spec = importlib.util.spec_from_file_location("phases", PATH)
assert _spec is not None and _spec.loader is not None
phases = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(phases)
Action, Event, Phase, next_phase = phases.Action, phases.Event, phases.Phase, phases.next_phase


def after(phase: object, *events: object) -> tuple[object, list[str]]:
    """The phase after these events, and the actions on the way."""
    done = []
    for event in events:
        phase, action = next_phase(phase, event)
        done.append(action.name)
    return phase, done


def test_every_event_leads_somewhere_from_every_phase() -> None:
    for phase, event in itertools.product(Phase, Event):
        then, action = next_phase(phase, event)
        assert then in Phase and action in Action, (phase, event)
        if action is Action.ADVANCE:
            assert phase in phases.SIMULATED and then in phases.SIMULATED, (phase, event)
        if action in (Action.BEGIN, Action.ADVANCE):
            assert then in phases.SIMULATED, (phase, event)
        if then in phases.SIMULATED and phase not in phases.SIMULATED:
            assert action is Action.BEGIN, f"{phase} {event}: it advances before it has begun"
        assert (action is Action.SHOW) == (event is Event.IS_BAKED), (phase, event)


def test_play_begins_goes_on_and_is_stopped() -> None:
    events = (Event.PLAY, Event.TICK, Event.RESET, Event.TICK, Event.STOP, Event.TICK)
    done = ["BEGIN", "ADVANCE", "REST", "ADVANCE", "STOP", "NONE"]
    assert after(Phase.REST, *events) == (Phase.REST, done)


def test_play_waits_at_rest_for_what_is_being_made() -> None:
    assert after(Phase.REST, Event.PLAY, Event.NOT_READY) == (Phase.WAITING, ["BEGIN", "NONE"])
    assert after(Phase.WAITING, Event.TICK, Event.RESET) == (Phase.WAITING, ["NONE", "REST"])
    assert after(Phase.WAITING, Event.PLAY) == (Phase.FREE, ["BEGIN"])
    assert after(Phase.WAITING, Event.STOP)[0] is Phase.REST
    assert after(Phase.WAITING, Event.FIRST)[0] is Phase.TIMELINE, "the timeline takes over"


def test_the_timeline_begins_advances_and_rests_where_it_is_scrubbed() -> None:
    events = (Event.FIRST, Event.NEXT, Event.SAME, Event.JUMP, Event.NEXT)
    done = ["BEGIN", "ADVANCE", "NONE", "REST", "ADVANCE"]
    assert after(Phase.REST, *events) == (Phase.TIMELINE, done)
    assert after(Phase.REST, Event.JUMP, Event.SAME) == (Phase.REST, ["REST", "NONE"])
    assert after(Phase.REST, Event.JUMP, Event.NEXT) == (Phase.TIMELINE, ["REST", "BEGIN"])


def test_the_timeline_takes_hair_over_that_plays_without_a_break() -> None:
    assert after(Phase.FREE, Event.NEXT) == (Phase.TIMELINE, ["ADVANCE"])
    assert after(Phase.TIMELINE, Event.PLAY) == (Phase.FREE, ["BEGIN"])


def test_playback_goes_on_without_what_is_being_made() -> None:
    events = (Event.NEXT, Event.NOT_READY, Event.NEXT, Event.NOT_READY)
    assert after(Phase.REST, *events) == (Phase.DEFERRED, ["BEGIN", "REST"] * 2)
    assert after(Phase.DEFERRED, Event.NEXT, Event.NEXT)[1] == ["BEGIN", "ADVANCE"]


def test_a_bake_leaves_no_motion_to_go_on_from() -> None:
    assert after(Phase.TIMELINE, Event.IS_BAKED)[0] is Phase.BAKED
    assert after(Phase.BAKED, Event.SAME, Event.NEXT) == (Phase.TIMELINE, ["NONE", "BEGIN"])
    assert after(Phase.BAKED, Event.RESET) == (Phase.REST, ["REST"])


def test_what_fails_is_at_rest() -> None:
    for phase in Phase:
        assert after(phase, Event.FAILED) == (Phase.REST, ["REST"])


@pytest.mark.parametrize(
    ("before", "now", "is_played", "event", "ahead"),
    [
        (None, 7, False, "JUMP", 0),
        (6, 7, False, "NEXT", 1),
        (7, 7, False, "SAME", 0),
        (5, 7, False, "JUMP", 0),
        (5, 7, True, "NEXT", 2),
        (9, 7, True, "JUMP", 0),
        (9, 1, True, "FIRST", 0),
        (0, 1, False, "FIRST", 0),
        (None, 1, False, "FIRST", 0),
        (7, 40, True, "JUMP", 0),
    ],
)
def test_what_a_frame_change_means(
    before: int | None, now: int, is_played: bool, event: str, ahead: int
) -> None:
    found = phases.frame_event(before, now, 1, is_played=is_played, max_dropped=24.0)
    assert found == (Event[event], ahead)
