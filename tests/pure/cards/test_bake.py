"""Strands that are laid flat and baked, against their known geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.cards.atlas import AtlasPlan
from hairloom.addon.cards.atlas_depth import relative_depths
from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.atlas_maps import AtlasMaps, dilated, tile_edges
from hairloom.addon.cards.bake import sample_maps
from hairloom.addon.cards.bake_strands import FlatStrands, flat_strands
from hairloom.addon.cards.strip import CardFrames, Strips

ROWS = 6
WIDTH, LENGTH = 0.02, 0.02


def upright(count: int, rows: int = ROWS) -> Strips:
    """Square strips that stand on the ground, face -Y and run along X across."""
    center = np.zeros((count, rows, 3), np.float32)
    center[..., 2] = np.linspace(0.0, LENGTH, rows)
    axes = np.broadcast_to(np.eye(3, dtype=np.float32), (count, rows, 3, 3))
    frames = CardFrames(center, axes[..., 2, :], -axes[..., 1, :], axes[..., 0, :])
    return Strips(frames, np.full((count, rows), WIDTH, np.float32))


def plan_of(per_tile: list[int], atlas: AtlasGrid | None = None, rows: int = ROWS) -> AtlasPlan:
    count = len(per_tile)
    return AtlasPlan(
        grid=atlas or AtlasGrid(),
        size=512,
        tile=np.arange(count),
        width_factor=np.ones(count),
        strips=upright(count, rows),
        strands=np.arange(sum(per_tile)),
        offsets=np.cumsum([0, *per_tile]),
        thickness=np.ones(count),
    )


def lines(
    across: np.ndarray, *, end: np.ndarray | None = None, depth: float = 0.0, rows: int = ROWS
) -> np.ndarray:
    """Straight strands from root to tip; across from -0.5 to 0.5, at the tip `end`."""
    end = across if end is None else end
    along = np.linspace(0.0, 1.0, rows)
    grid = np.zeros((len(across), rows, 3), np.float32)
    grid[..., 0] = WIDTH * (across[:, None] + (end - across)[:, None] * along)
    grid[..., 1] = -depth
    grid[..., 2] = LENGTH * along
    return grid


def baked(
    plan: AtlasPlan, grid: np.ndarray, width: float, size: int, base: np.ndarray | None = None
) -> tuple[FlatStrands, AtlasMaps]:
    """Bake strands; `width` is a strand's width as a fraction of the card's."""
    radius = np.full(grid.shape[:2], 0.5 * width * WIDTH, np.float32)
    flat = flat_strands(plan, grid, radius, base)
    return flat, sample_maps(flat, size)


@pytest.mark.parametrize("width", [0.05, 0.03, 0.0051, 0.0007])
def test_parallel_strands_cover_the_sum_of_their_widths(width: float) -> None:
    """Alpha is the sum of all widths. In 64 pixels, 0.05 is three pixels and 0.0007 a twentieth of
    one, which samples can miss."""
    across = np.linspace(-0.34, 0.33, 8)
    _, maps = baked(plan_of([8]), lines(across, rows=ROWS), width, 64)
    assert maps.alpha.mean() == pytest.approx(8 * width, rel=0.05)


def test_overlapping_strands_are_fully_opaque() -> None:
    across = np.linspace(-0.3, 0.3, 80)
    _, maps = baked(plan_of([80]), lines(across), 0.02, 32)
    middle = maps.alpha[1:-1, 8:24]
    np.testing.assert_array_equal(middle, 1.0)


def test_slanting_strands_cover_their_projected_area() -> None:
    """A slanting ribbon keeps its width across its direction and is longer than an upright one."""
    across = np.array([-0.33, -0.1, 0.1])
    slope = np.tan(np.radians(12.0))
    _, maps = baked(plan_of([3]), lines(across, end=across + slope), 0.03, 96)
    length = np.hypot(1.0, slope)
    assert maps.alpha.mean() == pytest.approx(3 * 0.03 * length, rel=0.04)


def test_a_diagonal_strand_has_its_direction_in_the_tangent_map() -> None:
    """A strand 30 degrees aside and 20 out of the card has this direction as its unit tangent."""
    grid = lines(np.array([-0.3]), end=np.array([-0.3 + np.tan(np.radians(30.0))]))
    grid[0, :, 1] = -np.linspace(0.0, LENGTH * np.tan(np.radians(20.0)), ROWS)
    flat, maps = baked(plan_of([1]), grid, 0.05, 64)
    way = np.array([np.tan(np.radians(30.0)), 1.0, np.tan(np.radians(20.0))])
    way /= np.linalg.norm(way)
    shown = maps.tangent[maps.alpha > 0.0]
    np.testing.assert_allclose(shown, np.broadcast_to(0.5 * way + 0.5, shown.shape), atol=1e-3)
    row, column = np.nonzero(maps.alpha > 0.5)
    slope = np.polyfit(row, column, 1)[0]
    assert slope == pytest.approx(np.tan(np.radians(30.0)), rel=0.02)
    assert flat.depth[0, 0] == pytest.approx(0.5)
    assert flat.depth[0, -1] == pytest.approx(0.5 + np.tan(np.radians(20.0)) * LENGTH / WIDTH)


def test_normals_are_those_of_a_round_strand() -> None:
    """Across a strand the normal's x goes linearly from -1 to 1, with z = sqrt(1 - x^2)."""
    _, maps = baked(plan_of([1]), lines(np.array([0.0])), 0.5, 64)
    x, y, z = np.moveaxis(2.0 * maps.normal[32, 17:47] - 1.0, -1, 0)
    place = (np.arange(17, 47) + 0.5 - 32.0) / 16.0
    np.testing.assert_allclose(x, place, atol=0.03)
    np.testing.assert_allclose(y, 0.0, atol=1e-6)
    np.testing.assert_allclose(z, np.sqrt(1.0 - place**2), atol=0.04)


