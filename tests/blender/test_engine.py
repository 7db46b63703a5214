"""The render engine in the background: pictures, passes, and what an artist may throw at it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

pytestmark = pytest.mark.usefixtures("gpu_context", "extension")

SIZE = 64


@pytest.fixture
def stage(extension: None) -> Any:
    """A scene with a camera 1 m in front of the origin, rendered by our engine."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -1.0, 0.0), (np.pi / 2.0, 0.0, 0.0)
    camera.data.clip_start = 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("World")
    set_world((0.5, 0.5, 0.5))
    render = scene.render
    render.engine = "HAIRLOOM"
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.dither_intensity = 0.0
    scene.hairloom.picture.samples = 4
    return scene


def set_world(color: tuple[float, float, float]) -> None:
    world = bpy.context.scene.world
    world.node_tree.nodes.clear()
    background = world.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*color, 1.0)


def add_ball(radius: float = 0.15, color: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=48, ring_count=24)
    ball = bpy.context.object
    material = bpy.data.materials.new("Diffuse")
    material.node_tree.nodes.clear()
    diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1.0)
    ball.data.materials.append(material)
    return ball


def rendered(folder: Path) -> dict[str, np.ndarray]:
    """Render, and read back all passes, see `passes_in`."""
    scene = bpy.context.scene
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth = "32"
    path = folder / "picture.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return passes_in(path) if path.is_file() else {}


def passes_in(path: Path) -> dict[str, np.ndarray]:
    """Name -> (height, width, channels), row 0 at the bottom."""
    import OpenImageIO

    found = {}
    file = OpenImageIO.ImageInput.open(str(path))
    while file.seek_subimage(len(found), 0):
        spec = file.spec()
        pixels = file.read_image(len(found), 0, 0, spec.nchannels, "float")
        found[spec.channelnames[0].rpartition(".")[0]] = pixels[::-1]
    file.close()
    return found


def picture(folder: Path) -> np.ndarray:
    return rendered(folder)["ViewLayer.Combined"]


def test_radiance_arrives_as_it_is(stage: Any, tmp_path: Path) -> None:
    """A white diffuse ball in a world of 0.5 shines as that world does."""
    add_ball()
    found = picture(tmp_path)
    assert found.shape == (SIZE, SIZE, 4)
    np.testing.assert_allclose(found, np.full((SIZE, SIZE, 4), (0.5, 0.5, 0.5, 1.0)), atol=1e-6)


@pytest.mark.parametrize("transform", ["Standard", "AgX"])
def test_radiance_is_shown_as_blender_shows_it(stage: Any, tmp_path: Path, transform: str) -> None:
    """What is saved is what Blender makes of an image of this very radiance."""
    stage.view_settings.view_transform = transform
    settings = stage.render.image_settings
    settings.file_format, settings.color_depth = "PNG", "16"
    stage.render.filepath = str(tmp_path / "rendered.png")
    bpy.ops.render.render(write_still=True)
    plain = bpy.data.images.new("Plain", SIZE, SIZE, float_buffer=True)
    plain.pixels.foreach_set([0.5, 0.5, 0.5, 1.0] * (SIZE * SIZE))
    plain.save_render(str(tmp_path / "plain.png"), scene=stage)
    shown = [coded(tmp_path / f"{name}.png") for name in ("rendered", "plain")]
    np.testing.assert_array_equal(*shown)
    assert 160 < 255.0 * shown[0].mean() < 190


