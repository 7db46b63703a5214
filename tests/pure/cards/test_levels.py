"""Levels of detail: each has half the triangles of the one before, covers the same area, and uses
the same atlas."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.joining import join_pairs, pairs_to_join
from hairloom.addon.cards.levels import card_levels
from hairloom.addon.cards.segments import with_segments
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.strip import CardFrames, Strips, UncutCards, strip_mesh
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import closest_point
from hairloom.addon.strands.frames import tangents, transported_normals

ROWS = 17


def fall(count: int = 300, seed: int = 3, groups: int = 2) -> UncutCards:
    """Cards that leave a ball along its normal and then fall."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=(count, 3))
    normal[:, 2] = np.abs(normal[:, 2])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, ROWS)[:, None]
    center = normal[:, None] * (0.1 + 0.06 * np.sin(along * np.pi / 2.0))
    center = (center + along**2 * [0.0, 0.0, -0.2]).astype(np.float32)
    tangent = tangents(center)
    across = transported_normals(tangent, normal.astype(np.float32))
    frames = CardFrames(center, tangent, across, np.cross(tangent, across))
    width = np.full((count, ROWS), 0.012, np.float32)
    none = np.zeros(count, np.int32)
    tile = random.integers(8, size=count)
    group = (np.arange(count) % groups).astype(np.int32)
    return UncutCards(Strips(frames, width), none + 5, group, none, tile, AtlasGrid(columns=8))


def area(mesh: CardMesh) -> float:
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


def seen(mesh: CardMesh, toward: int, pixels: int = 64) -> np.ndarray:
    """The pixels that the mesh covers in a view along an axis, by random points on it."""
    random = np.random.default_rng(0)
    corners = mesh.positions[mesh.triangles]
    share = random.dirichlet([1.0, 1.0, 1.0], size=(len(corners), 100))
    points = np.einsum("tsk,tki->tsi", share, corners).reshape(-1, 3)
    flat = (np.delete(points, toward, axis=1) + 0.2) / 0.4 * pixels
    column, row = np.clip(flat.astype(int), 0, pixels - 1).T
    covered = np.zeros((pixels, pixels), bool)
    covered[row, column] = True
    return covered


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_each_level_has_about_half_the_triangles_of_the_one_before(columns: int) -> None:
    settings = CardSettings(levels=5, column_count=columns, error=0.001)
    levels = card_levels(fall(), settings, settings.error)
    counts = [len(level.mesh.triangles) for level in levels]
    assert len(counts) == 5
    for finer, coarser in pairwise(counts):
        assert 0.4 <= coarser / finer <= 0.6


@pytest.mark.parametrize("budget", [600, 2400])
def test_the_finest_level_keeps_to_a_budget_of_triangles(budget: int) -> None:
    settings = CardSettings(levels=2, max_triangles=budget)
    levels = card_levels(fall(), settings, 0.0)
    assert 0.7 * budget <= len(levels[0].mesh.triangles) <= budget
    assert len(levels[1].mesh.triangles) <= 0.6 * len(levels[0].mesh.triangles)


def test_rows_go_first_then_columns_then_cards() -> None:
    settings = CardSettings(levels=5, column_count=2, error=0.002)
    levels = card_levels(fall(), settings, settings.error)
    cards = [level.mesh.card_count for level in levels]
    assert cards[0] == cards[1] == 300 and cards[-1] < 300
    errors = [level.error for level in levels]
    assert errors == sorted(errors) and errors[0] <= 0.002


def test_the_stated_error_holds_for_the_edges() -> None:
    """Nine tenths of the finest edges lie within the stated error of the level's surface, by their
    distance in space."""
    cards = fall(120)
    settings = CardSettings(levels=4, bend=0.0, error=0.0)
    levels = card_levels(cards, settings, 0.0)
    half = cards.strips.frames.side * 0.006
    edges = np.concatenate([cards.strips.frames.center - half, cards.strips.frames.center + half])
    for level in levels:
        surface = Surface(level.mesh.positions, level.mesh.triangles)
        distance = closest_point(edges.reshape(-1, 3), surface).distance
        assert np.percentile(distance, 90.0) <= level.error + 1e-5


