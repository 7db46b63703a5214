"""F12 in EEVEE with Hairloom's hair over it, in the render thread; undo and redo."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import new_head, press
from driver import hairloom_module, wait_until

SIZE = 160
FOLDER = Path(bpy.app.tempdir)


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from a_bald_head_alone()
    yield from hair_over_it()
    yield from hair_over_it("again")
    yield from undo_and_redo()


def set_the_scene():
    head = new_head()
    bpy.ops.hairloom.grow(method="normals", lift=1.0, strand_count=800, length=0.06)
    bpy.context.object.name = "Hair"
    bpy.ops.object.light_add(type="SUN", rotation=(0.9, 0.3, 0.0))
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler.x = (0.0, -1.0, 0.0), np.pi / 2.0
    scene.camera = camera
    scene.render.engine, scene.eevee.taa_render_samples = "BLENDER_EEVEE", 4
    scene.hairloom.picture.samples = 4
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.context.preferences.view.render_display_type = "NONE"
    assert head is not None
    yield


def f12(name):
    path = FOLDER / f"{name}.exr"
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from wait_until(
        lambda: path.is_file() and not bpy.app.is_job_running("RENDER"), "F12 writes no picture"
    )
    yield


def picture(name):
    image = bpy.data.images.load(str(FOLDER / f"{name}.exr"))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(SIZE, SIZE, 4)


def a_bald_head_alone():
    bpy.data.objects["Hair"].hide_render = True
    yield from f12("bald")
    bpy.data.objects["Hair"].hide_render = False


def hair_over_it(name="over"):
    scene, hair = bpy.context.scene, bpy.data.objects["Hair"]
    scene.hairloom.use_hair_scene = True
    yield
    yield from f12(name)
    assert hair.visible_camera and hair.visible_shadow, "hair stays hidden after the render"
    is_changed = (picture(name) != picture("bald")).any(axis=2)
    print(f"{is_changed.mean():.3f} of the picture are other than EEVEE's")
    assert 0.05 < is_changed.mean() < 0.7
    corner = SIZE // 10
    assert not is_changed[:corner, :corner].any()


def undo_and_redo():
    """The hair scene is added and removed with its checkbox."""
    scene = bpy.context.scene
    bpy.ops.ed.undo_push(message="with")
    scene.hairloom.use_hair_scene = False
    bpy.ops.ed.undo_push(message="without")
    yield
    assert bpy.context.scene.compositing_node_group is None
    bpy.ops.ed.undo()
    yield
    hair_scene = hairloom_module("hair_scene")
    assert hair_scene.problem_of(bpy.context.scene) == ""
    bpy.ops.ed.redo()
    yield
    assert not bpy.context.scene.hairloom.use_hair_scene and len(bpy.data.scenes) == 1


driver.play_session(steps())
