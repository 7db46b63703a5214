"""The scene's view transform in 3D views, and the table that reproduces it.

tests/window/session_look.py tests it in Blender's window.
"""

from __future__ import annotations

import gc
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from full_disk import full_disk
from tiers import few_in_commits

from hairloom.addon.blender.pictures.film import write_picture
from hairloom.addon.blender.viewport import view_transform
from hairloom.addon.blender.viewport.view_transform import (
    ColorView,
    apply_view_transform,
    display_of,
    view_of,
)
from hairloom.addon.errors import HairloomError
from hairloom.addon.render.display import Display, DisplayTable, table_radiances
from hairloom.addon.shading.stage_settings import StageSettings

pytestmark = pytest.mark.draws(light=False)


@pytest.fixture(autouse=True)
def nothing_kept() -> Any:
    view_transform.clear_tables()
    yield
    view_transform.clear_tables()


def shading(kind: str = "RENDERED", *, lights: bool = True, world: bool = True) -> Any:
    """A view's shading settings; those of the other modes are off."""
    is_rendered = kind == "RENDERED"
    return SimpleNamespace(
        type=kind,
        use_scene_lights=lights and not is_rendered,
        use_scene_world=world and not is_rendered,
        use_scene_lights_render=lights and is_rendered,
        use_scene_world_render=world and is_rendered,
    )


def hair_colours(count: int = 4000) -> np.ndarray[Any, Any]:
    """Colours as of lit hair: from black to above white, no channel below an eighth of another."""
    random = np.random.default_rng(1)
    level = 2.0 ** random.uniform(-10.0, 3.0, (count, 1))
    return (level * 2.0 ** random.uniform(-3.0, 0.0, (count, 3))).astype(np.float32)


def all_colours(count: int = 4000) -> np.ndarray[Any, Any]:
    return (2.0 ** np.random.default_rng(2).uniform(-10.0, 3.0, (count, 3))).astype(np.float32)


LOOKS = {
    "AgX": ColorView(transform="AgX"),
    "AgX with a look": ColorView(transform="AgX", look="AgX - Medium High Contrast"),
    "Filmic": ColorView(transform="Filmic"),
    "Standard": ColorView(),
    "white balance": ColorView(transform="AgX", white_balance=(4000.0, 20.0)),
}


@pytest.mark.parametrize("view", LOOKS.values(), ids=LOOKS)
def test_the_table_shows_what_blender_saves(view: ColorView) -> None:
    """With a white balance, colours are off the axes along which the table is exact."""
    hair_worst = 3.0 if view.white_balance is None else 5.0
    display = Display(DisplayTable(apply_view_transform(view, table_radiances())))
    for colours, worst in ((hair_colours(), hair_worst), (all_colours(), 6.0)):
        error = 255.0 * np.abs(display.display_code(colours) - apply_view_transform(view, colours))
        assert error.mean() < 0.5
        assert np.percentile(error, 99.0) < 3.0
        assert error.max() < worst


def test_exposure_and_gamma_need_no_other_table() -> None:
    """They act before and after the transform, as in Blender itself."""
    table = DisplayTable(apply_view_transform(ColorView(transform="AgX"), table_radiances()))
    scene, colours = bpy.context.scene, hair_colours(500)
    scene.view_settings.exposure, scene.view_settings.gamma = 1.5, 1.3
    shown = Display(table, 2.0**1.5, 1.3).display_code(colours)
    error = 255.0 * np.abs(shown - saved_by_scene(colours))
    assert error.mean() < 0.5 and error.max() < 3.0


def test_rgb_curves_are_applied() -> None:
    scene, colours = bpy.context.scene, hair_colours(500)
    settings = scene.view_settings
    settings.view_transform, settings.exposure = "AgX", 0.5
    settings.use_curve_mapping = True
    settings.curve_mapping.white_level = (0.8, 0.9, 1.0)
    settings.curve_mapping.curves[3].points.new(0.3, 0.6)
    settings.curve_mapping.curves[0].points[1].location.y = 0.7
    settings.curve_mapping.update()
    view, gain, _ = view_of(shading(), scene)
    assert (view.exposure, gain) == (0.5, 1.0)
    error = 255.0 * np.abs(apply_view_transform(view, colours) - saved_by_scene(colours))
    assert error.max() < 0.1


