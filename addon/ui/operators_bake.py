"""Bake and Delete Bake: the motion of hair and cloth, on disk, for the viewport and renders."""

from __future__ import annotations

from typing import ClassVar

import bpy

from ..blender.bakes import playback
from ..blender.base.outcome import report
from ..blender.preview import previews
from ..blender.preview.bake import Bake, free, is_bakeable, show_in_renders
from ..blender.scene.fin_modifier import fin_modifier
from ..blender.sessions.measures import table_of
from ..errors import HairloomError
from .drawing import draw_inactive
from .help import WithHelp
from .long_work import LongWork, Steps, can_start, counted, draw_progress
from .operators_measure import draw_figures
from .reports import reporting
from .selection import target_hair
from .texts import translated


class HAIRLOOM_OT_bake(LongWork, bpy.types.Operator):
    """Simulate selected hair and cloth over all frames and keep the motion on disk. Esc cancels"""

    bl_idname = "hairloom.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER", "UNDO"}
    state_after_cancel = "the previous bake is kept"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not cls.can_start():
            return False
        if chosen_objects(context):
            return True
        cls.poll_message_set("Select hair curves, or a mesh that is cloth, first")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        if previews.is_playing():
            previews.rest(context.evaluated_depsgraph_get(), keep_playing=False)
        bake = Bake.of(chosen_objects(context), context.scene)
        yield from counted(bake.steps(), bake.frame_count, "frames")
        locked = show_in_renders(bake.objects(), context.evaluated_depsgraph_get())
        names = ", ".join(obj.name for obj in bake.objects())
        lock_note = (
            "; Render > Lock Interface was turned on, as renders of baked hair need it"
            if locked
            else ""
        )
        count = "1 frame" if bake.frame_count == 1 else f"{bake.frame_count:,} frames"
        if bake.unfelt_notes:
            report(self, "WARNING", " ".join(bake.unfelt_notes))
        report(self, "INFO", f"Baked {count} of {names}{lock_note}")


class HAIRLOOM_OT_bake_free(bpy.types.Operator):
    """Delete the bake of the selected hair and cloth from disk. This cannot be undone"""

    bl_idname = "hairloom.bake_free"
    bl_label = "Delete Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not can_start(cls):
            return False
        if any(has_bake(obj) for obj in chosen_objects(context)):
            return True
        cls.poll_message_set("Nothing selected has a bake")
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        for obj in chosen_objects(context):
            free(obj, context.evaluated_depsgraph_get())
        return {"FINISHED"}


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects that the buttons apply to: hair, as for other buttons, and selected fins."""
    return list(
        dict.fromkeys(filter(is_bakeable, (*target_hair(context), *context.selected_objects)))
    )


def has_bake(obj: bpy.types.Object) -> bool:
    """Whether there is a bake, even a damaged one."""
    try:
        return playback.cache_of(obj) is not None
    except HairloomError:
        return True


def draw_bake(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw the bake settings of hair or a fin, the buttons, and the bake on disk, with the same
    number of lines in any state."""
    bake = obj.hairloom.bake
    layout.prop(bake, "folder")
    layout.prop(bake, "use_own_range")
    column = layout.column(align=True)
    for name, scene_property in (("first", "frame_start"), ("last", "frame_end")):
        if bake.use_own_range:
            column.prop(bake, name)
        else:
            draw_inactive(
                column, bpy.context.scene, scene_property, "as the scene", is_editable=False
            )
    if obj.type == "CURVES":
        layout.prop(bake, "in_renders")
    if not draw_progress(layout, HAIRLOOM_OT_bake):
        row = layout.row(align=True)
        row.operator("hairloom.bake", icon="REC")
        row.operator("hairloom.bake_free", text="", icon="TRASH")
    _draw_state(layout, obj)


def _inputs(changed: tuple[str, ...]) -> str:
    """The names of inputs of a bake, see `simulation.differences`."""
    texts = {
        "hair": translated("combed or edited hair"),
        "head": translated("head"),
        "guides": translated("guides"),
        "widths": translated("widths"),
        "children": translated("children"),
        "partings": translated("partings"),
        "ties": translated("hair ties"),
        "style": translated("style"),
        "paint": translated("masks"),
        "other grooms": translated("other hair"),
        "mesh": translated("mesh"),
        "pins": translated("pins"),
        "colliders": translated("colliders"),
        "frame rate": translated("frame rate"),
        "solver": translated("solver"),
        "pose": translated("pose"),
        "settings": translated("settings"),
        "selection": translated("selection"),
        "forces": translated("forces"),
        "what it was made from": translated("what it was made from"),
    }
    return ", ".join(texts.get(each, each) for each in changed)


def _draw_state(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    try:
        cache, problem = playback.cache_of(obj), ""
    except HairloomError as error:
        cache, problem = None, error.problem
    column = layout.column()
    if cache is None:
        draw_inactive(column, obj.hairloom.bake, "is_shown", "not baked")
    else:
        column.prop(obj.hairloom.bake, "is_shown")
    facts = None if cache is None else cache.facts
    if facts is None:
        text = problem or translated("Not baked")
        layout.label(text=text, icon="ERROR" if problem else "BLANK1", translate=False)
    else:
        device = {"numpy": "CPU", "compute": "GPU"}.get(facts.device, facts.device)
        layout.label(
            text=translated(
                "Frames {first} to {last} at {rate:g} fps, {device}",
                first=facts.first,
                last=facts.last,
                rate=facts.frame_rate,
                device=device,
            ),
            icon="CHECKMARK",
            translate=False,
        )
    if obj.type == "CURVES":  # cloth is not measured
        figures = None if facts is None else facts.figures
        draw_figures(layout.column(align=True), table_of(figures))
    preview_bake = previews.bake_of(obj)
    changed = () if facts is None or preview_bake is None else preview_bake.changed_inputs
    text = translated("Changed since: {inputs}", inputs=_inputs(changed)) if changed else ""
    layout.label(text=text, icon="ERROR" if changed else "BLANK1", translate=False)


class _FinBake(WithHelp):
    help_section = "bake"
    bl_label = "Bake"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        return obj is not None and fin_modifier(obj) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout  # type: ignore[attr-defined]
        # before the property split, which would cut off its label
        layout.prop(context.object.hairloom.bake, "follows")
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_bake(layout, context.object)


class HAIRLOOM_PT_fin_bake(_FinBake, bpy.types.Panel):
    """Bake of this cloth"""

    bl_parent_id = "HAIRLOOM_PT_fin"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"


class HAIRLOOM_PT_sidebar_fin_bake(_FinBake, bpy.types.Panel):
    """The bake of this cloth"""

    bl_parent_id = "HAIRLOOM_PT_sidebar_fin"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"


CLASSES = (HAIRLOOM_OT_bake, HAIRLOOM_OT_bake_free)
#: below the panels of operators_fins
FIN_CLASSES = (HAIRLOOM_PT_fin_bake, HAIRLOOM_PT_sidebar_fin_bake)
