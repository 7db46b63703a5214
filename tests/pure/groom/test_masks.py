"""Painted masks: nothing where they are 0, the whole setting where they are 1, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from small_wig import GUIDES, curves, sheet

from hairloom.addon import pipeline
from hairloom.addon.arrays import Floats
from hairloom.addon.groom.children import make_children
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.masks import MASKS, NO_MASKS, Masks, mask_names
from hairloom.addon.paint_flow import painted
from hairloom.addon.strands.kept import NOTHING_KEPT, Kept

HEAD = sheet()
ONES = np.ones(len(HEAD.positions))
#: a half, with nothing in between but across the middle
HALF = np.where(HEAD.positions[:, 0] > 0.0, 1.0, 0.0)
BOLD = ChildrenSettings(
    method="multi",
    strand_count=3000,
    clump=0.8,
    frizz=0.05,
    length=0.6,
    length_variation=0.0,
    baby_hair=0.0,
)
#: those that shape what has no curls, and so keep their point counts
STRAIGHT = [name for name in MASKS if name != "curl"]
#: what each setting is without its effect
WITHOUT = {"clump": 0.0, "frizz": 0.0}


def rig_of(
    settings: ChildrenSettings, masks: Masks = NO_MASKS, kept: Kept = NOTHING_KEPT
) -> pipeline.Rig:
    return pipeline.prepare(
        curves(), HEAD, GUIDES, place="a wig", children=settings, masks=masks, kept=kept
    )


def children(rig: pipeline.Rig) -> Floats:
    return rig.strands.grid[rig.own_count :]


def test_all_that_may_be_painted_is_declared() -> None:
    assert {name: f"{name}_mask" for name in ("length", "clump", "curl", "frizz")} == MASKS
    named = ChildrenSettings(method="multi", clump_mask="Crown", frizz_mask="")
    assert mask_names(named) == {"clump": "Crown"}
    assert mask_names(ChildrenSettings(method="auto", clump_mask="Crown")) == {}


@pytest.mark.parametrize("name", MASKS)
def test_a_mask_of_one_changes_not_a_bit(name: str) -> None:
    np.testing.assert_array_equal(
        children(rig_of(BOLD, Masks({name: ONES}))), children(rig_of(BOLD))
    )


@pytest.mark.parametrize("name", WITHOUT)
def test_a_mask_of_zero_is_the_setting_at_zero_bit_by_bit(name: str) -> None:
    masked = rig_of(BOLD, Masks({name: 0.0 * ONES}))
    without = rig_of(BOLD.from_dict(BOLD.as_dict() | {name: WITHOUT[name]}, "test"))
    np.testing.assert_array_equal(children(masked), children(without))
    assert not np.array_equal(children(masked), children(rig_of(BOLD)))


def test_curls_are_multiplied() -> None:
    """Around straight paths: the radius is how far points are from them."""
    guides = rig_of(BOLD).grown.shapes
    smooth = BOLD.from_dict(BOLD.as_dict() | {"frizz": 0.0, "curl": 0.02, "length": 1.0}, "test")

    def aside(weights: Floats) -> Floats:
        made = make_children(guides, HEAD, smooth, masks=Masks({"curl": weights}), place="test")
        grid = made.strands.grid
        again = made.growth.shapes(guides.grid, np.arange(len(grid)))
        np.testing.assert_allclose(again, grid, atol=1e-6, err_msg="as a brush shapes them")
        grid = grid.astype(np.float64) - grid[:, :1]
        chord = grid[:, -1:] / np.linalg.norm(grid[:, -1:], axis=2, keepdims=True)
        return np.linalg.norm(np.cross(grid, chord), axis=2).max(axis=1)

    whole, half = aside(ONES), aside(HALF)
    plain = make_children(guides, HEAD, smooth, place="test").strands
    masked = make_children(guides, HEAD, smooth, masks=Masks({"curl": ONES}), place="test").strands
    np.testing.assert_array_equal(masked.points, plain.points)
    x = plain.roots[:, 0]
    assert whole.min() > 0.001
    assert aside(0.5 * ONES) == pytest.approx(0.5 * whole, rel=0.15)
    assert half[x < -0.02].max() < 1e-5
    np.testing.assert_array_equal(half[x > 0.02], whole[x > 0.02])


def test_lengths_are_multiplied() -> None:
    """Against the lengths of children that are not cut: a fraction of their own curve."""
    whole = rig_of(BOLD.from_dict(BOLD.as_dict() | {"length": 1.0, "frizz": 0.0}, "test"))
    straight = BOLD.from_dict(BOLD.as_dict() | {"frizz": 0.0}, "test")
    cut = rig_of(straight, Masks({"length": 0.5 * ONES}))
    ratio = cut.strands.lengths()[60:] / whole.strands.lengths()[60:]
    assert ratio == pytest.approx(np.full(3000, 0.3), abs=2e-3)
    bare = rig_of(straight, Masks({"length": 0.0 * ONES}))
    assert 0.0 < bare.strands.lengths()[60:].max() < 0.0003, "of 11 cm"


@pytest.mark.parametrize("name", STRAIGHT)
def test_half_a_mask_shapes_its_half_alone(name: str) -> None:
    masked = rig_of(BOLD, Masks({name: HALF}))
    none, whole = rig_of(BOLD, Masks({name: 0.0 * ONES})), rig_of(BOLD)
    root = children(masked)[:, 0]
    # of one child a clump takes its middle from the other half; what lies between is mixed
    left, right = root[:, 0] < -0.04, root[:, 0] > 0.04
    np.testing.assert_array_equal(children(masked)[left], children(none)[left])
    np.testing.assert_array_equal(children(masked)[right], children(whole)[right])
    assert (children(masked)[right] != children(none)[right]).any(axis=(1, 2)).mean() > 0.8


def test_a_strong_mask_draws_no_child_beyond_its_clump() -> None:
    strong = rig_of(BOLD, Masks({"clump": 100.0 * ONES}))
    once = rig_of(BOLD.from_dict(BOLD.as_dict() | {"clump": 1.0}, "test"))
    tips = children(strong)[:, -1] - children(once)[:, -1]
    assert np.isfinite(tips).all() and np.abs(tips).max() < 0.05


@pytest.mark.parametrize("name", STRAIGHT)
def test_a_brush_gives_what_a_rebuild_makes_and_shapes_no_others(name: str) -> None:
    """More children than one level of clumps has, so that some are drawn by some that are drawn."""
    many = BOLD.from_dict(BOLD.as_dict() | {"strand_count": 6000}, "test")
    rig = rig_of(many)
    now, whole = painted(rig, None, Masks({name: HALF})), rig_of(many, Masks({name: HALF}))
    np.testing.assert_allclose(children(now), children(whole), atol=2e-6)
    is_same = (children(now) == children(rig)).all(axis=(1, 2))
    assert 0.3 < is_same.mean() < 0.7
    back = painted(now, None)
    np.testing.assert_allclose(children(back), children(rig), atol=1e-7)


def test_only_rows_that_are_painted_are_made_again() -> None:
    made: list[int] = []

    class Counted(Kept):
        def rows(self, name, fixed, rows, make):  # type: ignore[no-untyped-def]
            def counted(some):  # type: ignore[no-untyped-def]
                if name == "varied":
                    made.append(len(some))
                return make(some)

            return super().rows(name, fixed, rows, counted)

    kept = Counted()
    rig_of(BOLD, NO_MASKS, kept)
    again = rig_of(BOLD, Masks({"frizz": HALF}), kept)
    assert made[0] == 3000 and 1500 < made[1] < 2000
    np.testing.assert_array_equal(children(again), children(rig_of(BOLD, Masks({"frizz": HALF}))))
