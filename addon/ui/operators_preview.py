"""Preview, Play, Pause and Reset: hair in the 3D viewport. None of them changes the file.

Play is independent of the timeline: hair moves in real time, at the scene's frame rate, while the
artist moves the head or the sliders. Blender's own playback also moves hair, frame by frame, and
takes over if it starts during Play. Only Esc is used as a key, to stop; Space remains Blender's.

A timer drives Play. A modal operator would keep Blender from saving automatically.
"""

from __future__ import annotations

import time

import bpy

from ..blender.bakes.groom_hashes import frame_rate
from ..blender.base.frame_clock import FrameClock
from ..blender.base.latest_job import is_scheduled, schedule, unschedule
from ..blender.base.outcome import Outcome, report
from ..blender.base.redraw import show_status
from ..blender.base.suspension import is_suspended
from ..blender.preview import fins, previews
from ..blender.scene.source import hair_dynamics_modifiers, mute_hair_dynamics
from ..blender.sessions.fins import any_enabled
from .long_work import running_label
from .reports import report_outcome, reporting, wait_cursor
from .selection import needs_hair, target_hair

#: Rate of ticks [1/s]; high, so that a frame is delayed only by a fraction of its length.
TICKS_PER_SECOND = 120.0
#: The key of the ticks in `latest_job.schedule`.
TICKS = "play"
STATUS = "Hairloom plays. Move the head or the sliders. Esc: stop, and return the hair to its style"
PAUSED = "Hairloom is paused: press Resume in its panel. Esc: stop"
WAITING = "{names}: plays as soon as everything it needs is ready. Esc: cancel"


class HAIRLOOM_OT_preview(bpy.types.Operator):
    """Draw the selected hair in the 3D viewport, with its look, shadows and children. Press again
    to stop"""

    bl_idname = "hairloom.preview"
    bl_label = "Preview"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)
        if all(previews.session_of(each) for each in hair):
            stop_preview(hair)
            return {"FINISHED"}
        with wait_cursor(context):
            start_preview(self, context, hair)
        return {"FINISHED"}


class HAIRLOOM_OT_cancel_build(bpy.types.Operator):
    """Cancel what is being made for the selected hair: strands are shown instead of unfinished
    cards, and unfinished hair is no longer previewed"""

    bl_idname = "hairloom.cancel_build"
    bl_label = "Cancel"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if any(map(_is_building, target_hair(context))):
            return True
        cls.poll_message_set("Nothing is being made for the selected hair")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        for hair in filter(_is_building, target_hair(context)):
            session = previews.session_of(hair)
            if session is None or not session.is_made:
                stop_preview([hair])
                report(self, "INFO", f"{hair.name}: no longer previewed")
            else:
                hair.data.hairloom.use_cards = False
                report(self, "INFO", f"{hair.name}: strands are shown, not cards")
        return {"FINISHED"}


def _is_building(hair: bpy.types.Object) -> bool:
    """Whether hair or cards are being made that can be cancelled."""
    session = previews.session_of(hair)
    return session is not None and (not session.is_made or session.cards.is_pending)


class HAIRLOOM_OT_play(bpy.types.Operator):
    """Simulate previewed hair and cloth in real time. Esc stops them"""

    bl_idname = "hairloom.play"
    bl_label = "Play"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.background:
            cls.poll_message_set("Play needs a window; use the command line's simulate or bake")
            return False
        depsgraph = context.view_layer.depsgraph
        is_previewed = depsgraph is not None and bool(previews.simulations_in(depsgraph))
        if is_previewed or any_enabled(context.view_layer) or previews.is_playing():
            return True
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        if previews.is_playing():
            previews.rest(context.evaluated_depsgraph_get(), keep_playing=False)
            stop_ticking()
            return {"FINISHED"}
        with wait_cursor(context):
            if not previews.simulations_in(context.evaluated_depsgraph_get()):
                start_preview(self, context, target_hair(context))
            depsgraph = context.evaluated_depsgraph_get()
            fin_warnings = fins.start_enabled(depsgraph)
            for warning in (*fin_warnings, *previews.play(depsgraph, blocking=False)):
                report(self, "WARNING", warning)
        if not previews.is_playing():
            return {"CANCELLED"}
        start_ticking()
        return {"FINISHED"}


class HAIRLOOM_OT_stop(bpy.types.Operator):
    """Stop the hair and cloth that are playing. They return to their style"""

    bl_idname = "hairloom.stop"
    bl_label = "Stop Hair"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if previews.is_playing():
            return True
        cls.poll_message_set("No hair is playing")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        previews.rest(context.evaluated_depsgraph_get(), keep_playing=False)
        stop_ticking()
        return {"FINISHED"}


