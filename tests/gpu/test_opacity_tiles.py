"""The picture of a map's layers against the map's content."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.light_frame import ball_around
from hairloom.addon.shading.volume.opacity import layer_ends
from hairloom.addon.shading.volume.settings import VolumeSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

SUN = Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0)
SIDE = Light.sun((1.0, 0.0, 0.0), (1, 1, 1), 1.0)
GAP = 2
LAMP = Light.point((0.0, 0.0, 0.0), (1, 1, 1), 1.0)


def hair() -> np.ndarray:
    """Strands that descend along x."""
    strands = np.zeros((200, 4, 3), np.float32)
    x = np.random.default_rng(1).uniform(-0.1, 0.1, 200)
    strands[..., 0], strands[..., 2] = x[:, None], -0.5 * x[:, None]
    strands[..., 1] = np.linspace(-0.1, 0.1, 4)
    return strands


def tiles_of(settings: VolumeSettings, *lights: Light) -> tuple[Any, np.ndarray]:
    from hairloom.addon.render.opacity_pass import OpacityPass
    from hairloom.addon.render.opacity_tiles import opacity_tiles
    from hairloom.addon.render.strand_layout import StrandLayout, strand_rows
    from hairloom.addon.render.textures import texture_from

    strands = hair()
    radius = np.full((200, 4, 1), 5e-4, np.float32)
    points = texture_from(strand_rows(np.concatenate([strands, radius], axis=-1)), "RGBA32F")
    maps = OpacityPass().maps(
        points,
        1,
        StrandLayout.uniform(200, 4),
        ball_around(strands),
        lights,
        settings,
        StrandSettings(),
    )
    return maps, opacity_tiles(maps, len(layer_ends(settings)))


def tile(picture: np.ndarray, number: int, columns: int, side: int) -> np.ndarray:
    """One tile of the picture, row 0 at the bottom."""
    row, column = divmod(number, columns)
    top = len(picture) - row * (side + GAP)
    left = column * (side + GAP)
    return picture[top - side : top, left : left + side, 0]


def test_sixteen_slices_lie_in_four_rows_as_the_map_holds_them() -> None:
    from hairloom.addon.render.textures import texture_to_array

    settings = VolumeSettings(shadows="slices", resolution=64, extinction=2.0, strand_fraction=1.0)
    maps, picture = tiles_of(settings, SUN)
    assert picture.shape == (4 * 66, 4 * 66, 4) and (picture[..., 3] == 1.0).all()
    for number in range(16):
        sums = texture_to_array(maps.slots[number // 4])[..., number % 4]
        assert np.allclose(tile(picture, number, 4, 64), np.exp(-2.0 * sums), atol=1e-5)
    assert np.ptp(tile(picture, 15, 4, 64)) > 0.5
    assert not picture[:, 64:66, :3].any(), "the gap"


def test_deep_layers_have_their_starts_before_them() -> None:
    settings = VolumeSettings(shadows="deep", resolution=64, layers=8, strand_fraction=1.0)
    maps, picture = tiles_of(settings, SUN)
    assert picture.shape[:2] == (3 * 66, 3 * 66)
    starts = tile(picture, 0, 3, 64)
    kept = np.asarray(maps.starts.read()).reshape(16, 32)[:, :16]
    kept = np.minimum(kept / float(1 << 24), 1.0)
    # starts are planes, so the mean of a block is the value at its centre
    means = starts.reshape(16, 4, 16, 4).mean(axis=(1, 3))
    assert np.allclose(means, 1.0 - kept, atol=1e-5)
    light = [tile(picture, number, 3, 64).mean() for number in range(1, 9)]
    assert (np.diff(light) <= 1e-6).all() and light[-1] < 0.9


def test_maps_of_several_lights_lie_below_one_another() -> None:
    settings = VolumeSettings(shadows="slices", resolution=32, slices=4)
    both, first = tiles_of(settings, SIDE, SUN)[1], tiles_of(settings, SIDE)[1]
    assert len(both) == 2 * len(first)
    assert np.allclose(both[len(first) :], first, atol=1e-6)


def test_large_maps_are_shown_smaller_and_many_slices_in_more_rows() -> None:
    settings = VolumeSettings(shadows="slices", resolution=512, slices=25)
    assert tiles_of(settings, SUN)[1].shape[:2] == (5 * 258, 5 * 258)


def test_without_a_map_there_is_nothing_to_show() -> None:
    with pytest.raises(HairloomError, match="no light casts"):
        tiles_of(VolumeSettings(shadows="deep", resolution=32), LAMP)
