"""Show Opacity Map and Show Skin Shadow: maps as files from the command line, and as images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="runs inside Blender")

import bpy
from engine_stage import view_shadings

from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.pictures.skin_picture import IMAGE as SKIN_IMAGE
from hairloom.addon.blender.pictures.slices import IMAGE, filled_image, slices_picture
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.volume.settings import VolumeSettings

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context")]

SMALL = [
    "--set",
    "children.method=none",
    "--set",
    "grow.strand_count=200",
    "--width",
    "32",
    "--height",
    "32",
    "--samples",
    "1",
]


def test_render_writes_the_layers_side_by_side(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    slices, picture = tmp_path / "slices.png", tmp_path / "a.png"
    arguments = ["render", *SMALL, "--output", str(picture), "--slices", str(slices)]
    assert command_line.run([*arguments, "--set", "volume.shadows=none"]) == 1
    assert "--slices" in capfd.readouterr().err and not picture.exists()
    arguments += ["--set", "volume.shadows=slices", "--set", "volume.resolution=64"]
    # few strands that represent many would get a coarser map
    arguments += ["--set", "volume.max_lights=2", "--set", "widths.method=own"]
    assert command_line.run(arguments) == 0
    image = bpy.data.images.load(str(slices))
    # the maps of both lights, one above the other
    assert tuple(image.size) == (4 * 66, 2 * 4 * 66)
    assert np.ptp(np.array(image.pixels[:]).reshape(-1, 4)[:, 0]) > 0.5
    bpy.data.images.remove(image)


@pytest.mark.slow
def test_extreme_values_are_reported_on_the_command_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["render", *SMALL, "--output", str(tmp_path / "a.png")]
    arguments += ["--set", "volume.shadows=deep", "--set", "volume.resolution=32"]
    for value, word in ((0, "Extinction of 0"), (1000, "this high an Extinction")):
        assert command_line.run([*arguments, "--set", f"volume.extinction={value}"]) == 0
        assert word in capfd.readouterr().out


def test_an_image_shows_them_and_is_the_same_each_time(new_hair: Any, sphere: Any) -> None:
    from dataclasses import replace

    from hairloom.addon.render.strand_pass import StrandPass

    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    bpy.context.scene.collection.objects.link(lamp)
    session = Session(new_hair(sphere), bpy.context.evaluated_depsgraph_get())
    with pytest.raises(HairloomError, match="Set Shadows to"):
        none = replace(session.snapshot, volume=VolumeSettings(shadows="none"))
        slices_picture(none, StrandPass())
    for layers, across in ((3, 2), (8, 3)):
        volume = VolumeSettings(shadows="deep", resolution=32, layers=layers)
        snapshot = replace(session.snapshot, volume=volume)
        picture = slices_picture(snapshot, StrandPass())
        image = filled_image(IMAGE, picture)
        assert image.name == IMAGE and tuple(image.size) == (across * 34, across * 34)
        assert np.allclose(np.array(image.pixels[:]).reshape(picture.shape), picture)
    assert sum(each.name.startswith(IMAGE) for each in bpy.data.images) == 1


@pytest.mark.slow
def test_render_writes_the_skin_shadow(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A map for each light: white where no hair blocks it, dark below hair."""
    shadow, picture = tmp_path / "skin.png", tmp_path / "a.png"
    arguments = ["render", *SMALL, "--output", str(picture), "--skin-shadow", str(shadow)]
    assert command_line.run([*arguments, "--set", "volume.shadows=none"]) == 1
    assert "--skin-shadow" in capfd.readouterr().err and not picture.exists()
    arguments += ["--set", "volume.resolution=64", "--set", "skin.skin_resolution=128"]
    assert command_line.run([*arguments, "--set", "skin.soft_shadow=false"]) == 1
    assert "Soft Shadow on Skin" in capfd.readouterr().err
    assert command_line.run([*arguments, "--set", "volume.max_lights=2"]) == 0
    image = bpy.data.images.load(str(shadow))
    pixels = np.array(image.pixels[:]).reshape(*image.size[::-1], 4)
    assert max(image.size[0] / 2, image.size[1]) == 128
    is_skin = pixels[..., 3] > 0.5
    assert 0.1 < is_skin.mean() < 1.0
    assert pixels[is_skin][:, 0].min() < 0.3 and pixels[is_skin][:, 0].max() > 0.99
    bpy.data.images.remove(image)


def test_the_skin_shadow_of_previewed_hair(new_hair: Any, sphere: Any) -> None:
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    bpy.context.scene.collection.objects.link(lamp)
    hair = new_hair(sphere)
    hair.data.hairloom.volume.resolution = 128
    hair.data.hairloom.skin.skin_resolution = 128
    hair.data.hairloom.strands.fullness = 30.0
    assert not bpy.ops.hairloom.show_skin_shadow.poll()
    bpy.ops.hairloom.preview()
    try:
        assert bpy.ops.hairloom.show_skin_shadow() == {"FINISHED"}
        image = bpy.data.images[SKIN_IMAGE]
        pixels = np.array(image.pixels[:]).reshape(*image.size[::-1], 4)
        is_skin = pixels[..., 3] > 0.5
        assert pixels[is_skin][:, 0].min() < 0.5 < 0.99 < pixels[is_skin][:, 0].max()
        hair.data.hairloom.skin.soft_shadow = False
        bpy.context.view_layer.update()
        session = previews.session_of(hair)
        assert session is not None
        session.take_settings()
        with pytest.raises(RuntimeError, match="Soft Shadow on Skin"):
            bpy.ops.hairloom.show_skin_shadow()
    finally:
        bpy.ops.hairloom.preview()
    assert previews.session_of(hair) is None


def test_undo_of_a_later_step_keeps_the_picture(new_hair: Any, sphere: Any) -> None:
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    bpy.context.scene.collection.objects.link(lamp)
    hair = new_hair(sphere)
    hair.data.hairloom.volume.resolution = hair.data.hairloom.skin.skin_resolution = 64
    bpy.ops.hairloom.preview()
    bpy.ops.ed.undo_push(message="hair")
    assert bpy.ops.hairloom.show_skin_shadow("EXEC_DEFAULT", True) == {"FINISHED"}
    assert bpy.ops.hairloom.show_slices("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert SKIN_IMAGE in bpy.data.images and IMAGE not in bpy.data.images
    previews.stop_all()


def test_a_lamp_inside_the_hair_is_reported_if_a_view_uses_scene_lights(
    new_hair: Any, sphere: Any
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.volume.shadows = "deep"
    lamp = bpy.data.objects.new("Candle", bpy.data.lights.new("Candle", "POINT"))
    lamp.data.energy = 10.0
    bpy.context.scene.collection.objects.link(lamp)
    lamp.location = sphere.matrix_world.translation
    bpy.context.view_layer.update()
    session = Session(hair, bpy.context.evaluated_depsgraph_get())
    for shading in view_shadings():
        shading.type = "SOLID"
    assert not any("Candle" in warning for warning in session.warnings)
    view_shadings()[0].type = "RENDERED"
    (warning,) = (each for each in session.warnings if each.startswith("Candle: "))
    assert "inside the hair" in warning
    lamp.location.x += 5.0
    bpy.context.view_layer.update()
    session.take_lights(bpy.context.evaluated_depsgraph_get())
    assert not any("Candle" in each for each in session.warnings)
