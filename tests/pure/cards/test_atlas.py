"""The strands that an atlas's tiles show, and the division of an atlas."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.cards.atlas import AtlasPlan, plan_atlas
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.strip import CardFrames, Strips
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands.face import BROWS

ROWS = 8


def strips_of(width: np.ndarray, length: np.ndarray) -> Strips:
    """Upright strips side by side, a metre apart, that face -Y."""
    count = len(width)
    center = np.zeros((count, ROWS, 3), np.float32)
    center[..., 0] = np.arange(count)[:, None]
    center[..., 2] = np.linspace(0.0, 1.0, ROWS) * length[:, None]
    axes = np.broadcast_to(np.eye(3, dtype=np.float32), (count, ROWS, 3, 3))
    frames = CardFrames(center, axes[..., 2, :], -axes[..., 1, :], axes[..., 0, :])
    return Strips(frames, np.repeat(width[:, None], ROWS, axis=1).astype(np.float32))


def tufts(
    width: np.ndarray, length: np.ndarray, strand_count: np.ndarray, radius: float
) -> tuple[Strips, np.ndarray, np.ndarray, np.ndarray]:
    """Strips with evenly spread straight strands: strips, grid, radius, cluster."""
    strips = strips_of(width, length)
    cluster = np.repeat(np.arange(len(width)), strand_count)
    number = np.concatenate([np.arange(count) for count in strand_count])
    share = (number + 0.5) / strand_count[cluster] - 0.5
    grid = strips.frames.center[cluster]
    grid = grid + strips.frames.side[cluster] * (share * width[cluster])[:, None, None]
    return strips, grid, np.full(grid.shape[:2], radius, np.float32), cluster


def test_few_cards_have_a_tile_each() -> None:
    parts = tufts(np.full(3, 0.02), np.full(3, 0.2), np.array([5, 7, 9]), 1e-4)
    plan = plan_atlas(*parts, np.zeros(21, int), AtlasSettings(size="512", columns=4, rows=1))
    assert plan.tile.tolist() == [0, 1, 2]
    assert np.diff(plan.offsets).tolist() == [5, 7, 9]
    assert parts[3][plan.strands].tolist() == plan.tile_of_strand.tolist()
    np.testing.assert_array_equal(plan.width_factor, 1.0)


def many(seed: int = 0) -> AtlasPlan:
    """60 cards of three clearly different kinds: narrow, wide, and long with few strands."""
    random = np.random.default_rng(4)
    kind = random.integers(3, size=60)
    wobble = random.uniform(0.95, 1.05, size=60)
    width = np.array([0.005, 0.04, 0.02])[kind] * wobble
    length = np.array([0.1, 0.1, 0.6])[kind] * wobble
    parts = tufts(width, length, np.array([6, 40, 3])[kind], 1e-4)
    settings = AtlasSettings(size="512", columns=3, rows=1, seed=seed)
    plan = plan_atlas(*parts, np.zeros(len(parts[1]), int), settings)
    for tile in range(3):
        assert len(np.unique(kind[plan.tile == tile])) == 1
    return plan


def test_cards_that_look_alike_share_a_tile() -> None:
    for seed in range(4):
        assert len(np.unique(many(seed).tile)) == 3


def test_cards_of_different_colours_share_no_tile() -> None:
    """Colours count more than shapes, which differ too; strands without a colour are a kind of
    their own."""
    random, kind = np.random.default_rng(5), np.arange(48) % 4
    width = 0.02 * random.uniform(0.7, 1.4, 48)
    parts = tufts(width, np.full(48, 0.2), np.full(48, 8), 1e-4)
    none = (np.nan,) * 3
    colors = np.array([(0.8, 0.02, 0.03), (0.01, 0.05, 0.6), (0.0, 0.0, 0.0), none])
    color = np.repeat(colors[kind[parts[3]], None], ROWS, axis=1)
    settings = AtlasSettings(size="512", columns=4, rows=1)
    group = np.zeros(len(parts[1]), int)
    plan = plan_atlas(*parts, group, settings, color)
    assert len(np.unique(np.stack([kind, plan.tile]), axis=1).T) == 4
    plain = plan_atlas(*parts, group, settings)
    assert len(np.unique(np.stack([kind, plain.tile]), axis=1).T) > 4, "or this shows nothing"


def test_the_same_seed_gives_the_same_plan() -> None:
    np.testing.assert_array_equal(many().strands, many().strands)


def test_brows_have_enough_tiles_and_unwidened_strands() -> None:
    """Brows get six of 16 tiles, where their proportion is one. Strands of all other hair are drawn
    wider, since cards are mostly seen at an angle."""
    parts = tufts(np.full(200, 0.02), np.full(200, 0.2), np.full(200, 6), 1e-4)
    is_brow = np.arange(200) < 12
    settings = AtlasSettings(size="512", columns=16, rows=1)
    plan = plan_atlas(*parts, np.where(is_brow, BROWS, 0)[parts[3]], settings)
    of_brows = np.unique(plan.tile[is_brow])
    assert len(of_brows) == 6 and len(plan.strips) == 16
    np.testing.assert_allclose(plan.thickness[of_brows], 1.0)
    np.testing.assert_allclose(np.delete(plan.thickness, of_brows), settings.strand_width)


def test_cards_at_a_hairline_have_tiles_of_their_own_and_unwidened_strands() -> None:
    """Strands of all other cards are drawn wider, as the setting says."""
    is_rim, count = np.arange(40) % 4 == 0, np.resize([6, 6, 9], 40)
    parts = tufts(np.full(40, 0.02), np.full(40, 0.2), count, 1e-4)
    settings = AtlasSettings(size="512", columns=4, rows=1, strand_width=1.5)
    plan = plan_atlas(*parts, np.zeros(len(parts[1]), int), settings, is_rim=is_rim)
    tiles = [np.unique(plan.tile[is_one]) for is_one in (is_rim, ~is_rim)]
    assert not set(tiles[0]) & set(tiles[1])
    for numbers, width in zip(tiles, (1.0, 1.5), strict=True):
        np.testing.assert_array_equal(plan.thickness[numbers], width)


def test_cards_at_a_hairline_are_hardly_widened() -> None:
    """A card with six times as many strands as its tile shows becomes a quarter wider there, and
    twice as wide elsewhere."""
    parts = tufts(np.full(2, 0.02), np.full(2, 0.2), np.array([3, 18]), 1e-4)
    settings = AtlasSettings(size="512", columns=1, rows=1)
    for is_rim, width in ((True, 1.25), (False, 2.0)):
        rim = np.full(2, is_rim)
        plan = plan_atlas(*parts, np.zeros(21, int), settings, is_rim=rim)
        wider = plan.width_factor.max() if plan.strands[0] == 0 else 1.0 / plan.width_factor.min()
        assert wider == pytest.approx(width)


def test_groups_and_single_strands_share_no_tile() -> None:
    count = np.array([6] * 10 + [1] * 10)
    parts = tufts(np.full(20, 0.02), np.full(20, 0.2), count, 1e-4)
    card_group = np.arange(20) % 2
    settings = AtlasSettings(size="512", columns=4, rows=1)
    plan = plan_atlas(*parts, 7 + card_group[parts[3]], settings)
    assert len(plan.strips) == 4
    for tile in range(4):
        shown = plan.tile == tile
        assert len(np.unique(card_group[shown])) == 1
        assert len(np.unique(count[shown])) == 1


def test_single_strands_share_no_tile_with_tufts_that_are_as_wide() -> None:
    """Width varies by a factor of ten within both kinds, a larger difference than the number of
    strands."""
    count = np.repeat([2, 1], 10)
    parts = tufts(np.resize([0.005, 0.05], 20), np.full(20, 0.2), count, 1e-4)
    settings = AtlasSettings(size="512", columns=2, rows=1)
    plan = plan_atlas(*parts, np.zeros(30, int), settings)
    shown = [set(count[plan.tile == tile]) for tile in range(2)]
    assert sorted(shown, key=min) == [{1}, {2}]


def test_more_groups_than_tiles_share_them() -> None:
    parts = tufts(np.full(9, 0.02), np.full(9, 0.2), np.full(9, 4), 1e-4)
    plan = plan_atlas(*parts, parts[3], AtlasSettings(size="512", columns=2, rows=1))
    assert plan.tile.max() == 1


def test_a_thin_card_is_narrowed_to_cover_as_much_as_its_own_strands() -> None:
    """Two cards with 10 and 8 strands share a tile, which shows the strands of one of them."""
    parts = tufts(np.full(2, 0.1), np.full(2, 0.2), np.array([10, 8]), 1e-4)
    for seed in range(8):
        settings = AtlasSettings(size="512", columns=1, rows=1, seed=seed)
        plan = plan_atlas(*parts, np.zeros(18, int), settings)
        expected = (1.0, 0.8) if len(plan.strands) == 10 else (1.25, 1.0)
        # strands are 0.2 % of the width, so that they hardly overlap
        np.testing.assert_allclose(plan.width_factor, expected, rtol=0.01)


def test_a_full_tile_keeps_its_thickness() -> None:
    parts = tufts(np.array([0.1]), np.array([0.2]), np.array([3000]), 1e-5)
    settings = AtlasSettings(size="512", columns=1, rows=1, strand_width=1.5)
    plan = plan_atlas(*parts, np.zeros(3000, int), settings)
    assert len(plan.strands) == 1024
    assert plan.thickness[0] * len(plan.strands) == pytest.approx(1.5 * 3000)
    assert any("tiles do not all fit" in note for note in plan.notes)


def test_notes_say_what_is_smaller_than_a_pixel() -> None:
    """0.1 m on 504 pixels: strands of 0.05 mm are a quarter of a pixel, and one pixel in an atlas
    of 2048."""
    parts = tufts(np.array([0.1]), np.array([0.2]), np.array([30]), 2.5e-5)
    settings = AtlasSettings(size="512", columns=1, rows=1)
    (note,) = plan_atlas(*parts, np.zeros(30, int), settings).notes
    assert "0.25 pixels" in note
    assert "an atlas of 2048 would" in note
    thick = (*parts[:2], parts[2] * 10.0, parts[3])
    assert plan_atlas(*thick, np.zeros(30, int), settings).notes == ()


def test_notes_count_short_strands() -> None:
    strips, grid, radius, cluster = tufts(np.array([0.1]), np.array([0.2]), np.array([4]), 1e-3)
    grid[2] = grid[2, :1] + 1e-6 * (grid[2] - grid[2, :1])
    settings = AtlasSettings(size="512", columns=1, rows=1)
    (note,) = plan_atlas(strips, grid, radius, cluster, np.zeros(4, int), settings).notes
    assert note.startswith("1 strands are shorter than a pixel")


def test_an_atlas_that_is_too_small_says_by_how_much() -> None:
    settings = AtlasSettings(size="512", columns=32, rows=4, padding=8)
    with pytest.raises(HairloomError, match=r"need 640, which is 128 more"):
        _ = settings.grid
    assert AtlasSettings(size="1024", columns=32, rows=4, padding=8).grid.tile_count == 128


@pytest.mark.parametrize(("count", "radius", "size"), [(20, 1e-3, 256), (400, 5e-4, 1024)])
def test_an_automatic_atlas_is_as_large_as_its_strands_need(
    count: int, radius: float, size: int
) -> None:
    """The smallest size in which strands are at least one and a half texels wide."""
    parts = tufts(np.full(count, 0.02), np.full(count, 0.1), np.full(count, 5), radius)
    settings = AtlasSettings(strand_width=1.0)
    plan = plan_atlas(*parts, np.zeros(len(parts[1]), int), settings)
    assert plan.size == size
    used = len(plan.strips)
    assert used == min(count, settings.columns * settings.rows)
    assert used > plan.grid.columns * (plan.grid.rows - 1)  # no row of tiles is empty

    def texels(side: int) -> float:
        across = side / plan.grid.columns - 2 * settings.padding
        return 2.0 * radius / 0.02 * across

    assert texels(plan.size) >= 1.5 > texels(plan.size // 2)


def test_an_automatic_atlas_has_a_maximum_size() -> None:
    """At the maximum size a note reports strands that are too thin."""
    parts = tufts(np.full(64, 0.02), np.full(64, 0.2), np.full(64, 5), 1e-6)
    plan = plan_atlas(*parts, np.zeros(len(parts[1]), int), AtlasSettings())
    assert plan.size == 2048
    (note,) = plan.notes
    assert note.startswith("strands are 0.")


def test_a_chosen_size_is_that_of_the_atlas() -> None:
    parts = tufts(np.full(3, 0.02), np.full(3, 0.2), np.full(3, 5), 1e-3)
    plan = plan_atlas(*parts, np.zeros(15, int), AtlasSettings(size="4096", columns=8, rows=2))
    assert (plan.size, plan.grid.columns, plan.grid.rows) == (4096, 8, 2)


def test_strands_without_width_are_refused() -> None:
    parts = tufts(np.array([0.1]), np.array([0.2]), np.array([4]), 0.0)
    with pytest.raises(HairloomError, match="no strand has a width"):
        plan_atlas(*parts, np.zeros(4, int), AtlasSettings())


def test_padding_is_what_the_grid_leaves_free() -> None:
    settings = AtlasSettings(size="1024", columns=16, rows=2, padding=6)
    low = settings.grid.uv(np.array(17), np.array(0.0), np.array(0.0)) * 1024
    high = settings.grid.uv(np.array(17), np.array(1.0), np.array(1.0)) * 1024
    np.testing.assert_allclose(low, [64 + 6, 512 + 6], atol=1e-3)
    np.testing.assert_allclose(high, [128 - 6, 1024 - 6], atol=1e-3)
