"""Plays the animation of a GLB in Panda3D and stores the bounds of its vertices.

    python panda_motion.py FILE.glb BOUNDS.json RATE FRAME ...

BOUNDS.json gets the 1st and the 99th percentile of all vertices at each frame, in Panda3D's axes,
which are Blender's.
"""

import json
import sys

import numpy as np
from panda3d.core import loadPrcFileData

loadPrcFileData("", "window-type none\naudio-library-name null\n")

import gltf  # noqa: E402
from direct.actor.Actor import Actor  # noqa: E402
from panda3d.core import GeomVertexReader, NodePath, Thread  # noqa: E402


def places(actor: Actor) -> np.ndarray:
    """All vertices as the joints deform them."""
    found, now = [], Thread.get_current_thread()
    for path in actor.find_all_matches("**/+GeomNode"):
        for number in range(path.node().get_num_geoms()):
            data = path.node().get_geom(number).get_vertex_data().animate_vertices(True, now)
            reader, matrix = GeomVertexReader(data, "vertex"), path.get_mat(actor)
            while not reader.is_at_end():
                found.append(tuple(matrix.xform_point(reader.get_data3())))
    return np.array(found)


def main(path: str, output: str, rate: float, frames: list[int]) -> None:
    actor = Actor(NodePath(gltf.load_model(path)))
    (name,) = actor.get_anim_names()
    (control,) = actor.get_anim_controls(name)
    bounds = []
    for frame in frames:
        control.pose(frame / rate * control.get_frame_rate())
        actor.update(force=True)
        vertices = places(actor)
        bounds.append(np.percentile(vertices, (1, 99), axis=0).tolist())
    with open(output, "w", encoding="utf-8") as file:
        json.dump(bounds, file)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), [int(frame) for frame in sys.argv[4:]])