def test_all_levels_show_the_same_tiles_and_keep_numbers_and_groups() -> None:
    cards = fall()
    levels = [each.mesh for each in card_levels(cards, CardSettings(levels=5), 0.001)]
    for mesh in levels:
        assert mesh.atlas == cards.atlas
        np.testing.assert_array_equal(mesh.tile, cards.tile)
        np.testing.assert_array_equal(mesh.group, cards.group)
        owner = np.zeros(len(mesh.positions), int)
        owner[mesh.triangles] = mesh.card[:, None]
        for number in np.unique(mesh.card)[:20]:
            own = mesh.uv[owner == number]
            tile = cards.tile[number]
            np.testing.assert_allclose(own.min(axis=0), [tile / 8, 0.0], atol=1e-6)
            np.testing.assert_allclose(own.max(axis=0), [(tile + 1) / 8, 1.0], atol=1e-6)
    assert set(levels[-1].card.tolist()) < set(levels[0].card.tolist())


def test_the_hair_covers_as_much_in_every_level() -> None:
    levels = [each.mesh for each in card_levels(fall(400), CardSettings(levels=4), 0.001)]
    for toward in range(3):
        finest = seen(levels[0], toward)
        for mesh in levels[1:]:
            both = (finest & seen(mesh, toward)).sum() / (finest | seen(mesh, toward)).sum()
            assert both > 0.85


def test_cards_that_cannot_be_halved_have_fewer_levels() -> None:
    one = fall(1, groups=1)
    settings = CardSettings(levels=5, column_count=1, segment_count=4)
    counts = [len(level.mesh.triangles) for level in card_levels(one, settings, None)]
    assert counts == [8, 4, 2]
    assert len(card_levels(fall(0), CardSettings(levels=3), None)) == 1


def test_guides_keep_all_rows_in_the_finest_level() -> None:
    settings = CardSettings(levels=1, segment_count=16, column_count=2)
    mesh = card_levels(fall(10), settings, None)[0].mesh
    assert len(mesh.triangles) == 10 * 16 * 2 * 2


def side_by_side(gap: tuple[float, float, float]) -> UncutCards:
    """Two straight cards 1 cm wide, the second moved by `gap`."""
    along = np.linspace(0.0, 0.2, ROWS)[:, None] * [0.0, 0.0, -1.0]
    center = np.stack([along, along + np.array(gap)]).astype(np.float32)
    way = (np.broadcast_to(np.float32(v), center.shape) for v in np.eye(3)[[2, 1, 0]])
    tangent, normal, side = way
    frames = CardFrames(center, -tangent, normal, side)
    none = np.zeros(2, np.int32)
    strips = Strips(frames, np.full((2, ROWS), 0.01, np.float32))
    return UncutCards(strips, none + 1, none, none, none, AtlasGrid())


def test_two_cards_side_by_side_become_one_of_both_widths() -> None:
    cards = side_by_side((0.01, 0.0, 0.0))
    pairs = pairs_to_join(cards.strips, cards.strand_count, cards.group, np.arange(2))
    np.testing.assert_array_equal(pairs, [[0, 1]])
    strips, count = join_pairs(cards.strips, cards.strand_count, pairs)
    np.testing.assert_allclose(strips.width[0], 0.02, rtol=1e-4)
    np.testing.assert_allclose(strips.frames.center[0, :, 0], 0.005, atol=1e-6)
    assert count[0] == 2


def test_two_cards_on_each_other_become_one_between_the_same_and_twice_the_width() -> None:
    cards = side_by_side((0.0, 0.004, 0.0))
    strips, _ = join_pairs(cards.strips, cards.strand_count, np.array([[0, 1]]))
    np.testing.assert_allclose(strips.width[0], 0.01 * np.sqrt(2.0), rtol=1e-4)
    np.testing.assert_allclose(strips.frames.center[0, :, 1], 0.002, atol=1e-6)


def test_the_card_of_more_strands_keeps_its_number_and_hardly_moves() -> None:
    cards = side_by_side((0.01, 0.0, 0.0))
    count = np.array([1, 99], np.int32)
    pairs = pairs_to_join(cards.strips, count, cards.group, np.arange(2))
    np.testing.assert_array_equal(pairs, [[1, 0]])
    strips, _ = join_pairs(cards.strips, count, pairs)
    np.testing.assert_allclose(strips.frames.center[1, :, 0], 0.0099, atol=1e-6)
    assert 0.01 < strips.width[1, 0] < 0.015


def test_cards_of_two_groups_are_never_joined_and_no_card_joins_twice() -> None:
    cards = fall(200, groups=5)
    pairs = pairs_to_join(cards.strips, cards.strand_count, cards.group, np.arange(200))
    assert len(pairs) > 50
    assert len(np.unique(pairs)) == pairs.size
    np.testing.assert_array_equal(cards.group[pairs[:, 0]], cards.group[pairs[:, 1]])
    alone = replace(cards, group=np.arange(200, dtype=np.int32))
    assert not len(pairs_to_join(alone.strips, alone.strand_count, alone.group, np.arange(200)))


