"""Mip maps: sizes, coverage, colours without fringes, unit vectors, separate tiles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from mip_chains import alpha_chain, mip_chain

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.exchange.textures.mip_maps import level_sizes, mip_levels

THRESHOLD = 0.5


def hair_alpha(width: int, height: int, grid: AtlasGrid, seed: int = 3) -> np.ndarray:
    """Alpha as in a bake: strands that taper and wander, from few to many per tile."""
    random = np.random.default_rng(seed)
    alpha = np.zeros((height, width), np.float32)
    for tile in range(grid.tile_count):
        rows, columns = tile_texels(alpha.shape, grid, tile)
        across = np.arange(columns.start, columns.stop) + 0.5
        along = np.linspace(0.0, 1.0, rows.stop - rows.start)[:, None]
        tile_width = columns.stop - columns.start
        for _ in range(2 + 4 * tile):
            middle = columns.start + tile_width * random.uniform(0.15, 0.85)
            bend, phase = tile_width * random.uniform(0.02, 0.1), random.uniform(0, 6)
            middle = middle + bend * np.sin(random.uniform(2, 5) * along + phase)
            wide = random.uniform(1.0, 4.0) * (1.0 - 0.8 * along)
            covered = np.clip(0.5 * wide + 0.5 - np.abs(across - middle), 0.0, 1.0)
            alpha[rows, columns] = np.maximum(alpha[rows, columns], covered)
    return alpha


def tile_texels(shape: tuple[int, ...], grid: AtlasGrid, tile: int) -> tuple[slice, slice]:
    height, width = shape[0] // grid.rows, shape[1] // grid.columns
    row, column = divmod(tile, grid.columns)
    return (
        slice(row * height, (row + 1) * height),
        slice(column * width, (column + 1) * width),
    )


def coverage(alpha: np.ndarray) -> float:
    return float(np.mean(alpha >= THRESHOLD))


@pytest.mark.parametrize(
    ("width", "height"), [(1, 1), (8, 8), (7, 5), (64, 16), (100, 1), (33, 257), (6, 4)]
)
def test_levels_go_down_to_one_texel_as_gpus_have_them(width: int, height: int) -> None:
    sizes = level_sizes(width, height)
    assert sizes[0] == (width, height) and sizes[-1] == (1, 1)
    for (wide, high), (next_wide, next_high) in itertools.pairwise(sizes):
        assert (next_wide, next_high) == (max(wide // 2, 1), max(high // 2, 1))
    image = np.random.default_rng(1).random((height, width, 3)).astype(np.float32)
    chain = mip_chain(image)
    assert [level.shape for level in chain] == [(high, wide, 3) for wide, high in sizes]
    assert all(level.dtype == np.float32 for level in chain)
    assert (chain[0] == image).all()


@pytest.mark.parametrize(("width", "height"), [(64, 32), (31, 17), (45, 64)])
def test_values_are_the_mean_of_the_area(width: int, height: int) -> None:
    """At any size, the last texel is the mean of all, and a texel of level 1 that of its area."""
    image = np.random.default_rng(2).random((height, width)).astype(np.float32)
    chain = mip_chain(image)
    np.testing.assert_allclose(chain[-1], image.mean(), atol=1e-6)
    fine = np.kron(image, np.ones((height // 2, width // 2)))  # texels cut to equal parts
    blocks = fine.reshape(height // 2, height, width // 2, width)
    np.testing.assert_allclose(chain[1], blocks.mean(axis=(1, 3)), atol=1e-6)


def test_coverage_is_kept_within_a_hundredth() -> None:
    """For each tile, as long as it has 16 texels, also after rounding to bytes. Plain averaging
    loses more than two hundredths of the whole."""
    grid = AtlasGrid(4, 2)
    alpha = hair_alpha(1024, 512, grid)
    levels = alpha_chain(alpha, threshold=THRESHOLD, grid=grid)
    plain = mip_chain(alpha)
    lost = 0.0
    for level, averaged in zip(levels, plain, strict=True):
        in_bytes = np.rint(level * 255.0) / 255.0
        tile_size = level.size / grid.tile_count
        if tile_size < 16:
            break
        for tile in range(grid.tile_count):
            texels = tile_texels(level.shape, grid, tile)
            expected = coverage(alpha[tile_texels(alpha.shape, grid, tile)])
            most = max(0.01, 1.01 / tile_size)
            assert abs(coverage(level[texels]) - expected) <= most, (level.shape, tile)
            assert abs(coverage(in_bytes[texels]) - expected) <= most, (level.shape, tile)
        lost = max(lost, abs(coverage(averaged) - coverage(alpha)))
    assert lost > 0.02, "without care it would be lost"


@pytest.mark.parametrize("threshold", [0.1, 0.33, 0.9])
def test_coverage_is_kept_for_any_threshold(threshold: float) -> None:
    alpha = hair_alpha(512, 512, AtlasGrid(), seed=5)
    for level in alpha_chain(alpha, threshold=threshold)[:6]:
        kept = np.mean(level >= threshold)
        assert abs(kept - np.mean(alpha >= threshold)) <= 0.01, level.shape


def test_hair_neither_vanishes_nor_appears() -> None:
    """A single strand stays visible at all levels; empty and opaque tiles stay as they are."""
    grid = AtlasGrid(3, 1)
    alpha = np.zeros((64, 192), np.float32)
    alpha[:, 100] = 1.0  # a strand in the middle tile
    alpha[:, 128:] = 1.0  # the last tile is full
    for level in alpha_chain(alpha, grid=grid):
        if level.shape[1] % 3 or level.size < 48:
            break
        left, middle, right = np.split(level, 3, axis=1)
        assert (left == 0.0).all() and (right == 1.0).all()
        assert 0.0 < coverage(middle) <= 0.25
    assert coverage(alpha_chain(alpha)[-1]) == 1.0
    assert (alpha_chain(np.zeros((16, 16), np.float32))[-1] == 0.0).all()
    faint = np.full((16, 16), 0.2, np.float32)  # none of it passes the test
    assert all(coverage(level) == 0.0 for level in alpha_chain(faint))


def test_opaque_hair_stays_opaque() -> None:
    """Where averaging raises coverage, one factor for all alphas would make the middle clear."""
    across = np.abs(np.linspace(-1.0, 1.0, 256))
    alpha = np.broadcast_to(np.clip(2.0 - 2.2 * across, 0.0, 1.0), (256, 256)).astype(np.float32)
    for level in alpha_chain(alpha)[:5]:
        assert level[:, level.shape[1] // 2].min() == 1.0
        assert level[:, 0].max() < 0.2


def test_colours_have_no_dark_fringes() -> None:
    """The colour beside the strands, black here, has no weight as long as there is hair."""
    grid = AtlasGrid(2, 1)
    alpha = hair_alpha(256, 128, grid)
    color = np.array([0.8, 0.5, 0.3], np.float32)
    base = np.where(alpha[..., None] > 0.0, color, 0.0).astype(np.float32)
    levels = list(mip_levels({"alpha": alpha, "base": base}, grid=grid))
    assert len(levels) == 9
    for level in levels:
        has_hair = level["alpha"] > 0.0
        assert np.abs(level["base"][has_hair] - color).max() < 1e-6
    assert mip_chain(base)[-1].max() < 0.5, "without alpha it does"
    np.testing.assert_allclose(mip_chain(base, alpha=alpha)[-1], [[color]], rtol=1e-5)


def test_without_hair_colours_are_still_there() -> None:
    base = np.random.default_rng(4).random((8, 8, 3)).astype(np.float32)
    chain = mip_chain(base, alpha=np.zeros((8, 8), np.float32))
    np.testing.assert_allclose(chain[-1][0, 0], base.mean(axis=(0, 1)), rtol=1e-5)


def test_directions_are_averaged_as_vectors_and_are_unit_vectors() -> None:
    random = np.random.default_rng(5)
    vectors = random.normal(size=(40, 56, 3)) + [0.0, 1.5, 0.0]
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    alpha = random.random((40, 56)).astype(np.float32)
    coded = (0.5 * vectors + 0.5).astype(np.float32)
    chain = mip_chain(coded, alpha=alpha, is_direction=True)
    for level in chain:
        np.testing.assert_allclose(np.linalg.norm(2.0 * level - 1.0, axis=-1), 1.0, atol=1e-5)
    mean = (vectors * alpha[..., None]).sum(axis=(0, 1))
    np.testing.assert_allclose(2.0 * chain[-1][0, 0] - 1.0, mean / np.linalg.norm(mean), atol=1e-5)
    opposite = np.zeros((2, 2, 3), np.float32) + [0.5, 0.5, 0.5]
    opposite[0, :, 0], opposite[1, :, 0] = 0.0, 1.0
    chain = mip_chain(opposite.astype(np.float32), is_direction=True)
    np.testing.assert_allclose(chain[-1][0, 0], [0.5, 0.5, 1.0])


def test_strand_ids_are_those_of_strands() -> None:
    random = np.random.default_rng(6)
    ids = random.choice(np.array([0.1, 0.4, 0.9], np.float32), (32, 32))
    alpha = random.random((32, 32)).astype(np.float32)
    levels = list(mip_levels({"strand_id": ids, "alpha": alpha}))
    for level in levels:
        assert set(np.unique(level["strand_id"])) <= {np.float32(v) for v in (0.1, 0.4, 0.9)}
    block = ids[:2, :2].ravel()[np.argmax(alpha[:2, :2])]
    assert levels[1]["strand_id"][0, 0] == block


@pytest.mark.parametrize(
    ("width", "columns"), [(256, 4), (256, 8), (200, 5), (256, 3), (300, 7), (1000, 6)]
)
def test_tiles_do_not_run_into_each_other(width: int, columns: int) -> None:
    """Each tile has its own colour, which no level mixes while a tile has four texels."""
    grid = AtlasGrid(columns, 2)
    tile = np.floor((np.arange(width) + 0.5) * columns / width).astype(int)
    row = np.arange(128) // 64
    number = (tile[None] + columns * row[:, None]).astype(np.float32) / (2 * columns)
    levels = mip_chain(number, grid=grid)
    apart = [level for level in levels if min(level.shape[1] / columns, level.shape[0] / 2) >= 4]
    assert len(apart) >= 4
    for level in apart:
        height, wide = level.shape
        places = np.floor((np.arange(wide) + 0.5) * columns / wide) + columns * np.floor(
            (np.arange(height)[:, None] + 0.5) * 2 / height
        )
        np.testing.assert_allclose(level, places / (2 * columns), atol=1e-6)
