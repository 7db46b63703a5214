"""Light that spreads along the skin: energy, distance, and seams."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.shading.skin.diffusion import blurred, soft_shadow
from hairloom.addon.shading.skin.layout import SkinLayout, skin_layout
from hairloom.addon.strands import Surface

from .test_skin_layout import shown


def spread(values: np.ndarray, layout: SkinLayout, softness: float) -> np.ndarray:
    return blurred(blurred(values, layout, softness, 0), layout, softness, 1)


def both_sides(values: np.ndarray, layout: SkinLayout) -> tuple[np.ndarray, np.ndarray]:
    """Values at places along all seams, read from one side and from the other."""
    fraction = np.linspace(0.0, 1.0, 9)[None, :, None]
    place = layout.seams[:, :1] * (1.0 - fraction) + layout.seams[:, 1:] * fraction
    islands = np.repeat(layout.seam_islands, 9, axis=0)
    one, two = (
        soft_shadow(
            values, layout, place[..., 2 * side :][..., :2].reshape(-1, 2), islands[:, side]
        )
        for side in range(2)
    )
    assert one[1].min() > 0.0 and two[1].min() > 0.0
    return one[0], two[0]


def test_a_uniform_map_stays_unchanged(two_islands: Surface) -> None:
    layout = skin_layout(two_islands, 256)
    found = spread(np.full((*layout.island.shape, 2), 0.3), layout, 0.01)
    assert found[layout.island >= 0] == pytest.approx(0.3, abs=1e-12)
    assert both_sides(found, layout)[0] == pytest.approx(0.3, abs=1e-12)


@pytest.mark.alike
@pytest.mark.parametrize("stretched", [(1.0, 1.0), (1.0, 0.5), (0.25, 1.0)])
def test_light_gets_as_far_in_metres_however_the_map_is_stretched(
    square: Callable[..., Surface], stretched: tuple[float, float]
) -> None:
    """One lit place keeps its energy, and its variance is the squared softness."""
    surface, softness = square(), 0.008
    uv = np.asarray(surface.corner_uv) * stretched
    layout = skin_layout(Surface(surface.positions, surface.triangles, uv), 512)
    values = np.zeros((*layout.island.shape, 1))
    row, column = np.array(layout.island.shape) // 2
    values[row, column] = 1.0
    found = np.where(layout.island >= 0, spread(values, layout, softness)[..., 0], 0.0)
    assert found.sum() == pytest.approx(1.0, rel=1e-3)
    place = shown(layout, surface)
    for axis in range(2):
        variance = float((found * (place[..., axis] - place[row, column, axis]) ** 2).sum())
        # a Gaussian cut off at 2.5 standard deviations has 0.91 of its variance
        assert np.sqrt(variance) == pytest.approx(softness * np.sqrt(0.91), rel=0.03)


@pytest.mark.slow(instead="test_no_seam_is_seen")
def test_light_goes_on_across_a_seam(two_islands: Surface, square: Callable[..., Surface]) -> None:
    """A shadow's edge beside the seam is as soft as on a plane without seams."""
    whole = square()
    softness, edge = 0.006, 0.096

    def profile(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
        layout = skin_layout(surface, 512)
        place = shown(layout, surface)
        values = (place[..., :1] > edge).astype(float)
        found = spread(values, layout, softness)[..., 0]
        seen = (layout.island >= 0) & (np.abs(place[..., 1] - 0.1) < 0.05)
        return place[seen][:, 0], found[seen]

    x, cut = profile(two_islands)
    order = np.argsort(profile(whole)[0])
    expected = np.interp(x, *(array[order] for array in profile(whole)))
    assert np.abs(cut - expected).max() < 0.04
    assert 0.2 < np.interp(0.1, x[np.argsort(x)], cut[np.argsort(x)]) < 0.9


@pytest.mark.parametrize("softness", few_in_commits([0.001, 0.004, 0.01]))
def test_no_seam_is_seen(two_islands: Surface, softness: float) -> None:
    """With hard-edged stripes of shadow that cross the seam at a slant, both sides agree."""
    layout = skin_layout(two_islands, 512)
    place = shown(layout, two_islands)
    stripes = np.sin(120.0 * place[..., 1] + 50.0 * place[..., 0]) > 0.0
    one, two = both_sides(spread(stripes[..., None].astype(float), layout, softness), layout)
    assert np.ptp(one) > 0.05
    assert np.abs(one - two).max() < 2.0 / 255.0


def test_islands_that_touch_in_the_map_keep_apart(square: Callable[..., Surface]) -> None:
    """Each cell of a map tiled without a gap shows another part of the skin."""
    surface = square(cells=4)
    uv = np.array(surface.corner_uv)
    cell = np.floor(uv.mean(axis=1) * 4.0)
    order = np.random.default_rng(5).permutation(16)
    moved = order[(4 * cell[:, 1] + cell[:, 0]).astype(int)]
    uv += (np.stack([moved % 4, moved // 4], axis=1) - cell)[:, None] / 4.0
    layout = skin_layout(Surface(surface.positions, surface.triangles, uv), 256)
    place = shown(layout, surface)
    values = np.stack([np.sin(40.0 * place[..., 0]), place[..., 1] / 0.2], axis=-1)
    one, two = both_sides(spread(values, layout, 0.004), layout)
    assert np.abs(one - two).max() < 2.0 / 255.0
