"""Draws a GLB with Panda3D, an independent engine, and saves the picture.

Run in a separate process, because two OpenGL contexts in one process interfere:

    python panda_view.py FILE.glb PICTURE.npy SIZE EXTENT

The view is orthographic along +Y (Blender's axes), EXTENT wide and high around the origin. The
picture is (SIZE, SIZE, 4) uint8, row 0 at the bottom, on a transparent black background.
"""

import sys

import numpy as np
from panda3d.core import loadPrcFileData

loadPrcFileData("", "window-type offscreen\nload-display p3headlessgl\naudio-library-name null\n")

import gltf  # noqa: E402
from direct.showbase.ShowBase import ShowBase  # noqa: E402
from panda3d.core import FrameBufferProperties, OrthographicLens  # noqa: E402


def main(path: str, output: str, size: int, extent: float) -> None:
    loadPrcFileData("", f"win-size {size} {size}\nframebuffer-alpha true\n")
    base = ShowBase()
    properties = FrameBufferProperties()
    properties.set_rgba_bits(8, 8, 8, 8)
    properties.set_depth_bits(24)
    buffer = base.win.make_texture_buffer("view", size, size, None, True, properties)
    buffer.set_clear_color((0.0, 0.0, 0.0, 0.0))

    model = base.render.attach_new_node(gltf.load_model(path))
    low, high = model.get_tight_bounds()
    lens = OrthographicLens()
    lens.set_film_size(extent, extent)
    lens.set_near_far(0.0, (high - low).y + 2.0)
    camera = base.make_camera(buffer, lens=lens)
    camera.set_pos(0.0, low.y - 1.0, 0.0)

    base.graphicsEngine.render_frame()
    base.graphicsEngine.render_frame()
    texture = buffer.get_texture()
    bgra = np.frombuffer(texture.get_ram_image(), np.uint8).reshape(size, size, 4)
    np.save(output, bgra[..., [2, 1, 0, 3]])


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
