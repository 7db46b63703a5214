"""Gizmos in the 3D view: for the wind, while the overlay *Wind* is shown; and for the size of
Empties that are hair ties or colliders.

Blender's own tools move those Empties and the curves of partings, and set the strength of force
fields.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from ..blender.base.objects import objects_in
from ..blender.colliders.collider_reader import sized_axis
from ..blender.colliders.scene_colliders import collider_objects
from ..blender.colliders.ties import ties_of
from ..blender.preview import previews
from ..blender.scene.fin_modifier import has_fins
from ..blender.sessions.fins import fins_in
from ..blender.viewport.debug_lines import COLORS, wind_length

#: radius of a ring, relative to Blender's size of gizmos
RING_SCALE = 1.3
#: size of an arrow's head or a box, likewise; width of lines [pixels]
_HANDLE_SCALE, _LINE_WIDTH = 1.2, 2.0


class _ActiveObjectGizmos:
    """Base of gizmos of the active object, before bpy.types.GizmoGroup: shown when Blender shows
    its own."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "PERSISTENT"}

    @classmethod
    def poll(cls: Any, context: bpy.types.Context) -> bool:
        obj = context.active_object
        if obj is None or context.mode != "OBJECT" or not obj.is_editable:
            return False
        is_shown = context.space_data.show_gizmo_context and obj.visible_get()
        return bool(is_shown and cls.has_handles(obj, context))


class HAIRLOOM_GGT_wind(_ActiveObjectGizmos, bpy.types.GizmoGroup):
    """Speed, direction and elevation of the wind of previewed hair, while its overlay is shown"""

    bl_label = "Wind"

    @staticmethod
    def has_handles(obj: bpy.types.Object, _context: bpy.types.Context) -> bool:
        is_shown = obj.type == "CURVES" and "wind" in obj.hairloom.shown_overlays
        return is_shown and previews.session_of(obj) is not None

    def setup(self, _context: bpy.types.Context) -> None:
        self.speed = _arrow(self, "NORMAL", COLORS["wind"])
        self.dials = {}
        for name in ("wind_direction", "wind_elevation"):
            dial = self.dials[name] = self.gizmos.new("GIZMO_GT_dial_3d")
            dial.scale_basis, dial.use_draw_value = RING_SCALE, True
            _prepare(dial, COLORS["wind"])

    def refresh(self, context: bpy.types.Context) -> None:
        """Bind the gizmos to the active hair."""
        hair = context.active_object
        for name, dial in self.dials.items():
            dial.target_set_prop("offset", hair.hairloom.dynamics, name)
        self.speed.target_set_handler("offset", get=_arrow_length, set=_set_arrow_length)

    def draw_prepare(self, context: bpy.types.Context) -> None:
        """Move the gizmos to the hair."""
        session = previews.session_of(context.active_object)
        assert session is not None, "poll has looked"
        wind = context.active_object.hairloom.dynamics
        translation = Matrix.Translation(session.snapshot.root_center.tolist())
        azimuth = Euler((0.0, 0.0, wind.wind_direction)).to_matrix().to_4x4()
        # Blender counts a dial's angle clockwise around its z, so these point down and to the side
        down, sideways = (Euler((x, 0.0, 0.0)).to_matrix().to_4x4() for x in (np.pi, -np.pi / 2.0))
        downwind = (
            azimuth @ Euler((0.0, np.pi / 2.0 - wind.wind_elevation, 0.0)).to_matrix().to_4x4()
        )
        self.speed.matrix_basis = translation @ downwind
        self.dials["wind_direction"].matrix_basis = translation @ down
        self.dials["wind_elevation"].matrix_basis = translation @ azimuth @ sideways


class HAIRLOOM_GGT_empty_size(_ActiveObjectGizmos, bpy.types.GizmoGroup):
    """Size of an Empty that is a hair tie or a collider"""

    bl_label = "Size of Tie or Collider"

    @staticmethod
    def has_handles(obj: bpy.types.Object, context: bpy.types.Context) -> bool:
        return obj.type == "EMPTY" and any(
            obj in ties_of(owner) or obj in collider_objects(owner, None)
            for owner in _simulated_in(context.view_layer)
        )

    def setup(self, _context: bpy.types.Context) -> None:
        self.size = _arrow(self, "BOX", COLORS["colliders"])

    def refresh(self, _context: bpy.types.Context) -> None:
        """Bind the gizmo to the active Empty."""
        self.size.target_set_handler("offset", get=_size, set=_set_size)

    def draw_prepare(self, context: bpy.types.Context) -> None:
        """Move the gizmo to the Empty."""
        empty = context.active_object
        axis = _size_axis(empty).normalized()
        rotation = Vector((0.0, 0.0, 1.0)).rotation_difference(axis).to_matrix().to_4x4()
        self.size.matrix_basis = Matrix.Translation(empty.matrix_world.translation) @ rotation


def _simulated_in(layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """Hair and fins, which Empties may hold or collide with."""
    hair = [obj for obj in objects_in(layer) if obj.type == "CURVES"]
    return hair + fins_in(layer) if has_fins() else hair


def _arrow(group: bpy.types.GizmoGroup, style: str, color: tuple[float, ...]) -> bpy.types.Gizmo:
    """A handle without a stem that is dragged along its z axis."""
    arrow = group.gizmos.new("GIZMO_GT_arrow_3d")
    arrow.draw_style, arrow.length, arrow.use_draw_value = style, 0.0, True
    arrow.scale_basis = _HANDLE_SCALE
    _prepare(arrow, color)
    return arrow


def _prepare(gizmo: bpy.types.Gizmo, color: tuple[float, ...]) -> None:
    gizmo.color, gizmo.alpha = color[:3], 0.7
    gizmo.color_highlight, gizmo.alpha_highlight = (1.0, 1.0, 1.0), 1.0
    gizmo.line_width, gizmo.use_undo = _LINE_WIDTH, True


def _arrow_length() -> float:
    """Length of the overlay's arrow for the wind [m]."""
    hair = bpy.context.active_object
    return float(hair.hairloom.dynamics.wind_speed * _length_per_speed(hair))


def _set_arrow_length(length: float) -> None:
    hair = bpy.context.active_object
    hair.hairloom.dynamics.wind_speed = length / _length_per_speed(hair)


def _length_per_speed(hair: bpy.types.Object) -> float:
    session = previews.session_of(hair)
    assert session is not None, "poll has looked"
    return wind_length(session.rig.radius)


def _size_axis(empty: bpy.types.Object) -> Vector:
    """The Empty's axis along which its size is dragged; world space, for a display size of 1."""
    return empty.matrix_world.col[sized_axis(empty)].to_3d()


def _size() -> float:
    """The distance of the active Empty's border from its middle [m]."""
    empty = bpy.context.active_object
    return float(empty.empty_display_size * _size_axis(empty).length)


def _set_size(distance: float) -> None:
    empty = bpy.context.active_object
    length = _size_axis(empty).length
    if length > 0.0:
        empty.empty_display_size = distance / length


CLASSES = (HAIRLOOM_GGT_wind, HAIRLOOM_GGT_empty_size)