def coded(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(*image.size[::-1], 4)[..., :3]


def test_hair_is_drawn_and_two_renders_are_the_same(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    bald = picture(tmp_path)
    hair = new_hair(sphere)
    hair.data.hairloom.strands.width_scale = 20.0
    first, second = picture(tmp_path), picture(tmp_path)
    np.testing.assert_array_equal(first, second)
    assert (np.abs(first - bald)[..., :3].max(axis=2) > 0.05).mean() > 0.01


def test_mesh_depth_and_coverage_are_those_of_workbench(stage: Any, tmp_path: Path) -> None:
    """Of a ball before a cube, in a picture that is not square, through a shifted lens."""
    add_ball()
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0.1, 0.2, 0.05), rotation=(0.3, 0.4, 0.5))
    render, camera = stage.render, stage.camera.data
    render.resolution_x, render.resolution_y, render.pixel_aspect_x = 400, 300, 1.2
    camera.shift_x, camera.shift_y = 0.05, -0.08
    render.film_transparent = True
    stage.view_layers[0].use_pass_z = True
    stage.hairloom.picture.samples = 1
    stage.display.render_aa = "OFF"
    for kind in ("PERSP", "ORTHO"):
        camera.type, camera.ortho_scale = kind, 0.8
        found = {}
        for engine in ("HAIRLOOM", "BLENDER_WORKBENCH"):
            render.engine = engine
            found[engine] = rendered(tmp_path)
        ours, theirs = found.values()
        depths = [each["ViewLayer.Depth"][..., 0] for each in (ours, theirs)]
        is_there = [depth < 1.0e4 for depth in depths]
        assert 0.1 < is_there[0].mean() < 0.9
        differs = np.abs(depths[0] - depths[1]) > 1.0e-3
        assert differs.mean() < 0.001, kind
        alphas = [each["ViewLayer.Combined"][..., 3] for each in (ours, theirs)]
        assert (np.abs(alphas[0] - alphas[1]) > 0.5).mean() < 0.001, kind


