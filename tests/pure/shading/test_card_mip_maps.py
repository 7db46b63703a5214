"""Textures that contain their mip maps, and the coverage of slanted cards."""

from __future__ import annotations

import numpy as np
import pytest
from mip_chains import mip_chain

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.shading.card_look import MEAN_FACING, view_compensated_alpha
from hairloom.addon.shading.card_texture import (
    LEVELS,
    card_texel,
    level_corner,
    packed_levels,
    picture_size,
    wanted_level,
)
from hairloom.addon.shading.volume.card_opacity import MIN_FACING

GRID = AtlasGrid(4, 2)


def packed(picture: np.ndarray, *, is_repeated: bool = False) -> np.ndarray:
    return packed_levels(mip_chain(picture, grid=GRID)[:LEVELS], is_repeated=is_repeated)


@pytest.mark.parametrize("height", [1, 2, 5, 40, 63, 64, 2048])
@pytest.mark.parametrize("width", [1, 2, 3, 96, 97])
def test_levels_lie_apart(width: int, height: int) -> None:
    """All levels with their borders lie within the texture, without overlap."""
    levels = [np.full((max(height >> n, 1), max(width >> n, 1), 1), n + 1.0) for n in range(LEVELS)]
    whole = packed_levels(levels, is_repeated=False)
    assert picture_size(whole.shape[1], whole.shape[0]) == (width, height)
    for number, level in enumerate(levels):
        left, low = level_corner((width, height), number)
        rows = slice(low - 1, low + level.shape[0] + 1)
        columns = slice(left - 1, left + level.shape[1] + 1)
        assert (whole[rows, columns] == number + 1.0).all()
    areas = sum((level.shape[0] + 2) * (level.shape[1] + 2) for level in levels)
    assert np.count_nonzero(whole) == areas


def test_middle_of_a_texel_is_the_texel() -> None:
    picture = np.random.default_rng(1).random((40, 96, 3))
    levels = mip_chain(picture, grid=GRID)[:LEVELS]
    whole = packed_levels(levels, is_repeated=False)
    for number, level in enumerate(levels[:4]):
        row, column = np.divmod(np.arange(level.shape[0] * level.shape[1]), level.shape[1])
        place = np.stack([(column + 0.5) / level.shape[1], (row + 0.5) / level.shape[0]], axis=-1)
        found = card_texel(whole, place, np.full(len(place), float(number)), (1, 1))
        assert np.abs(found - level.reshape(-1, 3)).max() < 1e-6


def test_tiles_do_not_run_into_each_other() -> None:
    """At all levels and places, also at the edge of a tile."""
    tile = np.kron(np.arange(8.0).reshape(2, 4), np.ones((32, 32)))[..., None] / 8.0
    place = np.random.default_rng(2).random((4000, 2))
    level = np.random.default_rng(3).uniform(0.0, LEVELS - 1.0, 4000)
    expected = (np.floor(place[:, 1] * 2) * 4 + np.floor(place[:, 0] * 4)) / 8.0
    found = card_texel(packed(tile), place, level, (4, 2))
    assert np.abs(found[:, 0] - expected).max() < 1e-6


def test_repeated_textures_wrap_around() -> None:
    picture = np.random.default_rng(4).random((64, 64, 1))
    whole = packed(picture, is_repeated=True)
    place = np.random.default_rng(5).random((500, 2))
    level = np.full(500, 1.5)
    found = [card_texel(whole, place + shift, level) for shift in (0.0, 3.0, -2.0)]
    assert np.abs(found[1] - found[0]).max() < 1e-6 and np.abs(found[2] - found[0]).max() < 1e-6
    ends = card_texel(whole, np.array([[1e-9, 0.3], [1.0 - 1e-9, 0.3]]), np.zeros(2))
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


def test_level_is_where_a_pixel_is_as_large_as_a_texel() -> None:
    sizes = 2.0 ** np.array([-2.0, 0.0, 1.0, 3.5, 9.0]) / 256.0
    to_right = np.stack([sizes, 0.0 * sizes], axis=-1)
    found = wanted_level(to_right, 0.3 * to_right[:, ::-1], (256, 128))
    assert found == pytest.approx([0.0, 0.0, 1.0, 3.5, LEVELS - 1.0])


def test_slant_brings_strands_nearer() -> None:
    """With thin hair, a compensated card covers the same at any turn: an uncompensated one's
    mean."""
    turns = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    across = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=-1)
    tangent, to_eye = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    alpha = 0.01
    shown = view_compensated_alpha(np.full(1000, alpha), across, tangent, to_eye) * np.abs(
        across[:, 0]
    )
    turned = np.abs(across[:, 0]) > MIN_FACING
    assert shown[turned] == pytest.approx(alpha * MEAN_FACING, rel=0.06)
    # 0 stays 0 and 1 stays 1, however a strand leans towards the eye
    leaning = np.array([0.6, 0.0, 0.8])
    assert (view_compensated_alpha(np.zeros(1000), across, tangent, leaning) == 0.0).all()
    assert (view_compensated_alpha(np.ones(1000), across, tangent, leaning) == 1.0).all()
    same = view_compensated_alpha(np.full(1000, alpha), across, tangent, leaning)
    assert same == pytest.approx(
        view_compensated_alpha(np.full(1000, alpha), across, tangent, to_eye)
    )