def test_along_rises_evenly_from_root_to_tip_of_a_curl() -> None:
    """A helix along the strip: at height z of the card `along` is z, and place and depth are the
    helix's."""
    rows = 64
    turn = np.linspace(0.0, 4.0 * np.pi, rows)
    grid = lines(np.array([0.0]), rows=rows)
    grid[0, :, 0] += 0.3 * WIDTH * np.cos(turn)
    grid[0, :, 1] -= 0.3 * WIDTH * np.sin(turn)
    _, maps = baked(plan_of([1], rows=rows), grid, 0.05, 128)
    row, column = np.nonzero(maps.alpha > 0.9)
    height = (row + 0.5) / 128
    np.testing.assert_allclose(maps.along[row, column], height, atol=0.03)
    turns = 4.0 * np.pi * maps.along[row, column]
    np.testing.assert_allclose((column + 0.5) / 128, 0.5 + 0.3 * np.cos(turns), atol=0.04)
    outside = 0.5 + 0.3 * np.sin(turns)
    np.testing.assert_allclose(maps.depth[row, column], outside, atol=0.02)


def test_the_outermost_strand_shows() -> None:
    grid = np.concatenate([lines(np.array([0.0]), depth=0.004), lines(np.array([0.0]))])
    for order in ([0, 1], [1, 0]):
        flat, maps = baked(plan_of([2]), grid[order], 0.2, 32)
        front = order.index(0)
        assert maps.strand_id[16, 16] == flat.strand_id[front]
        assert maps.depth[16, 16] == pytest.approx(0.7)


def test_strands_behind_others_are_occluded() -> None:
    """exp(-tau) behind a strand of 0.1 of the card's width, which counts over a quarter of that
    width: tau is 0.4. Nothing lies before the front strand."""
    grid = np.concatenate([lines(np.array([0.05]), depth=0.004), lines(np.array([0.0]))])
    flat, _ = baked(plan_of([2]), grid, 0.1, 32)
    np.testing.assert_allclose(flat.occlusion[0], 1.0)
    np.testing.assert_allclose(flat.occlusion[1], np.exp(-0.4), rtol=1e-5)
    apart = np.concatenate([lines(np.array([0.3]), depth=0.004), lines(np.array([0.0]))])
    np.testing.assert_allclose(baked(plan_of([2]), apart, 0.1, 32)[0].occlusion, 1.0)


