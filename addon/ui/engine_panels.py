"""Panels of the render engine Hairloom, and the use of Blender's own panels with it."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.engine import hair_scene
from ..blender.viewport.overlay import ENGINE
from .drawing import draw_inactive
from .help import WithHelp
from .messages import draw_message

#: panels of Blender for all engines whose settings have no effect here
_INCOMPATIBLE = frozenset({"VIEWLAYER_PT_filter", "RENDER_PT_freestyle"})
#: EEVEE's panels whose settings have the same effect here
_COMPATIBLE = frozenset(
    {
        "EEVEE_MATERIAL_PT_context_material",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_WORLD_PT_surface",
        "VIEWLAYER_PT_layer_passes",
    }
)


class _RenderPanel(WithHelp, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    help_section = "picture"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == ENGINE


class HAIRLOOM_PT_engine_sampling(_RenderPanel):
    """Number of samples per pixel"""

    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        layout, picture = self.layout, context.scene.hairloom.picture
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(align=True)
        column.prop(picture, "viewport_samples")
        column.prop(picture, "samples")


class HAIRLOOM_PT_engine_mesh_shadows(_RenderPanel):
    """Shadows cast by meshes"""

    bl_label = "Mesh Shadows"
    help_section = "mesh_shadows"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hairloom.mesh_shadows, "mesh_shadows", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, shadows = self.layout, context.scene.hairloom.mesh_shadows
        layout.use_property_split = True
        layout.active = shadows.mesh_shadows
        layout.prop(shadows, "mesh_resolution")


class HAIRLOOM_PT_engine_motion_blur(_RenderPanel):
    """Motion blur and shutter time"""

    bl_label = "Motion Blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, render = self.layout, context.scene.render
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = render.use_motion_blur
        layout.prop(render, "motion_blur_position", text="Position")
        layout.prop(render, "motion_blur_shutter", text="Shutter")
        layout.prop(context.scene.hairloom.picture, "motion_steps", text="Steps")


class HAIRLOOM_PT_engine_film(_RenderPanel):
    """Background and pixel filter"""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, render = self.layout, context.scene.render
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(render, "filter_size")
        layout.prop(render, "film_transparent", text="Transparent")


class HAIRLOOM_PT_hair_scene(WithHelp, bpy.types.Panel):
    """Hair drawn by Hairloom over the pictures of this engine"""

    bl_label = "Hairloom Hair"
    help_section = "hair_scene"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine != ENGINE

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hairloom, "use_hair_scene", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.hairloom
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        # a setting of the preview, so it applies with any engine
        column.prop(settings.picture, "viewport_samples")
        column = layout.column()
        column.active = settings.use_hair_scene
        column.prop(settings.picture, "samples")
        if context.scene.render.use_motion_blur:
            column.prop(settings.picture, "motion_steps", text="Motion Steps")
        else:
            draw_inactive(column.row(), settings.picture, "motion_steps", "no Motion Blur")
        passes = column.column(heading="Passes")
        for name in ("use_alpha", "use_tangent", "use_strand_index"):
            passes.prop(hair_scene.drawn_layer(context.scene).hairloom, name)
        problem = hair_scene.problem_of(context.scene) if settings.use_hair_scene else ""
        if problem:
            draw_message(layout, context, f"Blender draws the hair. {problem}", "ERROR")


class _PassesPanel(WithHelp):
    """What both panels of passes share."""

    help_section = "passes"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "view_layer"
    bl_parent_id = "VIEWLAYER_PT_layer_passes"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == ENGINE


class HAIRLOOM_PT_engine_passes(_PassesPanel, bpy.types.Panel):
    """Passes rendered in addition to the image"""

    bl_label = "Data"

    def draw(self, context: bpy.types.Context) -> None:
        layout, layer = self.layout, context.view_layer
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(layer, "use_pass_z")
        column.prop(layer, "use_pass_normal")
        column.prop(layer, "use_pass_vector")
        column.prop(layer, "use_pass_object_index")
        column = layout.column(heading="Cryptomatte")
        column.prop(layer, "use_pass_cryptomatte_object", text="Object")
        levels = column.column()
        levels.active = layer.use_pass_cryptomatte_object
        levels.prop(layer, "pass_cryptomatte_depth", text="Levels")


class HAIRLOOM_PT_hair_passes(_PassesPanel, bpy.types.Panel):
    """Hair passes that Blender has no settings for"""

    bl_label = "Hair"

    def draw(self, context: bpy.types.Context) -> None:
        layout, passes = self.layout, context.view_layer.hairloom
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        for name in passes.__annotations__:
            column.prop(passes, name)


CLASSES = (
    HAIRLOOM_PT_engine_sampling,
    HAIRLOOM_PT_engine_mesh_shadows,
    HAIRLOOM_PT_engine_motion_blur,
    HAIRLOOM_PT_engine_film,
    HAIRLOOM_PT_hair_scene,
    HAIRLOOM_PT_engine_passes,
    HAIRLOOM_PT_hair_passes,
)


def register() -> None:
    """Show Blender's panels with our engine, as its documentation suggests."""
    for panel in _panels_limited_to_engines():
        name, engines = panel.__name__, panel.COMPAT_ENGINES
        if name in _COMPATIBLE or ("BLENDER_RENDER" in engines and name not in _INCOMPATIBLE):
            engines.add(ENGINE)


def unregister() -> None:
    for panel in _panels_limited_to_engines():
        panel.COMPAT_ENGINES.discard(ENGINE)


def _panels_limited_to_engines() -> list[type[Any]]:
    """Blender's panels that are limited to certain engines."""
    all_panels = (each for each in _derived_panels(bpy.types.Panel) if each not in CLASSES)
    return [each for each in all_panels if hasattr(each, "COMPAT_ENGINES")]


def _derived_panels(parent: type[Any]) -> list[type[Any]]:
    """All registered panels, also those derived from others."""
    panels = []
    for each in parent.__subclasses__():
        panels += [each, *_derived_panels(each)]
    return list(dict.fromkeys(panels))
