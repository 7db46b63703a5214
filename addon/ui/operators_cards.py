"""Make Cards: the cards of the selected hair as objects in the scene, and what they are made of."""

from __future__ import annotations

import bpy

from ..blender.base.outcome import Outcome
from ..blender.cards.build import order_line
from ..blender.cards.object import CardObjectJob, card_objects
from .long_work import LongWork, Progress, Steps, draw_progress, threaded
from .reports import tell
from .selection import chosen_hair, needs_hair


class HAIRLOOM_OT_make_cards(LongWork, bpy.types.Operator):
    """Make hair cards of the active hair as meshes in the scene, or update them. Esc cancels"""

    bl_idname = "hairloom.make_cards"
    bl_label = "Make Cards"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not cls.is_free():
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go back to Object Mode first")
            return False
        return needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        job = CardObjectJob(chosen_hair(context)[0], context.evaluated_depsgraph_get())
        yield Progress("Reading the hair")
        job.write((yield from threaded(job.building())))
        finest, levels = job.objects[0], len(job.objects)
        detail = f"{levels} levels of detail" if levels > 1 else "one level of detail"
        result = f"{finest.name}: {_counts(finest)}, {detail}. {job.order}"
        tell(self, Outcome(result, job.dropped, job.notes))


def draw_made_cards(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """The button, and what there is: a line a level of detail, and the texture."""
    if draw_progress(layout, HAIRLOOM_OT_make_cards):
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
    column.label(text=order_line(objects[0].hairloom.card_object.wrong_fraction), icon="SORTSIZE")
    image = objects[0].hairloom.card_object.image
    if image is not None:
        column.label(text=f"Texture {image.size[0]} x {image.size[1]}", icon="TEXTURE")


def _counts(obj: bpy.types.Object) -> str:
    cards, triangles = obj.hairloom.card_object.card_count, len(obj.data.polygons)
    return f"{cards:,} cards, {triangles:,} triangles"


CLASSES = (HAIRLOOM_OT_make_cards,)
