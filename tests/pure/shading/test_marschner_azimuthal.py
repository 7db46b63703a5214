"""N_p against rays traced in 3D through a glass cylinder, and against energy conservation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fibre_oracles import lobe_errors, traced_lobes
from tiers import few_in_commits

from hairloom.addon.shading.marschner.azimuthal import (
    azimuthal_r,
    azimuthal_trt,
    azimuthal_tt,
    elliptic_index,
    trt_caustic,
    trt_turn,
)
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.interface import (
    bravais_index,
    fresnel,
    higher_lobes_energy,
    lobe_energy,
)
from hairloom.addon.shading.marschner.scattering import azimuthal_lobes

CLEAR = Fibre(absorption=(0.0, 0.0, 0.0))
ABSORPTION = (0.1, 0.4, 1.5)


@pytest.mark.parametrize("theta", few_in_commits(np.radians([30.0, 0.0, -50.0, 70.0])))
@pytest.mark.parametrize("index", few_in_commits([1.55, 1.2, 2.5]))
def test_lobes_agree_with_half_a_million_rays(theta: float, index: float) -> None:
    fibre = Fibre(absorption=ABSORPTION, index_of_refraction=index, glint_width=0.0)
    traced, _ = traced_lobes(500_000, theta, fibre)
    assert max(lobe_errors(traced, theta, fibre)) < 0.01


@pytest.mark.slow
def test_lobes_agree_with_ten_million_rays() -> None:
    theta = np.radians(20.0)
    fibre = Fibre(absorption=ABSORPTION, glint_width=0.0)
    traced = np.mean(
        [traced_lobes(10**6, theta, fibre, seed=seed)[0] for seed in range(10)], axis=0
    )
    assert max(lobe_errors(traced, theta, fibre)) < 0.01


@pytest.mark.parametrize("theta", np.radians([0.0, 40.0, 75.0]))
def test_energies_agree_with_the_rays(theta: float) -> None:
    cos_d = np.array(np.cos(theta))
    _, traced = traced_lobes(200_000, theta, Fibre(absorption=ABSORPTION), 12)
    for order in range(5):
        energy = lobe_energy(order, cos_d, 1.55, ABSORPTION)
        assert energy == pytest.approx(traced[order], rel=2e-3, abs=2e-5)
    rest = higher_lobes_energy(cos_d, 1.55, ABSORPTION)
    assert rest == pytest.approx(traced[3:].sum(axis=0), rel=2e-3, abs=2e-5)


@pytest.mark.alike
@pytest.mark.parametrize("index", [1.0, 1.01, 1.3, 1.55, 2.0, 4.0])
@pytest.mark.parametrize("eccentricity", [1.0, 0.85, 2.0])
def test_white_furnace_around_the_fibre(index: float, eccentricity: float) -> None:
    """R, TT, TRT and higher orders, integrated over phi, sum to 1 for every cone."""
    cos_d = np.cos(np.radians([0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0]))
    phi = (np.arange(20_000) + 0.5) / 20_000 * np.pi
    fibre = replace(CLEAR, index_of_refraction=index, eccentricity=eccentricity)
    lobes = azimuthal_lobes(cos_d[:, None], phi, fibre)[..., 0]
    assert 2.0 * np.pi * lobes.mean(axis=1).sum(axis=1) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("width", few_in_commits(np.radians([25.0, 3.0, 60.0])))
def test_a_rough_surface_spreads_light_and_keeps_it(width: float) -> None:
    """A Gaussian scales the k-th harmonic by exp(-k^2 width^2 / 2) and keeps the mean."""
    cos_d = np.cos(np.radians([0.0, 40.0, 70.0]))
    phi = (np.arange(1440) + 0.5) / 1440 * np.pi
    smooth = Fibre(absorption=ABSORPTION)
    before = azimuthal_lobes(cos_d[:, None], phi, smooth)
    after = azimuthal_lobes(cos_d[:, None], phi, replace(smooth, azimuthal_width=width))
    for harmonic in range(4):
        wave = np.cos(harmonic * phi)[:, None, None]
        expected = (before * wave).mean(axis=1) * np.exp(-0.5 * (harmonic * width) ** 2)
        assert (after * wave).mean(axis=1) == pytest.approx(expected, rel=2e-3, abs=1e-5)


def test_a_nearly_smooth_surface_is_smooth() -> None:
    phi = np.linspace(0.0, np.pi, 721)
    smooth = azimuthal_lobes(np.array(0.9), phi, Fibre())
    differences = []
    for width in np.radians([2.0, 0.5, 0.05]):
        rough = azimuthal_lobes(np.array(0.9), phi, Fibre(azimuthal_width=width))
        differences.append((np.abs(rough - smooth).max(axis=0) / smooth.max(axis=0)).max())
    assert differences[0] > differences[1] > differences[2]
    assert differences[2] < 0.01


def test_blurred_caustics_keep_their_energy_and_color() -> None:
    """The integral of the blurred lobe over phi equals the lobe's energy, integrated over h."""
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
    """For light across the fibre, at index 1.55: the caustic at cos^2 gamma = (n^2 - 1) / 3."""
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
    brewster = np.arctan(1.55)  # p-polarized light passes whole; the mean is half of the other
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
