"""An artist's pictures for hair cards: from Blender's images and from files, missing and broken."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="Blender's images need Blender or the bpy module")

from hairloom.addon.blender.base import images  # noqa: E402
from hairloom.addon.blender.cards.textures import chosen_pictures, named_pictures  # noqa: E402
from hairloom.addon.blender.command_line import command_line  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402
from hairloom.addon.shading.textures import TEXTURES  # noqa: E402

pytestmark = pytest.mark.draws(light=False)

SHAPE = (6, 8)


def values(channels: int, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).random((*SHAPE, channels)).astype(np.float32)


@pytest.fixture
def write(tmp_path: Path) -> Any:
    """A function that writes a picture into a file and returns its path."""
    files = pytest.importorskip("hairloom.addon.exchange.textures.texture_files")
    pytest.importorskip("OpenImageIO")

    def written(name: str, pixels: np.ndarray, **more: Any) -> Path:
        files.write_texture(tmp_path / name, pixels, **more)
        return tmp_path / name

    return written


@pytest.mark.parametrize("is_color", [False, True])
@pytest.mark.parametrize(
    ("suffix", "depth"), [(".png", "uint8"), (".png", "uint16"), (".exr", "float")]
)
def test_an_image_reads_as_its_file(write: Any, suffix: str, depth: str, is_color: bool) -> None:
    """Blender's own conversions are undone: it decodes 16 bits as sRGB, and multiplies by alpha."""
    pixels = values(4)
    pixels[..., 3] = np.maximum(pixels[..., 3], 0.2)
    path = write(f"picture{suffix}", pixels, is_color=is_color, depth=depth)
    image = bpy.data.images.load(str(path))
    found = images.read_image(image, is_color=is_color, place="x")
    step = {"uint8": 0.006, "uint16": 2e-4, "float": 1e-6}[depth]
    np.testing.assert_allclose(found, pixels, atol=step)


