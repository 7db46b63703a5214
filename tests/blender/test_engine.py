"""The render engine in background mode: pictures, passes, and Blender's calls to engines."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from swinging import key_x
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import (  # noqa: E402
    SIZE,
    add_ball,
    read_encoded_pixels,
    read_passes,
    render_passes,
    render_picture,
)

from hairloom.addon.blender.engine import engine_view  # noqa: E402
from hairloom.addon.render import gpu_objects  # noqa: E402

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context", "extension")]


def test_radiance_is_written_unchanged(engine_scene: Any, tmp_path: Path) -> None:
    """A white diffuse ball in a uniform world of radiance 0.5 has radiance 0.5."""
    add_ball()
    found = render_picture(tmp_path)
    assert found.shape == (SIZE, SIZE, 4)
    np.testing.assert_allclose(found, np.full((SIZE, SIZE, 4), (0.5, 0.5, 0.5, 1.0)), atol=1e-6)


@pytest.mark.parametrize("transform", ["Standard", "AgX"])
def test_radiance_is_shown_as_blender_shows_it(
    engine_scene: Any, tmp_path: Path, transform: str
) -> None:
    """The saved file equals that of a Blender image with the same radiance."""
    engine_scene.view_settings.view_transform = transform
    settings = engine_scene.render.image_settings
    settings.file_format, settings.color_depth = "PNG", "16"
    engine_scene.render.filepath = str(tmp_path / "rendered.png")
    bpy.ops.render.render(write_still=True)
    plain = bpy.data.images.new("Plain", SIZE, SIZE, float_buffer=True)
    plain.pixels.foreach_set([0.5, 0.5, 0.5, 1.0] * (SIZE * SIZE))
    plain.save_render(str(tmp_path / "plain.png"), scene=engine_scene)
    shown = [read_encoded_pixels(tmp_path / f"{name}.png") for name in ("rendered", "plain")]
    np.testing.assert_array_equal(*shown)
    assert 160 < 255.0 * shown[0].mean() < 190


def test_hair_is_drawn_and_two_renders_are_the_same(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    bald = render_picture(tmp_path)
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 20.0
    first, second = render_picture(tmp_path), render_picture(tmp_path)
    np.testing.assert_array_equal(first, second)
    assert (np.abs(first - bald)[..., :3].max(axis=2) > 0.05).mean() > 0.01


def test_mesh_depth_and_coverage_are_those_of_workbench(engine_scene: Any, tmp_path: Path) -> None:
    """A ball in front of a cube agrees with Workbench, with non-square pixels and lens shift."""
    add_ball()
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0.1, 0.2, 0.05), rotation=(0.3, 0.4, 0.5))
    render, camera = engine_scene.render, engine_scene.camera.data
    render.resolution_x, render.resolution_y, render.pixel_aspect_x = 400, 300, 1.2
    camera.shift_x, camera.shift_y = 0.05, -0.08
    render.film_transparent = True
    engine_scene.view_layers[0].use_pass_z = True
    engine_scene.hairloom.picture.samples = 1
    engine_scene.display.render_aa = "OFF"
    for kind in ("PERSP", "ORTHO"):
        camera.type, camera.ortho_scale = kind, 0.8
        found = {}
        for engine in ("HAIRLOOM", "BLENDER_WORKBENCH"):
            render.engine = engine
            found[engine] = render_passes(tmp_path)
        ours, theirs = found.values()
        depths = [each["ViewLayer.Depth"][..., 0] for each in (ours, theirs)]
        is_there = [depth < 1.0e4 for depth in depths]
        assert 0.1 < is_there[0].mean() < 0.9
        differs = np.abs(depths[0] - depths[1]) > 1.0e-3
        assert differs.mean() < 0.001, kind
        alphas = [each["ViewLayer.Combined"][..., 3] for each in (ours, theirs)]
        assert (np.abs(alphas[0] - alphas[1]) > 0.5).mean() < 0.001, kind


def test_depth_and_object_index_of_hair(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 20.0
    sphere.pass_index, hair.pass_index = 3, 7
    layer = engine_scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_object_index = True
    found = render_passes(tmp_path)
    numbers = found["ViewLayer.Object Index"][..., 0]
    assert set(np.unique(numbers)) == {0.0, 3.0, 7.0}
    depth = found["ViewLayer.Depth"][..., 0]
    assert 0.88 < depth[numbers == 3.0].min() < 0.92
    assert 0.8 < depth[numbers == 7.0].min() < 0.9
    assert (depth[numbers == 0.0] == 1.0e10).all()


def test_border_percentage_and_film(engine_scene: Any, tmp_path: Path) -> None:
    """A border gives the same part of the whole picture, and resolution follows the percentage."""
    add_ball(color=(0.8, 0.2, 0.1))
    engine_scene.hairloom.picture.samples = 2
    render = engine_scene.render
    render.film_transparent = True
    whole = render_picture(tmp_path)
    assert whole[0, 0, 3] == 0.0 and whole[SIZE // 2, SIZE // 2, 3] == 1.0
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    render.use_crop_to_border = True
    part = render_picture(tmp_path)
    assert part.shape == (SIZE // 2, SIZE // 2, 4)
    np.testing.assert_allclose(part, whole[SIZE // 2 :, SIZE // 4 : -SIZE // 4], atol=1e-4)
    render.use_border = False
    render.resolution_percentage = 50
    assert render_picture(tmp_path).shape == (SIZE // 2, SIZE // 2, 4)


def test_the_region_of_a_view_is_that_of_the_picture(engine_scene: Any) -> None:
    """In a camera view it is the scene's border in the camera's frame, else the view's border."""
    from types import SimpleNamespace

    from hairloom.addon.blender.engine.engine_camera import view_rectangle

    camera, render = engine_scene.camera, engine_scene.render
    render.resolution_x, render.resolution_y = 200, 100
    camera.data.shift_x, camera.data.shift_y = 0.1, -0.2
    depsgraph = bpy.context.evaluated_depsgraph_get()
    # the camera's frame covers the middle of the view, half its width and height
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


