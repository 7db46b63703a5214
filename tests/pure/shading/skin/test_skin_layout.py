"""The unfolded skin against a plane, which is its own unfolding, and odd UV maps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.skin.layout import GUTTER, SkinLayout, skin_layout
from hairloom.addon.shading.skin.notes import skin_notes, uv_notes
from hairloom.addon.shading.skin.settings import SkinSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

DEEP = VolumeSettings(shadows="deep")


def shown(layout: SkinLayout, surface: Surface) -> np.ndarray:
    """The place on the skin [m] that each texel shows, (rows, columns, 3)."""
    weights = np.dstack([1.0 - layout.weights.sum(axis=-1), layout.weights])
    return np.einsum("hwi,hwij->hwj", weights, surface.corners[layout.triangle].astype(float))


def test_each_texel_shows_its_own_place(square: Callable[..., Surface]) -> None:
    """Inside the island its own place, and in the rim around it the nearest place."""
    surface = square()
    layout = skin_layout(surface, 128)
    margin = 128 // 8
    texel = 0.2 / (128 - 2 * margin)
    row, column = np.indices(layout.island.shape)
    middle = (np.stack([column, row], axis=-1) + 0.5 - margin) * texel
    expected = np.clip(middle, 0.0, 0.2)
    is_shown = layout.island >= 0
    assert np.abs(shown(layout, surface)[is_shown][:, :2] - expected[is_shown]).max() < 1e-6
    inside = ((middle > 0.0) & (middle < 0.2)).all(axis=-1)
    assert is_shown[inside].all() and layout.stretch[inside] == pytest.approx(texel)
    # no more than interpolation between texels needs
    assert 0 < is_shown.sum() - inside.sum() < 9 * (128 - 2 * margin)


def test_beyond_a_seam_texels_show_what_lies_across_it(two_islands: Surface) -> None:
    """Against the uncut plane: the texels continue it beyond the seam."""
    layout = skin_layout(two_islands, 512)
    left = layout.triangle_island[0]
    place = layout.place[layout.triangle_island == left]
    corner = two_islands.corners[layout.triangle_island == left][..., :2].astype(float)
    # the left half's own affine map between texels and the world, extrapolated
    map_of = np.linalg.lstsq(
        np.concatenate([place.reshape(-1, 2), np.ones((place.size // 2, 1))], axis=1),
        corner.reshape(-1, 2),
    )[0]
    row, column = np.nonzero(layout.island == left)
    expected = np.stack([column + 0.5, row + 0.5, np.ones(len(row))], axis=1) @ map_of
    found = shown(layout, two_islands)[row, column, :2]
    texel = float(np.median(layout.stretch[row, column]))
    beyond = (expected[:, 0] > 0.1 + texel) & (expected[:, 1] > 0.0) & (expected[:, 1] < 0.2)
    assert beyond.sum() > 0.8 * (GUTTER - 1) * 0.2 / texel
    off = np.linalg.norm(found[beyond] - expected[beyond], axis=1)
    assert np.percentile(off, 95.0) < 1e-6 and off.max() < 1.5 * texel


def test_vertices_that_a_file_has_split_are_one(two_islands: Surface) -> None:
    split = Surface(
        two_islands.corners.reshape(-1, 3),
        np.arange(two_islands.triangles.size).reshape(-1, 3),
        two_islands.corner_uv,
    )
    one, other = skin_layout(two_islands, 128), skin_layout(split, 128)
    assert (one.island >= 0).sum() == (other.island >= 0).sum()
    assert len(one.seams) == len(other.seams) > 0


@pytest.mark.parametrize("change", ["moved", "mirrored", "larger"])
def test_the_position_of_a_map_in_uv_space_does_not_matter(
    two_islands: Surface, change: str
) -> None:
    uv = two_islands.corner_uv
    assert uv is not None
    changed = {"moved": uv + (7.0, -3.0), "mirrored": uv * (-1.0, 1.0), "larger": uv * 20.0}[change]
    surface = replace(two_islands, corner_uv=changed)
    before, layout = skin_layout(two_islands, 128), skin_layout(surface, 128)
    island = before.island[:, ::-1] if change == "mirrored" else before.island
    # float32 rounding changes single texels on borders
    assert ((island >= 0) != (layout.island >= 0)).mean() < 0.002
    assert uv_notes(surface) == ()


def test_where_triangles_overlap_nothing_is_shown(square: Callable[..., Surface]) -> None:
    """In the map the right half lies mirrored on the left one, except for a strip."""
    surface = square()
    uv = np.array(surface.corner_uv)
    uv[..., 0] = np.where(uv[..., 0] > 0.625, 1.25 - uv[..., 0], uv[..., 0])
    folded = Surface(surface.positions, surface.triangles, uv)
    layout = skin_layout(folded, 128)
    margin = 16
    middle = layout.island[margin:-margin, margin:-margin]
    columns = middle.shape[1]
    assert (middle[:, : int(0.36 * columns)] >= 0).all()
    assert (middle[:, int(0.45 * columns) : -2] == -1).all()
    (note,) = skin_notes(folded, SkinSettings(), DEEP)
    assert "60%" in note
    assert skin_notes(surface, SkinSettings(), DEEP) == ()
    assert skin_notes(folded, SkinSettings(soft_shadow=False), DEEP) == ()


@pytest.mark.parametrize("uv", [None, 0.0, np.nan, np.inf])
def test_unusable_maps_have_an_empty_layout_and_a_message(
    square: Callable[..., Surface], uv: float | None
) -> None:
    surface = square()
    values = None if uv is None else np.full((len(surface.triangles), 3, 2), uv)
    surface = replace(surface, corner_uv=values)
    assert skin_layout(surface, 128).is_empty
    (note,) = skin_notes(surface, SkinSettings(), DEEP)
    assert "UVs" in note and "hard edges" in note


def test_triangles_without_area_are_left_out(square: Callable[..., Surface]) -> None:
    """Triangles without area in the map, in the world, and in both."""
    surface = square()
    uv = np.array(surface.corner_uv)
    uv[0], uv[1, :, 0] = 0.5, 0.3
    triangles = np.array(surface.triangles)
    triangles[2] = triangles[2, 0]
    positions = np.array(surface.positions)
    positions[triangles[3]] = positions[triangles[3, 0]]
    layout = skin_layout(Surface(positions, triangles, uv), 128)
    assert not layout.is_empty
    for values in (layout.weights, layout.stretch, layout.seams):
        assert np.isfinite(values).all()
    assert layout.weights.min() >= 0.0 and layout.stretch.min() > 0.0
