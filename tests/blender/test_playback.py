"""Bakes in renders: a render shows what was baked, in this process and in a new one."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from grids import baked_grid, strand_grid
from swinging import key_x
from tiers import few_in_commits
from undoing import undo

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake, is_bakeable, simulation_for
from hairloom.addon.blender.scene.fin_modifier import POSITION, add_modifier

LAST = 6
SIZE = 64
#: renders frames of a file as an artist's Blender does, with the extension enabled
RENDER = """
import sys
sys.path.insert(0, {tools!r})
from extension_loader import load_package
import bpy
load_package().register()
bpy.ops.wm.open_mainfile(filepath={file!r})
scene = bpy.context.scene
scene.frame_start, scene.frame_end = 2, {last}
bpy.ops.render.render(animation=True)
"""


@pytest.fixture
def scene(new_hair, sphere, tmp_path):
    """Thick hair that moves to the right, seen from the front; its head is hidden."""
    new_hair(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    key_x(sphere, {1: -0.2, LAST: 0.2})
    sphere.hide_render = True
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.8
    camera.location, camera.rotation_euler.x = (0.0, -2.0, 0.0), np.pi / 2.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler.x = 10.0, 1.0
    scene.collection.objects.link(sun)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = False
    scene.render.film_transparent = True
    scene.render.filepath = str(tmp_path / "pictures" / "still_")
    hair = bpy.data.objects["Hair"]
    hair.data.attributes["radius"].data.foreach_set("value", np.full(480, 0.004, np.float32))
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    return scene


def in_another_blender(script, folder):
    """The command that runs a script in a new process of the same Blender."""
    if bpy.app.module:
        return [sys.executable, "-c", script]
    file = folder / "script.py"
    file.write_text(script, encoding="utf-8")
    start = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1"]
    return [*start, "--python", str(file)]


def coverage(path):
    """The alpha of a picture, (SIZE, SIZE), row 0 at the bottom."""
    picture = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty(SIZE * SIZE * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    return pixels.reshape(SIZE, SIZE, 4)[..., 3]


def expected(strands):
    """A mask, (SIZE, SIZE), 1 where the camera sees these strands pass."""
    along = np.linspace(0.0, 1.0, 64)[:, None]
    between = strands[:, :-1, None] * (1.0 - along) + strands[:, 1:, None] * along
    pixel = ((between.reshape(-1, 3)[:, [2, 0]] / 0.8 + 0.5) * SIZE).astype(int)
    mask = np.zeros((SIZE, SIZE))
    inside = ((pixel >= 0) & (pixel < SIZE)).all(axis=1)
    mask[tuple(pixel[inside].T)] = 1.0
    return mask


def shows(picture, strands):
    """Intersection over union of the picture's hair and the strands."""
    seen, wanted = picture > 0.3, expected(strands) > 0.0
    return (seen & wanted).sum() / (seen | wanted).sum()


def written(curves):
    points = np.empty((len(curves.position_data), 3), np.float32)
    curves.position_data.foreach_get("vector", points.ravel())
    return points


@pytest.mark.parametrize(
    "engine", few_in_commits(["CYCLES", "BLENDER_WORKBENCH", "BLENDER_EEVEE"], 2)
)
def test_a_render_shows_the_baked_hair_of_its_frame(engine, scene, tmp_path):
    if engine != "CYCLES":
        pytest.importorskip("gpu").init()
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    scene.render.engine = engine
    hair = bpy.data.objects["Hair"]
    cache, copy = playback.cache_of(hair), hair.hairloom.bake.copy
    assert hair.hide_render and not copy.hide_render and copy.hide_viewport
    strands = {}
    for frame in (2, 5):
        scene.frame_current = frame  # F12 shows the frame that is set, without a frame change
        scene.render.filepath = str(tmp_path / f"{engine}{frame}.png")
        bpy.ops.render.render(write_still=True)
        strands[frame] = baked_grid(cache, frame)
        np.testing.assert_array_equal(written(copy.data), strands[frame].reshape(-1, 3))
    pictures = {frame: coverage(tmp_path / f"{engine}{frame}.png") for frame in strands}
    for frame, other in ((2, 5), (5, 2)):
        assert shows(pictures[frame], strands[frame]) > 0.4
        assert shows(pictures[frame], strands[other]) < 0.3