def test_neighbours_are_those_that_brute_force_finds() -> None:
    cards = fall(60, groups=1)
    pairs = pairs_to_join(cards.strips, cards.strand_count, cards.group, np.arange(60))
    rows = np.linspace(0, ROWS - 1, 6).round().astype(int)
    place = cards.strips.frames.center[:, rows].reshape(60, -1)
    gap = ((place[:, None] - place) ** 2).sum(axis=2) + np.eye(60) * 1e9
    assert set(pairs[0].tolist()) == set(np.unravel_index(gap.argmin(), gap.shape))


def hook(row_count: int = 41, arc: float = 0.2) -> Strips:
    """One flat card that turns by 90 degrees in its first part and is straight behind that."""
    along = np.linspace(0.0, 1.0, row_count)
    radius = arc / (np.pi / 2.0)
    turn = np.minimum(along, arc) / radius
    behind = np.maximum(along - arc, 0.0)
    center = np.zeros((1, row_count, 3), np.float32)
    center[0, :, 0] = radius * (1.0 - np.cos(turn)) + behind
    center[0, :, 2] = radius * np.sin(turn)
    tangent = tangents(center)
    normal = np.cross(tangent, np.float32([0.0, 1.0, 0.0]))
    frames = CardFrames(center, tangent, normal, np.cross(tangent, normal))
    return Strips(frames, np.full((1, row_count), 0.01, np.float32))


def deviation(line: np.ndarray, corners: np.ndarray) -> float:
    """The largest distance of a line's points from the nearest of the segments between corners."""
    begin, step = corners[:-1], np.diff(corners, axis=0)
    away = line[:, None] - begin
    fraction = np.clip((away * step).sum(axis=-1) / (step * step).sum(axis=-1), 0.0, 1.0)
    return float(np.linalg.norm(away - fraction[..., None] * step, axis=-1).min(axis=1).max())


def test_rows_lie_closer_where_a_card_bends() -> None:
    """With as many rows, the card stays three times as close to its hair as with even ones."""
    strips, segments = hook(), 6
    line = strips.frames.center[0]
    cut = with_segments(strips, np.arange(1), segments)
    places = cut.places[0]
    even = line[np.round(np.linspace(0, len(line) - 1, segments + 1)).astype(int)]
    assert deviation(line, cut.frames.center[0]) < deviation(line, even) / 3.0
    assert places[0] == 0.0 and places[-1] == 1.0 and (np.diff(places) > 0.0).all()
    np.testing.assert_allclose(cut.frames.center[0, :, 1], 0.0, atol=1e-7)


def test_rows_of_straight_cards_are_close_at_the_root_and_even_behind_it() -> None:
    steps = np.diff(with_segments(hook(arc=1e-6), np.arange(1), 12).places[0])
    assert steps[0] < steps[-1] / 3.0
    np.testing.assert_allclose(steps[-4:], steps[-1], rtol=0.05)


def test_cards_with_a_row_at_each_cv_keep_all_rows() -> None:
    whole = with_segments(hook(), np.arange(1), 40)
    np.testing.assert_array_equal(whole.frames.center, hook().frames.center)


def test_the_texture_does_not_slide_along_unevenly_cut_cards() -> None:
    """A vertex shows the same place of the strands as without a cut: its place along the card."""
    strips = hook()
    numbers, none = np.arange(1), np.zeros(1, np.int32)
    cards = UncutCards(strips, none + 5, none, none, none, AtlasGrid(columns=1))
    settings = CardSettings(column_count=2, bend=0.0)
    cut = with_segments(strips, numbers, 6)
    mesh = strip_mesh([(numbers, cut)], cards, 2, settings)
    whole = np.linspace(0.0, 1.0, strips.width.shape[1])
    for axis in (0, 2):
        expected = np.interp(mesh.along, whole, strips.frames.center[0, :, axis])
        np.testing.assert_allclose(mesh.positions[:, axis], expected, atol=1e-6)
    np.testing.assert_allclose(mesh.uv[:, 1], mesh.along, atol=1e-6)


def test_no_level_gives_an_artists_own_card_more_triangles_than_it_has() -> None:
    cards = fall(60)
    kept = np.where(np.arange(60) == 7, 4, 0)
    settings = CardSettings(levels=3, column_count=2)
    for level, usual in zip(
        card_levels(cards, settings, 0.0002, kept),
        card_levels(cards, settings, 0.0002),
        strict=True,
    ):
        own, made = (int((each.mesh.card == 7).sum()) for each in (level, usual))
        assert own <= 4 < made
