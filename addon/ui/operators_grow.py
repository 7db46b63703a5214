"""Grow Hair, Grow Again, and the panel with the settings of growth."""

from __future__ import annotations

import bpy

from ..blender.strands.growing import (
    COMBED_SHAPE,
    grow_again,
    grow_on,
    has_grown,
    is_outdated,
    lost_by_regrowing,
)
from .drawing import draw_button, draw_section
from .grow_options import GROW_PROPERTIES, draw_settings_hint
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .messages import draw_message
from .selection import (
    growth_mesh,
    in_object_mode,
    make_active,
    needs_hair,
    target_hair,
    without_linked_duplicates,
)
from .texts import translated

#: Further names are only counted.
_MAX_LISTED = 2


class HAIRLOOM_OT_grow(LongWork, bpy.types.Operator):
    """Grow hair curves on the active mesh"""

    bl_idname = "hairloom.grow"
    bl_label = "Grow Hair"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = GROW_PROPERTIES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context)):
            return False
        if growth_mesh(context) is not None:
            return True
        cls.poll_message_set("Select the mesh to grow hair on")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        head, depsgraph = growth_mesh(context), context.evaluated_depsgraph_get()
        growing = grow_on(
            head,
            depsgraph,
            context.collection,
            self,
            density_group=self.density_group,
            length_group=self.length_group,
        )
        make_active(context, [(yield from steps_of_parts(growing))])

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings_hint(self.layout)


class HAIRLOOM_OT_grow_again(LongWork, bpy.types.Operator):
    """Grow the selected hair again with its current settings. Combing, cutting, settling and
    painting on its curves since it grew is lost. Esc cancels"""

    bl_idname = "hairloom.grow_again"
    bl_label = "Grow Again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        grooms = without_linked_duplicates(target_hair(context))
        yield from steps_of_parts(grow_again(grooms, context.evaluated_depsgraph_get()))


def draw_grow(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw whether hair follows its settings, what growing again would lose, and the settings."""
    curves = hair.data
    lost = lost_by_regrowing(curves)
    lines = layout.column(align=True)
    icon = "UNLOCKED" if not lost else "LOCKED"
    lines.label(text=_state(curves, lost), icon=icon, translate=False)
    loses = translated("Growing again loses: {lost}", lost=_listed(curves, lost))
    lines.label(text=loses, icon="BLANK1", translate=False)
    if not draw_progress(lines, HAIRLOOM_OT_grow_again):
        button = lines.row()
        button.active = bool(lost)
        draw_button(button, "hairloom.grow_again", icon="FILE_REFRESH")
    groom = curves.hairloom
    if groom.grow.problem:
        draw_message(layout, bpy.context, groom.grow.problem, "ERROR")
    draw_section(layout, groom, "grow")
    for name in ("density_group", "length_group"):
        layout.prop(groom.grow, name, icon="GROUP_VERTEX")


def _state(curves: bpy.types.Curves, lost: tuple[str, ...]) -> str:
    if not lost:
        return translated("Follows these settings")
    if not has_grown(curves):
        return translated("Not grown from these")
    if is_outdated(curves):
        return translated("Older than these settings")
    return translated("Changed since it grew")


def _listed(curves: bpy.types.Curves, lost: tuple[str, ...]) -> str:
    """The names, or the number of them if they would not fit in a line."""
    if not lost:
        return translated("nothing")
    if not has_grown(curves):
        return translated("{count:,} curves", count=len(curves.curves))
    names = [translated("combed shape") if each == COMBED_SHAPE else each for each in lost]
    if len(names) > _MAX_LISTED:
        return f"{names[0]}, {translated('{count:,} attributes', count=len(names) - 1)}"
    return ", ".join(names)


CLASSES = (HAIRLOOM_OT_grow, HAIRLOOM_OT_grow_again)