def test_pictures_that_were_never_saved_are_read_as_they_are() -> None:
    pixels = values(4)
    image = bpy.data.images.new("Painted", SHAPE[1], SHAPE[0], alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(pixels.ravel())
    found = images.read_image(image, is_color=False, place="x")
    np.testing.assert_allclose(found, pixels, atol=1e-6)


@pytest.fixture
def hair(sphere: Any, new_hair: Any) -> Any:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 12
    hair.data.hairloom.cards.source, hair.data.hairloom.atlas.source = "guides", "made"
    texture = hair.data.hairloom.card_texture
    texture.variant_width, texture.height, texture.strand_count = 16, 32, 4
    return hair


def exported(hair: Any, path: Path) -> dict[str, Any]:
    assert bpy.ops.hairloom.export_cards(filepath=str(path)) == {"FINISHED"}
    return json.loads(path.with_suffix(".hairloom.json").read_text())


def test_an_artists_picture_is_written_in_place_of_the_generated_one(
    write: Any, hair: Any, tmp_path: Path
) -> None:
    plain = exported(hair, tmp_path / "plain.glb")["textures"]
    shift = values(1)
    hair.data.hairloom.card_images.shift = bpy.data.images.load(
        str(write("mine.png", shift, is_color=False, depth="uint16"))
    )
    own = exported(hair, tmp_path / "own.glb")["textures"]
    assert own["shift"]["file"] == "own_shift.png"
    found = images.read_texture(tmp_path / "own_shift.png", is_color=False)
    np.testing.assert_allclose(found, shift, atol=1e-4)
    for name in set(TEXTURES) - {"shift"}:
        same = [(tmp_path / made[name]["file"]).read_bytes() for made in (plain, own)]
        assert same[0] == same[1]


@pytest.mark.parametrize("kind", few_in_commits(["broken", "missing"]))
def test_a_missing_picture_is_reported_and_replaced(
    kind: str, write: Any, hair: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write("mine.png", values(3), is_color=True)
    image = bpy.data.images.load(str(path))
    path.unlink() if kind == "missing" else path.write_bytes(b"garbage")
    image.reload()
    hair.data.hairloom.card_images.base = image
    pictures, warnings = chosen_pictures(hair.data.hairloom.card_images)
    assert pictures == {}
    (warning,) = warnings
    assert "mine.png" in warning and "missing or broken" in warning and "generated base" in warning
    capfd.readouterr()
    exported(hair, tmp_path / "cards.glb")
    assert "missing or broken" in capfd.readouterr().out
    assert (tmp_path / "cards_base.png").stat().st_size > 0


@pytest.mark.usefixtures("gpu_context")
def test_a_picture_may_have_another_size_than_a_baked_atlas(write: Any, hair: Any) -> None:
    hair.data.hairloom.atlas.source = "baked"
    hair.data.hairloom.atlas.size = "256"
    hair.data.hairloom.card_images.base = bpy.data.images.load(
        str(write("mine.png", np.full((*SHAPE, 3), 0.5, np.float32), is_color=True))
    )
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}


def test_the_command_line_takes_pictures(write: Any, tmp_path: Path, gpu_context: Any) -> None:
    shift, tangent = values(1), values(3)
    arguments = [
        "cards",
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=60",
        "--set",
        "guides.guide_count=10",
    ]
    arguments += ["--set", "cards.source=guides", "--set", "atlas.source=made"]
    arguments += ["--set", "card_texture.highlights=tangent", "--output", str(tmp_path / "c.glb")]
    for name, pixels in (("shift", shift), ("tangent", tangent)):
        file = write(f"{name}.exr", pixels, is_color=False)
        arguments += ["--texture", f"{name}={file}"]
    report = tmp_path / "report.json"
    assert command_line.run([*arguments, "--report", str(report)]) == 0
    names = ["c.glb", *(f"c_{name}.png" for name in ("color", *TEXTURES)), "c.hairloom.json"]
    tables = [f"c_{name}.exr" for name in ("azimuthal", "longitudinal", "paths")]
    assert sorted(json.loads(report.read_text())["outputs"]) == sorted(names + tables)
    sidecar = json.loads((tmp_path / "c.hairloom.json").read_text())["textures"]
    assert sidecar["highlights_by"] == "tangent"
    for name, pixels in (("shift", shift), ("tangent", tangent)):
        found = images.read_texture(tmp_path / sidecar[name]["file"], is_color=False)
        np.testing.assert_allclose(found, pixels, atol=1e-3)


@pytest.mark.parametrize(
    ("argument", "named"),
    [
        ("shift", "does not name a texture"),
        ("gloss=a.png", "gloss"),
        ("shift=nowhere.png", "nowhere.png"),
        ("shift=broken.png", "broken.png"),
    ],
)
def test_a_wrong_picture_on_the_command_line_is_named(
    argument: str, named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "broken.png").write_bytes(b"garbage")
    argument = argument.replace("broken.png", str(tmp_path / "broken.png"))
    output = tmp_path / "made" / "c.glb"
    assert command_line.run(["cards", "--texture", argument, "--output", str(output)]) == 1
    message = capfd.readouterr().err
    assert named in message and "Traceback" not in message
    assert not output.parent.exists()


def test_without_openimageio_blender_reads_and_writes(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blender's reader and writer agree with OpenImageIO, in written files to 8 bits."""
    color, data = values(3), values(1)
    files = {
        "color": write("color.png", color, is_color=True),
        "data": write("data.png", data, is_color=False, depth="uint16"),
    }
    before = len(bpy.data.images)
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    found = named_pictures([f"base={files['color']}", f"shift={files['data']}"])
    np.testing.assert_allclose(found["base"], color, atol=0.006)
    np.testing.assert_allclose(found["shift"], data[..., 0], atol=2e-4)
    images.write_texture(tmp_path / "c.png", color, is_color=True, depth="uint8")
    images.write_texture(tmp_path / "d.png", data[..., 0], is_color=False, depth="uint16")
    with pytest.raises(HairloomError, match=r"nowhere\.png"):
        named_pictures(["base=nowhere.png"])
    assert len(bpy.data.images) == before
    monkeypatch.undo()
    for name, pixels in (("c", color), ("d", data)):
        back = images.read_texture(tmp_path / f"{name}.png", is_color=name == "c")
        np.testing.assert_allclose(back, np.broadcast_to(pixels, back.shape), atol=0.006)
