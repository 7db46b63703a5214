"""Draws pictures of the render engine, and of hair over Blender's own engines, for docs/engine.md
and docs/light_shafts.md.

python tools/engine_pictures.py FOLDER

FOLDER gets engine.png: picture, distance and object mask of the built-in head with a groom, in
front of a wall, rendered by the engine into a multilayer file, as by an artist. over_engines.jpg:
the sample scene by EEVEE and Cycles, with *Hairloom Hair*, and by Hairloom. And light_shafts.jpg:
the head in front of a bright window, without shafts and with them, and under water.
"""

import importlib
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from extension_loader import PACKAGE, load_package
from mathutils import Vector
from small_pictures import write_small

SIZE, SAMPLES, STRANDS, WIDTH_FACTOR = 340, 16, 12000, 1.5
#: of pictures of hair over Blender's own engines
OVER_SIZE, OVER_SAMPLES = 480, 64
#: of pictures of light shafts
SHAFT_SAMPLES = 6
WORLD = (0.12, 0.15, 0.2, 1.0)
#: colours of the world in a room and under water; the places and sizes of a window's bars [m]
ROOM = (0.03, 0.03, 0.04, 1.0)
SEA = (0.01, 0.04, 0.06, 1.0)
BARS = (
    *(((x, 0.0), (0.006, 0.3)) for x in (-0.045, 0.045)),
    *(((0.0, y), (0.3, 0.006)) for y in (-0.05, 0.05)),
)
CAMERA, TARGET = Vector((-0.42, -0.85, 0.12)), Vector((0.0, 0.0, 0.02))
#: number in the mask -> colour [scene-linear]
MASK = {0: (0.02, 0.02, 0.02), 1: (0.7, 0.25, 0.12), 2: (0.1, 0.3, 0.75), 3: (0.15, 0.4, 0.15)}


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def material(name: str, color: tuple[float, float, float], roughness: float) -> Any:
    material = bpy.data.materials.new(name)
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*color, 1.0)
    principled.inputs["Roughness"].default_value = roughness
    return material


def head() -> Any:
    """The built-in head as an object."""
    surface = addon_module("blender.scene.built_in_head").built_in_head().surface
    mesh = bpy.data.meshes.new("Head")
    mesh.from_pydata(surface.positions, [], surface.triangles)
    mesh.uv_layers.new().data.foreach_set("uv", surface.corner_uv.ravel())
    mesh.shade_smooth()
    mesh.materials.append(material("Skin", (0.8, 0.55, 0.42), 0.5))
    obj = bpy.data.objects.new("Head", mesh)
    bpy.context.collection.objects.link(obj)
    obj.pass_index = 1
    return obj


def scene_of_head() -> Any:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene, skin = bpy.context.scene, head()
    bpy.context.view_layer.objects.active = skin
    skin.select_set(True)
    bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12)
    hair = bpy.context.object
    hair.pass_index = 2
    bpy.ops.hairloom.apply_preset(name="looks/brown")
    hair.data.hairloom.strands.fullness = WIDTH_FACTOR
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.2, 0.5, 0.0), rotation=(1.57, 0.0, -0.4))
    wall = bpy.context.object
    wall.scale, wall.pass_index = (0.25, 0.2, 1.0), 3
    wall.data.materials.append(material("Wall", (0.3, 0.45, 0.3), 0.9))
    bpy.ops.object.light_add(type="AREA", location=(-0.7, -0.6, 0.9))
    lamp = bpy.context.object
    lamp.data.energy, lamp.data.size = 14.0, 0.3
    lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.object.camera_add(location=CAMERA)
    scene.camera = bpy.context.object
    scene.camera.rotation_euler = (TARGET - CAMERA).to_track_quat("-Z", "Y").to_euler()
    scene.camera.data.lens, scene.camera.data.clip_start = 92.0, 0.01
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = WORLD
    return scene


def passes_of(scene: Any, path: Path) -> dict[str, Any]:
    """Render; name -> (height, width, channels), row 0 at the bottom."""
    import OpenImageIO

    render, layer = scene.render, scene.view_layers[0]
    render.engine = "HAIRLOOM"
    render.resolution_x = render.resolution_y = SIZE
    scene.hairloom.picture.samples = SAMPLES
    layer.use_pass_z = layer.use_pass_object_index = True
    settings = render.image_settings
    settings.media_type, settings.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    file, passes = OpenImageIO.ImageInput.open(str(path)), {}
    while file.seek_subimage(len(passes), 0):
        spec = file.spec()
        pixels = file.read_image(len(passes), 0, 0, spec.nchannels, "float")
        passes[spec.channelnames[0].split(".")[1]] = np.asarray(pixels)[::-1]
    file.close()
    return passes


