"""The atlas baked on the GPU, against its reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import SUBPIXEL, tolerance

from hairloom.addon.cards import bake
from hairloom.addon.cards.atlas_maps import MAP_NAMES
from hairloom.addon.cards.bake import Block, fibre_normal, is_counted, sample_maps
from hairloom.addon.cards.bake_strands import FlatStrands

pytestmark = pytest.mark.usefixtures("gpu_context")

STATIONS = 12


@pytest.fixture
def baked_maps() -> Any:
    from hairloom.addon.render.atlas_pass import baked_maps

    return baked_maps


def wavy(count: int, half: float, seed: int = 0) -> FlatStrands:
    """Strands that wind up the atlas, of all depths and colours."""
    random = np.random.default_rng(seed)
    along = np.linspace(0.05, 0.95, STATIONS)
    start, phase = random.uniform(0.2, 0.8, count), random.uniform(0.0, 6.0, count)
    across = start[:, None] + 0.12 * np.sin(7.0 * along + phase[:, None])
    place = np.stack(np.broadcast_arrays(across, along), axis=-1)
    direction = np.gradient(place, axis=1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    taper = np.linspace(1.0, 0.5, STATIONS)[:, None]
    depth = random.random((count, 1)) + 0.1 * np.sin(9.0 * along)
    tangent = np.concatenate([direction, random.uniform(-0.3, 0.3, (count, STATIONS, 1))], axis=-1)
    parts = (
        place,
        half * taper * np.stack([direction[..., 1], -direction[..., 0]], axis=-1),
        random.random((count, STATIONS)),
        np.clip(depth, 0.0, 1.0),
        tangent / np.linalg.norm(tangent, axis=-1, keepdims=True),
        random.random((count, STATIONS, 3)),
        random.random((count, STATIONS)),
        random.random(count),
    )
    return FlatStrands(*(part.astype(np.float32) for part in parts), base_gain=1.5)


@pytest.mark.parametrize(
    ("size", "half"),
    [(64, 0.02), (50, 0.02), (64, 0.0008)],
    ids=["wide", "odd size", "thinner than a sample"],
)
def test_the_pass_agrees_with_the_reference(baked_maps: Any, size: int, half: float) -> None:
    """Except for samples on an edge, and for half-float rounding."""
    flat = wavy(12, half)
    ours, reference = baked_maps(flat, size), sample_maps(flat, size)
    assert ours.base_gain == reference.base_gain == 1.5
    differs = np.abs(ours.alpha - reference.alpha) > 1e-6
    assert differs.mean() < 0.01
    assert np.abs(ours.alpha - reference.alpha).max() <= 2 / 16
    assert reference.alpha.mean() > 0.01
    for name in MAP_NAMES:
        apart = np.abs(getattr(ours, name) - getattr(reference, name))
        assert np.quantile(apart[~differs], 0.999) < tolerance(2e-3, SUBPIXEL), name


def test_blocks_join_without_a_seam(baked_maps: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many small blocks, with lower ones at the top, give the same as one."""
    flat, size = wavy(12, 0.02), 80
    whole = baked_maps(flat, size)
    monkeypatch.setattr(bake, "_MAX_BLOCK_WIDTH", 40)
    monkeypatch.setattr(bake, "_MAX_SAMPLES", 40 * 16 * 24)
    assert len(bake.atlas_blocks(size)) == 8
    parted = baked_maps(flat, size)
    differs = np.abs(parted.alpha - whole.alpha) > 1e-6
    assert differs.mean() < 0.002
    for name in MAP_NAMES:
        apart = np.abs(getattr(parted, name) - getattr(whole, name))
        assert np.quantile(apart[~differs], 0.999) < 2e-3, name


def test_thin_strands_cover_as_much_as_they_are_wide(baked_maps: Any) -> None:
    """For forty upright strands, each a fiftieth of a pixel wide."""
    place = np.zeros((40, STATIONS, 2), np.float32)
    place[..., 0] = np.linspace(0.1, 0.9, 40)[:, None]
    place[..., 1] = np.linspace(0.0, 1.0, STATIONS)
    half = np.zeros_like(place)
    half[..., 0] = 0.01 / 128
    flat = wavy(40, 0.01)
    thin = replace(flat, place=place, half_width=half)
    assert baked_maps(thin, 128).alpha.mean() == pytest.approx(40 * 0.02 / 128, rel=0.05)


def test_no_strands_are_an_empty_atlas(baked_maps: Any) -> None:
    assert not baked_maps(wavy(0, 0.01), 64).alpha.any()


def test_functions_agree_with_their_twins(compute: Any) -> None:
    random = np.random.default_rng(3)
    direction = random.normal(size=(16, 16, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    direction[0, 0] = (0.0, 0.0, 1.0)
    side = random.uniform(-1.0, 1.0, (16, 16))
    directions = np.concatenate([direction, side[..., None]], axis=-1).astype(np.float32)
    numbers = np.floor(random.random((16, 16, 4)) * (16384, 16384, 50_000, 1.0))
    numbers[..., 3] = random.random((16, 16))
    numbers = numbers.astype(np.float32)

    normals = compute("atlas_normal.glsl", (16, 16), textures={"directions": directions})
    reference = fibre_normal(directions[..., :3].astype(float), directions[..., 3].astype(float))
    np.testing.assert_allclose(normals[..., :3], reference, atol=1e-5)

    found = compute("atlas_place.glsl", (16, 16), textures={"numbers": numbers})
    column, row, strand = np.moveaxis(numbers[..., :3].astype(np.int64), -1, 0)
    counted = is_counted(column, row, strand, numbers[..., 3])
    np.testing.assert_array_equal(found[..., 0] > 0.5, counted)
    places = Block(64, 32, 128, 128).sheared(numbers[..., :2] / 16384.0, 512)
    np.testing.assert_allclose(found[..., 1:3], places, rtol=1e-5, atol=1e-3)