def test_motion_blur_spreads_along_the_motion(engine_scene: Any, tmp_path: Path) -> None:
    """The blurred alpha has the same sum, and is as much wider as the ball moves in a frame."""
    engine_scene.render.film_transparent = True
    engine_scene.hairloom.picture.samples = engine_scene.hairloom.picture.motion_steps = 16
    ball = add_ball(0.05)
    key_x(ball, {1: -0.2, 3: 0.2})
    for curve in curves_of(ball):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    engine_scene.frame_set(2)
    sharp = render_picture(tmp_path)[..., 3]
    engine_scene.render.use_motion_blur, engine_scene.render.motion_blur_shutter = True, 1.0
    blurred = render_picture(tmp_path)[..., 3]
    assert abs(blurred.sum() / sharp.sum() - 1.0) < 0.02
    columns = [np.flatnonzero(each.max(axis=0) > 0.02) for each in (sharp, blurred)]
    width = [each[-1] - each[0] for each in columns]
    # 0.2 m in a frame, seen from 1 m, where the lens covers 0.72 m
    assert abs(width[1] - width[0] - 0.2 / 0.72 * SIZE) < 2.0
    assert engine_scene.frame_current == 2 and engine_scene.frame_subframe == 0.0


def test_stretched_time_is_stretched_once(engine_scene: Any, tmp_path: Path) -> None:
    """Time remapping is applied once: a very short shutter gives the picture without blur."""
    engine_scene.hairloom.picture.samples = engine_scene.hairloom.picture.motion_steps = 2
    ball = add_ball(0.05)
    key_x(ball, {1: -0.2, 21: 0.2})
    engine_scene.render.frame_map_old, engine_scene.render.frame_map_new = 100, 200
    engine_scene.frame_set(20)
    engine_scene.render.film_transparent = True
    sharp = render_picture(tmp_path)[..., 3]
    engine_scene.render.use_motion_blur, engine_scene.render.motion_blur_shutter = True, 0.01
    assert sharp.any(), "there is a ball"
    np.testing.assert_allclose(render_picture(tmp_path)[..., 3], sharp, atol=0.02)


@pytest.mark.parametrize("kind", ["nothing", "empty"])
def test_without_a_camera_the_report_says_so(engine_scene: Any, tmp_path: Path, kind: str) -> None:
    engine_scene.camera = None if kind == "nothing" else bpy.data.objects.new("Empty", None)
    with pytest.raises(RuntimeError, match="camera"):
        render_passes(tmp_path)


def curves_of(obj: Any) -> Iterator[Any]:
    for layer in obj.animation_data.action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def test_panels_support_the_engine_only_while_registered(empty_scene: None) -> None:
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