def render_with_each_engine(work: Path) -> list[Path]:
    """The sample scene as EEVEE and Cycles show it with our hair, and as our engine does."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.sample_scene(look="looks/brown", plays=False)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = OVER_SIZE
    scene.hairloom.picture.samples = SAMPLES
    scene.eevee.taa_render_samples = scene.cycles.samples = OVER_SAMPLES
    scene.hairloom.use_hair_scene = True
    pictures = []
    for engine in ("BLENDER_EEVEE", "CYCLES", "HAIRLOOM"):
        scene.render.engine = engine
        pictures.append(work / f"{engine}.png")
        scene.render.filepath = str(pictures[-1])
        bpy.ops.render.render(write_still=True, scene=scene.name)
    return pictures


def add_pane_behind(offset: Any, size: tuple[float, float], material: Any) -> Any:
    """A pane that faces the camera, at this offset from the target."""
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=TARGET + offset)
    pane = bpy.context.object
    pane.rotation_euler = (CAMERA - TARGET).to_track_quat("Z", "Y").to_euler()
    pane.scale = (*size, 1.0)
    pane.data.materials.append(material)
    return pane


def render_shafts(work: Path) -> list[Path]:
    """A window without its shafts and with them, and a sun under water."""
    scene = scene_of_head()
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    bpy.data.objects["Area"].data.energy = 5.0
    world = scene.world.node_tree.nodes["Background"].inputs["Color"]
    world.default_value = ROOM
    hair = next(each for each in scene.objects if each.type == "CURVES")
    behind, glowing = (TARGET - CAMERA).normalized(), material("Pane", (0.0, 0.0, 0.0), 0.9)
    principled = glowing.node_tree.nodes["Principled BSDF"]
    principled.inputs["Emission Color"].default_value = (1.0, 0.85, 0.6, 1.0)
    principled.inputs["Emission Strength"].default_value = 6.0
    dark = material("Bar", (0.05, 0.04, 0.03), 0.9)
    panes = [add_pane_behind(behind * 0.3, (0.3, 0.3), glowing)]
    for offset, size in BARS:
        bar = add_pane_behind(behind * 0.29, size, dark)
        bar.location += bar.rotation_euler.to_matrix() @ Vector((*offset, 0.0))
        panes.append(bar)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.engine, scene.hairloom.picture.samples = "HAIRLOOM", SHAFT_SAMPLES
    shafts, pictures = hair.data.hairloom.shafts, []

    def render(name: str) -> None:
        pictures.append(work / f"{name}.png")
        scene.render.filepath = str(pictures[-1])
        bpy.ops.render.render(write_still=True)

    render("without")
    shafts.use_shafts, shafts.source = True, "bright"
    render("window")
    for pane in panes:
        bpy.data.objects.remove(pane)
    bpy.context.view_layer.objects.active = hair
    bpy.ops.hairloom.apply_preset(name="looks/under_water")
    world.default_value = SEA
    bpy.ops.object.light_add(type="SUN")
    sun = bpy.context.object
    sun.data.energy, sun.data.angle = 2.5, 0.0
    above = behind + Vector((0.0, 0.0, 0.22))
    sun.rotation_euler = above.to_track_quat("Z", "Y").to_euler()
    render("under_water")
    return pictures


def side_by_side(pictures: list[Path], target: Path) -> None:
    import OpenImageIO as oiio

    side = oiio.ImageBuf(str(pictures[0])).spec().width
    sheet = oiio.ImageBuf(oiio.ImageSpec(side * len(pictures), side, 3, "uint8"))
    for number, path in enumerate(pictures):
        picture = oiio.ImageBufAlgo.channels(oiio.ImageBuf(str(path)), (0, 1, 2))
        oiio.ImageBufAlgo.paste(sheet, number * side, 0, 0, 0, picture)
    temporary = target.with_suffix(".png")
    sheet.write(str(temporary))
    write_small(temporary, target)
    temporary.unlink()


def opaque(colors: Any) -> Any:
    return np.concatenate([colors, np.ones_like(colors[..., :1])], axis=-1).astype(np.float32)


def distances(depth: Any) -> Any:
    """A picture of depth: white near, grey far, black where nothing is."""
    is_surface = depth < 1.0e9
    near, far = depth[is_surface].min(), np.percentile(depth[is_surface], 98.0)
    fraction = np.clip((depth - near) / (far - near), 0.0, 1.0)
    return opaque(np.where(is_surface, 0.9 - 0.85 * fraction, 0.0) * np.ones(3))


def main() -> int:
    folder = Path(sys.argv[1])
    extension = load_package()
    extension.register()
    try:
        with tempfile.TemporaryDirectory() as work:
            passes = passes_of(scene_of_head(), Path(work) / "picture.exr")
            side_by_side(render_with_each_engine(Path(work)), folder / "over_engines.jpg")
            side_by_side(render_shafts(Path(work)), folder / "light_shafts.jpg")
    finally:
        extension.unregister()
    mask = np.zeros((SIZE, SIZE, 3), np.float32)
    for number, color in MASK.items():
        mask[passes["Object Index"][..., 0] == number] = color
    pictures = [opaque(passes["Combined"][..., :3]), distances(passes["Depth"]), opaque(mask)]
    images = addon_module("blender.base.images")
    images.write_png(folder / "engine.png", images.contact_sheet(pictures, len(pictures)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