def test_colours_are_at_most_one_and_the_gain_restores_them() -> None:
    base = np.ones((2, ROWS, 3), np.float32)
    base[0] *= (1.6, 0.8, 0.4)
    flat, maps = baked(plan_of([2]), lines(np.array([-0.2, 0.2])), 0.2, 32, base)
    assert maps.base.max() <= 1.0
    np.testing.assert_allclose(maps.base[16, 9] * maps.base_gain, (1.6, 0.8, 0.4), rtol=1e-5)
    np.testing.assert_allclose(maps.base[16, 22] * flat.base_gain, 1.0, rtol=1e-5)


def test_strands_beyond_the_strip_are_compressed_into_it() -> None:
    """Nothing is cut off: not at the sides, nor before the root, nor beyond the tip."""
    across = np.array([-0.9, -0.2, 0.0, 0.2, 0.9])
    grid = lines(across)
    grid[2, :, 2] = np.linspace(-0.3 * LENGTH, 1.4 * LENGTH, ROWS)
    flat, maps = baked(plan_of([5]), grid, 0.04, 64)
    edges = np.stack([flat.place - flat.half_width, flat.place + flat.half_width])
    assert edges.min() >= 0.0
    assert edges.max() <= 1.0
    np.testing.assert_allclose(flat.place[1:4, 0, 0], 0.5 + across[1:4], atol=1e-6)
    assert maps.alpha.mean() == pytest.approx(5 * 0.04, rel=0.08)


def test_strands_begin_where_their_roots_are() -> None:
    """At a hairline, each at its own place, and not in a straight row."""
    grid, late = lines(np.zeros(3)), np.array([0.0, 0.05, 0.5])
    for strand, start in enumerate(late):
        grid[strand, :, 2] = np.linspace(start, 1.0, ROWS) * LENGTH
    flat, _ = baked(plan_of([3]), grid, 0.04, 64)
    np.testing.assert_allclose(flat.place[:, 0, 1], late, atol=1e-6)
    np.testing.assert_allclose(flat.place[:, -1, 1], 1.0, atol=1e-6)
    assert (np.diff(flat.place[..., 1], axis=1) > 0.0).all()


def test_roots_on_a_slanted_edge_begin_at_the_edge_of_the_tile() -> None:
    """The card itself is slanted there; from a quarter of it on it is square."""
    across, slope = np.linspace(-0.3, 0.3, 5), 0.3
    grid = lines(across, rows=9)
    plan = replace(plan_of([5], rows=9), root_slope=np.array([slope], np.float32))
    slanted = grid.copy()
    slanted[..., 2] += slope * slanted[..., 0] * np.maximum(1.0 - np.linspace(0.0, 4.0, 9), 0.0)
    square, _ = baked(plan_of([5], rows=9), grid, 0.04, 64)
    flat, _ = baked(plan, slanted, 0.04, 64)
    np.testing.assert_allclose(flat.place, square.place, atol=1e-6)


def test_strips_without_size_give_finite_maps() -> None:
    plan = plan_of([2])
    frames = replace(plan.strips.frames, center=np.zeros_like(plan.strips.frames.center))
    flat_plan = replace(plan, strips=Strips(frames, np.zeros_like(plan.strips.width)))
    flat, maps = baked(flat_plan, np.zeros((2, ROWS, 3), np.float32), 0.1, 16)
    for values in (flat.place, flat.half_width, flat.depth, flat.tangent, *maps.by_name.values()):
        assert np.isfinite(values).all()


def red_and_green(grid: AtlasGrid, size: int) -> AtlasMaps:
    """Tiles of red and of green strands, alternating as on a chessboard."""
    count = grid.tile_count
    plan = plan_of([3] * count, grid)
    strands = np.concatenate([lines(np.array([-0.5, 0.1, 0.5]))] * count)
    base = np.zeros((len(strands), ROWS, 3), np.float32)
    parity = np.arange(count) % grid.columns + np.arange(count) // grid.columns
    base[np.arange(len(strands)), :, np.repeat(parity % 2, 3)] = 1.0
    return dilated(baked(plan, strands, 0.02, size, base)[1], grid)


