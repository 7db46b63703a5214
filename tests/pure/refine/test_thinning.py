"""Thinning: even ranks, fractions and widths without jumps, and coverage by brute force."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.arrays import Floats
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.refine.detail import PictureView
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.thinning import (
    WHOLE,
    Thinning,
    drawn_fraction,
    even_ranks,
    groom_size,
    thinning,
    widening,
    width_factor,
)
from hairloom.addon.render.camera import look_at, orthographic, perspective

#: Samples across a pixel for the coverage below.
SAMPLES = 5


def on_a_ball(count: int, seed: int = 0) -> Floats:
    """Random places on the upper half of a ball, denser on one side."""
    random = np.random.default_rng(seed)
    places = random.normal(size=(8 * count, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    chance = (places[:, 2] > 0.0) * np.where(places[:, 0] > 0.0, 1.0, 0.3)
    return places[random.random(8 * count) < chance][:count].astype(np.float32)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 1000, 1024, 5000])
def test_each_rank_is_there_once(count: int) -> None:
    ranks = even_ranks(on_a_ball(count))
    assert ranks.dtype == np.float32
    assert np.sort(ranks) == pytest.approx(np.arange(count) / max(count, 1), abs=1e-6)
    assert (ranks < 1.0).all()


@pytest.mark.parametrize("share", [0.5, 0.3, 0.125])
def test_low_ranks_are_the_same_groom_but_sparser(share: float) -> None:
    """Each patch keeps its fraction of strands, far more evenly than in random samples."""
    roots = on_a_ball(8000)
    assert len(roots) == 8000
    ranks = even_ranks(roots)
    centers = on_a_ball(60, seed=1)
    patches = [np.linalg.norm(roots - center, axis=1) < 0.25 for center in centers]
    kept = np.array([(ranks[patch] < share).sum() for patch in patches])
    there = np.array([patch.sum() for patch in patches])
    by_lot = np.sqrt(there * share * (1.0 - share))  # of a binomial distribution
    assert np.sqrt(np.mean(((kept - share * there) / by_lot) ** 2)) < 0.5
    assert (np.abs(kept - share * there) < 3.0 * by_lot).all()


def test_ranks_hang_on_roots_and_seed_alone() -> None:
    roots = on_a_ball(500)
    assert (even_ranks(roots) == even_ranks(roots.copy())).all()
    assert (even_ranks(roots) != even_ranks(roots, seed=2)).any()
    in_one_place = even_ranks(np.zeros((10, 3), np.float32))
    assert np.sort(in_one_place) == pytest.approx(np.arange(10) / 10, abs=1e-6)


def test_all_strands_are_drawn_from_the_full_size_on() -> None:
    ranks = np.linspace(0.0, 1.0, 101)
    settings = DetailSettings(lod_size=200.0)
    for size in (200.0, 1000.0, np.inf):
        assert drawn_fraction(size, settings) == WHOLE
    assert width_factor(ranks, WHOLE) == pytest.approx(1.0)
    assert drawn_fraction(1.0, DetailSettings(lod_size=0.0)) == WHOLE
    assert drawn_fraction(1.0, DetailSettings(min_density=1.0)) == WHOLE
    assert drawn_fraction(1.0, DetailSettings(min_density=0.125)) == 0.125
    assert (width_factor(ranks, 0.125) > 0.0).tolist() == (ranks < 0.125).tolist()


def test_a_strand_gets_thin_before_it_is_gone() -> None:
    """As the groom's height shrinks by a pixel, no width changes by more than a tenth."""
    ranks = np.linspace(0.0, 0.999, 500)
    settings = DetailSettings(lod_size=300.0, min_density=0.0)
    before = width_factor(ranks, drawn_fraction(310.0, settings))
    for height in np.arange(309.0, 60.0, -1.0):
        now = width_factor(ranks, drawn_fraction(height, settings))
        assert (now <= before).all()
        assert (before - now).max() < 0.1
        before = now
    assert (width_factor(ranks, 0.0)[1:] == 0.0).all()


def test_widths_are_made_up_as_far_as_strands_do_not_hide_each_other() -> None:
    # a sparse groom of thin strands: the sum of all widths stays
    ranks = np.linspace(0.0, 1.0, 100_001)
    for share in (1.2, 1.0, 0.5, 0.125):
        factors = width_factor(ranks, share, widening(share, 0.0, 0.0))
        assert factors.mean() == pytest.approx(1.0, abs=1e-4)
    assert widening(WHOLE, 30.0, 0.01) == pytest.approx(1.0)
    # many layers: less widening, and even less for strands that are wide relative to the groom
    few, many = widening(0.125, 1.0, 0.01), widening(0.125, 30.0, 0.01)
    assert 1.0 < many < few < 1.0 / 0.1
    assert widening(0.125, 30.0, 0.03) < many


