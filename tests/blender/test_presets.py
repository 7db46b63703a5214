"""Presets as the artist's menu and the command line apply them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="presets are applied inside Blender")

import bpy

from hairloom.addon.errors import HairloomError
from hairloom.addon.host import command_line, presets
from hairloom.addon.host.properties import settings_of
from hairloom.addon.shading.settings import ShadingSettings


@pytest.fixture
def hair(new_hair: Callable[..., bpy.types.Object]) -> bpy.types.Object:
    return new_hair()


@pytest.mark.parametrize("name", [name for name, _ in presets.shipped("shading")])
def test_a_look_goes_onto_the_selected_hair(hair: bpy.types.Object, name: str) -> None:
    assert bpy.ops.hairloom.apply_preset(name=name) == {"FINISHED"}
    applied = settings_of(hair.data.hairloom.shading, ShadingSettings)
    for value, wanted in zip(
        applied.as_dict().values(),
        presets.named_preset(name).settings.as_dict().values(),
        strict=True,
    ):
        assert value == pytest.approx(wanted, rel=1e-6)


def test_dynamics_go_onto_the_object(hair: bpy.types.Object) -> None:
    bpy.ops.hairloom.apply_preset(name="dynamics/soft")
    wanted = presets.named_preset("dynamics/soft").settings.as_dict()["style_tip"]
    assert hair.hairloom.dynamics.style_tip == pytest.approx(wanted)


def test_an_unknown_name_is_reported_with_those_that_are_known(hair: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="looks/blond"):
        bpy.ops.hairloom.apply_preset(name="looks/plaid")


def test_a_name_cannot_leave_the_preset_folder() -> None:
    with pytest.raises(HairloomError, match="no such preset"):
        presets.named_preset("../package")


def test_the_command_line_takes_presets_and_single_values_over_them(tmp_path: Path) -> None:
    options = command_line.parser().parse_args(
        ["cards", "--output", "x.glb", "--preset", "looks/blond"]
        + ["--set", "shading.primary_strength=3"]
    )
    shading = command_line._settings(options)["shading"].as_dict()
    assert shading["primary_strength"] == 3.0
    blond = presets.named_preset("looks/blond").settings.as_dict()
    assert shading["base_color"] == blond["base_color"]
