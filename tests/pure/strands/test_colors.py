"""The hair's own colours, from curves to drawn strands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import rig_flow
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.clean import clean
from hairloom.addon.strands.colors import color_notes, joined_colors
from hairloom.addon.strands.resample import resample

COUNTS = np.array([3, 4, 2, 5])
OFFSETS = np.concatenate([[0], np.cumsum(COUNTS)])
RED, BLUE = (0.8, 0.0, 0.1), (0.0, 0.1, 0.9)


def upright() -> StrandSet:
    """Strands a metre long whose colour is their height."""
    height = np.concatenate([np.linspace(0.0, 1.0, count) for count in COUNTS])
    points = np.stack([np.repeat(np.arange(4.0), COUNTS), 0.0 * height, height], axis=-1)
    return StrandSet(
        points, OFFSETS, np.full(14, 1e-4), np.zeros(4), color=np.tile(height[:, None], (1, 3))
    )


def test_what_is_dropped_takes_its_colours_along() -> None:
    strands = upright()
    points = strands.points.copy()
    points[4] = np.nan
    found = clean(points, OFFSETS, color=strands.color).strands
    np.testing.assert_array_equal(found.color, strands.take(np.array([0, 2, 3])).color)
    np.testing.assert_array_equal(found.color, found.points[:, [2, 2, 2]])


@pytest.mark.parametrize("faulty", [np.nan, -0.1, np.inf])
@pytest.mark.parametrize("radius", [None, np.full(14, 1e-4)])
def test_a_colour_is_usable_all_along_or_not_at_all(
    faulty: float, radius: np.ndarray | None
) -> None:
    strands = upright()
    color = strands.color.copy()  # type: ignore[union-attr]
    color[8, 1] = faulty  # the tip of the third
    found = clean(strands.points, OFFSETS, radius=radius, color=color).strands
    assert found.color is not None
    assert np.isnan(found.color[7:9]).all()
    known = np.delete(np.arange(14), [7, 8])
    np.testing.assert_array_equal(found.color[known], color[known])
    (note,) = color_notes("Hair", found)
    assert "Hair: 1 of 4 strands" in note
    assert color_notes("Hair", strands) == color_notes("Hair", replace(strands, color=None)) == ()


def test_colours_are_resampled_with_the_points() -> None:
    found = resample(upright(), 7)
    assert found.color_grid is not None
    np.testing.assert_allclose(found.color_grid[..., 0], found.grid[..., 2], atol=1e-6)


def test_joined_hair_without_colours_has_none_beside_hair_that_has_some() -> None:
    strands = upright()
    plain = replace(strands, color=None)
    assert joined_colors([plain, plain]) is None
    both = joined_colors([plain, strands])
    assert both is not None and np.isnan(both[:14]).all()
    np.testing.assert_array_equal(both[14:], strands.color)


def sheet() -> Surface:
    """A square of 0.2 m in the plane z = 0."""
    corners = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]], np.float32)
    return Surface(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def halves(left: tuple[float, ...] = RED, right: tuple[float, ...] = BLUE) -> StrandSet:
    """Upright guides on the square, with one colour on each side of x = 0."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-0.09, 0.09, 10)] * 2))
    height = np.linspace(0.0, 0.1, 4)
    grid = np.stack(np.broadcast_arrays(x[:, None], y[:, None], height), axis=-1)
    color = np.where(x[:, None, None] < 0.0, left, right)
    return StrandSet(
        grid.reshape(-1, 3),
        np.arange(101) * 4,
        np.full(400, 1e-4),
        np.zeros(100),
        color=np.broadcast_to(color, (100, 4, 3)).reshape(-1, 3),
    )


@pytest.mark.parametrize("way", ["multi", "single"])
def test_children_mix_the_colours_of_their_guides(way: str) -> None:
    """With the weights by which they ride."""
    children = ChildrenSettings(method=way, strand_count=300)
    settings = GuideSettings(guide_count=100, cv_count=4)
    rig = rig_flow.prepare(halves(), sheet(), settings, place="a wig", children=children)
    color = rig.strands.color_grid
    assert color is not None
    own = color[rig.guides, 0].astype(np.float64)
    expected = np.einsum("ng,ngc->nc", rig.weights.weight, own[rig.weights.guide])
    np.testing.assert_allclose(color, np.repeat(expected[:, None], 4, axis=1), atol=1e-6)
    x = rig.strands.roots[:, 0]
    left = color[x < -0.04, 0]
    np.testing.assert_allclose(left, np.broadcast_to(RED, left.shape), atol=1e-6)
    is_mixed = (color[:, 0, 0] > 0.01) & (color[:, 0, 2] > 0.11)
    assert is_mixed.any() == (way == "multi")


def test_children_of_a_guide_without_a_colour_have_their_other_guides() -> None:
    none = (np.nan,) * 3
    settings = GuideSettings(guide_count=100, cv_count=4)
    children = ChildrenSettings(method="multi", strand_count=300)
    rig = rig_flow.prepare(halves(RED, none), sheet(), settings, place="wig", children=children)
    color = rig.strands.color_grid
    assert color is not None
    is_none = np.isnan(color).any(axis=(1, 2))
    np.testing.assert_allclose(
        color[~is_none], np.broadcast_to(RED, color[~is_none].shape), atol=1e-6
    )
    own = ~np.isnan(rig.strands.color_grid[rig.guides, 0, 0])  # type: ignore[index]
    is_beside = (rig.weights.weight * own[rig.weights.guide]).sum(axis=1) > 0.0
    np.testing.assert_array_equal(is_none, ~is_beside)
    assert 0 < is_none.sum() < len(is_none)
