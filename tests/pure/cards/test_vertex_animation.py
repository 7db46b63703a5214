"""Motion textures: every vertex and frame has its texel as the layout defines it."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.cards.vertex_animation import (
    motion_layout,
    motion_texture,
    vertex_texels,
)
from hairloom.addon.errors import HairloomError


@pytest.mark.parametrize(("vertices", "frames"), [(1, 2), (700, 5), (1025, 40), (5000, 900)])
def test_a_shader_reads_back_the_stored_values(vertices: int, frames: int) -> None:
    """From a vertex's texel and the step to the next frame alone, rows counted from the top."""
    values = np.random.default_rng(vertices).normal(size=(vertices, frames, 3)).astype(np.float32)
    layout = motion_layout(vertices, frames, "x")
    texture = motion_texture(values, layout)
    assert texture.shape == (layout.height, layout.width, 3)
    assert max(texture.shape) <= 8192
    picture, texel = texture[::-1], vertex_texels(layout)
    for frame in (0, 1, frames - 1):
        u, v = texel[:, 0], texel[:, 1] + frame * layout.frame_step
        row, column = np.floor(v * layout.height), np.floor(u * layout.width)
        found = picture[row.astype(int), column.astype(int)]
        np.testing.assert_array_equal(found, values[:, frame])


def test_texels_are_exact_enough_as_float32() -> None:
    """As float32, the coordinate of a texel's centre stays within the texel's middle half."""
    layout = motion_layout(60_000, 1000, "x")
    v = vertex_texels(layout).astype(np.float32).astype(np.float64)[:, 1] * layout.height
    assert np.abs(v % 1.0 - 0.5).max() < 0.01


def test_the_layout_wastes_few_texels() -> None:
    layout = motion_layout(4097, 60, "x")
    assert layout.width * layout.rows < 4097 * 1.01


def test_motion_that_fits_no_texture_is_refused() -> None:
    with pytest.raises(HairloomError, match="do not fit"):
        motion_layout(100_000, 1000, "hair.glb")
