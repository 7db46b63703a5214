"""Pictures where images have no atomics, as an artist gets them: F12, stills, and what says so."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import picture  # noqa: E402

from hairloom.addon.blender.setup import self_test  # noqa: E402
from hairloom.addon.render import capabilities  # noqa: E402
from hairloom.addon.render.strand_pass import calm_draws  # noqa: E402
from hairloom.addon.shading.settings import StrandSettings  # noqa: E402
from hairloom.addon.ui import preferences  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]


@pytest.fixture(autouse=True)
def automatic() -> Iterator[None]:
    yield
    capabilities.choose_image_atomics("automatic")


def test_a_render_is_calm_without_atomics(
    stage: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    """One sample is asked for; hashed strands take as many as make them calm."""
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 20.0
    picture_settings = stage.hairloom.picture
    pictures = {}
    for samples, choice in ((16, "automatic"), (1, "never"), (16, "never")):
        picture_settings.samples = samples
        capabilities.choose_image_atomics(choice)
        pictures[samples, choice] = picture(tmp_path)
    wanted = pictures[16, "automatic"]
    np.testing.assert_array_equal(pictures[1, "never"], pictures[16, "never"])
    off = np.abs(pictures[1, "never"] - wanted)[..., :3]
    assert 0.0 < off.mean() < 0.01 * wanted[..., :3].max()
    assert pictures[1, "never"].mean() == pytest.approx(wanted.mean(), rel=0.01)


def test_stills_take_several_draws_without_atomics() -> None:
    layers, hashed = StrandSettings(), StrandSettings(transparency="hashed")
    assert [calm_draws(layers, samples) for samples in (1, 3, 8)] == [1, 1, 1]
    capabilities.choose_image_atomics("never")
    assert [calm_draws(layers, samples) for samples in (1, 3, 8)] == [16, 2, 1]
    assert calm_draws(hashed, 1) == 1, "what an artist has chosen is drawn as it is"


def test_the_preferences_forbid_them_and_the_self_test_says_so(monkeypatch: Any) -> None:
    monkeypatch.setattr(self_test, "_last", ())
    page = SimpleNamespace(image_atomics="never")
    preferences._choose_atomics(page, bpy.context)
    self_test.run()
    found = {check.name: check for check in self_test.last_report()}
    atomics, limits = found["Image atomics"], found["GPU"]
    assert (atomics.outcome, limits.outcome) == ("absent", "passed")
    assert "turned off in the preferences" in atomics.text and "Hashed" in atomics.text
    assert "textures of 16,384 texels" in limits.text and "ms" in limits.text
    assert not any(check.outcome == "failed" for check in found.values())
    preferences._choose_atomics(SimpleNamespace(image_atomics="automatic"), bpy.context)
    self_test.run()
    assert {check.name: check.outcome for check in self_test.last_report()}[
        "Image atomics"
    ] == "passed"
    assert "passed  Image atomics: " in self_test.report_text()
