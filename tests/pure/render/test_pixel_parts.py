"""Parts of a picture: together they cover it, and each fits into memory."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective
from hairloom.addon.render.pixel_parts import DEPTH_END, PixelPart, expected_depths, pixel_parts
from hairloom.addon.shading.volume.light_frame import Ball


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
    """The farther half comes first, so that the nearer one is drawn over it; each part is halved
    down to one layer of one pixel."""
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


@pytest.mark.parametrize("expected", [range(500, 508), range(DEPTH_END - 8, DEPTH_END), range(9)])
def test_depths_are_cut_where_hair_is_and_all_are_in_one_slab(expected: range) -> None:
    cuts: set[int] = set()

    def cut(part: PixelPart, rounds: int) -> list[PixelPart]:
        if not rounds or not part.slabs:
            return [part]
        cuts.add(part.slabs[0].near)
        return [end for slab in part.slabs for end in cut(slab, rounds - 1)]

    ends = cut(PixelPart(4, 5, expected=expected), 2)
    assert cuts <= set(expected), "no draw for what holds no hair"
    assert ends[0].far == DEPTH_END and ends[-1].near == 0
    assert all(far.near == near.far for far, near in pairwise(ends))


def test_a_part_with_a_pixel_that_is_too_long_is_two_at_once() -> None:
    counts = np.array([5, 1, 9, 2], np.uint32)
    parts = pixel_parts(counts, 8, longest=8, expected=range(100, 104))
    ends = [(part.first, part.end, part.near, part.far) for part in parts]
    assert ends == [
        (0, 2, 0, DEPTH_END),
        (2, 3, 102, DEPTH_END),
        (2, 3, 0, 102),
        (3, 4, 0, DEPTH_END),
    ]
    assert len(pixel_parts(counts, 8, longest=9)) == 3


@pytest.mark.parametrize(
    "projection",
    [perspective(0.5, 1.5, 0.1, 30.0), orthographic(3.0, 1.5, 0.1, 30.0)],
    ids=["perspective", "orthographic"],
)
def test_depths_of_hair_are_expected_where_it_is_seen(projection: np.ndarray) -> None:
    ball = Ball(np.array([0.3, 0.2, 1.0]), 0.2)
    camera = Camera(look_at((1.0, -4.0, 2.0), (0.3, 0.0, 1.0)), projection)
    away = np.random.default_rng(1).normal(size=(10_000, 3))
    points = ball.center + ball.radius * away / np.linalg.norm(away, axis=1, keepdims=True)
    clip = np.column_stack([points, np.ones(len(points))]) @ (projection @ camera.view).T
    depths = (0.5 + 0.5 * clip[:, 2] / clip[:, 3]).astype(np.float32).view(np.int32)
    expected = expected_depths(ball, camera)
    assert expected.start <= depths.min() and depths.max() < expected.stop
    assert len(expected) < 1.01 * (depths.max() - depths.min())


def test_an_eye_within_hair_expects_some_before_it() -> None:
    camera = Camera(look_at((0.0, 0.1, 0.0), (0.0, 1.0, 0.0)), perspective(0.5, 1.0, 0.01, 30.0))
    expected = expected_depths(Ball(np.zeros(3), 1.0), camera)
    assert np.int32(expected.start).view(np.float32) > 0.1
    assert len(expected) > 0 and expected.stop <= DEPTH_END


def test_depths_up_to_the_farthest_have_bits_in_order() -> None:
    bits = np.linspace(0.0, 1.0, 1000, dtype=np.float32).view(np.int32)
    assert (np.diff(bits) > 0).all() and bits[0] == 0 and bits[-1] == DEPTH_END - 1


def test_rows_are_those_that_a_part_touches() -> None:
    assert PixelPart(9, 10).rows(10) == range(0, 1)
    assert PixelPart(9, 21).rows(10) == range(0, 3)
    assert PixelPart(10, 20).rows(10) == range(1, 2)