def saved_by_scene(colours: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The display values that the open scene itself saves."""
    scene, path = bpy.context.scene, f"{bpy.app.tempdir}saved.png"
    picture = scene.render.image_settings
    picture.file_format, picture.color_mode, picture.color_depth = "PNG", "RGB", "16"
    image = bpy.data.images.new("Colours", len(colours), 1, float_buffer=True)
    pixels = np.ones((len(colours), 4), np.float32)
    pixels[:, :3] = colours
    image.pixels.foreach_set(pixels.ravel())
    image.save_render(path, scene=scene)
    saved = bpy.data.images.load(path)
    saved.colorspace_settings.is_data = True
    saved.pixels.foreach_get(pixels.ravel())
    return pixels[:, :3]


def test_each_mode_has_what_blender_applies_in_it() -> None:
    scene = bpy.context.scene
    settings = scene.view_settings
    settings.view_transform, settings.look = "AgX", "AgX - Punchy"
    settings.exposure, settings.gamma = 2.0, 1.5
    settings.use_white_balance = True
    balance = settings.white_balance_temperature, settings.white_balance_tint
    bare = ColorView(transform="AgX", look="AgX - Punchy")
    full = ColorView(transform="AgX", look="AgX - Punchy", white_balance=balance)
    for kind in ("WIREFRAME", "SOLID"):
        assert view_of(shading(kind), scene) == (ColorView(), 1.0, 1.0)
    for kind in ("MATERIAL", "RENDERED"):
        assert view_of(shading(kind), scene) == (full, 4.0, 1.5)
        assert view_of(shading(kind, lights=False), scene) == (full, 4.0, 1.5)
        neither = shading(kind, lights=False, world=False)
        assert view_of(neither, scene) == (bare, 1.0, 1.0)
    scene.render.engine = "BLENDER_WORKBENCH"
    assert view_of(shading(lights=False, world=False), scene) == (full, 4.0, 1.5)


def test_plain_standard_needs_no_table_and_others_are_made_once() -> None:
    scene = bpy.context.scene
    assert display_of(shading("SOLID"), scene) is None
    assert not bpy.app.timers.is_registered(view_transform._make_requested)
    scene.view_settings.view_transform = "AgX"
    assert display_of(shading(), scene) is None, "it is made while drawing"
    assert bpy.app.timers.is_registered(view_transform._make_requested)
    view_transform._make_requested()
    first = display_of(shading(), scene)
    assert first is not None
    scene.view_settings.exposure = 1.0
    second = display_of(shading(), scene)
    assert second is not None and second.table is first.table and second.gain == 2.0
    scene.view_settings.look = "AgX - Punchy"
    third = display_of(shading(), scene)
    assert third is not None and third.table is first.table, "until its own is there"
    view_transform._make_requested()
    fourth = display_of(shading(), scene)
    assert fourth is not None and fourth.table is not first.table


def test_nothing_is_left_in_the_file_and_it_is_as_saved_as_before() -> None:
    def state() -> Any:
        data = bpy.data
        return data.is_dirty, len(data.images), len(data.scenes), len(data.worlds)

    before, settings = state(), bpy.context.scene.view_settings
    kept = settings.view_transform, settings.exposure
    apply_view_transform(ColorView(transform="Filmic", exposure=1.0), hair_colours(10))
    assert state() == before
    assert (settings.view_transform, settings.exposure) == kept


def test_an_unreadable_view_transform_is_reported_and_not_retried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: Any) -> Any:
        raise OSError("no space left")

    monkeypatch.setattr(view_transform, "apply_view_transform", refuse)
    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    assert display_of(shading(), scene) is None
    view_transform._make_requested()
    assert "no space left" in view_transform.problem()
    assert display_of(shading(), scene) is None
    assert not view_transform._tables.requested
    view_transform.prepare()
    assert view_transform.problem() == ""


@pytest.mark.parametrize("most_bytes", few_in_commits([0, 3000]))
def test_a_full_disk_is_an_error_and_not_wrong_colours(most_bytes: int, tmp_path: Path) -> None:
    """A truncated picture is an error. It must not refer to data that Blender has freed: garbage
    collection would then crash Blender."""
    held = []
    with full_disk(most_bytes), pytest.raises((OSError, RuntimeError)) as raised:
        apply_view_transform(LOOKS["AgX"], hair_colours())
    held.append(raised.value)
    frame = raised.value.__traceback__
    while frame is not None:
        names = {type(each).__name__ for each in frame.tb_frame.f_locals.values()}
        assert not names & {"BlendData", "Scene", "Image"}
        frame = frame.tb_next
    gc.collect()
    stage = StageSettings(view="agx")
    with full_disk(most_bytes), pytest.raises(HairloomError, match="temporary files") as error:
        write_picture(tmp_path / "a.png", np.ones((8, 512, 4), np.float32), stage)
    assert "Free some space" in error.value.remedy and list(tmp_path.iterdir()) == []


def test_a_look_that_this_blender_lacks_is_named(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="Nowhere"):
        apply_view_transform(ColorView(transform="Nowhere"), hair_colours(4))
