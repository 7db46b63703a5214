"""N_p against rays traced in space through a glass cylinder, and against the sum of the energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.marschner.azimuthal import (
    azimuthal_r,
    azimuthal_trt,
    azimuthal_tt,
    elliptic_index,
    trt_caustic,
    trt_turn,
)
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.interface import bravais_index, fresnel, lobe_energy

CLEAR = Fibre(absorption=(0.0, 0.0, 0.0))
ABSORPTION = (0.1, 0.4, 1.5)
BIN_COUNT = 360


def dot(one: Floats, other: Floats) -> Floats:
    return np.einsum("ij,ij->i", one, other)


def glass(cos_in: Floats, ratio: float) -> tuple[Floats, Floats]:
    """Fresnel's reflectance and the cosine behind, in space; ratio is n before over n behind."""
    cos_out = np.sqrt(np.maximum(1.0 - ratio**2 * (1.0 - cos_in**2), 0.0))
    across = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out)
    along = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out)
    return 0.5 * (across**2 + along**2), cos_out


def traced_lobes(
    ray_count: int, theta: float, index: float, order_count: int, seed: int = 1
) -> tuple[Floats, Floats]:
    """Histograms of phi and energies of the lobes: rays in space on a cylinder around z.

    The light comes from azimuth 0 and inclination theta. Nothing of the plane across the fibre
    is used: hit points, normals, reflection and refraction are vectors.

    Returns:
        (order_count, BIN_COUNT, 3) density over phi in [-pi, pi], and (order_count, 3).
    """
    random = np.random.default_rng(seed)
    h = 2.0 * (np.arange(ray_count) + random.random(ray_count)) / ray_count - 1.0
    light = np.array([-np.cos(theta), 0.0, -np.sin(theta)])
    normal = np.stack([np.sqrt(1.0 - h * h), h, np.zeros_like(h)], axis=1)
    cosine = -(normal @ light)
    mirrored, cos_in = glass(cosine, 1.0 / index)
    ways = light + 2.0 * cosine[:, None] * normal
    inside = light / index + (cosine / index - cos_in)[:, None] * normal
    energy = np.repeat((1.0 - mirrored)[:, None], 3, axis=1)
    lobes = [(ways, np.repeat(mirrored[:, None], 3, axis=1))]
    point = normal
    for _ in range(1, order_count):
        flat = inside * [1.0, 1.0, 0.0]
        length = -2.0 * dot(point, flat) / dot(flat, flat)
        point = point + length[:, None] * flat
        energy = energy * np.exp(-length[:, None] * np.array(ABSORPTION))
        cosine = np.maximum(dot(inside, point), 0.0)
        mirrored, cos_out = glass(cosine, index)
        ways = inside * index + (cos_out - index * cosine)[:, None] * point
        lobes.append((ways, energy * (1.0 - mirrored)[:, None]))
        inside = inside - 2.0 * cosine[:, None] * point
        energy = energy * mirrored[:, None]
    scale = BIN_COUNT / (2.0 * np.pi) / ray_count
    found = np.empty((order_count, BIN_COUNT, 3))
    for order, (ways, weight) in enumerate(lobes):
        azimuth = (np.arctan2(ways[:, 1], ways[:, 0]) + np.pi) * (BIN_COUNT / (2.0 * np.pi))
        place = np.minimum(azimuth.astype(np.int64), BIN_COUNT - 1)
        for channel in range(3):
            counts = np.bincount(place, weight[:, channel], BIN_COUNT)
            found[order, :, channel] = counts * scale
    return found, np.array([weight.mean(axis=0) for _, weight in lobes])


def bin_means(function, theta: float, fibre: Fibre, samples: int = 32) -> Floats:
    """Mean of N_p over each bin of the histogram, (BIN_COUNT, channels)."""
    count = BIN_COUNT * samples
    phi = (np.arange(count) + 0.5) / count * 2.0 * np.pi - np.pi
    values = function(np.array(np.cos(theta)), phi, fibre).reshape(BIN_COUNT, samples, -1)
    return values.mean(axis=1)