@pytest.mark.slow(instead="test_a_render_shows_the_baked_hair_of_its_frame")
def test_a_fresh_process_renders_the_bake_of_a_saved_file(scene, tmp_path):
    bpy.data.objects["Hair"].hairloom.bake.folder = "//bake"
    file = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.hairloom.bake()
    cache = playback.cache_of(bpy.data.objects["Hair"])
    strands = [baked_grid(cache, frame) for frame in range(1, LAST + 1)]
    bpy.ops.wm.save_mainfile()
    tools = str(Path(__file__).parents[2] / "tools")
    script = RENDER.format(tools=tools, file=str(file), last=LAST)
    subprocess.run(in_another_blender(script, tmp_path), check=True, capture_output=True)
    for frame in range(2, LAST + 1):
        picture = coverage(tmp_path / "pictures" / f"still_{frame:04d}.png")
        fits = [shows(picture, each) for each in strands]
        assert np.argmax(fits) == frame - 1 and fits[frame - 1] > 0.4


def test_a_render_changes_nothing_of_what_the_viewport_shows(scene, get_depsgraph):
    bpy.ops.hairloom.bake()
    hair = bpy.data.objects["Hair"]
    session = previews.start(hair, get_depsgraph())
    scene.frame_set(4)
    before = strand_grid(session)
    bpy.ops.render.render()
    np.testing.assert_array_equal(strand_grid(session), before)
    assert previews.sessions() == (session,) and scene.frame_current == 4
    assert not playback._loaded.is_rendering


def test_motion_blur_smears_the_hair_between_two_frames(scene, tmp_path):
    """Cycles reads subframes: the blurred picture also covers the next frame's strands."""
    bpy.ops.hairloom.bake()
    cache = playback.cache_of(bpy.data.objects["Hair"])
    scene.cycles.samples = 64
    scene.render.motion_blur_shutter = 1.0
    scene.render.motion_blur_position = "START"
    scene.frame_current = 3
    pictures = []
    for is_blurred in (False, True):
        scene.render.use_motion_blur = is_blurred
        scene.render.filepath = str(tmp_path / f"blur{is_blurred}.png")
        bpy.ops.render.render(write_still=True)
        pictures.append(coverage(tmp_path / f"blur{is_blurred}.png"))
    sharp, blurred = pictures
    ends = [expected(baked_grid(cache, frame)) > 0.0 for frame in (3, 4)]
    only_later = ends[1] & ~ends[0]
    assert blurred[only_later].mean() > 2.0 * sharp[only_later].mean() + 0.05
    assert blurred.max() < 0.99 * sharp.max() or blurred[ends[0]].mean() < sharp[ends[0]].mean()


def test_strands_are_interpolated_linearly_between_frames_for_motion_blur(scene):
    bpy.ops.hairloom.bake()
    hair = bpy.data.objects["Hair"]
    cache = playback.cache_of(hair)
    here, there = (baked_grid(cache, frame) for frame in (3, 4))
    scene.frame_set(3, subframe=0.25)
    between = written(hair.hairloom.bake.copy.data).reshape(here.shape)
    assert between == pytest.approx(0.75 * here + 0.25 * there, abs=1e-6)


def test_beyond_its_frames_a_copy_shows_the_nearest(scene):
    bpy.ops.hairloom.bake()
    hair = bpy.data.objects["Hair"]
    cache, curves = playback.cache_of(hair), hair.hairloom.bake.copy.data
    for beyond, nearest in ((-3, 1), (LAST + 9, LAST)):
        scene.frame_set(beyond)
        strands = baked_grid(cache, nearest)
        np.testing.assert_array_equal(written(curves), strands.reshape(-1, 3))


