"""Hairstyles: a menu and a page of pictures to choose from, and adding one to a head."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..blender.base.objects import objects_in
from ..blender.base.outcome import report
from ..blender.base.parts import new_blocks_removed_on_error
from ..blender.scene.bust_skin import TONES
from ..blender.setup.foreign_heads import add_landmarks, may_be_head
from ..blender.setup.hairstyles import (
    add_face_hair,
    add_hairstyle,
    add_head,
    fit_again,
    grows_anywhere,
    is_bust,
    is_face_hairstyle,
    named_hairstyle,
    shipped_hairstyles,
)
from .grow_options import search_weight_names
from .long_work import LongWork, Progress, Steps, steps_of_parts
from .operators_start import start_preview_steps
from .preferences import preferences
from .selection import (
    growth_mesh,
    in_object_mode,
    make_active,
    target_hair,
    without_linked_duplicates,
)

#: pictures per row, their scale, and the width of the page at UI scale 1
_COLUMNS, _PICTURE_SCALE, _WIDTH = 4, 5.0, 440
#: types of objects without visible geometry, which do not count as contents of a scene
_INVISIBLE_TYPES = frozenset(("CAMERA", "EMPTY", "LIGHT", "LIGHT_PROBE", "SPEAKER"))


class HAIRLOOM_OT_add_hairstyle(LongWork, bpy.types.Operator):
    """Add this hairstyle as hair curves to the selected head, or fur to the selected mesh. If no
    head is selected, the built-in head is used, and added if the scene has none, with brows and
    lashes unless the hairstyle is one of them. Esc cancels"""

    bl_idname = "hairloom.add_hairstyle"
    bl_label = "Hairloom Hairstyle"
    bl_options = {"REGISTER", "UNDO"}

    style: EnumProperty(
        name="Hairstyle",
        description="Hairstyle to add",
        items=[(entry.name, entry.title, "") for entry in shipped_hairstyles()],
    )
    skin: EnumProperty(
        name="Skin",
        description="Skin tone of the head, if one is added",
        items=[(name, name.title(), "") for name in TONES],
        translation_context="Skin",  # "Light" is also a panel
        default="light",
    )
    hairline: StringProperty(
        name="Hairline",
        description="Vertex group or point attribute (float) of the head that limits where this "
        "hair grows. If empty, the one that the hairstyle names, such as scalp",
        search=search_weight_names,
    )
    plays: BoolProperty(
        name="Play", description="Simulate the hair as soon as it is added", default=True
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if not self.properties.is_property_set("plays"):
            self.plays = preferences(context).plays
        return self.execute(context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        style, collection = named_hairstyle(self.style), context.collection
        head = growth_mesh(context) if grows_anywhere(style) else self._head(context)
        is_new, is_alone = head is None, _is_empty(context)
        with new_blocks_removed_on_error() as record_added:
            if head is None:
                head = yield from steps_of_parts(add_head(collection, self.skin))
                record_added()
                yield Progress(f"Placing {style.title}")
            depsgraph = context.evaluated_depsgraph_get()
            added = yield from steps_of_parts(
                add_hairstyle(style, head, depsgraph, collection, hairline=self.hairline)
            )
            record_added()
            grooms = [added.hair]
            if is_new and not is_face_hairstyle(style):
                depsgraph = context.evaluated_depsgraph_get()
                adding = add_face_hair(head, depsgraph, collection, added.hair)
                grooms.insert(0, (yield from steps_of_parts(adding)))
        for kind, lines in (("WARNING", added.warnings), ("INFO", added.done)):
            for line in lines:
                report(self, kind, line)
        if is_new:
            report(self, "INFO", f"Added a head, {head.name}, for the hair to grow on")
        if is_new and is_alone and self.is_interactive():
            _frame_in_view([*grooms, head], context)
        yield from start_preview_steps(self, context, grooms, plays=self.plays)

    def _head(self, context: bpy.types.Context) -> bpy.types.Object | None:
        """The head to use: the active one, or that of the active hair, else the first built-in one
        in the view layer; None: there is none."""
        active = growth_mesh(context)
        if active is not None:
            if is_bust(active) or may_be_head(active):
                return active
            report(self, "INFO", f"{active.name}: no head; a built-in one is used")
        return next((obj for obj in objects_in(context.view_layer) if is_bust(obj)), None)


def _is_empty(context: bpy.types.Context) -> bool:
    """Whether the view layer has no object with visible geometry."""
    return all(obj.type in _INVISIBLE_TYPES for obj in objects_in(context.view_layer))


def _frame_in_view(objects: list[bpy.types.Object], context: bpy.types.Context) -> None:
    """Select these objects and frame them in the current 3D view, as a head is a dot in the view of
    a new file. A view through a camera stays."""
    area = context.area
    if area is None or area.type != "VIEW_3D":
        return
    if area.spaces.active.region_3d.view_perspective == "CAMERA":
        return
    make_active(context, objects)
    region = next(each for each in area.regions if each.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_selected(use_all_regions=True)


class HAIRLOOM_OT_place_landmarks(LongWork, bpy.types.Operator):
    """Guess the places of crown, ears, nose and other landmarks on the selected head, and mark them
    with movable objects. Hairstyles are fitted to these when added or fitted again"""

    bl_idname = "hairloom.place_landmarks"
    bl_label = "Place Landmarks"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context)):
            return False
        if growth_mesh(context) is not None:
            return True
        cls.poll_message_set("Select a head")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        head = growth_mesh(context)
        assert head is not None, "poll has looked"
        adding = add_landmarks(head, context.evaluated_depsgraph_get(), context.collection)
        landmarks, is_sure = yield from steps_of_parts(adding)
        if is_sure:
            report(self, "INFO", f"{head.name}: {_placed_text(len(landmarks))}")
        else:
            report(
                self,
                "WARNING",
                f"{head.name}: it does not look like a head: drag all landmarks yourself",
            )


def _placed_text(count: int) -> str:
    if not count:
        return "it has all landmarks already"
    return "placed 1 missing landmark" if count == 1 else f"placed {count} missing landmarks"


class HAIRLOOM_OT_fit_again(LongWork, bpy.types.Operator):
    """Fit the hairstyle of the selected hair again to the current landmarks and shape of its head.
    Modifiers and settings stay, combing is lost. Esc cancels"""

    bl_idname = "hairloom.fit_again"
    bl_label = "Fit Again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context)):
            return False
        if any(hair.hairloom.hairstyle for hair in target_hair(context)):
            return True
        cls.poll_message_set("Select hair that was added as a hairstyle")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        grooms = without_linked_duplicates(
            hair for hair in target_hair(context) if hair.hairloom.hairstyle
        )
        fitting = fit_again(grooms, context.evaluated_depsgraph_get())
        for warning in (yield from steps_of_parts(fitting)):
            report(self, "WARNING", warning)


class HAIRLOOM_OT_choose_hairstyle(bpy.types.Operator):
    """Choose a hairstyle and add it to the selected or built-in head, or choose fur and add it to
    the selected mesh"""

    bl_idname = "hairloom.choose_hairstyle"
    bl_label = "Add Hairstyle"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.label(text="Hairstyles")
        grid = self.layout.grid_flow(row_major=True, columns=_COLUMNS, even_columns=True)
        for entry in shipped_hairstyles():
            cell = grid.column(align=True)
            if entry.icon:
                cell.template_icon(icon_value=entry.icon, scale=_PICTURE_SCALE)
            cell.operator("hairloom.add_hairstyle", text=entry.title).style = entry.name
        for _ in range(-len(shipped_hairstyles()) % _COLUMNS):
            grid.label(text="")


class HAIRLOOM_MT_hairstyles(bpy.types.Menu):
    """Ready-made hair with shape, settings and look"""

    bl_idname = "HAIRLOOM_MT_hairstyles"
    bl_label = "Hairloom Hairstyle"

    def draw(self, _context: bpy.types.Context) -> None:
        for entry in shipped_hairstyles():
            operator = self.layout.operator(
                "hairloom.add_hairstyle", text=entry.title, icon_value=entry.icon
            )
            operator.style = entry.name


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_OT_add_hairstyle,
    HAIRLOOM_OT_place_landmarks,
    HAIRLOOM_OT_fit_again,
    HAIRLOOM_OT_choose_hairstyle,
    HAIRLOOM_MT_hairstyles,
)
