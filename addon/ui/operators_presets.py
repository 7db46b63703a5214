"""Presets: a menu a section, and the operator behind its entries."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..host.presets import apply, named_preset, shipped
from .reports import reporting
from .selection import chosen_hair, needs_hair


class HAIRLOOM_OT_apply_preset(bpy.types.Operator):
    """Take over these settings for the selected hair"""

    bl_idname = "hairloom.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(
        name="Preset", description="A preset such as looks/blond, or the path of a preset file"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        preset = named_preset(self.name)
        for hair in chosen_hair(context):
            apply(preset.settings, hair)
        return {"FINISHED"}


class _PresetMenu:
    bl_label = "Presets"
    section = ""

    def draw(self, _context: bpy.types.Context) -> None:
        for name, title in shipped(self.section):
            self.layout.operator("hairloom.apply_preset", text=title).name = name  # type: ignore[attr-defined]


class HAIRLOOM_MT_looks(_PresetMenu, bpy.types.Menu):
    """Colours and highlights that come with Hairloom"""

    bl_idname = "HAIRLOOM_MT_looks"
    section = "shading"


class HAIRLOOM_MT_dynamics(_PresetMenu, bpy.types.Menu):
    """Ways to move that come with Hairloom"""

    bl_idname = "HAIRLOOM_MT_dynamics"
    section = "dynamics"


CLASSES = (HAIRLOOM_OT_apply_preset, HAIRLOOM_MT_looks, HAIRLOOM_MT_dynamics)
