"""A script for another Blender process: renders a world alone, as a panorama with +X in the middle.

render_panorama.py -- WORLD.blend PANORAMA.exr
"""

import math
import sys

import bpy

#: small suns need this many samples in total
SIZE, SAMPLES = (1024, 512), 16


def main(blend: str, panorama: str) -> None:
    with bpy.data.libraries.load(blend) as (found, loaded):
        loaded.worlds = found.worlds
    scene = bpy.data.scenes.new("World")
    scene.world = loaded.worlds[0]
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.panorama_type = "PANO", "EQUIRECTANGULAR"
    camera.rotation_euler = (0.5 * math.pi, 0.0, -0.5 * math.pi)
    scene.collection.objects.link(camera)
    scene.camera, render = camera, scene.render
    render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", SAMPLES
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type = "BOX"
    render.resolution_x, render.resolution_y = SIZE
    render.resolution_percentage = 100
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    render.filepath = panorama
    bpy.ops.render.render(write_still=True, scene=scene.name)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 :])