def test_depth_and_object_index_of_hair(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.strands.width_scale = 20.0
    sphere.pass_index, hair.pass_index = 3, 7
    layer = stage.view_layers[0]
    layer.use_pass_z = layer.use_pass_object_index = True
    found = rendered(tmp_path)
    numbers = found["ViewLayer.Object Index"][..., 0]
    assert set(np.unique(numbers)) == {0.0, 3.0, 7.0}
    depth = found["ViewLayer.Depth"][..., 0]
    assert 0.88 < depth[numbers == 3.0].min() < 0.92
    assert 0.8 < depth[numbers == 7.0].min() < 0.9
    assert (depth[numbers == 0.0] == 1.0e10).all()


def test_border_percentage_and_film(stage: Any, tmp_path: Path) -> None:
    """A region is that region of the whole picture, cropped to it or not."""
    add_ball(color=(0.8, 0.2, 0.1))
    stage.hairloom.picture.samples = 2
    render = stage.render
    render.film_transparent = True
    whole = picture(tmp_path)
    assert whole[0, 0, 3] == 0.0 and whole[SIZE // 2, SIZE // 2, 3] == 1.0
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    render.use_crop_to_border = True
    part = picture(tmp_path)
    assert part.shape == (SIZE // 2, SIZE // 2, 4)
    np.testing.assert_allclose(part, whole[SIZE // 2 :, SIZE // 4 : -SIZE // 4], atol=1e-4)
    render.use_border = False
    render.resolution_percentage = 50
    assert picture(tmp_path).shape == (SIZE // 2, SIZE // 2, 4)


def test_the_region_of_a_view_is_that_of_the_picture(stage: Any) -> None:
    """In a camera's view the scene's, wherever the camera's frame lies in it; else the view's."""
    from types import SimpleNamespace

    from hairloom.addon.host.engine_camera import view_rectangle

    camera, render = stage.camera, stage.render
    render.resolution_x, render.resolution_y = 200, 100
    camera.data.shift_x, camera.data.shift_y = 0.1, -0.2
    depsgraph = bpy.context.evaluated_depsgraph_get()
    # the frame is the middle of the view, half as wide and half as high
    matrix = np.array(camera.calc_matrix_camera(depsgraph, x=200, y=100))
    matrix[:2] *= 0.5
    region = SimpleNamespace(view_perspective="CAMERA", window_matrix=matrix)
    space = SimpleNamespace(camera=None, use_render_border=False)
    context = SimpleNamespace(space_data=space, region_data=region)
    assert view_rectangle(context, depsgraph, 400, 200) == (0, 0, 400, 200)
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 1.0
    render.border_min_y, render.border_max_y = 0.5, 1.0
    depsgraph.update()
    assert view_rectangle(context, depsgraph, 400, 200) == (150, 100, 150, 50)
    region.view_perspective = "PERSP"
    assert view_rectangle(context, depsgraph, 400, 200) == (0, 0, 400, 200)
    space.use_render_border = True
    space.render_border_min_x, space.render_border_max_x = 0.0, 0.5
    space.render_border_min_y, space.render_border_max_y = 0.25, 0.25
    assert view_rectangle(context, depsgraph, 400, 200) == (0, 50, 200, 0)


def test_view_layers_and_holdouts(stage: Any, tmp_path: Path) -> None:
    """Each layer has what is in it; a holdout is a hole."""
    stage.render.film_transparent = True
    collections = [bpy.data.collections.new(name) for name in ("One", "Two")]
    for collection, x in zip(collections, (-0.15, 0.15), strict=True):
        stage.collection.children.link(collection)
        ball = add_ball(0.1)
        ball.location.x = x
        stage.collection.objects.unlink(ball)
        collection.objects.link(ball)
    second = stage.view_layers.new("Second")
    second.layer_collection.children["One"].exclude = True
    third = stage.view_layers.new("Third")
    third.layer_collection.children["One"].holdout = True
    found = rendered(tmp_path)
    covered = {
        name: (
            found[f"{name}.Combined"][:, : SIZE // 2, 3].max(),
            found[f"{name}.Combined"][:, SIZE // 2 :, 3].max(),
        )
        for name in ("ViewLayer", "Second", "Third")
    }
    assert covered == {"ViewLayer": (1.0, 1.0), "Second": (0.0, 1.0), "Third": (0.0, 1.0)}


@pytest.mark.parametrize("way", ["none", "hashed", "layers"])
def test_hair_may_be_a_hole(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path, way: str
) -> None:
    """Before a wall it takes as much away as it covers alone; meshes before it stay."""
    stage.render.film_transparent = True
    stage.hairloom.picture.samples = 16
    hair = new_hair(sphere)
    hair.data.hairloom.strands.width_scale = 60.0
    hair.data.hairloom.strands.transparency = way
    hair.data.hairloom.strands.opacity = 0.7
    bpy.data.objects.remove(sphere)
    alone = picture(tmp_path)[..., 3]
    assert alone.max() > 0.1 and 0.005 < alone.mean() < 0.9
    wall = add_ball(1.5)
    wall.location.y = 2.0
    assert picture(tmp_path)[..., 3].min() > 0.99
    hair.is_holdout = True
    np.testing.assert_allclose(picture(tmp_path)[..., 3], 1.0 - alone, atol=2e-3)
    wall.location.y, wall.scale = -0.6, (0.1,) * 3
    assert picture(tmp_path)[SIZE // 2, SIZE // 2, 3] == 1.0
    hair.is_holdout = False
    bpy.data.objects.remove(wall)
    apart = bpy.data.collections.new("Apart")
    stage.collection.children.link(apart)
    stage.collection.objects.unlink(hair)
    apart.objects.link(hair)
    assert picture(tmp_path)[..., 3].max() > 0.1
    stage.view_layers[0].layer_collection.children["Apart"].indirect_only = True
    assert picture(tmp_path)[..., 3].max() == 0.0


def test_previewed_hair_is_seen_as_its_object_is(
    stage: Any, new_hair: Callable[..., Any], sphere: Any
) -> None:
    """The reader leaves it out and says how it takes part, whatever a preview wrote to the copy."""
    from hairloom.addon.host.engine_scene import SceneReader

    hair, reader = new_hair(sphere), SceneReader()
    hair.is_holdout = True
    depsgraph = bpy.context.evaluated_depsgraph_get()
    hair.evaluated_get(depsgraph).visible_camera = False
    assert not reader.read(depsgraph, is_previewed=lambda _: True).grooms
    found = reader.previewed[hair.session_uid]
    assert (found.is_seen, found.is_holdout) == (True, True)
    hair.visible_camera, hair.is_holdout = False, False
    reader.read(bpy.context.evaluated_depsgraph_get(), is_previewed=lambda _: True)
    found = reader.previewed[hair.session_uid]
    assert (found.is_seen, found.is_holdout) == (False, False)


def test_texts_metaballs_and_instances_are_drawn(stage: Any, tmp_path: Path) -> None:
    stage.render.film_transparent = True
    add: list[Callable[[], Any]] = [
        lambda: bpy.ops.object.text_add(rotation=(np.pi / 2.0, 0.0, 0.0), scale=(0.3,) * 3),
        lambda: bpy.ops.object.metaball_add(radius=0.1),
        lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(radius=0.1),
    ]
    for each in add:
        each()
        assert picture(tmp_path)[..., 3].mean() > 0.01
        bpy.data.objects.remove(bpy.context.object)
    inside = bpy.data.collections.new("Inside")
    ball = add_ball(0.05)
    stage.collection.objects.unlink(ball)
    inside.objects.link(ball)
    assert picture(tmp_path)[..., 3].max() == 0.0
    for x in (-0.1, 0.1):
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.location.x = x
        stage.collection.objects.link(empty)
    alpha = picture(tmp_path)[SIZE // 2, :, 3]
    assert np.count_nonzero(np.diff((alpha > 0.5).astype(int))) == 4


def test_hidden_in_renders_is_not_drawn(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    stage.render.film_transparent = True
    hair = new_hair(sphere)
    sphere.hide_render = True
    hair.data.hairloom.strands.width_scale = 20.0
    assert picture(tmp_path)[..., 3].max() > 0.5
    hair.visible_camera = False
    assert picture(tmp_path)[..., 3].max() == 0.0
    hair.visible_camera, hair.hide_render = True, True
    assert picture(tmp_path)[..., 3].max() == 0.0


def test_motion_blur_spreads_over_the_way(stage: Any, tmp_path: Path) -> None:
    """A ball that flies by is as dense in each place as it is long there, and loses nothing."""
    stage.render.film_transparent = True
    stage.hairloom.picture.samples = stage.hairloom.picture.motion_steps = 16
    ball = add_ball(0.05)
    for frame, x in ((1, -0.2), (3, 0.2)):
        ball.location.x = x
        ball.keyframe_insert("location", frame=frame)
    for curve in curves_of(ball):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    stage.frame_set(2)
    sharp = picture(tmp_path)[..., 3]
    stage.render.use_motion_blur, stage.render.motion_blur_shutter = True, 1.0
    blurred = picture(tmp_path)[..., 3]
    assert abs(blurred.sum() / sharp.sum() - 1.0) < 0.02
    columns = [np.flatnonzero(each.max(axis=0) > 0.02) for each in (sharp, blurred)]
    width = [each[-1] - each[0] for each in columns]
    # 0.2 m in a frame, seen from 1 m by a lens that sees 0.72 m
    assert abs(width[1] - width[0] - 0.2 / 0.72 * SIZE) < 2.0
    assert stage.frame_current == 2 and stage.frame_subframe == 0.0


def curves_of(obj: Any) -> Iterator[Any]:
    for layer in obj.animation_data.action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def test_bad_input_is_told(stage: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    stage.world = None
    assert picture(tmp_path)[..., :3].max() == 0.0
    assert "Lights: no light shines here" in capfd.readouterr().out
    stage.camera.data.type = "PANO"
    picture(tmp_path)
    assert "panoramic cameras are not drawn" in capfd.readouterr().out
    render = stage.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 0.501
    with pytest.raises(RuntimeError, match=r"too small|pixels"):
        bpy.ops.render.render()
    render.use_border = False
    stage.camera = None
    with pytest.raises(RuntimeError, match=r"(?i)camera"):
        bpy.ops.render.render()


def test_the_camera_may_be_inside_of_hair_and_head(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    new_hair(sphere)
    for y in (-0.12, 0.0):
        stage.camera.location.y = y
        found = picture(tmp_path)
        assert np.isfinite(found).all() and found[..., 3].min() > 0.99


@pytest.mark.skipif(
    not (sys.platform.startswith("linux") and bpy.app.module), reason="hides Linux's drivers"
)
def test_without_a_gpu_driver_it_says_so_and_does_not_crash() -> None:
    hidden = ("__EGL_VENDOR_LIBRARY_FILENAMES", "VK_DRIVER_FILES", "LIBGL_DRIVERS_PATH")
    script = NO_GPU.format(tools=str(Path(__file__).parents[2] / "tools"))
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | dict.fromkeys(hidden, "/nowhere"),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "there is no GPU here" in done.stdout


NO_GPU = """
import sys
sys.path.insert(0, {tools!r})
from extension_loader import load_package
import bpy
load_package().register()
bpy.context.scene.render.engine = "HAIRLOOM"
try:
    bpy.ops.render.render()
except RuntimeError as error:
    print(error)
"""


def test_panels_serve_the_engine_and_let_go(empty_scene: None) -> None:
    import hairloom

    def serving() -> list[str]:
        found, waiting = [], list(bpy.types.Panel.__subclasses__())
        while waiting:
            panel = waiting.pop()
            waiting += panel.__subclasses__()
            if "HAIRLOOM" in getattr(panel, "COMPAT_ENGINES", ()):
                found.append(panel.__name__)
        return found

    names = serving()
    assert {"RENDER_PT_format", "DATA_PT_light", "VIEWLAYER_PT_layer_passes"} & set(names)
    hairloom.unregister()
    try:
        for _ in range(10):
            assert serving() == []
            hairloom.register()
            assert sorted(serving()) == sorted(names)
            hairloom.unregister()
        assert not hasattr(bpy.types, "HAIRLOOM_RE_engine")
    finally:
        hairloom.register()


def test_a_cancelled_render_keeps_what_there_is(
    stage: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two samples of 64 are a whole picture."""
    from hairloom.addon.host import engine

    add_ball()
    stage.hairloom.picture.samples = 2
    two = picture(tmp_path)
    asked = iter(range(100))
    monkeypatch.setattr(
        engine.HAIRLOOM_RE_engine, "test_break", lambda _: next(asked) >= 2, raising=False
    )
    stage.hairloom.picture.samples = 64
    np.testing.assert_allclose(picture(tmp_path), two, atol=1e-6)
    assert next(asked) < 10


def test_both_eyes_of_a_stereo_camera(stage: Any, tmp_path: Path) -> None:
    stage.render.film_transparent = True
    add_ball(0.05)
    stage.render.use_multiview = True
    stage.camera.data.stereo.interocular_distance = 0.1
    stage.camera.data.stereo.convergence_distance = 2.0
    rendered(tmp_path)
    eyes = [passes_in(tmp_path / f"picture_{side}.exr") for side in "LR"]
    alphas = [found["ViewLayer.Combined"][..., 3] for found in eyes]
    places = [np.average(np.arange(SIZE), weights=alpha.sum(axis=0)) for alpha in alphas]
    # parallax of a point at 1 m, whose eyes meet at 2 m, through a lens that sees 0.72 m there
    assert abs(abs(places[0] - places[1]) - 0.05 / 0.72 * SIZE) < 0.3


def test_hair_is_rendered_as_it_was_baked(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    """Frames and moments between them, although the curves themselves are hidden then."""
    from hairloom.addon.host import engine_hair, playback

    hair = new_hair(sphere)
    stage.frame_start, stage.frame_end = 1, 4
    for frame, x in ((1, -0.2), (4, 0.2)):
        sphere.location.x = x
        sphere.keyframe_insert("location", frame=frame)
    hair.hairloom.dynamics.form = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.pass_index = 5
    stage.frame_set(1)
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    assert hair.hide_render and hair.hairloom.bake.copy is not None
    copy = hair.hairloom.bake.copy
    for frame, subframe in ((2, 0.0), (2, 0.25)):
        stage.frame_set(frame, subframe=subframe)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        expected = playback.strands_in(playback.cache_of(hair), frame, subframe)
        for obj in (copy, hair):
            found = engine_hair.read_groom(obj, depsgraph)
            np.testing.assert_array_equal(found.strands, expected)
    stage.view_layers[0].use_pass_object_index = True
    hair.data.hairloom.strands.width_scale = 20.0
    numbers = rendered(tmp_path)["ViewLayer.Object Index"]
    assert (numbers == 5.0).any()


def test_animated_settings_are_those_of_the_frame(
    stage: Any, new_hair: Callable[..., Any], sphere: Any
) -> None:
    from hairloom.addon.host import engine_hair

    hair = new_hair(sphere)
    strands = hair.data.hairloom.strands
    for frame, width in ((1, 1.0), (3, 5.0)):
        strands.width_scale = width
        hair.data.keyframe_insert("hairloom.strands.width_scale", frame=frame)
    stage.frame_set(3)
    found = engine_hair.read_groom(hair, bpy.context.evaluated_depsgraph_get())
    assert found.strand_settings.width_scale == 5.0
