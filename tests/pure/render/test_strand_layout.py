"""The layout of strands' points in a texture: each strand in one row, without overlap."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.strand_layout import StrandLayout, strand_rows

ROWS = 16384


def layout_of(counts: object) -> StrandLayout:
    return StrandLayout(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))


def numbered(layout: StrandLayout) -> np.ndarray:
    """Pixels that store the number of their point, from 1 on."""
    return layout.pixels(np.arange(1, layout.point_count + 1, dtype=np.float32)[:, None])[..., 0]


@pytest.mark.parametrize(
    "counts",
    [
        [2],
        [2, 256, 3],
        [16] * 100,
        [7] * (ROWS + 5),
        np.random.default_rng(3).integers(2, 257, 4000),
        [256] * 64 + [2],
    ],
    ids=["one", "few", "uniform", "blocks", "many", "full row"],
)
def test_each_strand_lies_whole_in_a_row(counts: object) -> None:
    layout = layout_of(counts)
    pixels = numbered(layout)
    assert pixels.shape == layout.size[::-1]
    number = 1
    for (x, y, count, _), expected in zip(
        layout.spans.astype(int).tolist(), layout.counts.tolist(), strict=True
    ):
        assert count == expected
        assert (pixels[y, x : x + count] == np.arange(number, number + count)).all()
        number += count
    assert np.count_nonzero(pixels) == layout.point_count, "all other texels are empty"
    assert (layout.values(pixels[..., None])[:, 0] == np.arange(1, number)).all()


def test_equally_many_points_lie_as_they_are() -> None:
    values = np.random.default_rng(1).random((50, 8, 4)).astype(np.float32)
    layout = StrandLayout.uniform(50, 8)
    pixels = layout.pixels(values.reshape(-1, 4))
    assert (pixels == strand_rows(values)).all()
    assert np.shares_memory(pixels, values), "nothing is copied"


def test_detail_factors_of_strands_do_not_overlap() -> None:
    layout = layout_of([2, 17, 18, 256, 33, 34])
    # a texel holds the factors of sixteen segments
    assert layout.spans[:, 3].tolist() == [0, 1, 2, 4, 20, 22]


def test_layouts_larger_than_a_texture_are_refused() -> None:
    with pytest.raises(ValueError, match="fewer than two"):
        layout_of([4, 1])
    with pytest.raises(ValueError, match="more than 16384"):
        layout_of([2, ROWS + 1])
    with pytest.raises(ValueError, match="do not fit"):
        StrandLayout.uniform(ROWS * 600, 30)


def test_no_strands_have_a_layout() -> None:
    layout = layout_of([])
    assert layout.size == (1, 1) and layout.spans.shape == (0, 4)