def lobe_errors(traced: Floats, theta: float, index: float) -> list[float]:
    """Largest difference of R, TT, TRT from the traced lobes, over the lobe's peak.

    The pole of TRT is left out, 3 degrees on either side.
    """
    fibre = Fibre(absorption=ABSORPTION, index_of_refraction=index, glint_width=0.0)
    caustic = float(trt_caustic(bravais_index(index, np.array(np.cos(theta))))[1])
    phi = (np.arange(BIN_COUNT) + 0.5) / BIN_COUNT * 2.0 * np.pi - np.pi
    is_near = np.abs(np.abs(phi) - caustic) < np.radians(3.0)
    errors = []
    for order, function in enumerate((azimuthal_r, azimuthal_tt, azimuthal_trt)):
        expected = bin_means(function, theta, fibre)
        kept = ~is_near if order == 2 else np.full(BIN_COUNT, True)
        difference = np.abs(expected - traced[order])[kept].max(axis=0)
        errors.append(float((difference / traced[order][kept].max(axis=0)).max()))
    return errors


@pytest.mark.parametrize("theta", np.radians([0.0, 30.0, -50.0, 70.0]))
@pytest.mark.parametrize("index", [1.2, 1.55, 2.5])
def test_lobes_agree_with_a_million_rays(theta: float, index: float) -> None:
    traced, _ = traced_lobes(1_000_000, theta, index, 3)
    assert max(lobe_errors(traced, theta, index)) < 0.01


def test_lobes_agree_with_ten_million_rays() -> None:
    theta = np.radians(20.0)
    traced = np.mean([traced_lobes(10**6, theta, 1.55, 3, seed)[0] for seed in range(10)], axis=0)
    assert max(lobe_errors(traced, theta, 1.55)) < 0.01


@pytest.mark.parametrize("theta", np.radians([0.0, 40.0, 75.0]))
def test_energies_agree_with_the_rays(theta: float) -> None:
    _, traced = traced_lobes(200_000, theta, 1.55, 5)
    for order in range(5):
        energy = lobe_energy(order, np.array(np.cos(theta)), 1.55, ABSORPTION)
        assert energy == pytest.approx(traced[order], rel=2e-3, abs=2e-5)


@pytest.mark.parametrize("index", [1.01, 1.3, 1.55, 2.0, 3.0])
def test_white_furnace_around_the_fibre(index: float) -> None:
    """R, TT, TRT summed over phi, and TRRT to p = 8 over h, make 1 for every cone."""
    cos_d = np.cos(np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0]))
    phi = (np.arange(20_000) + 0.5) / 20_000 * np.pi
    fibre = replace(CLEAR, index_of_refraction=index)
    grid = cos_d[:, None]
    total = 2.0 * np.pi * azimuthal_r(grid, phi, fibre).mean(axis=1)
    total += 2.0 * np.pi * azimuthal_tt(grid, phi, fibre)[..., 0].mean(axis=1)
    total += 2.0 * np.pi * azimuthal_trt(grid, phi, fibre)[..., 0].mean(axis=1)
    for order in range(3, 9):
        total += lobe_energy(order, cos_d, index, CLEAR.absorption)[:, 0]
    assert (total < 1.01).all()
    # a steep cone holds light for more than 8 passages: the rest is what p = 9 and up keep
    rest = sum(lobe_energy(order, cos_d, index, CLEAR.absorption)[:, 0] for order in range(9, 200))
    assert total + rest == pytest.approx(1.0, abs=0.005)
    assert total[:4] == pytest.approx(1.0, abs=0.02)


def test_blurred_caustics_keep_their_energy_and_color() -> None:
    """Away from the width of the blur the lobe is as it was; its integral is that over h."""
    cos_d = np.cos(np.radians([0.0, 30.0, 50.0]))
    phi = (np.arange(40_000) + 0.5) / 40_000 * np.pi
    fibre = Fibre(absorption=ABSORPTION)
    blurred = azimuthal_trt(cos_d[:, None], phi, fibre)
    energy = lobe_energy(2, cos_d, 1.55, ABSORPTION)
    assert 2.0 * np.pi * blurred.mean(axis=1) == pytest.approx(energy, rel=0.01)
    assert blurred.max() < 1.0
    stronger = azimuthal_trt(cos_d[:, None], phi, replace(fibre, glint_strength=3.0))
    assert (stronger >= blurred).all() and stronger.max() > 1.5 * blurred.max()


