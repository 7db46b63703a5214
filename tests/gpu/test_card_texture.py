"""Mip maps of cards, and the coverage of slanted cards: the shaders against Python, and in
pictures."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from mip_chains import mip_chain

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.shading.card_look import view_compensated_alpha
from hairloom.addon.shading.card_texture import LEVELS, card_texel, packed_levels, wanted_level
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.card_opacity import (
    card_optical_depth,
    layer_facing,
    tau_within_card,
    tau_within_card_at_depth,
    tau_within_short_hair,
    view_compensated_depth,
    visible_depth,
)

SHAPE = (40, 96)


@pytest.mark.parametrize("size", [(96, 40), (33, 17), (1, 3)])
def test_texel(compute: Callable[..., np.ndarray], size: tuple[int, int]) -> None:
    random = np.random.default_rng(3)
    picture = random.random((size[1], size[0], 4)).astype(np.float32)
    levels = mip_chain(picture, grid=AtlasGrid(4, 2))[:LEVELS]
    tiled, repeated = (packed_levels(levels, is_repeated=each) for each in (False, True))
    place = random.uniform(-0.4, 1.4, (*SHAPE, 2))
    level = random.choice([0.0, 1.0, 2.3, 4.7, LEVELS - 1.0], SHAPE)
    repeats = random.integers(0, 2, SHAPE)
    packed = np.dstack([place, level, repeats]).astype(np.float32)
    found = compute(
        "card_texel.glsl",
        (SHAPE[1], SHAPE[0]),
        textures={"places": packed, "tiled_levels": tiled, "repeated_levels": repeated},
    )
    place, level = packed[..., :2].astype(np.float64), packed[..., 2]
    for chosen, whole, tiles in ((repeats == 0, tiled, (4, 2)), (repeats == 1, repeated, None)):
        expected = card_texel(whole, place[chosen], level[chosen], tiles)
        # a driver interpolates with weights of eight bits
        assert np.abs(found[chosen] - expected).max() < 0.01


def test_slant_of_shells(compute: Callable[..., np.ndarray]) -> None:
    normals, tangents, eyes = np.random.default_rng(6).normal(size=(3, *SHAPE, 3))
    tangents, eyes = (
        each / np.linalg.norm(each, axis=-1, keepdims=True) for each in (tangents, eyes)
    )
    named = {"normals": normals, "tangents": tangents, "eyes": eyes}
    textures = {name: np.dstack([each, np.ones(SHAPE)]) for name, each in named.items()}
    found = compute(
        "layer_facing.glsl",
        (SHAPE[1], SHAPE[0]),
        textures={name: each.astype(np.float32) for name, each in textures.items()},
    )
    expected = layer_facing(normals, tangents, eyes)
    assert found[..., 0] == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_level_and_slant(compute: Callable[..., np.ndarray]) -> None:
    random = np.random.default_rng(4)
    normals, tangents, eyes = random.normal(size=(3, *SHAPE, 3))
    tangents, eyes = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (tangents, eyes))
    alpha = random.choice([0.0, 0.1, 0.7, 1.0], SHAPE)
    steps = 10.0 ** random.uniform(-4.0, 0.5, (*SHAPE, 4))
    textures = {
        "normals": np.dstack([normals, alpha]),
        "tangents": np.dstack([tangents, alpha]),
        "eyes": np.dstack([eyes, alpha]),
        "steps_of": steps,
    }
    found = compute(
        "card_steps.glsl",
        (SHAPE[1], SHAPE[0]),
        textures={name: values.astype(np.float32) for name, values in textures.items()},
        settings=(ShadingSettings,),
    )
    assert (
        np.abs(found[..., 0] - view_compensated_alpha(alpha, normals, tangents, eyes)).max() < 1e-4
    )
    level = wanted_level(steps[..., :2], steps[..., 2:], (96, 40))
    assert np.abs(found[..., 1] - level).max() < 1e-3
    assert (level > 1.0).mean() > 0.2
    first, second, parts = steps[..., 0], steps[..., 1], np.minimum(steps[..., 2:], 1.0)
    own = card_optical_depth(alpha) * view_compensated_depth(normals, tangents, eyes)
    strands = tau_within_card(first, own, second, parts[..., 0])
    strands = tau_within_card_at_depth(strands, 2.0 * parts[..., 1] - 1.0, parts[..., 0])
    tips = tau_within_short_hair(own, card_optical_depth(alpha), parts[..., 1])
    among = np.stack(strands, axis=-1) + np.stack(tips, axis=-1) + visible_depth(first)[..., None]
    assert found[..., 2:] == pytest.approx(among, rel=1e-3, abs=1e-3)
    assert np.ptp(among) > 1.0
