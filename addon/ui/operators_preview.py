"""Preview, Play and Reset: hair in the 3D viewport. None of them changes the file."""

from __future__ import annotations

import time

import bpy

from ..host import live
from ..host.groom_files import Outcome
from .reports import reporting, tell, waiting
from .selection import chosen_hair, needs_hair

TICKS_PER_SECOND = 60.0
STATUS = "Hairloom plays. Move the head or the sliders. Esc: stop, the hair returns to its style"


#: ticks while hair plays; kept here because Blender does not tell an operator that it is disabled
_timer: bpy.types.Timer | None = None


class HAIRLOOM_OT_preview(bpy.types.Operator):
    """Draw the selected hair in the 3D viewport as it will look in an engine"""

    bl_idname = "hairloom.preview"
    bl_label = "Preview"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = chosen_hair(context)
        if all(live.session_of(each) for each in hair):
            stop_preview(hair)
            return {"FINISHED"}
        with waiting(context):
            start_preview(self, context, hair)
        return {"FINISHED"}


class HAIRLOOM_OT_play(bpy.types.Operator):
    """Let previewed hair move: it follows the head, falls and swings. Esc stops it"""

    bl_idname = "hairloom.play"
    bl_label = "Play"

    _last_tick: float = 0.0

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.background:
            cls.poll_message_set("Play needs a window; use the command line's simulate")
            return False
        return bool(live.sessions()) or needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return self._start_or_stop(context)

    @reporting
    def _start_or_stop(self, context: bpy.types.Context) -> set[str]:
        if live.is_playing():
            live.rest(context.evaluated_depsgraph_get(), keep_playing=False)
            return {"FINISHED"}  # the operator that plays sees it and ends
        with waiting(context):
            if not live.sessions():
                start_preview(self, context, chosen_hair(context))
            for warning in live.play(context.evaluated_depsgraph_get()):
                self.report({"WARNING"}, warning)
        start_ticking(context)
        self._last_tick = time.perf_counter()
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not live.is_playing():
            stop_ticking()
            return {"FINISHED"}
        if event.type == "ESC" and event.value == "PRESS":
            live.rest(context.evaluated_depsgraph_get(), keep_playing=False)
            stop_ticking()
            return {"CANCELLED"}
        if event.type == "TIMER":
            self._tick(context)
        return {"PASS_THROUGH"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender ends the operator: a file is loaded or its window closed."""
        stop_ticking()

    def _tick(self, context: bpy.types.Context) -> None:
        """Simulate the time that really passed; other timers' ticks in between are left out."""
        now = time.perf_counter()
        if now - self._last_tick < 0.5 / TICKS_PER_SECOND:
            return
        live.advance(context.evaluated_depsgraph_get(), now - self._last_tick)
        self._last_tick = now


class HAIRLOOM_OT_reset(bpy.types.Operator):
    """Put previewed hair back into its style, where the head is now"""

    bl_idname = "hairloom.reset"
    bl_label = "Reset"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if live.sessions():
            return True
        cls.poll_message_set("No hair is previewed: press Preview first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        live.rest(context.evaluated_depsgraph_get(), keep_playing=True)
        return {"FINISHED"}


def start_ticking(context: bpy.types.Context) -> None:
    global _timer
    stop_ticking()
    _timer = context.window_manager.event_timer_add(1.0 / TICKS_PER_SECOND, window=context.window)
    context.workspace.status_text_set(STATUS)


def stop_ticking() -> None:
    """Leave no timer and no text in the status bar, however Play ends."""
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
    """Preview what is not yet previewed, and say what was read."""
    depsgraph = context.evaluated_depsgraph_get()
    for each in hair:
        if live.session_of(each) is None:
            session = live.start(each, depsgraph)
            rig = session.rig
            counts = f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides"
            tell(operator, Outcome(counts, session.source.dropped, session.source.warnings))


def stop_preview(hair: list[bpy.types.Object]) -> None:
    for each in hair:
        session = live.session_of(each)
        if session is not None:
            live.stop(session)


CLASSES = (HAIRLOOM_OT_preview, HAIRLOOM_OT_play, HAIRLOOM_OT_reset)
