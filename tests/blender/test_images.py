"""Textures written by Blender itself, for a Blender whose Python lacks OpenImageIO."""

import bpy
import numpy as np
import pytest
from full_disk import full_disk

from hairloom.addon.blender.base import images
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.textures import texture_files
from hairloom.addon.exchange.textures.srgb import srgb_encoded


@pytest.fixture(autouse=True)
def without_openimageio(monkeypatch):
    monkeypatch.setattr(texture_files, "has_openimageio", lambda: False)


def stored(path):
    """The stored values of a file, (height, width, 4), row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    try:
        image.alpha_mode = "CHANNEL_PACKED"
        image.colorspace_settings.name = "Non-Color"
        return images.read_image(image, is_color=False, place=path.name)
    finally:
        bpy.data.images.remove(image)


@pytest.mark.parametrize("is_color", [True, False])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_channels_are_kept_also_where_the_fourth_is_zero(channels, is_color, tmp_path):
    pixels = np.random.default_rng(3).random((6, 5, channels)).astype(np.float32)
    if channels == 4:
        pixels[:3, :, 3] = 0.0
    images.write_texture(
        tmp_path / "a.png", pixels, is_color=is_color, depth="uint16", is_packed=True
    )
    found = stored(tmp_path / "a.png")
    colors = srgb_encoded(pixels[..., :3]) if is_color else pixels[..., :3]
    assert np.abs(found[..., :3] - colors).max() <= 0.51 / 255
    alpha = pixels[..., 3] if channels == 4 else 1.0
    assert np.abs(found[..., 3] - alpha).max() <= 0.51 / 255


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(HairloomError, match=r"'\.exr'.*PNG"):
        images.write_texture(tmp_path / "a.exr", np.zeros((2, 2, 3)), is_color=False, depth="half")


@pytest.mark.parametrize("most_bytes", [0, 3000])
def test_a_full_disk_is_reported_and_keeps_the_old_file(most_bytes, tmp_path):
    """Blender's PNG writer does not report a full disk."""
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    noise = np.random.default_rng(4).random((96, 96, 4)).astype(np.float32)
    for write in (
        lambda: images.write_png(path, noise),
        lambda: images.write_texture(path, noise, is_color=True, depth="uint8"),
    ):
        with full_disk(most_bytes), pytest.raises(HairloomError, match="cannot be written"):
            write()
    assert path.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1
