"""Cards by hand: Card Width, Card Twist and Card Tile in Edit Mode, and Add Card Along Curve."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..arrays import Ints
from ..blender.base.outcome import report
from ..blender.cards.hand_tools import (
    add_along_curves,
    edited_cards,
    move_to_tiles,
    shape_selected,
)
from ..blender.cards.made_objects import card_objects
from .reports import reporting
from .selection import in_object_mode, needs_hair, target_hair

_MENU = "HAIRLOOM_MT_card_edits"
_STEPS = {"next": 1, "previous": -1}


def _in_edit_mode(operator: Any, context: bpy.types.Context) -> bool:
    if edited_cards(context):
        return True
    operator.poll_message_set("Select cards in Edit Mode, in the finest level made by Make Cards")
    return False


def _report_count(operator: bpy.types.Operator, count: int, change: str) -> set[str]:
    if not count:
        report(operator, "WARNING", "No card is selected: a vertex of each is enough")
        return {"CANCELLED"}
    report(operator, "INFO", f"{count:,} {'card' if count == 1 else 'cards'} {change}")
    return {"FINISHED"}


class HAIRLOOM_OT_card_width(bpy.types.Operator):
    """Make the selected cards wider or narrower, evenly from root to tip. One selected vertex per
    card is enough"""

    bl_idname = "hairloom.card_width"
    bl_label = "Card Width"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "root": FloatProperty(
            name="Root", description="Factor at the root", default=1.0, min=0.0, soft_max=4.0
        ),
        "tip": FloatProperty(
            name="Tip", description="Factor at the tip", default=1.5, min=0.0, soft_max=4.0
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _in_edit_mode(cls, context)

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        root, tip = self.root, self.tip
        objects = edited_cards(context)
        count = sum(shape_selected(obj, lambda each: each.widened(root, tip)) for obj in objects)
        return _report_count(
            self, count, f"{root:.2g} times as wide at the root, {tip:.2g} at the tip"
        )


class HAIRLOOM_OT_card_twist(bpy.types.Operator):
    """Twist the selected cards along their length, increasingly from root to tip. One selected
    vertex per card is enough"""

    bl_idname = "hairloom.card_twist"
    bl_label = "Card Twist"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "angle": FloatProperty(
            name="Angle",
            description="Rotation of the tip",
            subtype="ANGLE",
            default=float(np.pi / 4.0),
            soft_min=float(-np.pi),
            soft_max=float(np.pi),
        )
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _in_edit_mode(cls, context)

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        angle = self.angle
        objects = edited_cards(context)
        count = sum(shape_selected(obj, lambda each: each.twisted(angle)) for obj in objects)
        return _report_count(self, count, f"twisted by {np.degrees(angle):.0f} degrees")


class HAIRLOOM_OT_card_tile(bpy.types.Operator):
    """Show another tile of the atlas on the selected cards. One selected vertex per card is
    enough"""

    bl_idname = "hairloom.card_tile"
    bl_label = "Card Tile"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "to": EnumProperty(
            name="Tile",
            description="Tile that the cards show",
            items=(
                (
                    "next",
                    "Next",
                    "The tile after that of each card; the first one follows the last",
                ),
                (
                    "previous",
                    "Previous",
                    "The tile before that of each card; the last one precedes the first",
                ),
                ("number", "Number", "The same tile for all cards"),
            ),
        ),
        "number": IntProperty(
            name="Number",
            description="Number of the tile, counted along rows from 1 at the lower left",
            default=1,
            min=1,
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _in_edit_mode(cls, context)

    def draw(self: Any, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "to")
        column = layout.column()
        column.active = self.to == "number"
        column.prop(self, "number")

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        def new_tiles(tile: Ints, count: int) -> Ints:
            if self.to == "number":
                return np.full(len(tile), min(self.number, count) - 1, np.int32)
            return (tile + _STEPS[self.to]) % count

        tiles = [tile for obj in edited_cards(context) for tile in move_to_tiles(obj, new_tiles)]
        numbers = sorted(set(tiles))
        change = f"on tile {numbers[0] + 1}" if len(numbers) == 1 else f"on {len(numbers)} tiles"
        return _report_count(self, len(tiles), change)


class HAIRLOOM_OT_add_card_along_curve(bpy.types.Operator):
    """Add a card along each selected curve to the cards of the selected hair, rooted on the nearest
    skin"""

    bl_idname = "hairloom.add_card_along_curve"
    bl_label = "Add Card Along Curve"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "width": FloatProperty(
            name="Width",
            description="Width at the root; 0 uses the usual width of the other cards",
            subtype="DISTANCE",
            min=0.0,
            soft_max=0.1,
        ),
        "tile": IntProperty(
            name="Tile",
            description="Number of the tile, from 1; 0 uses the tile of the nearest card",
            min=0,
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if not card_objects(target_hair(context)[0]):
            cls.poll_message_set("There are no cards yet: press Make Cards first")
            return False
        if not _curves(context):
            cls.poll_message_set(
                "Select a curve together with the hair, such as one made with the Draw tool"
            )
            return False
        return True

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        hair, depsgraph = target_hair(context)[0], context.evaluated_depsgraph_get()
        count = add_along_curves(hair, _curves(context), depsgraph, self.width, self.tile - 1)
        added = "1 card was added" if count == 1 else f"{count:,} cards were added"
        name = card_objects(hair)[0].name
        report(self, "INFO", f"{name}: {added}. Make Cards Again sorts and shades them")
        return {"FINISHED"}


def _curves(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in context.selected_objects if obj.type == "CURVE"]


class HAIRLOOM_MT_card_edits(bpy.types.Menu):
    """Tools for selected hair cards"""

    bl_idname = _MENU
    bl_label = "Hair Cards"

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator("hairloom.card_width")
        layout.operator("hairloom.card_twist")
        layout.separator()
        for step, text in (("next", "Next Tile"), ("previous", "Previous Tile")):
            layout.operator("hairloom.card_tile", text=text).to = step


def draw_card_edits(layout: bpy.types.UILayout) -> None:
    """Draw the tools in the panel, greyed out if their poll fails."""
    layout.label(text="By Hand")
    column = layout.column(align=True)
    row = column.row(align=True)
    row.operator("hairloom.card_width", text="Width")
    row.operator("hairloom.card_twist", text="Twist")
    row.operator("hairloom.card_tile", text="Tile")
    column.operator("hairloom.add_card_along_curve", icon="CURVE_DATA")
    column.operator("hairloom.discard_card_edits", icon="LOOP_BACK")


def draw_menu(self: Any, context: bpy.types.Context) -> None:
    """An entry in the menus of Edit Mode, if cards are being edited."""
    if edited_cards(context):
        self.layout.separator()
        self.layout.menu(_MENU, icon="MESH_GRID")


CLASSES = (
    HAIRLOOM_OT_card_width,
    HAIRLOOM_OT_card_twist,
    HAIRLOOM_OT_card_tile,
    HAIRLOOM_OT_add_card_along_curve,
    HAIRLOOM_MT_card_edits,
)