class HAIRLOOM_OT_pause(bpy.types.Operator):
    """Pause or resume the simulation of playing hair"""

    bl_idname = "hairloom.pause"
    bl_label = "Pause"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if previews.is_playing():
            return True
        cls.poll_message_set("No hair is playing: press Play first")
        return False

    def execute(self, _context: bpy.types.Context) -> set[str]:
        previews.pause(not previews.is_paused())
        return {"FINISHED"}


class HAIRLOOM_OT_mute_hair_dynamics(bpy.types.Operator):
    """Limit Blender's own Hair Dynamics to attaching the selected hair to its surface, so that only
    Hairloom moves it"""

    bl_idname = "hairloom.mute_hair_dynamics"
    bl_label = "Mute Hair Dynamics"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if any(hair_dynamics_modifiers(hair) for hair in target_hair(context)):
            return True
        cls.poll_message_set("No modifier with Hair Dynamics simulates the selected hair")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        count = sum(mute_hair_dynamics(hair) for hair in target_hair(context))
        modifiers = "1 modifier" if count == 1 else f"{count} modifiers"
        report(self, "INFO", f"Muted {modifiers} of Hair Dynamics")
        return {"FINISHED"}


class HAIRLOOM_OT_reset(bpy.types.Operator):
    """Return previewed hair to its style, at the current position of the head"""

    bl_idname = "hairloom.reset"
    bl_label = "Reset"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if previews.simulations():
            return True
        cls.poll_message_set("No hair is previewed: press Preview first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        previews.rest(context.evaluated_depsgraph_get(), keep_playing=True)
        return {"FINISHED"}


def start_ticking() -> None:
    ticks = _Ticks()
    ticks.update_status()
    schedule(TICKS, ticks.tick)


def stop_ticking() -> None:
    """Stop the clock, and remove the text in the status bar."""
    if is_scheduled(TICKS):
        unschedule(TICKS)
        show_status(None)


class _Ticks:
    """Play's clocks, one for each scene, and its text in the status bar."""

    def __init__(self) -> None:
        self._clocks: dict[int, FrameClock] = {}
        self._status = ""

    def tick(self) -> float | None:
        """Simulate the due frames of each scene in one step, as its head has moved only once."""
        if not previews.is_playing():
            show_status(None)
            return None
        self.update_status()
        now, windows = time.perf_counter(), previews.playing_windows()
        # the clock of a scene that was hidden for a while starts at this moment
        self._clocks = {uid: self._clocks.get(uid) or FrameClock(now) for uid in windows}
        for uid, window in windows.items():
            if previews.is_paused() or is_suspended():
                self._clocks[uid].skip(now)
                continue
            rate = frame_rate(window.scene)
            frames = self._clocks[uid].due_frames(now, rate)
            if frames:
                with bpy.context.temp_override(window=window):
                    previews.advance(bpy.context.evaluated_depsgraph_get(), frames / rate)
        return 1.0 / TICKS_PER_SECOND

    def update_status(self) -> None:
        if running_label():  # a long operator uses the status bar, and empties it at its end
            self._status = ""
            return
        text = PAUSED if previews.is_paused() else STATUS
        if names := previews.waiting_names():
            text = WAITING.format(names=", ".join(names))
        if text != self._status:
            self._status = text
            show_status(text)


def start_preview(
    operator: bpy.types.Operator, context: bpy.types.Context, hair: list[bpy.types.Object]
) -> None:
    """Preview those that are not previewed yet, and report what was read."""
    depsgraph = context.evaluated_depsgraph_get()
    for each in hair:
        if previews.session_of(each) is None:
            session = previews.start(each, depsgraph)
            rig = session.rig
            counts = f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides"
            if not session.is_made:
                counts = f"{session.source.strands.strand_count:,} strands"
            report_outcome(operator, Outcome(counts, session.source.dropped, session.warnings))


def stop_preview(hair: list[bpy.types.Object]) -> None:
    for each in hair:
        session = previews.session_of(each)
        if session is not None:
            previews.stop(session)


CLASSES = (
    HAIRLOOM_OT_preview,
    HAIRLOOM_OT_cancel_build,
    HAIRLOOM_OT_play,
    HAIRLOOM_OT_stop,
    HAIRLOOM_OT_pause,
    HAIRLOOM_OT_reset,
    HAIRLOOM_OT_mute_hair_dynamics,
)


def register() -> None:
    """Let Esc stop hair that plays; while none does, the key works as usual."""
    keys = bpy.context.window_manager.keyconfigs.addon
    if keys is not None:  # None without a window
        keymap = keys.keymaps.new(name="Window")
        keymap.keymap_items.new(HAIRLOOM_OT_stop.bl_idname, "ESC", "PRESS")


def unregister() -> None:
    keys = bpy.context.window_manager.keyconfigs.addon
    keymap = None if keys is None else keys.keymaps.get("Window")
    if keymap is None:
        return
    for item in tuple(keymap.keymap_items):
        if item.idname == HAIRLOOM_OT_stop.bl_idname:
            keymap.keymap_items.remove(item)
