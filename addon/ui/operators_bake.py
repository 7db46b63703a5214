"""Bake and Delete Bake: the motion of hair and fins on disk, for the viewport and for renders."""

from __future__ import annotations

import time
from typing import ClassVar

import bpy

from ..errors import HairloomError
from ..host import live, playback, timeline
from ..host.bake import Bake, bakeable, free, show_in_renders
from ..host.fin_modifier import fin_modifier
from .reports import reporting
from .selection import chosen_hair

#: Work this long [s] between two looks at the keyboard.
_SPELL = 0.1


class _Running:
    """The bake that goes on in the window; Blender does not tell an operator that it is disabled.

    done: frames so far.
    """

    def __init__(self, bake: Bake, timer: bpy.types.Timer) -> None:
        self.bake, self.timer = bake, timer
        self.steps = bake.steps()
        self.done = 0


_running: _Running | None = None


class HAIRLOOM_OT_bake(bpy.types.Operator):
    """Simulate selected hair and fins over all frames and keep the motion on disk. Esc cancels"""

    bl_idname = "hairloom.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if _running is not None:
            cls.poll_message_set("A bake goes on already; Esc cancels it")
            return False
        if chosen(context):
            return True
        cls.poll_message_set("Select hair curves, or a mesh that is a fin, first")
        return False

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        return self._start(context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        """All at once, for scripts."""
        bake = Bake.of(chosen(context), context.scene)
        manager = context.window_manager
        manager.progress_begin(0, bake.frame_count)
        try:
            for done in bake.steps():
                manager.progress_update(done)
        finally:
            manager.progress_end()
        return self._finish(context, bake)

    @reporting
    def _start(self, context: bpy.types.Context) -> set[str]:
        global _running
        if live.is_playing():
            live.rest(context.evaluated_depsgraph_get(), keep_playing=False)
        bake = Bake.of(chosen(context), context.scene)
        manager = context.window_manager
        _running = _Running(bake, manager.event_timer_add(0.01, window=context.window))
        manager.progress_begin(0, bake.frame_count)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything else waits: what is edited in the middle of a bake would be in half of it."""
        if _running is None:
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            stop()
            self.report({"INFO"}, "The bake was cancelled; what was baked before stays")
            return {"CANCELLED"}
        if event.type == "TIMER":
            return self._spell(context)
        return {"RUNNING_MODAL"}

    def _spell(self, context: bpy.types.Context) -> set[str]:
        running, end = _running, time.perf_counter() + _SPELL
        assert running is not None
        try:
            while time.perf_counter() < end:
                running.done = next(running.steps)
        except StopIteration:
            stop()
            return self._finish(context, running.bake)
        except HairloomError as error:
            stop()
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except BaseException:
            stop()
            raise
        context.window_manager.progress_update(running.done)
        total = running.bake.frame_count
        context.workspace.status_text_set(
            f"Hairloom bakes: {running.done:,} of {total:,} frames. Esc: cancel"
        )
        for area in context.screen.areas:
            area.tag_redraw()
        return {"RUNNING_MODAL"}

    def _finish(self, context: bpy.types.Context, bake: Bake) -> set[str]:
        locks = show_in_renders(bake.objects(), context.evaluated_depsgraph_get())
        names = ", ".join(obj.name for obj in bake.objects())
        also = "; Render > Lock Interface is on, which renders of baked hair need" if locks else ""
        self.report({"INFO"}, f"Baked {bake.frame_count:,} frames of {names}{also}")
        return {"FINISHED"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender ends the operator: a file is loaded or its window closed."""
        stop()


class HAIRLOOM_OT_bake_free(bpy.types.Operator):
    """Delete the bake of the selected hair and fins from disk. This cannot be undone"""

    bl_idname = "hairloom.bake_free"
    bl_label = "Delete Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if _running is None and any(has_bake(obj) for obj in chosen(context)):
            return True
        cls.poll_message_set("Nothing that is selected has a bake")
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        for obj in chosen(context):
            free(obj, context.evaluated_depsgraph_get())
        return {"FINISHED"}


def chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """What the bake's buttons are about: hair as elsewhere, and selected fins."""
    return list(dict.fromkeys(filter(bakeable, (*chosen_hair(context), *context.selected_objects))))


def has_bake(obj: bpy.types.Object) -> bool:
    """Whether there is a bake, be it damaged."""
    try:
        return playback.cache_of(obj) is not None
    except HairloomError:
        return True


def stop() -> None:
    """End the bake, if one goes on: leave no timer, no text and nothing half written."""
    global _running
    if _running is None:
        return
    running, _running = _running, None
    running.steps.close()
    manager = bpy.context.window_manager
    manager.event_timer_remove(running.timer)
    manager.progress_end()
    if bpy.context.workspace is not None:
        bpy.context.workspace.status_text_set(None)


def draw_bake(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """The settings of the bake of hair or a fin, its buttons, and what there is on disk."""
    bake = obj.hairloom.bake
    layout.prop(bake, "folder")
    layout.prop(bake, "use_own_range")
    if bake.use_own_range:
        column = layout.column(align=True)
        column.prop(bake, "first")
        column.prop(bake, "last")
    if obj.type == "CURVES":
        layout.prop(bake, "in_renders")
    if _running is not None:
        total = _running.bake.frame_count
        text = f"{_running.done:,} of {total:,} frames"
        layout.progress(factor=_running.done / total, text=text)
        return
    row = layout.row(align=True)
    row.operator("hairloom.bake", icon="REC")
    row.operator("hairloom.bake_free", text="", icon="TRASH")
    _draw_state(layout, obj)


def _draw_state(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    try:
        cache = playback.cache_of(obj)
    except HairloomError as error:
        layout.label(text=error.problem, icon="ERROR")
        return
    if cache is None:
        layout.label(text="Not baked", icon="BLANK1")
        return
    layout.prop(obj.hairloom.bake, "is_shown")
    facts, known = cache.facts, timeline.baked(obj.session_uid)
    computed = {"numpy": "CPU", "compute": "GPU"}.get(facts.form, facts.form)
    layout.label(
        text=f"Frames {facts.first} to {facts.last} at {facts.frame_rate:g} fps, {computed}",
        icon="CHECKMARK",
    )
    if known is not None and known.changed:
        layout.label(text="Out of date: " + ", ".join(known.changed), icon="ERROR")


class _FinBake:
    bl_label = "Bake"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        return obj is not None and fin_modifier(obj) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.object.hairloom.bake, "follows")
        draw_bake(layout, context.object)


class HAIRLOOM_PT_fin_bake(_FinBake, bpy.types.Panel):
    """The bake of this fin"""

    bl_parent_id = "HAIRLOOM_PT_fin"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"


class HAIRLOOM_PT_sidebar_fin_bake(_FinBake, bpy.types.Panel):
    """The bake of this fin"""

    bl_parent_id = "HAIRLOOM_PT_sidebar_fin"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"


CLASSES = (HAIRLOOM_OT_bake, HAIRLOOM_OT_bake_free)
#: below the panels of operators_fins
FIN_CLASSES = (HAIRLOOM_PT_fin_bake, HAIRLOOM_PT_sidebar_fin_bake)