def test_the_size_in_the_picture() -> None:
    bounds = np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0])
    flat = PictureView(look_at((0, -5, 0), (0, 0, 0)), orthographic(8.0, 2.0, 0.1, 10.0), 800, 400)
    assert groom_size(bounds, flat) == pytest.approx((100.0, 100.0))
    lens = perspective(np.pi / 2.0, 2.0, 0.1, 10.0)
    near = PictureView(look_at((0, -5, 0), (0, 0, 0)), lens, 800, 400)
    assert groom_size(bounds, near) == pytest.approx((100.0, 100.0))  # the face at 4 m
    inside = PictureView(look_at((0, 0, 0), (0, 1, 0)), lens, 800, 400)
    assert groom_size(bounds, inside) == (np.inf, np.inf)
    settings = DetailSettings(lod_size=1000.0)
    assert thinning(bounds, 100.0, 4e-5, 1.0, inside, settings) == Thinning()


def test_a_flat_groom_is_as_large_as_it_is_wide_however_the_camera_is_rolled() -> None:
    brows = np.array([-0.06, -0.01, -0.008]), np.array([0.06, 0.01, 0.008])

    def of(roll: float, distance: float) -> Thinning:
        turned = np.eye(4)
        turned[:2, :2] = [[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]]
        view = turned @ look_at((0, -distance, 0), (0, 0, 0))
        seen = PictureView(view, perspective(0.5, 1.0, 0.01, 100.0), 1080, 1080)
        return thinning(brows, 600 * 0.01, 4e-5, 1.0, seen, DetailSettings())

    assert of(0.0, 0.57) == Thinning()  # 450 x 60 pixels, in a portrait
    far, rolled = of(0.0, 2.0), of(np.pi / 2.0, 2.0)
    assert 0.125 < far.fraction < 0.8 and far.widening > 1.0
    assert rolled.fraction == pytest.approx(far.fraction)
    assert rolled.widening == pytest.approx(far.widening)


@pytest.mark.parametrize("height", few_in_commits([75, 150, 38]))
def test_the_groom_covers_as_much_when_it_is_thinned(shared_data: Path, height: int) -> None:
    path = shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx"
    grid = read_tfx(path).strands.grid
    low, high = grid.min(axis=(0, 1)), grid.max(axis=(0, 1))
    middle = (low + high) / 2.0
    size = height * 5 // 4
    view = look_at(middle + [-0.5, -1.0, 0.2], middle)
    metre = PictureView(view, orthographic(1.0, 1.0, 0.01, 10.0), size, size)
    tall = groom_size((low, high), metre)[1] / height
    seen = PictureView(view, orthographic(tall, 1.0, 0.01, 10.0), size, size)
    length = float(np.linalg.norm(np.diff(grid, axis=1), axis=2).sum())
    in_picture = max(groom_size((low, high), seen))
    settings = DetailSettings(lod_size=1.25 * 8.0 * in_picture)  # an eighth is left
    thinned = thinning((low, high), length, 4e-5, 1.0, seen, settings)
    assert thinned.fraction == pytest.approx(0.125)
    factors = width_factor(even_ranks(grid[:, 0]), thinned.fraction, thinned.widening)
    drawn = factors > 0.0
    assert drawn.mean() == pytest.approx(0.125, abs=0.001)
    full = covered(grid, np.ones(len(grid)), seen)
    assert covered(grid[drawn], factors[drawn], seen) == pytest.approx(full, rel=0.015)
    # widths that compensate fully would swell the outline
    assert covered(grid[drawn], np.full(drawn.sum(), 1.0 / 0.11), seen) > 1.05 * full


def covered(grid: Floats, width: Floats, view: PictureView) -> float:
    """The number of pixels that ribbons of these widths [pixels] cover, by brute force."""
    clip = np.concatenate([grid, np.ones((*grid.shape[:2], 1))], axis=2) @ view.view_projection.T
    corners = (clip[..., :2] / clip[..., 3:] + 1.0) * view.half_size * SAMPLES
    way = np.diff(corners, axis=1)
    length = np.linalg.norm(way, axis=2, keepdims=True)
    across = way[..., ::-1] * [-1.0, 1.0] / np.maximum(length, 1e-9)
    picture = np.zeros((view.height * SAMPLES, view.width * SAMPLES), bool)
    steps_along = int(np.ceil(1.4 * length.max()))
    steps_across = int(np.ceil(1.4 * SAMPLES * width.max()))
    # a point fills a whole sample, so half a sample is left out on each side
    side = (width[:, None, None] * SAMPLES - 1.0) * across
    for along in (np.arange(steps_along) + 0.5) / steps_along:
        middle = corners[:, :-1] + along * way
        for shift in (np.arange(steps_across) + 0.5) / steps_across - 0.5:
            x, y = (middle + shift * side).reshape(-1, 2).astype(int).T
            picture[np.clip(y, 0, len(picture) - 1), np.clip(x, 0, len(picture[0]) - 1)] = True
    return float(picture.sum()) / SAMPLES**2
