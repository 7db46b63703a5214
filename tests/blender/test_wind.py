"""The wind of the scene's force fields."""

import math

import bpy
import numpy as np
from collider_scene import depsgraph

from hairloom.addon.blender.scene.wind import scene_wind


def test_wind_fields_add_up_along_their_own_z(extension):
    assert scene_wind(depsgraph()).tolist() == [0.0, 0.0, 0.0]
    for strength, turn in ((3.0, (0, math.pi / 2, 0)), (-2.0, (0, 0, 0))):
        bpy.ops.object.effector_add(type="WIND", rotation=turn)
        bpy.context.object.field.strength = strength
        bpy.context.object.scale = (5, 5, 5)
    bpy.ops.object.effector_add(type="VORTEX")
    np.testing.assert_allclose(scene_wind(depsgraph()), [3.0, 0.0, -2.0], atol=1e-6)
    bpy.data.objects["Wind"].hide_viewport = True
    np.testing.assert_allclose(scene_wind(depsgraph()), [0.0, 0.0, -2.0], atol=1e-6)
    bpy.data.objects["Wind.001"].hide_set(True)
    assert scene_wind(depsgraph()).tolist() == [0.0, 0.0, 0.0]