def test_the_copy_has_the_look_of_the_hair(scene):
    hair = bpy.data.objects["Hair"]
    material = bpy.data.materials.new("Brown")
    hair.data.materials.append(material)
    hair.data.set_types(type="POLY")
    bpy.ops.hairloom.bake()
    copy = hair.hairloom.bake.copy
    assert list(copy.data.materials) == [material]
    assert {item.value for item in copy.data.attributes["curve_type"].data} == {1}
    assert {item.value for item in copy.data.attributes["groom_group_id"].data} == {0, 1}
    radius = [item.value for item in copy.data.attributes["radius"].data]
    assert radius == pytest.approx([0.004] * len(radius))
    assert copy.users_collection == hair.users_collection
    assert copy.data.surface is None and copy.parent is None


def test_hair_without_show_in_renders_is_rendered_as_it_stands(scene):
    hair = bpy.data.objects["Hair"]
    hair.hairloom.bake.in_renders = False
    bpy.ops.hairloom.bake()
    assert hair.hairloom.bake.copy is None and not hair.hide_render
    assert not scene.render.use_lock_interface
    hair.hairloom.bake.in_renders = True
    bpy.ops.hairloom.bake()
    assert hair.hide_render and scene.render.use_lock_interface
    hair.hairloom.bake.in_renders = False
    bpy.ops.hairloom.bake()
    assert hair.hairloom.bake.copy is None and not hair.hide_render


def test_renders_show_the_copy_to_what_its_hair_is_shown_to(scene):
    hair = bpy.data.objects["Hair"]
    hair.visible_shadow = False
    bpy.ops.hairloom.bake()
    copy = hair.hairloom.bake.copy
    assert copy.visible_camera and not copy.visible_shadow
    hair.visible_camera, hair.is_holdout = False, True
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.ops.render.render()
    assert not copy.visible_camera and copy.is_holdout


def test_a_copy_with_a_missing_bake_is_reported_once_and_stays(scene, tmp_path, capfd):
    bpy.ops.hairloom.bake()
    curves = bpy.data.objects["Hair"].hairloom.bake.copy.data
    scene.frame_set(2)
    before = written(curves)
    (tmp_path / "bake").rename(tmp_path / "elsewhere")
    for frame in (3, 4, 5):
        scene.frame_set(frame)
    np.testing.assert_array_equal(written(curves), before)
    assert capfd.readouterr().out.count("there is no bake") == 1


@pytest.fixture
def fin(extension, tmp_path):
    """A flag that is pinned at its upper edge and moves."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=6, size=0.4)
    flag = bpy.context.object
    group = flag.vertex_groups.new(name="Pins")
    group.add([v.index for v in flag.data.vertices if v.co.y > 0.19], 1.0, "REPLACE")
    flag.hairloom.fin.pin_group = "Pins"
    flag.hairloom.bake.folder = str(tmp_path / "flag")
    add_modifier(flag)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    key_x(flag, {1: 0.0, LAST: 0.3})
    scene.frame_set(1)
    return flag


def shown(flag_object):
    """The evaluated vertices, (vertex_count, 3), object space."""
    bpy.context.view_layer.update()
    mesh = flag_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.ravel())
    return positions


def test_a_baked_fin_equals_playback_and_plays_without_a_preview(fin, get_depsgraph):
    assert is_bakeable(fin)
    previews.add(simulation_for(fin, get_depsgraph()), get_depsgraph())
    frames = range(1, LAST + 1)
    played = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        played.append(shown(fin))
    assert np.abs(played[-1] - played[0]).max() > 0.02
    list(Bake.of([fin], bpy.context.scene).steps())
    previews.stop_all()
    for frame in (4, 2, 6, 1, 3, 5):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(shown(fin), played[frame - 1])
    bpy.context.scene.frame_set(LAST + 1)
    np.testing.assert_array_equal(shown(fin), played[0])
    bpy.ops.hairloom.bake_free()
    assert fin.data.attributes.get(POSITION) is None


def test_undo_leaves_a_previewed_fin_in_its_baked_shape(fin, get_depsgraph):
    list(Bake.of([fin], bpy.context.scene).steps())
    previews.add(simulation_for(fin, get_depsgraph()), get_depsgraph())
    bpy.context.scene.frame_set(4)
    baked = shown(fin)
    bpy.ops.ed.undo_push(message="baked")
    fin.hide_select = True
    bpy.ops.ed.undo_push(message="changed")
    undo()
    np.testing.assert_array_equal(shown(bpy.data.objects["Grid"]), baked)
