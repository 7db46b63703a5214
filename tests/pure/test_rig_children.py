"""`rig_flow.prepare` with children: which strands are guides, which children, and its notes."""

from dataclasses import replace

import numpy as np
import pytest
from baby_hair import short_strands, wig
from small_wig import GUIDES, sheet, wig_strands

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.card_flow import card_groom
from hairloom.addon.cards.card_strands import card_strands
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.strands import Surface


def rig_of(children: ChildrenSettings | None, head: Surface | None) -> rig_flow.Rig:
    return rig_flow.prepare(wig_strands(), head, GUIDES, place="a wig", children=children)


def test_none_is_as_without_the_setting() -> None:
    for head in (sheet(), None):
        plain, none = rig_of(None, head), rig_of(ChildrenSettings(method="none"), head)
        np.testing.assert_array_equal(none.strands.points, plain.strands.points)
        np.testing.assert_array_equal(none.guides, plain.guides)
        np.testing.assert_array_equal(none.weights.weight, plain.weights.weight)
        assert none.strands.strand_count == 60 and none.notes == ()


def test_an_artist_reads_which_curves_are_simulated() -> None:
    some = rig_of(None, sheet())
    assert (
        some.guides_line == "30 of 60 curves are simulated, with 6 points each; the others follow"
    )
    more = rig_of(ChildrenSettings(method="multi", strand_count=2000), sheet())
    assert more.guides_line == f"{some.guides_line}. 2,000 children follow, too"
    few = rig_flow.prepare(wig_strands(20), sheet(), GUIDES, place="a wig")
    assert few.guides_line == "All 20 curves are simulated, with 6 points each"


@pytest.mark.parametrize("method", ["multi", "single"])
def test_no_strand_of_the_artist_is_lost(method: str) -> None:
    """The artist's strands come first, in their places and with their guides; children follow."""
    plain = rig_of(None, sheet())
    rig = rig_of(ChildrenSettings(method=method, strand_count=200), sheet())
    assert (rig.strands.strand_count, rig.own_count, rig.child_count) == (260, 60, 200)
    np.testing.assert_array_equal(rig.strands.grid[:60], plain.strands.grid)
    np.testing.assert_array_equal(rig.guides, plain.guides)
    np.testing.assert_array_equal(rig.weights.weight[:60], plain.weights.weight)
    assert rig.strands.root_uv is not None and rig.rest_frames is not None
    np.testing.assert_allclose(rig.strands.root_uv, rig.strands.roots[:, :2] / 0.2 + 0.5, atol=1e-5)
    assert len(rig.rest_frames.origin) == len(rig.weights.guide) == 260


def test_at_rest_nothing_moves_and_each_guide_moves_itself() -> None:
    rig = rig_of(ChildrenSettings(method="multi", strand_count=200), sheet())
    guides = rig.guide_grid
    np.testing.assert_array_equal(
        motion_flow.strands_at(rig, rig.rest_pose, guides), rig.strands.points
    )
    steps = np.diff(guides, axis=1) + np.random.default_rng(3).normal(0.0, 0.01, (30, 5, 3))
    steps *= lengths(guides) / np.linalg.norm(steps, axis=2, keepdims=True)
    moved = np.concatenate([guides[:, :1], guides[:, :1] + steps.cumsum(axis=1)], axis=1)
    now = motion_flow.strands_at(rig, rig.rest_pose, moved.astype(np.float32))
    now = now.reshape(rig.strands.grid.shape)
    np.testing.assert_allclose(now[rig.guides], moved, atol=1e-6)
    np.testing.assert_allclose(lengths(now), lengths(rig.strands.grid), atol=1e-7)


def lengths(grid: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(grid, axis=1), axis=2, keepdims=True)


def test_a_head_and_guides_that_turn_as_one_turn_all_strands() -> None:
    """By half a turn about a slanting axis, and two metres away."""
    rig = rig_of(ChildrenSettings(method="multi", strand_count=200, baby_hair=0.0), sheet())
    axis = np.array([0.6, 0.0, 0.8])
    turn = 2.0 * np.outer(axis, axis) - np.eye(3)
    shift = np.array([2.0, -1.0, 0.5])
    assert rig.head is not None
    pose = rig_flow.Pose((rig.head.positions @ turn.T + shift).astype(np.float32), np.eye(4))
    now = motion_flow.strands_at(rig, pose, (rig.guide_grid @ turn.T + shift).astype(np.float32))
    error = np.abs(now - (rig.strands.points @ turn.T + shift)).max()
    assert error < 2e-5 * lengths(rig.strands.grid).sum(axis=1).min()


