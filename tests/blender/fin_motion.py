"""A fin in motion, as the session computes it and as Blender shows it."""

import bpy
import numpy as np

from hairloom.addon.blender.preview import fins

FRAME_S = 1.0 / 60.0


def update_view_layer():
    bpy.context.view_layer.update()


def rest_vertices(obj):
    """The vertices of the original mesh, object space."""
    rest = np.empty((len(obj.data.vertices), 3), np.float32)
    obj.data.vertices.foreach_get("co", rest.ravel())
    return rest


def evaluated_vertices(obj, get_depsgraph):
    """The vertices of the evaluated mesh, world space; the original vertices come first."""
    evaluated_obj = obj.evaluated_get(get_depsgraph())
    points = np.empty((len(evaluated_obj.data.vertices), 3), np.float32)
    evaluated_obj.data.vertices.foreach_get("co", points.ravel())
    matrix = np.array(evaluated_obj.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def play_frames(session, get_depsgraph, frames, before_frame=lambda frame: None):
    for frame in range(frames):
        before_frame(frame)
        update_view_layer()
        session.advance(get_depsgraph(), FRAME_S)
        update_view_layer()


def start_fin(obj, get_depsgraph):
    update_view_layer()
    session = fins.start(obj, get_depsgraph())
    session.play(get_depsgraph())
    return session
