"""A scene of colliders, and what an object reads of it."""

import bpy
import numpy as np

from hairloom.addon.blender.colliders.scene_colliders import SceneColliders
from hairloom.addon.dynamics.colliders import transform_points
from hairloom.addon.dynamics.settings import DynamicsSettings

FRAME_S = 1.0 / 60.0
COARSE_SETTINGS = DynamicsSettings(collider_resolution=16)


class ColliderScene:
    """An owner without a head, with its colliders in a collection."""

    def __init__(self):
        self.colliders = bpy.data.collections.new("Colliders")
        bpy.context.scene.collection.children.link(self.colliders)
        self.owner = bpy.data.objects.new("Fin", bpy.data.meshes.new("Fin"))
        bpy.context.collection.objects.link(self.owner)
        self.owner.hairloom.collider_collection = self.colliders

    def add(self, obj, shape="automatic"):
        for collection in obj.users_collection:
            collection.objects.unlink(obj)
        self.colliders.objects.link(obj)
        obj.hairloom.collider_shape = shape
        return obj

    def ball(self, radius=0.1, place=(0, 0, 0), name="Ball"):
        empty = bpy.data.objects.new(name, None)
        empty.empty_display_type, empty.empty_display_size = "SPHERE", radius
        empty.location = place
        bpy.context.collection.objects.link(empty)
        return self.add(empty)

    def cube(self, size=0.2, shape="automatic", name="Cube", place=(0, 0, 0)):
        bpy.ops.mesh.primitive_cube_add(size=size, location=place)
        bpy.context.object.name = name
        return self.add(bpy.context.object, shape)

    def read_colliders(self, known=None):
        return SceneColliders.of(self.owner, None, None, COARSE_SETTINGS, depsgraph(), known)


def depsgraph():
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def distance_now(posed, point):
    """Distance [m] between collider and point (3,), world space, at the frame's end, first
    order."""
    inverse = np.linalg.inv(posed.matrix_now)
    local = transform_points(inverse, np.array(point, np.float32)[:, None])
    distance, gradient = posed.collider.distance(local)
    return float(distance[0] / np.linalg.norm(inverse[:3, :3].T @ gradient[:, 0]))


def move_colliders(colliders, duration=FRAME_S):
    return colliders.move(depsgraph(), duration)
