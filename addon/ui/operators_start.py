"""Operators to start with: a groom on a mesh, from Blender's hair, or in a sample scene, shaded and
moving at once.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..blender.base.outcome import Outcome, report
from ..blender.base.parts import batched, run_parts
from ..blender.preview import previews
from ..blender.scene.bust_skin import TONES
from ..blender.scene.particle_hair import convert_particle_hair, hair_systems
from ..blender.setup.sample_scene import add_sample_scene
from ..blender.setup.starting import check_presets, new_groom, prepare_existing_hair
from ..errors import HairloomError
from .grow_options import GROW_PROPERTIES, draw_settings_hint
from .long_work import LongWork, Progress, Steps, steps_of_parts
from .operators_preview import start_preview
from .preferences import NEW_GROOM, chosen_presets, preferences
from .reports import report_outcome, reporting
from .selection import (
    active_mesh,
    growth_mesh,
    in_object_mode,
    make_active,
    needs_hair,
    target_hair,
)

_NO_MESH = "Select the mesh to grow hair on, or add a sample: Add > Curve > Hairloom Sample Scene"


class HAIRLOOM_OT_add_groom(LongWork, bpy.types.Operator):
    """Grow a groom with a look on the active mesh, and simulate it. Esc cancels"""

    bl_idname = "hairloom.add_groom"
    bl_label = "Hairloom Groom"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        **NEW_GROOM,
        "fits": BoolProperty(
            name="Fit to Mesh",
            description="Scale lengths and motion to the mesh, unless it has the size of a human "
            "head or body",
            default=True,
        ),
        **GROW_PROPERTIES,
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context) and _has_growth_mesh(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        _apply_preferences(self, context)
        return self.execute(context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        growing = new_groom(
            growth_mesh(context),
            context.evaluated_depsgraph_get(),
            context.collection,
            self,
            presets=chosen_presets(self),
            fits=self.fits,
            density_group=self.density_group,
            length_group=self.length_group,
        )
        hair = yield from steps_of_parts(growing)
        yield from start_preview_steps(self, context, [hair], plays=self.plays)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        for name in (*NEW_GROOM, "fits"):
            self.layout.prop(self, name)
        draw_settings_hint(self.layout)


class HAIRLOOM_OT_sample_scene(LongWork, bpy.types.Operator):
    """Add and play a new scene with a turning head, long hair, lights and a camera. Other scenes
    are not changed. Esc cancels"""

    bl_idname = "hairloom.sample_scene"
    bl_label = "Hairloom Sample Scene"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        **NEW_GROOM,
        "skin": EnumProperty(
            name="Skin",
            description="Skin tone of the head",
            items=[(name, name.title(), "") for name in TONES],
            translation_context="Skin",
            default="light",
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        _apply_preferences(self, context)
        return self.execute(context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        adding = add_sample_scene(chosen_presets(self), self.skin)
        scene, hair = yield from steps_of_parts(adding)
        if context.window is not None:
            context.window.scene = scene
        with context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            start_previews(self, context, [hair], plays=False)
            hair.select_set(False)  # active, but without an outline
        if not bpy.app.background:
            _look_through_the_camera(context)
            if self.plays and not context.screen.is_animation_playing:
                bpy.ops.screen.animation_play()


class HAIRLOOM_OT_use_groom(LongWork, bpy.types.Operator):
    """Preview the selected hair with Hairloom. Mutes Blender's Hair Dynamics, grows hair if
    there are no curves, and adds a look if there is none. Esc cancels"""

    bl_idname = "hairloom.use_groom"
    bl_label = "Use Hairloom"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context)):
            return False
        if any(previews.session_of(hair) is None for hair in target_hair(context)):
            return True
        cls.poll_message_set("Select hair curves that Hairloom does not preview yet")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        chosen = preferences(context)
        prepared, problems = list[bpy.types.Object](), list[HairloomError]()
        grooms, depsgraph = target_hair(context), context.evaluated_depsgraph_get()
        jobs = (prepare_existing_hair(hair, depsgraph, chosen_presets(chosen)) for hair in grooms)
        for hair, notes in (yield from steps_of_parts(batched(jobs, problems.append))):
            for note in notes:
                report(self, "INFO", f"{hair.name}: {note}")
            prepared.append(hair)
        for problem in problems[not prepared :]:
            report(self, "ERROR", problem)
        if not prepared:
            raise problems[0]
        yield from start_preview_steps(self, context, prepared, plays=chosen.plays)
        if len(grooms) > 1:
            report(self, "INFO", f"Hairloom now previews {len(prepared)} of {len(grooms)} grooms")


class HAIRLOOM_OT_convert_particles(LongWork, bpy.types.Operator):
    """Convert the particle hair of the active mesh to hair curves attached to it, and preview them.
    The particles are hidden, not deleted. Esc cancels"""

    bl_idname = "hairloom.convert_particles"
    bl_label = "Convert Particle Hair"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context)):
            return False
        mesh = active_mesh(context)
        if mesh is not None and hair_systems(mesh):
            return True
        cls.poll_message_set("Select a mesh that has particle hair")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        chosen, mesh = preferences(context), active_mesh(context)
        assert mesh is not None, "poll has looked"
        check_presets(chosen_presets(chosen))
        yield Progress("Reading the particles")
        grooms, dropped = yield from steps_of_parts(convert_particle_hair(context, mesh))
        for hair in grooms:
            depsgraph = context.evaluated_depsgraph_get()
            _, notes = run_parts(prepare_existing_hair(hair, depsgraph, chosen_presets(chosen)))
            for note in notes:
                report(self, "INFO", f"{hair.name}: {note}")
        result = f"{mesh.name}: its particle hair was hidden and replaced by curves"
        report_outcome(self, Outcome(result, dropped))
        yield from start_preview_steps(self, context, grooms, plays=chosen.plays)


class HAIRLOOM_OT_show_settings(bpy.types.Operator):
    """Make the hair active and show all its settings in Properties > Data"""

    bl_idname = "hairloom.show_settings"
    bl_label = "All Settings"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        make_active(context, target_hair(context)[:1])
        for area in () if context.screen is None else context.screen.areas:
            if area.type == "PROPERTIES":
                _show_data(area.spaces.active)
        return {"FINISHED"}


def _show_data(editor: bpy.types.SpaceProperties) -> None:
    for tab in ("DATA", "OBJECT"):
        # the editor lacks the tab while it is pinned to something else, or if nothing was active
        # when it was last drawn
        with suppress(TypeError):
            editor.context = tab
            return


def start_previews(
    operator: bpy.types.Operator,
    context: bpy.types.Context,
    grooms: list[bpy.types.Object],
    *,
    plays: bool,
) -> None:
    """`start_preview_steps` in one go."""
    for _ in start_preview_steps(operator, context, grooms, plays=plays):
        pass


def start_preview_steps(
    operator: bpy.types.Operator,
    context: bpy.types.Context,
    grooms: list[bpy.types.Object],
    *,
    plays: bool,
) -> Steps[None]:
    """Select and preview grooms and, in a window, play them.

    The grooms exist by now and must be undone in one step, so errors are reported here instead of
    raised, and the work can no longer be cancelled.
    """
    chosen = preferences(context)
    for hair in grooms:
        hair.hairloom.bake.follows = chosen.follows
        hair.hairloom.show_counts = chosen.show_counts
        if chosen.device != "automatic":
            hair.hairloom.dynamics.device = chosen.device
    make_active(context, grooms)
    for hair in grooms:
        yield Progress("Starting the preview", is_committed=True)
        try:
            start_preview(operator, context, [hair])
        except HairloomError as error:
            report(operator, "ERROR", error)
            return
    if not plays or bpy.app.background:
        return
    if previews.is_playing():
        depsgraph = context.evaluated_depsgraph_get()
        for session in filter(None, map(previews.session_of, grooms)):
            previews.begin(session, depsgraph, blocking=False)
    else:
        bpy.ops.hairloom.play("INVOKE_DEFAULT")


def _look_through_the_camera(context: bpy.types.Context) -> None:
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"


def _apply_preferences(operator: Any, context: bpy.types.Context) -> None:
    chosen = preferences(context)
    for name in NEW_GROOM:
        if not operator.properties.is_property_set(name):
            setattr(operator, name, getattr(chosen, name))


def _has_growth_mesh(operator: type[Any], context: bpy.types.Context) -> bool:
    if growth_mesh(context) is not None:
        return True
    operator.poll_message_set(_NO_MESH)
    return False


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_OT_add_groom,
    HAIRLOOM_OT_sample_scene,
    HAIRLOOM_OT_use_groom,
    HAIRLOOM_OT_convert_particles,
    HAIRLOOM_OT_show_settings,
)
