"""Suzanne, which every Blender has, as the head of benchmarks, so that figures stay comparable."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.strands import Surface

HEAD_HEIGHT = 0.22  # [m], of a grown human, so that hair lengths and gravity look familiar
_SUBDIVISIONS = 2


def suzanne() -> Surface:
    """Suzanne as a smooth surface with UVs, facing -Y, centred on the origin, in metres."""
    mesh = bpy.data.meshes.new("Hairloom head")
    head = bpy.data.objects.new("Hairloom head", mesh)
    shape = bmesh.new()
    try:
        shape.loops.layers.uv.new("UVMap")
        bmesh.ops.create_monkey(shape, calc_uvs=True)
        shape.to_mesh(mesh)
        head.modifiers.new("Smooth", "SUBSURF").levels = _SUBDIVISIONS
        bpy.context.scene.collection.objects.link(head)
        surface = read_surface(
            head, bpy.context.evaluated_depsgraph_get(), need_uv=True, place="built-in head"
        )
    finally:
        shape.free()
        bpy.data.objects.remove(head)
        bpy.data.meshes.remove(mesh)
    low, high = surface.bounds()
    upright = np.eye(4)
    upright[:3, :3] *= HEAD_HEIGHT / float(high[2] - low[2])
    upright[:3, 3] = -upright[0, 0] * (low + high) / 2.0
    return surface.transformed(upright)
