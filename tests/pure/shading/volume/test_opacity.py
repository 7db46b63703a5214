"""Opacity maps in numpy against strands counted one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.volume.light_frame import ball_around, light_frame
from hairloom.addon.shading.volume.opacity import (
    Coverage,
    adds_to,
    coverage,
    layer_ends,
    layer_weights,
    look_up,
    transmittance,
)
from hairloom.addon.shading.volume.settings import VolumeSettings

SIZE = 64
SUN = Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0)


@pytest.mark.parametrize(
    "settings",
    [
        VolumeSettings(shadows="slices"),
        VolumeSettings(shadows="slices", slices=64),
        VolumeSettings(shadows="deep"),
        VolumeSettings(shadows="deep", layers=2, layer_depth=2.0),
        VolumeSettings(shadows="deep", layers=64, layer_depth=0.001),
    ],
)
def test_layers_end_one_behind_the_other_and_the_last_behind_all(settings: VolumeSettings) -> None:
    ends = layer_ends(settings)
    assert (np.diff(ends) > 0.0).all() and ends[0] > 0.0 and ends[-1] == 1.0
    depth = np.linspace(-0.5, 1.0, 301)
    assert adds_to(depth, ends)[:, -1].all()


def test_weights_give_back_what_grows_evenly() -> None:
    """Sums that grow with depth as hair of one density would make them come out exactly."""
    ends = np.array([0.1, 0.3, 0.4, 1.0])
    depth = np.linspace(-0.2, 1.0, 50)
    found = layer_weights(depth, ends) @ ends
    assert np.allclose(found, np.maximum(depth, 0.0), atol=1e-12)


def hair(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    roots = random.uniform(-0.1, 0.1, size=(count, 3))
    way = random.normal(size=(count, 3)) * 0.02
    strands = roots[:, None] + way[:, None] * np.linspace(0, 1, 5)[:, None]
    return strands, np.full((count, 5), 1e-4)


def counted(light: Light = SUN, size: int = SIZE) -> tuple[Coverage, np.ndarray, np.ndarray]:
    """Coverage; texels and depths of random places."""
    strands, radius = hair()
    frame = light_frame(light, ball_around(strands))
    assert frame is not None
    place, depth = frame.places(np.random.default_rng(5).permutation(strands.reshape(-1, 3)))
    column, row = np.floor(place * size).astype(np.int64).T
    return coverage(strands, radius, frame, size), row * size + column, depth


def test_coverage_is_length_times_width() -> None:
    """Of strands across the light, over the area of a texel; whatever the texels are."""
    strands, radius = hair()
    strands[..., 2] = 0.0
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    area = (np.linalg.norm(np.diff(strands, axis=1), axis=2) * 2.0 * radius[:, 1:]).sum()
    for size in (16, 64):
        found = coverage(strands, radius, frame, size)
        texel = frame.texel_width(np.zeros(3), size) ** 2
        assert found.covered.sum() * texel == pytest.approx(area, rel=1e-6)


def test_strands_along_the_light_cover_nothing() -> None:
    strands = np.zeros((3, 4, 3))
    strands[..., 2] = np.linspace(-0.1, 0.1, 4)
    frame = light_frame(SUN, ball_around(strands))
    assert frame is not None
    found = coverage(strands, np.full((3, 4), 1e-4), frame, 32)
    assert found.covered.sum() < 1e-9


def test_counting_one_by_one_is_the_sum_over_what_is_in_front() -> None:
    found, texel, depth = counted()
    for which in range(0, 60, 3):
        in_front = (found.texel == texel[which]) & (found.depth < depth[which])
        expected = found.covered[in_front].sum()
        one = slice(which, which + 1)
        assert found.optical_depth(texel[one], depth[one])[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("shadows", ["slices", "deep"])
def test_at_the_ends_of_layers_sums_are_exact(shadows: str) -> None:
    settings = VolumeSettings(shadows=shadows)
    found, _, _ = counted()
    ends = layer_ends(settings)
    starts = found.starts() if shadows == "deep" else np.zeros(SIZE * SIZE)
    layers = found.layers(ends, starts)
    filled = np.flatnonzero(layers[:, -1] > 0.0)
    for number, end in enumerate(ends[:-1]):
        depth = starts[filled] + end
        expected = found.optical_depth(filled, np.nextafter(depth, 2.0))
        assert np.allclose(layers[filled, number], expected, atol=1e-6)


def test_error_falls_with_slices_and_deep_layers_beat_as_many_even_ones() -> None:
    found, texel, depth = counted(Light.sun((0.4, -1.0, -0.6), (1, 1, 1), 3.0))
    exact = transmittance(found.optical_depth(texel, depth), 2.0)

    def error(settings: VolumeSettings) -> float:
        ends = layer_ends(settings)
        starts = found.starts() if settings.shadows == "deep" else np.zeros(SIZE * SIZE)
        weights = layer_weights(depth - starts[texel], ends)
        tau = (found.layers(ends, starts)[texel] * weights).sum(axis=1)
        return float(np.abs(transmittance(tau, 2.0) - exact).mean())

    even = [error(VolumeSettings(shadows="slices", slices=count)) for count in (4, 8, 16, 64)]
    assert all(finer < coarser for coarser, finer in pairwise(even))
    assert error(VolumeSettings(shadows="deep", layers=8)) < even[1]


def test_blended_look_up_of_equal_texels_is_that_of_one() -> None:
    ends = np.array([0.5, 1.0])
    layers = np.broadcast_to(np.array([1.0, 3.0]), (8, 8, 2))
    places = np.random.default_rng(0).uniform(size=(50, 2))
    depth = np.linspace(0.0, 1.0, 50)
    tau, beyond, lit = look_up(layers, np.zeros((8, 8)), np.ones((8, 8)), ends, places, depth, 0.0)
    assert np.allclose(tau, np.where(depth < 0.5, 2.0 * depth, 4.0 * depth - 1.0))
    assert np.allclose(tau + beyond, 3.0) and np.allclose(lit, 1.0)


def test_behind_a_mesh_it_is_dark_and_hair_behind_it_does_not_count() -> None:
    layers, ends = np.full((4, 4, 1), 2.0), np.array([1.0])
    meshes, places = np.full((4, 4), 0.5), np.full((2, 2), 0.4)
    tau, beyond, lit = look_up(
        layers, np.zeros((4, 4)), meshes, ends, places, np.array([0.25, 0.75]), 0.0
    )
    assert np.allclose(tau, [0.5, 1.5]) and np.allclose(beyond, [0.5, 0.0])
    assert np.allclose(lit, [1.0, 0.0])


def test_outside_of_a_map_nothing_shades() -> None:
    layers, ends = np.ones((4, 4, 1)), np.array([1.0])
    places = np.array([[-0.1, 0.5], [0.5, 1.1]])
    tau, beyond, lit = look_up(
        layers, np.zeros((4, 4)), np.zeros((4, 4)), ends, places, np.ones(2), 0.0
    )
    assert not tau.any() and not beyond.any() and (lit == 1.0).all()


@pytest.mark.parametrize("extinction", [0.0, 1000.0])
def test_transmittance_stays_a_share(extinction: float) -> None:
    left = transmittance(np.array([0.0, 1e-6, 1.0, 1e6]), extinction)
    assert np.isfinite(left).all() and (left >= 0.0).all() and (left <= 1.0).all()
    assert left[0] == 1.0
