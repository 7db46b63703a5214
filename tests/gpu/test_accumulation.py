"""Accumulated pictures: exact, not spoilt by a broken sample, and drawn unchanged."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("gpu_context")


@pytest.fixture(scope="module")
def rooms() -> Any:
    pytest.importorskip("gpu")
    from hairloom.addon.render import accumulation, textures

    return accumulation, textures


def test_the_mean_of_many_pictures(rooms: Any) -> None:
    accumulation, textures = rooms
    pictures = np.random.default_rng(3).random((40, 13, 21, 4)).astype(np.float32)
    found = accumulation.Accumulation()
    found.begin(21, 13)
    for one in pictures:
        found.add(textures.texture_from(one, "RGBA32F"))
    assert found.count == 40
    np.testing.assert_allclose(found.mean(), pictures.mean(axis=0), rtol=1e-5)
    found.begin(21, 13)
    assert found.count == 0
    np.testing.assert_array_equal(found.mean(), 0.0)


def test_a_broken_sample_does_not_break_the_pixel(rooms: Any) -> None:
    accumulation, textures = rooms
    broken = np.full((4, 4, 4), 0.5, np.float32)
    broken[1, 1], broken[2, 2, 0] = np.nan, np.inf
    found = accumulation.Accumulation()
    found.begin(4, 4)
    for one in (broken, np.full_like(broken, 0.5)):
        found.add(textures.texture_from(one, "RGBA32F"))
    mean = found.mean()
    assert np.isfinite(mean).all()
    np.testing.assert_allclose(mean[1, 1], 0.25)
    np.testing.assert_allclose(mean[0, 0], 0.5)


def test_the_mean_is_drawn_over_the_picture_at_its_corner(rooms: Any) -> None:
    accumulation, textures = rooms
    one = np.zeros((2, 3, 4), np.float32)
    one[..., 0], one[..., 3] = np.arange(6).reshape(2, 3) / 10.0, 0.5
    found = accumulation.Accumulation()
    found.begin(3, 2)
    for _ in range(2):
        found.add(textures.texture_from(one, "RGBA32F"))
    target = accumulation.Target().sized(3, 2)
    target.clear((0.0, 1.0, 0.0, 1.0))
    with target.drawing():
        found.show()
    shown = textures.texture_to_array(target.color)
    np.testing.assert_allclose(shown[..., 0], one[..., 0], rtol=1e-6)
    np.testing.assert_allclose(shown[..., 1], 0.5)
