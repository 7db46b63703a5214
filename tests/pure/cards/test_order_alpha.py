"""The effect of the texture's alpha on the order, in cases with an obvious answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sheets import VIEW, sheets

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.order_pairs import concatenated_pairs, pairs_by_view
from hairloom.addon.cards.order_views import (
    downsampled_alpha,
    fragment_alpha,
    rasterized,
    texels_per_metre,
)
from hairloom.addon.cards.sort import SortBy, card_orders


def half_clear(clear: slice) -> np.ndarray:
    alpha = np.full((64, 64), 0.5, np.float32)
    alpha[:, clear] = 0.0
    return alpha


LEFT, RIGHT = half_clear(slice(32, 64)), half_clear(slice(0, 32))


def crossing_sheets() -> CardMesh:
    """Two sheets that cross in the middle: on the right the first is nearer to the eye of VIEW."""
    mesh = sheets((0.0, 0.0))
    points = mesh.positions.copy()
    points[:, 1] = points[:, 0] * np.repeat([-0.3, 0.3], 4)
    return replace(mesh, positions=points)


def test_alpha_is_that_of_the_texel_under_the_pixel() -> None:
    mesh = sheets((0.0,))
    random = np.random.default_rng(0).random((16, 16))
    met = rasterized(VIEW, mesh.positions, mesh.triangles)
    # the sheet covers half the picture, from column 7.84 and row 7.936
    row, column = (
        at - offset for at, offset in zip(divmod(met.pixel, 32), (7.936, 7.84), strict=True)
    )
    texel = [np.floor(at + 0.5).astype(int) for at in (row, column)]
    assert len(met.pixel) == 256
    np.testing.assert_array_equal(fragment_alpha(mesh, met, random), random[texel[0], texel[1]])


def test_texels_on_a_square_metre() -> None:
    mesh = sheets((0.0, 0.3))
    assert texels_per_metre(np.zeros((64, 64)), mesh) == pytest.approx(64.0)
    half = replace(mesh, uv=mesh.uv * [0.5, 1.0])
    assert texels_per_metre(np.zeros((64, 32)), half) == pytest.approx(32.0)


def test_downsampled_texels_are_as_large_as_a_pixel() -> None:
    mesh, alpha = sheets((0.0,)), np.random.default_rng(1).random((64, 48))
    assert downsampled_alpha(alpha, mesh, 1.0e-3) is alpha
    coarse = downsampled_alpha(alpha, mesh, 0.15)
    assert coarse.shape == (8, 6)
    np.testing.assert_allclose(coarse[2, 3], alpha[16:24, 24:32].mean())
    assert downsampled_alpha(np.ones((1, 9)), mesh, 1.0).shape == (1, 9)
    assert downsampled_alpha(alpha, mesh, 1.0e9).shape == (2, 1)


def test_clear_and_hidden_fragments_have_no_order() -> None:
    mesh = sheets((0.0, 0.1, 0.2))

    def pairs(alpha: np.ndarray) -> set[tuple[int, ...]]:
        found = concatenated_pairs(list(pairs_by_view(mesh, None, 8, 32, alpha)))
        both = np.stack([found.farther, found.nearer], axis=1)
        return set(map(tuple, mesh.card[both].tolist()))

    assert len(pairs(half_clear(slice(0, 0)))) == 6  # three pairs from either side
    assert pairs(np.zeros((64, 64))) == set()
    assert pairs(np.ones((64, 64))) == set()


def test_fine_strands_of_a_texture_count_by_what_they_cover_together() -> None:
    mesh = sheets((0.0, 0.1, 0.2))
    strands = np.zeros((1024, 1024), np.float32)
    strands[:, ::8] = 0.8
    even = np.full((8, 8), 0.1, np.float32)
    of_strands, of_even = (
        concatenated_pairs(list(pairs_by_view(mesh, None, 4, 32, alpha)))
        for alpha in (strands, even)
    )
    assert len(of_even.weight) > 1000
    np.testing.assert_array_equal(of_strands.farther, of_even.farther)
    np.testing.assert_array_equal(of_strands.weight, of_even.weight)


@pytest.mark.parametrize("by", ["pieces", "cards"])
def test_crossing_cards_are_ordered_by_their_visible_texels(by: SortBy) -> None:
    mesh = crossing_sheets()
    for alpha, first in ((RIGHT, 1), (LEFT, 0)):
        orders = card_orders(mesh, None, by, view_count=8, alpha=alpha)
        assert mesh.card[orders.front].tolist() == [first, first, 1 - first, 1 - first]
        assert mesh.card[orders.back].tolist() == [1 - first, 1 - first, first, first]
