"""Painted masks: no effect where they are 0, the whole setting where they are 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_wig import GUIDES, sheet, wig_strands

from hairloom.addon import rig_flow
from hairloom.addon.arrays import Floats
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.children import make_children
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.masks import (
    NO_MASKS,
    ImageMask,
    Masks,
    Places,
    StrandMask,
    SurfaceMask,
    mask_names,
    mask_parameters,
)
from hairloom.addon.paint_flow import painted_guides, painted_rig
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.face import BROWS
from hairloom.addon.strands.result_cache import NO_CACHE, ResultCache

HEAD = sheet()
ONES = np.ones(len(HEAD.positions))
#: 1 on one half and 0 on the other, with a step at the middle
HALF = np.where(HEAD.positions[:, 0] > 0.0, 1.0, 0.0)
BOLD = ChildrenSettings(
    method="multi",
    strand_count=3000,
    clump=0.8,
    frizz=0.05,
    length=0.6,
    length_variation=0.0,
    baby_hair=0.0,
    fly_aways=1.0,
)
#: settings other than curls, which keep point counts
STRAIGHT = ["length", "clump", "frizz", "fly_aways"]
#: value of each setting without effect
WITHOUT = {"clump": 0.0, "frizz": 0.0, "fly_aways": 0.0}


def rig_of(
    settings: ChildrenSettings,
    masks: Masks = NO_MASKS,
    cache: ResultCache = NO_CACHE,
    strands: StrandSet | None = None,
) -> rig_flow.Rig:
    placement = rig_flow.ChildPlacement(masks=masks)
    return rig_flow.prepare(
        strands or wig_strands(),
        HEAD,
        GUIDES,
        place="a wig",
        children=settings,
        placement=placement,
        cache=cache,
    )


def on_head(name: str, weights: Floats) -> Masks:
    return Masks({name: SurfaceMask.of_vertices(HEAD, weights)})


def children(rig: rig_flow.Rig) -> Floats:
    return rig.strands.grid[rig.own_count :]


def test_all_that_may_be_painted_is_declared() -> None:
    of_children = ("scatter", "length", "clump", "frizz", "fly_aways", "curl", "width")
    assert mask_parameters(ChildrenSettings) == {name: f"{name}_mask" for name in of_children}
    of_motion = {"gravity", "damping", "style_root", "style_tip", "style_damping", "bend", "volume"}
    assert mask_parameters(DynamicsSettings).keys() == of_motion | {"influence"}
    named = {"clump_mask": "Crown", "frizz_mask": "", "width_mask": "Front"}
    for method, expected in (
        ("multi", {"clump": "Crown", "width": "Front"}),
        ("auto", {"width": "Front"}),
        ("none", {}),
    ):
        settings = ChildrenSettings.from_dict({"method": method, **named}, "test")
        assert mask_names(settings) == expected


@pytest.mark.parametrize("name", mask_parameters(ChildrenSettings))
def test_a_mask_of_one_changes_not_a_bit(name: str) -> None:
    np.testing.assert_array_equal(
        children(rig_of(BOLD, on_head(name, ONES))), children(rig_of(BOLD))
    )


@pytest.mark.parametrize("name", WITHOUT)
def test_a_mask_of_zero_is_the_setting_at_zero_bit_by_bit(name: str) -> None:
    masked = rig_of(BOLD, on_head(name, 0.0 * ONES))
    without = rig_of(BOLD.from_dict(BOLD.as_dict() | {name: WITHOUT[name]}, "test"))
    np.testing.assert_array_equal(children(masked), children(without))
    assert not np.array_equal(children(masked), children(rig_of(BOLD)))


def test_curls_are_multiplied() -> None:
    """Around straight paths, the largest distance of points is the radius."""
    guides = rig_of(BOLD).grown_children.shapes
    plain = {"frizz": 0.0, "fly_aways": 0.0, "curl": 0.02, "length": 1.0}
    smooth = BOLD.from_dict(BOLD.as_dict() | plain, "test")

    def aside(weights: Floats) -> Floats:
        grown = make_children(guides, HEAD, smooth, masks=on_head("curl", weights), place="test")
        grid = grown.strands.grid
        again = grown.growth.shapes(guides.grid, np.arange(len(grid)))
        np.testing.assert_allclose(again, grid, atol=1e-6, err_msg="as a brush shapes them")
        grid = grid.astype(np.float64) - grid[:, :1]
        chord = grid[:, -1:] / np.linalg.norm(grid[:, -1:], axis=2, keepdims=True)
        return np.linalg.norm(np.cross(grid, chord), axis=2).max(axis=1)

    whole, half = aside(ONES), aside(HALF)
    plain = make_children(guides, HEAD, smooth, place="test").strands
    masked = make_children(guides, HEAD, smooth, masks=on_head("curl", ONES), place="test").strands
    np.testing.assert_array_equal(masked.points, plain.points)
    x = plain.roots[:, 0]
    assert whole.min() > 0.001
    assert aside(0.5 * ONES) == pytest.approx(0.5 * whole, rel=0.15)
    assert half[x < -0.02].max() < 1e-5
    np.testing.assert_array_equal(half[x > 0.02], whole[x > 0.02])


def test_lengths_are_multiplied() -> None:
    """Against the lengths of uncut children."""
    whole = rig_of(BOLD.from_dict(BOLD.as_dict() | {"length": 1.0, "frizz": 0.0}, "test"))
    straight = BOLD.from_dict(BOLD.as_dict() | {"frizz": 0.0}, "test")
    cut = rig_of(straight, on_head("length", 0.5 * ONES))
    ratio = cut.strands.lengths()[60:] / whole.strands.lengths()[60:]
    assert ratio == pytest.approx(np.full(3000, 0.3), abs=2e-3)
    bare = rig_of(straight, on_head("length", 0.0 * ONES))
    assert 0.0 < bare.strands.lengths()[60:].max() < 0.0003, "of 11 cm"


@pytest.mark.parametrize("name", STRAIGHT)
def test_half_a_mask_shapes_its_half_alone(name: str) -> None:
    masked = rig_of(BOLD, on_head(name, HALF))
    none, whole = rig_of(BOLD, on_head(name, 0.0 * ONES)), rig_of(BOLD)
    root = children(masked)[:, 0]
    # not near the middle, where clumps reach across and values are interpolated
    left, right = root[:, 0] < -0.04, root[:, 0] > 0.04
    np.testing.assert_array_equal(children(masked)[left], children(none)[left])
    np.testing.assert_array_equal(children(masked)[right], children(whole)[right])
    assert (children(masked)[right] != children(none)[right]).any(axis=(1, 2)).mean() > 0.8


def test_a_strong_mask_draws_no_child_beyond_its_clump() -> None:
    strong = rig_of(BOLD, on_head("clump", 100.0 * ONES))
    once = rig_of(BOLD.from_dict(BOLD.as_dict() | {"clump": 1.0}, "test"))
    tips = children(strong)[:, -1] - children(once)[:, -1]
    assert np.isfinite(tips).all() and np.abs(tips).max() < 0.05


@pytest.mark.parametrize("name", STRAIGHT)
def test_a_brush_gives_what_a_rebuild_makes_and_shapes_no_others(name: str) -> None:
    """With more children than one level of clumps holds, so that some clump to children that
    themselves clump."""
    many = BOLD.from_dict(BOLD.as_dict() | {"strand_count": 6000}, "test")
    rig = rig_of(many)
    now, whole = painted_rig(rig, None, on_head(name, HALF)), rig_of(many, on_head(name, HALF))
    np.testing.assert_allclose(children(now), children(whole), atol=2e-6)
    is_same = (children(now) == children(rig)).all(axis=(1, 2))
    assert 0.3 < is_same.mean() < 0.7
    back = painted_rig(now, None)
    np.testing.assert_allclose(children(back), children(rig), atol=1e-7)


def test_only_rows_that_are_painted_are_made_again() -> None:
    row_counts: list[int] = []

    class Counted(ResultCache):
        def rows(self, name, fixed, rows, make):  # type: ignore[no-untyped-def]
            def counted(some):  # type: ignore[no-untyped-def]
                if name == "varied":
                    row_counts.append(len(some))
                return make(some)

            return super().rows(name, fixed, rows, counted)

    cache = Counted()
    rig_of(BOLD, NO_MASKS, cache)
    again = rig_of(BOLD, on_head("frizz", HALF), cache)
    assert row_counts[0] == 3000 and 1500 < row_counts[1] < 2000
    np.testing.assert_array_equal(children(again), children(rig_of(BOLD, on_head("frizz", HALF))))


def test_widths_are_multiplied_whatever_their_method() -> None:
    for method in ("own", "found"):

        def radius(masks: Masks, method: str = method) -> Floats:
            placement = rig_flow.ChildPlacement(masks=masks)
            rig = rig_flow.prepare(
                wig_strands(),
                HEAD,
                GUIDES,
                place="a wig",
                children=BOLD,
                placement=placement,
                widths=method,
            )
            return rig.strands.radius.reshape(rig.strands.strand_count, -1)[rig.own_count :, 0]

        half, whole = radius(on_head("width", 0.5 * ONES)), radius(NO_MASKS)
        np.testing.assert_allclose(half, 0.5 * whole, rtol=1e-5)
    assert not len(rig_of(BOLD, on_head("width", HALF)).baby_hair), "fine, but no baby hair"
    rig = rig_of(BOLD)
    now, again = (
        painted_rig(rig, None, on_head("width", HALF)),
        rig_of(BOLD, on_head("width", HALF)),
    )
    np.testing.assert_allclose(now.strands.radius, again.strands.radius, rtol=1e-5)
    assert np.ptp(now.strands.radius) > 0.0


def test_scatter_where_it_is_painted_is_that_of_the_setting() -> None:
    wild = BOLD.from_dict(BOLD.as_dict() | {"scatter": 0.5}, "test")
    half, whole, none = rig_of(wild, on_head("scatter", HALF)), rig_of(wild), rig_of(BOLD)
    weights = [each.grown_children.growth.weights.weight for each in (half, whole, none)]
    x = half.grown_children.growth.root[:, 0]
    np.testing.assert_array_equal(weights[0][x > 0.04], weights[1][x > 0.04])
    np.testing.assert_array_equal(weights[0][x < -0.04], weights[2][x < -0.04])


def test_an_image_is_seen_as_bilinear_sampling_says() -> None:
    """Against a loop over places with the four pixels around each."""
    random = np.random.default_rng(2)
    pixels, uv = random.random((5, 7), np.float32), random.random((9, 3, 2), np.float32)
    triangle, barycentric = random.integers(0, 9, 50), random.dirichlet(np.ones(3), 50)
    places = Places(triangle, barycentric, np.zeros((50, 1), int), np.ones((50, 1)))
    values = ImageMask(pixels, uv).at(places)
    for number, value in enumerate(values):
        x, y = barycentric[number] @ uv[triangle[number]] * (7, 5) - 0.5
        around = 0.0
        for column in (int(np.floor(x)), int(np.floor(x)) + 1):
            for row in (int(np.floor(y)), int(np.floor(y)) + 1):
                part = (1.0 - abs(x - column)) * (1.0 - abs(y - row))
                around += part * pixels[row % 5, column % 7]
        assert value == pytest.approx(around, abs=1e-6)
    np.testing.assert_array_equal(ImageMask(np.ones((3, 3), np.float32), uv).at(places), 1.0)


def test_what_is_painted_on_curves_is_mixed_as_their_points_are() -> None:
    """With `along` painted at each point, guides have it at their CVs, and 0.5 as a whole; between
    two curves, values are interpolated."""
    strands = wig_strands()
    along = np.concatenate([np.linspace(0.0, 1.0, count) for count in strands.point_counts])
    mask = StrandMask.of_points(strands, along.astype(np.float32))
    np.testing.assert_allclose(mask.at_points(strands), along, atol=1e-5)
    guides = Places.of_strands(strands, np.array([3, 5]))
    even = np.linspace(0.0, 1.0, 9)[:, None].repeat(2, 1)
    np.testing.assert_allclose(mask.along(guides, 9), even, atol=1e-5)
    np.testing.assert_allclose(mask.at(guides), 0.5, atol=1e-6)
    numbers = StrandMask(np.arange(strands.strand_count, dtype=np.float32)[:, None])
    between = Places(None, None, np.array([[2, 6]]), np.array([[0.25, 0.75]]))
    assert numbers.at(between) == pytest.approx(5.0)
    assert (
        numbers.for_strands(np.array([4, 9])).at(Places.of_strands(strands, np.array([1]))) == 9.0
    )


def test_children_take_what_is_painted_on_their_guides() -> None:
    """Where guides are painted 0, children are as with the setting at 0. Brows come first, so that
    guides of children have other indices than curves."""
    strands = replace(wig_strands(), group=np.where(np.arange(60) < 9, BROWS, 0))
    is_right = strands.roots[:, 0] > 0.0
    masks = Masks({"frizz": StrandMask(is_right.astype(np.float32)[:, None])})
    masked, whole = rig_of(BOLD, masks, strands=strands), rig_of(BOLD, strands=strands)
    none = rig_of(BOLD, on_head("frizz", 0.0 * ONES), strands=strands)
    guide = masked.grown_children.growth.weights.guide
    are_right = is_right[masked.grown_children.parents][guide].all(axis=1)
    are_left = ~is_right[masked.grown_children.parents][guide].any(axis=1)
    assert masked.grown_children.parents[0] == 9 and are_right.sum() > 100 and are_left.sum() > 100
    np.testing.assert_allclose(children(masked)[are_right], children(whole)[are_right], atol=1e-7)
    np.testing.assert_array_equal(children(masked)[are_left], children(none)[are_left])
    np.testing.assert_allclose(
        children(painted_rig(whole, None, masks)), children(masked), atol=2e-6
    )


def test_guides_of_a_rig_have_their_own_factors() -> None:
    rig = rig_of(BOLD)
    masks = Masks(
        {
            "gravity": SurfaceMask.of_vertices(HEAD, HALF),
            "bend": StrandMask(np.arange(rig.own_count, dtype=np.float32)[:, None]),
        }
    )
    painted = painted_guides(rig, masks)
    root = rig.strands.roots[rig.guides]
    assert painted.factors["gravity"].shape == (1, len(rig.guides))
    np.testing.assert_array_equal(painted.factors["gravity"][0, root[:, 0] > 0.04], 1.0)
    np.testing.assert_array_equal(painted.factors["gravity"][0, root[:, 0] < -0.04], 0.0)
    np.testing.assert_array_equal(painted.factors["bend"][0], rig.guides)
    assert painted_guides(rig, Masks({"bend": StrandMask(np.ones((7, 1)))})) is None
