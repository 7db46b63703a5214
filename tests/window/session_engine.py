"""The render engine on screen: Rendered mode refines and comes to rest, equals F12, and shows
playing hair."""

import gc
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    click,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    region,
    sidebar_button,
    viewport,
    viewport_middle,
)
from driver import hairloom_module, wait_until

SAMPLES = 4
#: [pixels] distance from the middle of the view up to which pictures are compared
REACH = 150


def view():
    """The engine's object that draws the viewport; the newest one, since Blender may still hold
    older ones."""
    kind = hairloom_module("engine").HAIRLOOM_RE_engine
    engines = [each for each in gc.get_objects() if type(each) is kind]
    return engines[-1].view if engines else None


def is_finished():
    now = view()
    return now is not None and now.count == SAMPLES and not now.is_waiting


def settled():
    """Wait until a change has arrived and all samples are drawn again and shown."""
    yield
    yield from wait_until(is_finished, "the viewport does not finish its samples")
    yield


def pixels(label):
    return viewport_middle(driver.screenshot(label), REACH)


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from it_gets_better_and_rests()
    yield from it_is_what_f12_gives()
    yield from a_region_alone_is_drawn()
    yield from it_begins_anew_at_a_change()
    yield from hair_plays_in_it()
    assert hairloom_module("overlay").failure() == ""


def set_the_scene():
    new_head()
    bpy.ops.object.shade_smooth()
    bpy.ops.hairloom.grow(method="normals", lift=1.0, strand_count=800, length=0.06)
    bpy.context.object.name = "Hair"
    bpy.ops.object.light_add(type="SUN", rotation=(0.9, 0.3, 0.0))
    bpy.context.object.name = "Sun"
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    scene = bpy.context.scene
    scene.render.engine = "HAIRLOOM"
    scene.render.dither_intensity = 0.0
    scene.view_settings.view_transform = "AgX"
    scene.hairloom.picture.samples = scene.hairloom.picture.viewport_samples = SAMPLES
    space = viewport().spaces.active
    space.overlay.show_overlays = False
    space.show_gizmo = False
    space.shading.type = "RENDERED"
    look_from_front(0.7)
    yield from open_our_sidebar()


def it_gets_better_and_rests():
    yield from settled()
    first = pixels("rendered")
    assert first.std() > 0.05, "nothing is seen in Rendered mode"
    yield
    np.testing.assert_array_equal(first, pixels("rendered_later"))
    assert is_finished()


def it_is_what_f12_gives():
    """The viewport equals F12, through a camera whose frame fills the view."""
    space, main = viewport().spaces.active, region("WINDOW")
    camera = bpy.data.objects.new("Viewer", bpy.data.cameras.new("Viewer"))
    bpy.context.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0.0, -0.75, 0.0), (np.pi / 2.0, 0.0, 0.0)
    camera.data.sensor_width = 72.0
    camera.data.clip_start = 0.01
    scene = bpy.context.scene
    scene.camera = camera
    render = scene.render
    render.resolution_x, render.resolution_y = main.width, main.height
    render.resolution_percentage = 100
    space.region_3d.view_perspective = "CAMERA"
    space.region_3d.view_camera_zoom = 50.0 * (2.0 - np.sqrt(2.0))
    yield from settled()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    of_camera = camera.calc_matrix_camera(depsgraph, x=main.width, y=main.height)
    np.testing.assert_allclose(of_camera, space.region_3d.window_matrix, atol=1e-5)
    shown = pixels("beside_f12")
    path = Path(bpy.app.tempdir) / "f12.png"
    render.filepath, render.image_settings.file_format = str(path), "PNG"
    bpy.context.preferences.view.render_display_type = "NONE"
    bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from wait_until(
        lambda: path.is_file() and not bpy.app.is_job_running("RENDER"), "F12 writes no picture"
    )
    yield
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    rendered = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(rendered)
    rendered = rendered.reshape(main.height, main.width, 4)[::-1, :, :3]
    bpy.data.images.remove(image)
    top = main.height - main.height // 2 - REACH
    left = main.width // 2 - REACH
    part = rendered[top : top + 2 * REACH, left : left + 2 * REACH]
    difference = 255.0 * np.abs(part - shown)
    print(f"Rendered mode against F12: {difference.max():.2f} / 255 at most")
    assert difference.max() < 1.5


def a_region_alone_is_drawn():
    """The lower left quarter of the camera's frame, which is also that of the view; then all
    again."""
    yield from settled()  # F12 lets the view begin again
    whole, render, size = pixels("whole"), bpy.context.scene.render, view()._picture.size
    render.border_min_x = render.border_min_y = 0.0
    render.border_max_x = render.border_max_y = 0.5
    render.use_border = True
    yield from wait_until(lambda: view()._picture.size != size, "the region is not taken over")
    yield from settled()
    part = pixels("region")
    inside = np.s_[REACH + 2 :, : REACH - 2]
    difference = 255.0 * np.abs(part - whole)[inside]
    print(f"a region against the whole: {difference.max():.2f} / 255 at most")
    # single pixels, in which another hair represents all, differ more
    assert np.quantile(difference, 0.999) < 1.5 and difference.max() < 9.0
    outside = part[: REACH - 2, REACH + 2 :]
    assert np.ptp(outside, axis=(0, 1)).max() < 0.02, "something is drawn beyond the region"
    assert np.ptp(whole[: REACH - 2, REACH + 2 :], axis=(0, 1)).max() > 0.1
    render.use_border = False
    yield from wait_until(lambda: view()._picture.size == size, "the region is not let go of")
    yield from settled()
    assert np.abs(pixels("whole_again") - whole).max() < 1.5 / 255.0


def it_begins_anew_at_a_change():
    before = pixels("before_the_sun_moves")
    bpy.data.objects["Sun"].rotation_euler = (-0.9, 0.3, 0.0)
    yield from settled()
    after = pixels("the_sun_has_moved")
    assert np.abs(after - before).max() > 0.1, "the picture does not follow the sun"


def hair_plays_in_it():
    yield from click(*sidebar_button("hairloom.preview"))
    overlay = hairloom_module("overlay")
    yield from wait_until(lambda: bool(overlay.drawn_uids()), "the preview does not start")
    yield from settled()
    at_rest = pixels("previewed")
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(
        lambda: np.abs(pixels("played") - at_rest).max() > 0.1, "the hair does not move"
    )
    drawn = [overlay.statistics_of(uid).strands for uid in overlay.drawn_uids()]
    assert drawn == [0], "the overlay draws the hair a second time"
    yield from click(*sidebar_button("hairloom.pause"))
    yield from wait_until(is_finished, "paused hair does not come to rest")


driver.play_session(steps())
