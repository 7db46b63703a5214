"""A fin in motion, as the session computes it and as Blender shows it."""

import bpy
import numpy as np

from hairloom.addon.blender.preview import fins

FRAME = 1.0 / 60.0


def update():
    bpy.context.view_layer.update()


def rest_of(obj):
    """The vertices of the original mesh, object space."""
    rest = np.empty((len(obj.data.vertices), 3), np.float32)
    obj.data.vertices.foreach_get("co", rest.ravel())
    return rest


def shown(obj, evaluated):
    """The vertices of the evaluated mesh, world space; the original vertices come first."""
    there = obj.evaluated_get(evaluated())
    points = np.empty((len(there.data.vertices), 3), np.float32)
    there.data.vertices.foreach_get("co", points.ravel())
    matrix = np.array(there.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def play(session, evaluated, frames, each=lambda frame: None):
    for frame in range(frames):
        each(frame)
        update()
        session.advance(evaluated(), FRAME)
        update()


def started(obj, evaluated):
    update()
    session = fins.start(obj, evaluated())
    session.play(evaluated())
    return session
