"""Parts of a picture: together they are all of it, and each has room."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.render.pixel_parts import DEPTH_END, PixelPart, pixel_parts


@pytest.mark.parametrize("seed", range(20))
def test_each_fragment_is_in_one_part_that_has_room(seed: int) -> None:
    random = np.random.default_rng(seed)
    counts = random.integers(0, 40, 500) * (random.random(500) < 0.3)
    counts[random.integers(0, 500, 3)] = 90
    parts, capacity = pixel_parts(counts, 60), 60
    held = np.zeros(500, int)
    for part in parts:
        own = counts[part.first : part.end]
        held[part.first : part.end] += 1
        assert own.any() and (own.sum() <= capacity or len(own) == 1)
    assert (held[counts > 0] == 1).all() and held.max() == 1
    for one, other in pairwise(parts):
        both = counts[one.first : other.end].sum()
        assert both > capacity, "two that would have room together"


def test_nothing_has_no_parts() -> None:
    assert pixel_parts(np.zeros(9, np.uint32), 4) == []
    assert pixel_parts(np.zeros(0, np.uint32), 4) == []


def test_counts_beyond_32_bits_are_added_up() -> None:
    counts = np.full(4, 2**31, np.uint32)
    assert [(part.first, part.end) for part in pixel_parts(counts, 2**32)] == [(0, 2), (2, 4)]


def test_a_part_is_cut_until_it_is_one_depth_of_one_pixel() -> None:
    """The farther half comes first, so that the nearer one is drawn over it."""
    part, steps = PixelPart(3, 8), 0
    while part.halves:
        one, other = part.halves
        if part.end - part.first > 1:
            assert (one.first, one.end, other.end) == (part.first, other.first, part.end)
            assert replace(one, first=0, end=0) == replace(other, first=0, end=0)
        else:
            assert (other.near, other.far, one.far) == (part.near, one.near, part.far)
        part, steps = (one, other)[steps % 2], steps + 1
    assert part.end - part.first == 1 and part.far - part.near == 1
    assert steps < 3 + 32


def test_depths_up_to_the_farthest_have_bits_in_order() -> None:
    bits = np.linspace(0.0, 1.0, 1000, dtype=np.float32).view(np.int32)
    assert (np.diff(bits) > 0).all() and bits[0] == 0 and bits[-1] == DEPTH_END - 1


def test_rows_are_those_that_a_part_touches() -> None:
    assert PixelPart(9, 10).rows(10) == range(0, 1)
    assert PixelPart(9, 21).rows(10) == range(0, 3)
    assert PixelPart(10, 20).rows(10) == range(1, 2)
