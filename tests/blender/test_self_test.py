"""The self-test of the Preferences page finds out what works and what does not."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.sessions import solvers
from hairloom.addon.blender.setup import self_test

pytestmark = [pytest.mark.portable, pytest.mark.usefixtures("extension")]


def test_all_is_well_here_and_can_be_copied(monkeypatch):
    monkeypatch.setattr(self_test, "_last_results", ())
    with pytest.raises(RuntimeError, match="Press Self-Test first"):
        bpy.ops.hairloom.copy_report()
    assert bpy.ops.hairloom.self_test() == {"FINISHED"}
    outcomes = {check.name: check.outcome for check in self_test.last_report()}
    assert outcomes["Files"] == outcomes["Drawing, Marschner"] == "passed"
    assert "failed" not in outcomes.values()
    assert bpy.ops.hairloom.copy_report() == {"FINISHED"}
    text = self_test.report_text()
    assert "passed  Drawing, shadows: hair covers" in text and "backend: " in text


def test_failures_are_reported_and_other_tests_continue(monkeypatch, capfd):
    def broken(*_, **__):
        raise RuntimeError("this GPU refuses")

    monkeypatch.setattr(self_test, "_last_results", ())
    monkeypatch.setattr(self_test, "render_image", broken)
    monkeypatch.setattr(solvers, "_test_frame_error", lambda: "it is 1 m off after one frame")
    monkeypatch.setattr(self_test, "find_spec", lambda name: None)
    assert bpy.ops.hairloom.self_test() == {"FINISHED"}
    found = {check.name: check for check in self_test.last_report()}
    assert found["Drawing, Marschner"].outcome == "failed"
    assert "this GPU refuses" in found["Drawing, Marschner"].text
    assert found["Simulation on the GPU"].outcome == "absent"
    assert found["OpenImageIO"].text == "not here: no textures of 16 bits and EXR"
    assert found["Files"].outcome == "passed"
    assert "Drawing, Marschner: RuntimeError" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda picture: np.zeros_like(picture), "covers 0%"),
        (lambda picture: np.full_like(picture, np.nan), "not numbers"),
        (lambda picture: np.ones_like(picture), "covers 100%"),
        (lambda picture: picture * np.float32([0, 0, 0, 1]), "black"),
    ],
    ids=["nothing", "nan", "everywhere", "black"],
)
def test_pictures_that_show_no_hair_fail(change, message):
    good = np.zeros((8, 8, 4), np.float32)
    good[2:6, 2:6] = 1.0
    assert "25%" in self_test._check_picture(good)
    with pytest.raises(RuntimeError, match=message):
        self_test._check_picture(change(good))
