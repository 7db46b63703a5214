"""Colliders: Fit Spheres and Remove Spheres, and the panels."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..blender.base.objects import OVERRIDE, head_of
from ..blender.base.outcome import report
from ..blender.colliders import spheres
from ..blender.colliders.spheres import FittedSpheres
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..dynamics.fitting.settings import SphereFitSettings
from .drawing import draw_button
from .help import WithHelp
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .selection import active_mesh, in_object_mode, target_hair
from .texts import translated

_MILLIMETRES = 1000.0


class HAIRLOOM_OT_fit_spheres(LongWork, bpy.types.Operator):
    """Fit collision spheres to the active mesh, or to the mesh that the active hair grows on. They
    follow armature deformation and collide faster than a mesh. Esc cancels"""

    bl_idname = "hairloom.fit_spheres"
    bl_label = "Fit Spheres"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        **operator_properties("sphere_fit"),
        "replace_mesh": BoolProperty(
            name="Replace Mesh",
            description="Stop collisions with the mesh itself, so that Play does not have to "
            "prepare it",
            default=True,
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and _has_mesh(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        mesh = _mesh(context)
        assert mesh is not None
        fitting = spheres.fit_spheres_to(mesh, context, settings_of(self, SphereFitSettings))
        fitted = yield from steps_of_parts(fitting)
        for hair in spheres.hair_on(mesh, context.view_layer):
            if hair.is_editable:
                spheres.use_spheres(hair, fitted.collection, context.scene)
            else:
                report(
                    self,
                    "WARNING",
                    f"{hair.name} is linked from another file, so it does not use them. {OVERRIDE}",
                )
        if self.replace_mesh and not mesh.is_editable:
            report(
                self,
                "WARNING",
                f"{mesh.name} is linked from another file, so it still collides, too. {OVERRIDE}",
            )
        elif self.replace_mesh:
            spheres.replace_mesh(mesh, fitted.collection)
        self._report(mesh, fitted)

    def _report(self, mesh: bpy.types.Object, fitted: FittedSpheres) -> None:
        error, count = fitted.fit.error, len(fitted.fit.radii)
        if fitted.unskinned and mesh.modifiers:
            report(
                self,
                "WARNING",
                f"{fitted.unskinned} of {count} spheres follow the object {mesh.name} but not its "
                "shape: apply the modifiers that copy vertices, and fit again",
            )
        report(
            self,
            "INFO",
            f"{'1 sphere' if count == 1 else f'{count} spheres'} in {fitted.collection.name}. "
            f"The mesh sticks out of them by {error.gap_mean * _MILLIMETRES:.1f} mm on average "
            f"(at most {error.gap_max * _MILLIMETRES:.1f} mm), they out of the mesh by "
            f"{error.outside_mean * _MILLIMETRES:.1f} mm "
            f"(at most {error.outside_max * _MILLIMETRES:.1f} mm)",
        )


class HAIRLOOM_OT_remove_spheres(bpy.types.Operator):
    """Remove the spheres fitted to the active mesh, or to the mesh that the active hair grows on.
    The mesh itself collides again"""

    bl_idname = "hairloom.remove_spheres"
    bl_label = "Remove Spheres"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _has_mesh(cls, context):
            return False
        if spheres.fitted_collections(_mesh(context)):
            return True
        cls.poll_message_set("No spheres were fitted to this mesh")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        mesh = _mesh(context)
        assert mesh is not None
        count = spheres.remove_spheres(mesh)
        text = "1 sphere removed" if count == 1 else f"{count} spheres removed"
        if mesh.hairloom.collider_shape != "none":
            text += f"; {mesh.name} collides by itself again"
        report(self, "INFO", text)
        return {"FINISHED"}


def draw_colliders(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the colliders of hair curves or of a fin."""
    column = layout.column()
    column.prop(hair.hairloom, "collider")
    column.prop(hair.hairloom, "collider_collection")
    solid = hair.hairloom.collider or (head_of(hair) if hair.type == "CURVES" else None)
    if solid is not None:
        text = translated("{name} As", name=solid.name)
        column.prop(solid.hairloom, "collider_shape", text=text, translate=False)
    if draw_progress(layout, HAIRLOOM_OT_fit_spheres):
        return
    row = layout.row(align=True)
    draw_button(row, "hairloom.fit_spheres", icon="META_BALL")
    row.operator("hairloom.remove_spheres", text="", icon="X")


class HAIRLOOM_PT_collider(WithHelp, bpy.types.Panel):
    """How this object collides with hair that uses it as a collider"""

    bl_label = "Hairloom Collider"
    help_section = "collisions"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type in {"MESH", "EMPTY"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(context.object.hairloom, "collider_shape")


def _mesh(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active mesh, or the one that the chosen hair grows on."""
    mesh = active_mesh(context)
    hair = target_hair(context)
    return mesh if mesh is not None or not hair else head_of(hair[0])


def _has_mesh(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """For `poll`: whether there is such a mesh; the greyed-out button says what to do."""
    if not in_object_mode(operator, context):
        return False
    if _mesh(context) is not None:
        return True
    operator.poll_message_set("Select a mesh, or hair that grows on one")
    return False


CLASSES = (HAIRLOOM_OT_fit_spheres, HAIRLOOM_OT_remove_spheres, HAIRLOOM_PT_collider)
