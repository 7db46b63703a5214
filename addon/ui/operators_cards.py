"""Make Cards: the cards of the selected hair as objects in the scene, and what they are made of."""

from __future__ import annotations

import bpy

from ..host.card_making import order_line
from ..host.card_object import CardObjectJob, card_objects
from ..host.groom_files import Outcome
from ..host.redraw import redraw_panels
from .reports import reporting, tell
from .selection import chosen_hair, needs_hair


class _Running:
    """The cards that are being made in the window."""

    def __init__(self, job: CardObjectJob, timer: bpy.types.Timer) -> None:
        self.job, self.timer, self.work = job, timer, job.making()
        self.told = ""

    @property
    def stage(self) -> str:
        """What is done now."""
        return self.work.stage or "Reading the hair"


_running: _Running | None = None


class HAIRLOOM_OT_make_cards(bpy.types.Operator):
    """Make hair cards of the active hair, as meshes in the scene, or those anew. Esc cancels"""

    bl_idname = "hairloom.make_cards"
    bl_label = "Make Cards"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if _running is not None:
            cls.poll_message_set("Cards are being made already; Esc cancels it")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go back to Object Mode first")
            return False
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return self.execute(context) if bpy.app.background else self._start(context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        """All at once, for scripts."""
        job = CardObjectJob(chosen_hair(context)[0], context.evaluated_depsgraph_get())
        for _ in job.steps():
            pass
        return self._finish(job)

    @reporting
    def _start(self, context: bpy.types.Context) -> set[str]:
        global _running
        job = CardObjectJob(chosen_hair(context)[0], context.evaluated_depsgraph_get())
        manager = context.window_manager
        _running = _Running(job, manager.event_timer_add(0.01, window=context.window))
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if _running is None:
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            stop()
            self.report({"INFO"}, "Making cards was cancelled; nothing has changed")
            return {"CANCELLED"}
        if event.type == "TIMER":
            return self._step(context)
        return {"RUNNING_MODAL"}

    @reporting
    def _step(self, context: bpy.types.Context) -> set[str]:
        running = _running
        assert running is not None
        if running.work.serve():
            stop()
            running.job.write(running.work.result())
            return self._finish(running.job)
        if running.told != running.stage:
            running.told = running.stage
            context.workspace.status_text_set(f"Hairloom makes cards: {running.told}. Esc: cancel")
            redraw_panels()
        return {"RUNNING_MODAL"}

    def _finish(self, job: CardObjectJob) -> set[str]:
        finest, levels = job.objects[0], len(job.objects)
        detail = f"{levels} levels of detail" if levels > 1 else "one level of detail"
        result = f"{finest.name}: {_counts(finest)}, {detail}. {job.order}"
        tell(self, Outcome(result, job.dropped, job.notes))
        return {"FINISHED"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender ends the operator: a file is loaded or its window closed."""
        stop()


def is_making() -> bool:
    """Whether cards are being made in the window."""
    return _running is not None


def stop() -> None:
    """End it, if cards are being made: leave no timer and no text."""
    global _running
    if _running is None:
        return
    running, _running = _running, None
    running.work.give_up()
    bpy.context.window_manager.event_timer_remove(running.timer)
    if bpy.context.workspace is not None:
        bpy.context.workspace.status_text_set(None)


def draw_made_cards(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """The button, and what there is: a line a level of detail, and the texture."""
    if _running is not None:
        layout.label(text=_running.stage, icon="SORTTIME")
        return
    objects = card_objects(hair)
    text = "Make Cards Again" if objects else "Make Cards"
    layout.operator("hairloom.make_cards", text=text, icon="MESH_GRID")
    column = layout.column(align=True)
    for obj in objects:
        row = column.row(align=True)
        row.label(text=f"{obj.name}: {_counts(obj)}")
        row.prop(obj, "hide_viewport", text="", emboss=False)
    if not objects:
        return
    column.label(text=order_line(objects[0].hairloom.card_object.wrong_share), icon="SORTSIZE")
    image = objects[0].hairloom.card_object.image
    if image is not None:
        column.label(text=f"Texture {image.size[0]} x {image.size[1]}", icon="TEXTURE")


def _counts(obj: bpy.types.Object) -> str:
    cards, triangles = obj.hairloom.card_object.card_count, len(obj.data.polygons)
    return f"{cards:,} cards, {triangles:,} triangles"


CLASSES = (HAIRLOOM_OT_make_cards,)