def test_caustic_is_where_the_turn_turns() -> None:
    gamma = np.linspace(0.0, np.pi / 2, 200_001)
    for bravais in (1.1, 1.55, 1.9):
        place, caustic = trt_caustic(np.array(bravais))
        turn = trt_turn(gamma, np.array(bravais))
        assert caustic == pytest.approx(turn.max(), abs=1e-9)
        assert place == pytest.approx(gamma[turn.argmax()], abs=1e-4)
    assert trt_caustic(np.array(2.5)) == pytest.approx((0.0, 0.0))


def test_glints_of_ordinary_hair_lie_where_the_light_turns() -> None:
    """Across the fibre, index 1.55: the turning point at cos^2 gamma = (n^2 - 1) / 3."""
    gamma = np.arccos(np.sqrt((1.55**2 - 1.0) / 3.0))
    expected = 4.0 * np.arcsin(np.sin(gamma) / 1.55) - 2.0 * gamma
    assert np.degrees(expected) == pytest.approx(18.6, abs=0.1)
    phi = np.linspace(0.0, np.pi, 20_001)
    narrow = Fibre(glint_width=np.radians(0.5))
    peak = phi[azimuthal_trt(np.array(1.0), phi, narrow)[:, 0].argmax()]
    assert peak == pytest.approx(expected, abs=np.radians(0.5))
    assert phi[azimuthal_tt(np.array(1.0), phi, narrow)[:, 0].argmax()] == pytest.approx(np.pi)


def test_fresnel_at_normal_incidence_and_at_grazing() -> None:
    bravais = bravais_index(1.55, np.array(1.0))
    assert fresnel(np.array(0.0), 1.55, bravais) == pytest.approx((0.55 / 2.55) ** 2)
    assert fresnel(np.array(np.pi / 2), 1.55, bravais) == pytest.approx(1.0)
    brewster = np.arctan(1.55)  # what lies in the plane passes whole: half of the other is left
    across = np.sin(brewster - (np.pi / 2 - brewster)) ** 2
    assert fresnel(np.array(brewster), 1.55, bravais) == pytest.approx(0.5 * across)


def test_absorption_takes_blue_first_and_dims_with_every_passage() -> None:
    phi = np.linspace(0.0, np.pi, 181)
    through = azimuthal_tt(np.array(1.0), phi, Fibre(absorption=ABSORPTION))
    back = azimuthal_trt(np.array(1.0), phi, Fibre(absorption=ABSORPTION))
    assert (np.diff(through, axis=1) <= 0.0).all() and (np.diff(back, axis=1) <= 0.0).all()
    straight = azimuthal_tt(np.array(1.0), np.array(np.pi), CLEAR)
    assert through[-1] == pytest.approx(straight * np.exp(-2.0 * np.array(ABSORPTION)))


def test_an_elliptic_fibre_turns_its_glints_with_the_strand() -> None:
    assert elliptic_index(1.55, 1.0, 0.3) == pytest.approx(1.55)
    phi = np.linspace(0.0, np.pi, 2001)
    fibre = Fibre(eccentricity=0.9)
    turns = np.linspace(0.0, np.pi, 17)[:-1]
    lobes = [azimuthal_trt(np.array(1.0), phi, fibre, turn) for turn in turns]
    assert np.abs(lobes[0] - lobes[8]).max() > 0.2 * lobes[0].max()
    mean = azimuthal_trt(np.array(1.0), phi, fibre)
    assert np.abs(mean - np.mean(lobes, axis=0)).max() < 0.02 * mean.max()


def test_the_lobes_are_even_and_whole_turns_do_not_matter() -> None:
    phi = np.linspace(0.0, np.pi, 50)
    for function in (azimuthal_r, azimuthal_tt, azimuthal_trt):
        lobe = function(np.array(0.8), phi, Fibre())
        assert function(np.array(0.8), -phi, Fibre()) == pytest.approx(lobe)
        inner = slice(1, -1)
        assert function(np.array(0.8), phi[inner] + 4.0 * np.pi, Fibre()) == pytest.approx(
            lobe[inner]
        )