def test_a_cancelled_render_keeps_its_samples(
    engine_scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cancelled after two of 64 samples, the picture equals one of two samples."""
    from hairloom.addon.blender.engine import engine

    add_ball()
    engine_scene.hairloom.picture.samples = 2
    two = render_picture(tmp_path)
    asked = iter(range(100))
    monkeypatch.setattr(
        engine.HAIRLOOM_RE_engine, "test_break", lambda _: next(asked) >= 2, raising=False
    )
    engine_scene.hairloom.picture.samples = 64
    np.testing.assert_allclose(render_picture(tmp_path), two, atol=1e-6)
    assert next(asked) < 10


def test_both_eyes_of_a_stereo_camera(engine_scene: Any, tmp_path: Path) -> None:
    engine_scene.render.film_transparent = True
    add_ball(0.05)
    engine_scene.render.use_multiview = True
    engine_scene.camera.data.stereo.interocular_distance = 0.1
    engine_scene.camera.data.stereo.convergence_distance = 2.0
    render_passes(tmp_path)
    eyes = [read_passes(tmp_path / f"picture_{side}.exr") for side in "LR"]
    alphas = [found["ViewLayer.Combined"][..., 3] for found in eyes]
    places = [np.average(np.arange(SIZE), weights=alpha.sum(axis=0)) for alpha in alphas]
    # parallax of a point at 1 m, with convergence at 2 m, where the lens covers 0.72 m at 1 m
    assert abs(abs(places[0] - places[1]) - 0.05 / 0.72 * SIZE) < 0.3


@pytest.mark.parametrize(
    "aperture", few_in_commits(["circle", "three blades", "narrow", "orthographic"])
)
def test_depth_of_field_blurs_as_in_cycles(
    engine_scene: Any, tmp_path: Path, aperture: str
) -> None:
    """A ball, focused on an object behind it, covers as much of each pixel as in Cycles."""
    add_ball(0.08)
    target = bpy.data.objects.new("Target", None)
    target.location = (0.7, 1.5, 0.0)
    engine_scene.collection.objects.link(target)
    dof = engine_scene.camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_object = True, 0.5, target
    if aperture == "three blades":
        dof.aperture_blades, dof.aperture_rotation = 3, 0.5
    if aperture == "narrow":
        dof.aperture_ratio = 2.0
    if aperture == "orthographic":
        engine_scene.camera.data.type, engine_scene.camera.data.ortho_scale = "ORTHO", 0.6
        dof.aperture_fstop = 8.0
    engine_scene.render.film_transparent = True
    engine_scene.hairloom.picture.samples = 256
    ours = render_picture(tmp_path)[..., 3]
    engine_scene.render.engine, engine_scene.cycles.samples = "CYCLES", 1024
    engine_scene.cycles.use_denoising = engine_scene.cycles.use_adaptive_sampling = False
    theirs = render_picture(tmp_path)[..., 3]
    assert ((theirs > 0.05) & (theirs < 0.95)).mean() > 0.02
    difference = np.abs(ours - theirs)
    # blades that turn the other way differ by 0.0017 and 0.057
    assert difference.mean() < 0.001 and np.quantile(difference, 0.99) < 0.03


def test_a_cancelled_motion_blur_render_changes_no_frame(
    engine_scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.blender.engine import engine
    from hairloom.addon.blender.engine.engine_still import Still

    class Cancelled:
        """An engine that is cancelled after two samples."""

        def __init__(self, own: Any) -> None:
            self.own, self.asked, self.places = own, 0, list[float]()
            cancelled.append(self)

        def __getattr__(self, name: str) -> Any:
            return getattr(self.own, name)

        def test_break(self) -> bool:
            self.asked += 1
            return self.asked > 4

        def frame_set(self, frame: int, subframe: float) -> None:
            self.places.append(frame + subframe)
            self.own.frame_set(frame, subframe=subframe)

    cancelled: list[Cancelled] = []
    monkeypatch.setattr(engine, "Still", lambda own, depsgraph: Still(Cancelled(own), depsgraph))
    add_ball()
    engine_scene.render.use_motion_blur = True
    engine_scene.hairloom.picture.samples = engine_scene.hairloom.picture.motion_steps = 32
    render_picture(tmp_path)
    (found,) = cancelled
    assert len(found.places) == 3, "two moments, and back"
    assert found.places[-1] == engine_scene.frame_current


def test_a_render_leaves_nothing_unused_on_the_gpu(engine_scene: Any, tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cube_add(size=0.2)
    gc.collect()  # other tests may have left reference cycles
    gpu_objects.free_unused()
    render_passes(tmp_path)
    left = gpu_objects.bytes_in_use()
    gc.collect()
    gpu_objects.free_unused()
    assert gpu_objects.bytes_in_use() == left


def test_gpu_memory_of_a_view_is_freed_when_it_leaves_rendered_mode(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[bool] = []
    monkeypatch.setattr(engine_view, "schedule_free_unused", lambda: asked.append(True))
    view = engine_view.EngineView()
    assert not asked
    del view
    gc.collect()
    assert asked
