"""Our DDS files, read by Blender's own reader."""

from importlib.util import find_spec

import bpy
import numpy as np
import pytest
from mip_chains import mip_chain

from hairloom.addon.blender.base.images import read_image
from hairloom.addon.exchange.textures.dds import write_dds

COMPRESSED = pytest.param(
    True, marks=pytest.mark.skipif(find_spec("etcpak") is None, reason="there is no etcpak")
)


@pytest.mark.parametrize("is_compressed", [COMPRESSED, False])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_blender_shows_what_was_written(channels, is_compressed, tmp_path):
    x, y = np.linspace(0.1, 0.9, 64), np.linspace(0.2, 0.8, 32)[:, None]
    waves = [x * y, 0.5 + 0.3 * np.sin(5 * y) * x, 0.8 * y + 0 * x, 0.3 + 0.5 * x * y]
    picture = np.stack(waves[:channels], axis=-1).astype(np.float32)
    path = tmp_path / "a.dds"
    write_dds(path, mip_chain(picture), is_compressed=is_compressed)
    image = bpy.data.images.load(str(path))
    try:
        image.alpha_mode = "CHANNEL_PACKED"
        found = read_image(image, is_color=False, place=path.name)
    finally:
        bpy.data.images.remove(image)
    assert found.shape == (32, 64, 4)
    error = np.abs(found[..., :channels] - picture)
    assert error.max() < (0.06 if is_compressed else 0.003)