@pytest.mark.parametrize(("columns", "rows"), [(4, 2), (5, 3)])
def test_no_tile_reaches_into_another(columns: int, rows: int) -> None:
    """Each texel has its tile's colour, also in the padding, which contains no hair."""
    size, share = 128, 4 / 128
    grid = AtlasGrid(columns, rows, (share * columns, share * rows))
    maps = red_and_green(grid, size)
    row, column = np.indices((size, size)) + 0.5
    tile_row, tile_column = (row * rows / size).astype(int), (column * columns / size).astype(int)
    is_green = (tile_row + tile_column) % 2
    np.testing.assert_allclose(maps.base[..., 0], 1 - is_green, atol=1e-6)
    np.testing.assert_allclose(maps.base[..., 1], is_green, atol=1e-6)
    within = [
        np.minimum(place % (size / count), -place % (size / count))
        for place, count in ((row, rows), (column, columns))
    ]
    assert maps.alpha[np.minimum(*within) < 3.5].max() == 0.0
    assert maps.alpha.max() > 0.3


def test_no_tile_reaches_into_another_in_mip_maps() -> None:
    """Down to the level at which a tile is 4 texels wide, each has its tile's colour alone."""
    grid = AtlasGrid(4, 4, (1 / 8, 1 / 8))
    base = red_and_green(grid, 128).base
    while len(base) > 16:
        base = base.reshape(len(base) // 2, 2, len(base) // 2, 2, 3).mean(axis=(1, 3))
    row, column = np.indices((16, 16)) // 4
    np.testing.assert_allclose(base[..., 1], (row + column) % 2, atol=1e-6)


def test_tiles_without_hair_are_plain() -> None:
    grid = AtlasGrid(2, 1)
    maps = dilated(baked(plan_of([3], grid), lines(np.array([-0.2, 0.0, 0.2])), 0.1, 32)[1], grid)
    np.testing.assert_array_equal(maps.normal[:, 16:], np.full((32, 16, 3), (0.5, 0.5, 1.0)))
    np.testing.assert_array_equal(maps.occlusion[:, 16:], 1.0)


def test_values_are_interpolated_between_hairs() -> None:
    """Between two strands, depth is interpolated, while the strand's number is one of the two."""
    grid = np.concatenate([lines(np.array([-0.3]), depth=0.008), lines(np.array([0.3]))])
    flat, maps = baked(plan_of([2]), grid, 0.1, 64)
    whole = dilated(maps, AtlasGrid())
    between = slice(16, 48)
    assert (np.diff(whole.depth[32, between]) < 0.0).all()
    assert set(whole.strand_id[32, between]) == set(flat.strand_id)
    np.testing.assert_array_equal(whole.alpha, maps.alpha)


def test_a_texel_belongs_to_the_tile_that_holds_its_middle() -> None:
    assert tile_edges(128, 5).tolist() == [0, 26, 51, 77, 102, 128]
    assert tile_edges(64, 4).tolist() == [0, 16, 32, 48, 64]


@pytest.mark.parametrize(("bend", "column"), [(0.0, 0), (0.4, 1)])
def test_relative_depth_places_a_strand_among_its_neighbours(bend: float, column: int) -> None:
    """Straight strands at random in a slab, flat or bent about the head, against the foremost one
    at 16 places of each texel: how much deeper it lies in the slab than these do on average."""
    random, count, deep, width = np.random.default_rng(2), 300, 0.3 * WIDTH, 0.03
    across, behind = random.uniform(-0.48, 0.48, count), random.random(count)
    grid = lines(across)
    grid[..., 1] = (bend * WIDTH * across**2 - deep * (0.5 - behind))[:, None]
    single = np.zeros((1, ROWS, 3), np.float32)
    beside = slice(None, None, 1 - 2 * column)
    plan = plan_of([count, 1][beside], AtlasGrid(2, 1))
    flat, maps = baked(plan, np.concatenate([grid, single][beside]), width, 64)
    tiles = np.split(relative_depths(maps, flat, plan), 2, axis=1)
    sample = (np.arange(32 * 16) + 0.5) / (32 * 16) - 0.5
    is_met = np.abs(sample[:, None] - across) < 0.5 * width
    foremost = np.where(is_met, grid[:, 0, 1], np.inf).argmin(axis=1)
    visible = behind[foremost].reshape(32, 16).mean(axis=1)[2:-2]
    expected = 0.5 + 0.5 * (visible - visible.mean())
    place = tiles[column][:, 2:-2]
    assert np.abs(place - expected).mean() < 0.03
    assert np.corrcoef(place.mean(axis=0), expected)[0, 1] > 0.7
    assert (tiles[1 - column] == 0.5).all()  # a single strand has no depth
