"""Make Cards: the cards of the selected hair as objects in the scene, and their counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from ..blender.base.outcome import Outcome, report
from ..blender.cards.build import counts_line
from ..blender.cards.edits import read_edits
from ..blender.cards.made_objects import card_objects
from ..blender.cards.object import CardObjectJob
from ..blender.preview.previews import previewed_rigs, previews
from ..cards.settings import CardSettings
from ..errors import HairloomError
from .drawing import draw_button
from .long_work import LongWork, Progress, Steps, draw_progress, threaded
from .reports import report_outcome
from .selection import in_object_mode, needs_hair, target_hair
from .texts import translated

#: number of levels of detail in a panel: the most that there may be
_MAX_LEVELS = next(
    int(each.hard_range[1])
    for each in CardSettings.parameters()
    if each.name == "levels" and each.hard_range
)


class HAIRLOOM_OT_make_cards(LongWork, bpy.types.Operator):
    """Make hair cards from the active hair as meshes in the scene, or update them. Esc cancels"""

    bl_idname = "hairloom.make_cards"
    bl_label = "Make Cards"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_make_cards(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        yield from _build_steps(self, context)


class HAIRLOOM_OT_discard_card_edits(LongWork, bpy.types.Operator):
    """Discard all edits to the cards of the active hair: edited cards are made again, deleted cards
    are restored, and added cards are removed. Esc cancels"""

    bl_idname = "hairloom.discard_card_edits"
    bl_label = "Discard Edits"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _can_make_cards(cls, context):
            return False
        if not card_objects(target_hair(context)[0]):
            cls.poll_message_set("There are no cards yet: press Make Cards first")
            return False
        return True

    def invoke(self: Any, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        hair = target_hair(context)[0]
        try:
            edits, _ = read_edits(hair, context.evaluated_depsgraph_get())
        except HairloomError:  # cards that cannot be read can still be discarded
            edits_text = "All edits"
        else:
            if edits is None:
                report(self, "INFO", f"{hair.name}: its cards have no edits")
                return {"CANCELLED"}
            edits_text = edits.counts.summary
        return context.window_manager.invoke_confirm(
            self,
            event,
            title="Discard Edits",
            message=f"{edits_text} of {hair.name} will be lost",
            confirm_text="Discard",
            icon="WARNING",
        )

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        yield from _build_steps(self, context, keep_edits=False)


def _can_make_cards(operator: Any, context: bpy.types.Context) -> bool:
    can_start: bool = operator.can_start()
    return can_start and in_object_mode(operator, context) and needs_hair(operator, context)


def _build_steps(
    operator: bpy.types.Operator, context: bpy.types.Context, *, keep_edits: bool = True
) -> Steps[None]:
    """Make the cards of the active hair, and report it."""
    hair = target_hair(context)[0]
    depsgraph, cached_rigs = context.evaluated_depsgraph_get(), tuple(previewed_rigs().values())
    job = CardObjectJob(
        hair, depsgraph, keep_edits=keep_edits, cached_rigs=cached_rigs, cache=previews.built_cards
    )
    yield Progress("Reading the hair")
    job.write((yield from threaded(job.building())))
    finest, levels = job.objects[0], len(job.objects)
    detail = f"{levels} levels of detail" if levels > 1 else "one level of detail"
    lines = f"{finest.name}: {_counts(finest)}, {detail}", job.order, job.edits.report_line
    report_outcome(operator, Outcome(". ".join(filter(None, lines)), job.dropped, job.notes))


def draw_made_cards(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the button and the counts of the cards, with as many lines before as after."""
    objects = card_objects(hair)
    if not draw_progress(layout, HAIRLOOM_OT_make_cards):
        text = translated("Make Cards Again") if objects else "Make Cards"
        draw_button(layout, "hairloom.make_cards", text=text, icon="MESH_GRID")
    finest = objects[0] if objects else None
    card_object = finest and finest.hairloom.card_object
    column = layout.column(align=True)
    counts = _translated_counts(finest) if finest else translated("No cards yet")
    column.label(text=counts, icon="OUTLINER_OB_MESH", translate=False)
    _draw_levels(column, objects)
    percent = 100.0 * card_object.wrong_fraction if card_object else 0.0
    order = translated("{percent:.0f} % of pixels blend in the wrong order", percent=percent)
    column.label(text=order if card_object else "", icon="SORTSIZE", translate=False)
    image = card_object and card_object.image
    size = f"{image.size[0]} x {image.size[1]}" if image else "-"
    texture = translated("Texture {size}", size=size)
    column.label(text=texture, icon="TEXTURE", translate=False)


def _draw_levels(column: bpy.types.UILayout, objects: Sequence[bpy.types.Object]) -> None:
    """Draw a visibility switch for each level of detail that there may be, with its number of
    triangles."""
    row = column.row(align=True)
    for number in range(_MAX_LEVELS):
        if number < len(objects):
            text = _short_count(len(objects[number].data.polygons))
            row.prop(objects[number], "hide_viewport", text=text, toggle=1, invert_checkbox=True)
        else:
            row.label(text="-")


def _short_count(count: int) -> str:
    """A number in at most four characters, such as "37k"."""
    return f"{count:,}" if count < 1000 else f"{count / 1000.0:.0f}k"


def _translated_counts(obj: bpy.types.Object) -> str:
    card_object = obj.hairloom.card_object
    if card_object.shell_layers:
        things = translated("{count} layers of shells", count=card_object.shell_layers)
    else:
        things = translated("{count:,} cards", count=card_object.card_count)
    return f"{things}, {translated('{count:,} triangles', count=len(obj.data.polygons))}"


def _counts(obj: bpy.types.Object) -> str:
    card_object = obj.hairloom.card_object
    return counts_line(card_object.card_count, len(obj.data.polygons), card_object.shell_layers)


CLASSES = (HAIRLOOM_OT_make_cards, HAIRLOOM_OT_discard_card_edits)
