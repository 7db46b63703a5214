"""Preview, Play, Pause and Reset: hair in the 3D viewport. None of them changes the file.

Play is independent of the timeline: hair moves in real time, at the scene's frame rate, while the
artist moves the head or the sliders. Blender's own playback also moves hair, frame by frame, and
takes over if it starts during Play. Only Esc is used as a key, to stop; Space remains Blender's.
"""

from __future__ import annotations

import time

import bpy

from ..blender.bakes.groom_hashes import frame_rate
from ..blender.base.frame_clock import FrameClock
from ..blender.base.outcome import Outcome, report
from ..blender.base.suspension import is_suspended
from ..blender.preview import fins, previews
from ..blender.scene.source import mute_own_dynamics, own_dynamics
from ..blender.sessions.fins import any_enabled
from .reports import reporting, tell, waiting
from .selection import chosen_hair, needs_hair

#: Minimum rate of ticks [1/s], so that a frame is delayed by a fraction of its length only.
TICKS_PER_SECOND = 120.0
STATUS = "Hairloom plays. Move the head or the sliders. Esc: stop, the hair returns to its style"
PAUSED = "Hairloom is paused: press Resume in its panel. Esc: stop"


#: ticks while hair plays; kept here because Blender does not notify an operator of being disabled
_timer: bpy.types.Timer | None = None


class HAIRLOOM_OT_preview(bpy.types.Operator):
    """Draw the selected hair in the 3D viewport as it will look in a game engine"""

    bl_idname = "hairloom.preview"
    bl_label = "Preview"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = chosen_hair(context)
        if all(previews.session_of(each) for each in hair):
            stop_preview(hair)
            return {"FINISHED"}
        with waiting(context):
            start_preview(self, context, hair)
        return {"FINISHED"}


class HAIRLOOM_OT_play(bpy.types.Operator):
    """Simulate previewed hair and fins in real time. Esc stops them"""

    bl_idname = "hairloom.play"
    bl_label = "Play"

    _clock: FrameClock
    _ticks: bpy.types.Timer

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.background:
            cls.poll_message_set("Play needs a window; use the command line's simulate or bake")
            return False
        if any_enabled(context.view_layer) or previews.simulated():
            return True
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return self._start_or_stop(context)

    @reporting
    def _start_or_stop(self, context: bpy.types.Context) -> set[str]:
        if previews.is_playing():
            previews.rest(context.evaluated_depsgraph_get(), keep_playing=False)
            return {"FINISHED"}  # the operator that plays sees it and ends
        with waiting(context):
            if not previews.simulated():
                start_preview(self, context, chosen_hair(context))
            depsgraph = context.evaluated_depsgraph_get()
            fin_warnings = fins.start_enabled(depsgraph)
            for warning in (*fin_warnings, *previews.play(depsgraph, blocking=False)):
                report(self, "WARNING", warning)
        if not previews.is_playing():
            return {"CANCELLED"}
        self._ticks = start_ticking(context)
        self._clock = FrameClock(time.perf_counter())
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self._ticks is not _timer:
            return {"FINISHED"}  # another Play has taken over
        if not previews.is_playing():
            stop_ticking()
            return {"FINISHED"}
        if event.type == "ESC" and event.value == "PRESS":
            previews.rest(context.evaluated_depsgraph_get(), keep_playing=False)
            stop_ticking()
            return {"CANCELLED"}
        if event.type == "TIMER":
            self._tick(context)
        return {"PASS_THROUGH"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender ends the operator: a file is loaded or its window closed."""
        stop_ticking()

    def _tick(self, context: bpy.types.Context) -> None:
        """Simulate the scene's frames that are due, in one step: the head has moved only once."""
        now, rate = time.perf_counter(), frame_rate(context.scene)
        if previews.is_paused() or is_suspended():
            self._clock.skip(now)
            return
        frames = self._clock.due(now, rate)
        if frames:
            previews.advance(context.evaluated_depsgraph_get(), frames / rate)


class HAIRLOOM_OT_pause(bpy.types.Operator):
    """Pause the simulation of hair that plays, or resume it"""

    bl_idname = "hairloom.pause"
    bl_label = "Pause"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if previews.is_playing():
            return True
        cls.poll_message_set("No hair is playing: press Play first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        previews.pause(not previews.is_paused())
        if _timer is not None:
            context.workspace.status_text_set(PAUSED if previews.is_paused() else STATUS)
        return {"FINISHED"}


class HAIRLOOM_OT_mute_hair_dynamics(bpy.types.Operator):
    """Turn off Blender's own Hair Dynamics on the selected hair, so that only Hairloom moves it"""

    bl_idname = "hairloom.mute_hair_dynamics"
    bl_label = "Mute Hair Dynamics"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if any(own_dynamics(hair) for hair in chosen_hair(context)):
            return True
        cls.poll_message_set("The selected hair has no Hair Dynamics modifier that is on")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        count = sum(mute_own_dynamics(hair) for hair in chosen_hair(context))
        report(self, "INFO", f"Turned off {count} Hair Dynamics modifiers")
        return {"FINISHED"}


class HAIRLOOM_OT_reset(bpy.types.Operator):
    """Return previewed hair to its style, at the head's present position"""

    bl_idname = "hairloom.reset"
    bl_label = "Reset"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if previews.simulated():
            return True
        cls.poll_message_set("No hair is previewed: press Preview first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        previews.rest(context.evaluated_depsgraph_get(), keep_playing=True)
        return {"FINISHED"}


def start_ticking(context: bpy.types.Context) -> bpy.types.Timer:
    global _timer
    stop_ticking()
    _timer = context.window_manager.event_timer_add(1.0 / TICKS_PER_SECOND, window=context.window)
    context.workspace.status_text_set(STATUS)
    return _timer


def stop_ticking() -> None:
    """Remove the timer and the text in the status bar, however Play ends."""
    global _timer
    if _timer is None:
        return
    bpy.context.window_manager.event_timer_remove(_timer)
    _timer = None
    if bpy.context.workspace is not None:
        bpy.context.workspace.status_text_set(None)


def start_preview(
    operator: bpy.types.Operator, context: bpy.types.Context, hair: list[bpy.types.Object]
) -> None:
    """Preview what is not yet previewed, and report what was read."""
    depsgraph = context.evaluated_depsgraph_get()
    for each in hair:
        if previews.session_of(each) is None:
            session = previews.start(each, depsgraph)
            rig = session.rig
            counts = f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides"
            if not session.is_made:
                counts = f"{session.source.strands.strand_count:,} strands"
            tell(operator, Outcome(counts, session.source.dropped, session.warnings))


def stop_preview(hair: list[bpy.types.Object]) -> None:
    for each in hair:
        session = previews.session_of(each)
        if session is not None:
            previews.stop(session)


CLASSES = (
    HAIRLOOM_OT_preview,
    HAIRLOOM_OT_play,
    HAIRLOOM_OT_pause,
    HAIRLOOM_OT_reset,
    HAIRLOOM_OT_mute_hair_dynamics,
)
