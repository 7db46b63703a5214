"""The scene's gravity, and the wind of its force fields."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats


def gravity_of(scene: bpy.types.Scene) -> Floats:
    """(3,) [m/s^2], world space."""
    return np.array(scene.gravity) if scene.use_gravity else np.zeros(3)


def scene_wind(depsgraph: bpy.types.Depsgraph) -> Floats:
    """The sum of the scene's Wind force fields, (3,) float64 [m/s], world space.

    Each blows along its object's local +Z with the same speed everywhere. A strength of 1 is 1 m/s:
    Blender's default is a breath, 10 a fresh breeze, and negative values blow backwards. The
    object's position and scale do not matter. As in Blender, fields that are hidden or excluded
    from the view layer have no effect. Other kinds of fields, falloff and the field's noise are
    ignored; gusts are part of the hair's own wind settings.
    """
    total = np.zeros(3)
    for instance in depsgraph.objects:
        field = instance.field
        if field is None or field.type != "WIND":
            continue
        along = np.array(instance.matrix_world, np.float64)[:3, 2]
        length = float(np.linalg.norm(along))
        if length > 0.0 and np.isfinite(length) and np.isfinite(field.strength):
            total += along / length * field.strength
    return total
