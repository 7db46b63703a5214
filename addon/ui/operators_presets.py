"""Presets: applying, saving and deleting them; and Look from Material."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper, poll_file_object_drop

from ..blender.base.file_names import absolute_path
from ..blender.base.objects import check_editable
from ..blender.base.outcome import report
from ..blender.properties.presets import (
    OWN_PREFIX,
    apply,
    delete_own,
    free_title,
    is_title_taken,
    named_preset,
    save_own,
    settings_to_store,
)
from ..blender.properties.properties import settings_of
from ..blender.scene.hair_material import has_look_material
from ..blender.scene.look_materials import apply_look
from ..blender.scene.principled import has_principled_hair, look_from_material
from .file_paths import FILE_TO_READ
from .preset_chooser import KIND
from .reports import reporting
from .selection import needs_hair, target_hair

#: suffix of preset files
_SUFFIX = ".json"


class HAIRLOOM_OT_apply_preset(bpy.types.Operator):
    """Apply these settings to the selected hair"""

    bl_idname = "hairloom.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(
        name="Preset", description="Preset such as looks/blond, or the path of a preset file"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        _apply(named_preset(absolute_path(self.name)).all, context)
        return {"FINISHED"}


def _apply(all_settings: Iterable[Any], context: bpy.types.Context) -> None:
    """Apply a preset to the selected hair, and to its material if that is one of ours.

    Raises:
        HairloomError: some hair is linked from another file. Nothing is changed then.
    """
    for hair in target_hair(context):
        check_editable(hair)
    for hair in target_hair(context):
        for settings in all_settings:
            apply(settings, hair)
        if has_look_material(hair.data):
            apply_look(hair)


class HAIRLOOM_OT_add_preset(bpy.types.Operator, ImportHelper):
    """Apply a preset file to the selected hair, and add it to your own presets"""

    bl_idname = "hairloom.add_preset"
    bl_label = "Add Preset File"
    bl_options = {"REGISTER", "UNDO"}

    filepath: FILE_TO_READ
    filter_glob: StringProperty(default=f"*{_SUFFIX}", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.properties.is_property_set("filepath"):  # it was dropped
            return self.execute(context)
        return super().invoke(context, event)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        preset = named_preset(absolute_path(self.filepath))
        _apply(preset.all, context)
        title = free_title(preset.title or Path(self.filepath).stem, preset.settings.section)
        save_own(title, *preset.all)
        report(self, "INFO", f"'{title}' was applied, and is now one of your own presets")
        return {"FINISHED"}


class HAIRLOOM_FH_preset(bpy.types.FileHandler):
    """Preset files dropped into the viewport"""

    bl_idname = "HAIRLOOM_FH_preset"
    bl_label = "Hairloom Preset"
    bl_import_operator = HAIRLOOM_OT_add_preset.bl_idname
    bl_file_extensions = _SUFFIX

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return poll_file_object_drop(context) and bool(target_hair(context))


class HAIRLOOM_OT_save_preset(bpy.types.Operator):
    """Save these settings of the selected hair as your own preset, available in all files"""

    bl_idname = "hairloom.save_preset"
    bl_label = "Save as Preset"

    section: KIND
    title: StringProperty(
        name="Name",
        description="Name of the preset. An own preset of this name is replaced",
        maxlen=40,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self.title = free_title(target_hair(context)[0].name, self.section)
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        path = save_own(self.title, *settings_to_store(target_hair(context)[0], self.section))
        report(self, "INFO", f"Saved as {OWN_PREFIX}{path.stem}, in {path}")
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.prop(self, "title")
        if is_title_taken(self.title, self.section):
            self.layout.label(text="Replaces your preset of this name", icon="ERROR")


class HAIRLOOM_OT_delete_preset(bpy.types.Operator):
    """Delete this preset of your own permanently"""

    bl_idname = "hairloom.delete_preset"
    bl_label = "Delete Preset"

    name: StringProperty(name="Preset", description="Such as own/mine")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    @reporting
    def execute(self, _context: bpy.types.Context) -> set[str]:
        delete_own(self.name)
        return {"FINISHED"}


class HAIRLOOM_OT_look_from_material(bpy.types.Operator):
    """Derive the look from the Principled Hair BSDF of the hair's material"""

    bl_idname = "hairloom.look_from_material"
    bl_label = "Look from Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if any(has_principled_hair(hair) for hair in target_hair(context)):
            return True
        cls.poll_message_set("The hair has no material with a Principled Hair BSDF")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        depsgraph = context.evaluated_depsgraph_get()
        grooms = list(filter(has_principled_hair, target_hair(context)))
        for hair in grooms:
            check_editable(hair)
        for hair in grooms:
            group = hair.data.hairloom.shading
            before = settings_of(group, group.settings)
            settings, notes = look_from_material(hair, depsgraph, before)
            apply(settings, hair)
            for note in notes:
                report(self, "WARNING", f"{hair.name}: {note}")
        return {"FINISHED"}


class HAIRLOOM_OT_look_to_material(bpy.types.Operator):
    """Give the hair a Principled Hair material that matches its look, for EEVEE, Cycles and other
    tools"""

    bl_idname = "hairloom.look_to_material"
    bl_label = "Look to Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        for hair in target_hair(context):
            check_editable(hair)
        for hair in target_hair(context):
            material, notes = apply_look(hair)
            report(self, "INFO", f"{hair.name} has the material '{material.name}'")
            for note in notes:
                report(self, "WARNING", f"{hair.name}: {note}")
        return {"FINISHED"}


CLASSES = (
    HAIRLOOM_OT_apply_preset,
    HAIRLOOM_OT_add_preset,
    HAIRLOOM_FH_preset,
    HAIRLOOM_OT_save_preset,
    HAIRLOOM_OT_delete_preset,
    HAIRLOOM_OT_look_from_material,
    HAIRLOOM_OT_look_to_material,
)
