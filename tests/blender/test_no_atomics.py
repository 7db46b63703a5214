"""Pictures without image atomics: F12, stills, and messages about them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import SIZE, render_picture  # noqa: E402

from hairloom.addon.blender.preview import previews  # noqa: E402
from hairloom.addon.blender.setup import self_test  # noqa: E402
from hairloom.addon.blender.viewport import overlay  # noqa: E402
from hairloom.addon.render import capabilities  # noqa: E402
from hairloom.addon.render.accumulation import Target  # noqa: E402
from hairloom.addon.render.camera import Camera, look_at, perspective  # noqa: E402
from hairloom.addon.render.frame import render_image  # noqa: E402
from hairloom.addon.render.hashed_strands import HASHED_STRANDS  # noqa: E402
from hairloom.addon.render.snapshot import Snapshot  # noqa: E402
from hairloom.addon.render.strand_pass import noise_free_samples  # noqa: E402
from hairloom.addon.render.textures import texture_to_array  # noqa: E402
from hairloom.addon.shading.lights import three_point_lights  # noqa: E402
from hairloom.addon.shading.settings import StrandSettings  # noqa: E402
from hairloom.addon.ui import preferences  # noqa: E402

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context", "extension")]


@pytest.fixture(autouse=True)
def automatic() -> Iterator[None]:
    yield
    capabilities.choose_image_atomics("automatic")


@pytest.mark.slow(instead="test_the_preview_is_drawn_without_atomics")
def test_a_render_without_atomics_has_little_noise(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    """Hashed strands take 16 samples although one is set, and agree with layers to 1 %."""
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 20.0
    picture_settings = engine_scene.hairloom.picture
    pictures = {}
    for samples, choice in ((16, "automatic"), (1, "never"), (16, "never")):
        picture_settings.samples = samples
        capabilities.choose_image_atomics(choice)
        pictures[samples, choice] = render_picture(tmp_path)
    expected = pictures[16, "automatic"]
    np.testing.assert_array_equal(pictures[1, "never"], pictures[16, "never"])
    off = np.abs(pictures[1, "never"] - expected)[..., :3]
    assert 0.0 < off.mean() < 0.01 * expected[..., :3].max()
    assert pictures[1, "never"].mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.slow(instead="test_the_preview_is_drawn_without_atomics")
def test_a_render_works_after_drawing_in_another_gpu_context(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    """A render's own GPU context cannot bind framebuffers of another context."""
    hair = new_hair(sphere)
    hair.data.hairloom.strands.transparency = "hashed"
    hair.data.hairloom.strands.fullness = 20.0
    before = render_picture(tmp_path)
    HASHED_STRANDS.release()
    camera = Camera(look_at((0.4, -0.5, 0.3), (0.0, 0.0, 0.0)), perspective(0.4, 1.0, 0.05, 5.0))
    points = np.linspace((0.0, 0.0, -0.1), (0.0, 0.0, 0.1), 4, dtype=np.float32)[None]
    settings = StrandSettings(transparency="hashed")
    one = Snapshot(points, np.full((1, 4), 0.01, np.float32), strand_settings=settings)
    assert render_image(one, camera, SIZE, SIZE, 1)[..., 3].any()
    np.testing.assert_array_equal(render_picture(tmp_path), before)


def test_stills_take_more_samples_without_atomics() -> None:
    layers, hashed = StrandSettings(), StrandSettings(transparency="hashed")
    assert noise_free_samples(layers) == 1
    capabilities.choose_image_atomics("never")
    assert noise_free_samples(layers) == 16
    assert noise_free_samples(hashed) == 1, "what an artist has chosen is drawn as it is"


def test_the_preferences_forbid_them_and_the_self_test_says_so(monkeypatch: Any) -> None:
    monkeypatch.setattr(self_test, "_last_results", ())
    page = SimpleNamespace(image_atomics="never", gpu_memory=1024)
    preferences._apply_gpu_preferences(page, bpy.context)
    self_test.run()
    found = {check.name: check for check in self_test.last_report()}
    atomics, limits = found["Image atomics"], found["GPU"]
    assert (atomics.outcome, limits.outcome) == ("absent", "passed")
    assert "turned off in the preferences" in atomics.text and "Hashed" in atomics.text
    most = capabilities.capabilities().texture_size
    assert f"textures of {most:,} texels" in limits.text and "ms" in limits.text
    assert not any(check.outcome == "failed" for check in found.values())
    page.image_atomics = "automatic"
    preferences._apply_gpu_preferences(page, bpy.context)
    self_test.run()
    assert {check.name: check.outcome for check in self_test.last_report()}[
        "Image atomics"
    ] == "passed"
    assert "passed  Image atomics: " in self_test.report_text()


def test_the_preview_is_drawn_without_atomics(
    new_hair: Callable[..., Any], sphere: Any, get_depsgraph: Callable[[], Any]
) -> None:
    """The preview of a groom with its shadow on the body: noisy, but as bright."""
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 20.0
    session = previews.start(hair, get_depsgraph())
    target, pictures = Target(), []
    camera = Camera(look_at((0.4, -0.5, 0.3), (0.0, 0.0, 0.0)), perspective(0.4, 1.0, 0.05, 5.0))
    for choice in ("automatic", "never"):
        capabilities.choose_image_atomics(choice)
        drawn = overlay.DrawnGroom(overlay.GroomDrawing(session.snapshot))
        lit = replace(session.snapshot, lights=three_point_lights(camera.view))
        shown = overlay._ShownGroom(
            *(0, drawn, drawn.drawing, lit, None, 0),
            shades_body=True,
            is_turning=False,
            shows_all_strands=False,
        )
        target.sized(96, 96).clear((0.0, 0.0, 0.0, 0.0))
        with target.drawing():
            shown.draw_body_shadow(camera)
            shown.draw(camera, {}, None, is_moving=False)
        pictures.append(texture_to_array(target.color))
    layers, hashed = pictures
    assert (layers[..., 3] > 0.1).mean() > 0.05 and not np.array_equal(layers, hashed)
    assert hashed.mean(axis=(0, 1)) == pytest.approx(layers.mean(axis=(0, 1)), rel=0.03)