def test_a_head_without_uvs_gives_children_without() -> None:
    rig = rig_of(ChildrenSettings(method="multi", strand_count=20), sheet(has_uv=False))
    assert rig.strands.root_uv is None and rig.strands.strand_count == 80


def test_without_a_head_there_are_no_children() -> None:
    rig = rig_of(ChildrenSettings(method="multi"), None)
    assert rig.strands.strand_count == 60 and rig.child_count == 0
    (note,) = rig.notes
    assert "surface" in note and note.count(". ") == 1, "what is missing, and a remedy"


def test_low_ranks_are_an_even_sparser_groom() -> None:
    """Each quarter of the sheet has about a quarter of the strands of low rank."""
    for children in (None, ChildrenSettings(method="multi", strand_count=700)):
        rig = rig_flow.prepare(
            wig_strands(300 if children else 1000),
            sheet(),
            GUIDES,
            place="a wig",
            children=children,
        )
        rank = rig_flow.strand_ranks(rig)
        assert sorted(rank) == pytest.approx(np.arange(1000) / 1000, abs=4e-3)
        few = rig.strands.roots[rank < 0.25]
        quarter = (few[:, 0] > 0.0) * 2 + (few[:, 1] > 0.0)
        assert np.bincount(quarter, minlength=4).min() > 45
        own = rank[:300]
        assert (own < 0.25).sum() == pytest.approx(75, abs=10) and not (np.diff(own) > 0.0).all()


def test_children_keep_their_noise_when_others_come_or_go() -> None:
    """A child's seed depends on its root alone, not on its place among the others; the artist's
    strands are numbered."""
    many, few = (ChildrenSettings(method="multi", strand_count=count) for count in (700, 300))
    rig, other = rig_of(many, sheet()), rig_of(few, sheet())
    own, seeds = rig.own_count, rig_flow.strand_seeds(rig)
    assert own is not None
    assert (seeds[:own] == np.arange(own)).all()
    assert len(np.unique(seeds[own:])) > 690
    assert seeds.max() < 1 << 24
    shuffled = rig.strands.take(np.append(np.arange(own), own + np.arange(700)[::-1]))
    turned = rig_flow.strand_seeds(replace(rig, strands=shuffled))
    assert (turned[own:] == seeds[own:][::-1]).all()
    assert (rig_flow.strand_seeds(other) == seeds[: own + 300]).all()


def test_baby_hair_is_fine_where_widths_are_found() -> None:
    """Found widths depend on the distance between strands; baby hair is thinner all the same."""
    settings = ChildrenSettings(method="multi", strand_count=2000, length_variation=0.0)

    def widths(baby_hair: float) -> tuple[np.ndarray, np.ndarray]:
        children = replace(settings, baby_hair=baby_hair)
        rig = rig_flow.prepare(
            wig_strands(), sheet(), GUIDES, place="a wig", children=children, widths="found"
        )
        assert rig.widths.is_found
        first = rig.strands.offsets[:-1]
        return rig.strands.lengths()[60:], rig.strands.radius[first][60:]

    (plain, _), (cut, radius) = widths(0.0), widths(0.8)
    is_baby = cut < 0.5 * plain
    assert 50 < is_baby.sum() < 1500
    assert np.median(radius[is_baby]) < 0.65 * np.median(radius[~is_baby])


def test_cards_are_made_from_all_hair_but_baby_hair() -> None:
    rig = wig()
    groom = card_groom(rig)
    np.testing.assert_array_equal(groom.strand_numbers, np.flatnonzero(~short_strands(rig)))
    expected = card_strands(rig.strands.take(groom.strand_numbers))
    np.testing.assert_array_equal(groom.strands.points, expected.points)
    np.testing.assert_array_equal(
        groom.root_normal, rig_flow.root_normals(rig)[groom.strand_numbers]
    )
    np.testing.assert_array_equal(groom.strands.roots[groom.guide_indices], rig.guide_grid[:, 0])
