"""S: reciprocity, and the white furnace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fibre_oracles import scattered_energy

from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.scattering import marschner

CLEAR = Fibre(absorption=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "fibre",
    [
        CLEAR,
        Fibre(),
        Fibre(eccentricity=0.85),
        Fibre(azimuthal_width=0.1),
        Fibre(strength_higher=9.0),
    ],
)
def test_reciprocity(fibre: Fibre) -> None:
    random = np.random.default_rng(5)
    theta_i, theta_r = np.radians(random.uniform(-89.0, 89.0, (2, 1000)))
    phi = random.uniform(-np.pi, np.pi, 1000)
    there = marschner(theta_i, theta_r, phi, fibre)
    back = marschner(theta_r, theta_i, -phi, fibre)
    assert np.abs(there - back).max() <= 1e-6 * there.max()
    assert there == pytest.approx(back, rel=1e-6, abs=1e-12)


@pytest.mark.alike
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"index_of_refraction": 1.17},
        {"index_of_refraction": 2.5},
        {"width_r": np.radians(2.0), "width_tt": np.radians(1.0), "width_trt": np.radians(4.0)},
        {"width_r": np.radians(15.0), "width_trt": np.radians(30.0)},
        {"eccentricity": 0.8},
        {"azimuthal_width": np.radians(10.0)},
    ],
)
def test_white_furnace(change: dict) -> None:
    """R + TT + TRT + higher orders = 1."""
    theta_i = np.radians(np.linspace(-85.0, 85.0, 35))
    total = scattered_energy(replace(CLEAR, cuticle_tilt=0.0, **change), theta_i)[:, 0]
    assert total == pytest.approx(1.0, abs=0.003)


def test_the_furnace_sums_what_s_itself_scatters() -> None:
    theta_i, phi = np.radians([10.0, -60.0]), (np.arange(240) + 0.5) / 240 * np.pi
    theta_r = ((np.arange(240) + 0.5) / 240 - 0.5) * np.pi
    brown = Fibre(strength_tt=0.5)
    scattered = marschner(theta_i[:, None, None], theta_r[:, None], phi, brown)
    total = (scattered * np.cos(theta_r[:, None, None]) ** 2).mean(axis=(1, 2)) * 2.0 * np.pi**2
    assert total == pytest.approx(scattered_energy(brown, theta_i), abs=2e-3)


@pytest.mark.parametrize(("tilt", "least"), [(2.0, 0.85), (3.0, 0.78), (8.0, 0.53)])
def test_white_furnace_of_tilted_scales(tilt: float, least: float) -> None:
    """No angle gains energy; on one side, tilted scales lose light at their edges."""
    fibre = replace(CLEAR, cuticle_tilt=np.radians(tilt))
    theta_i = np.radians(np.linspace(-85.0, 85.0, 35))
    total = scattered_energy(fibre, theta_i)[:, 0]
    assert (total <= 1.01).all() and (total > least).all()
    assert total[17] == pytest.approx(1.0, abs=0.02)
    assert total[17:31] == pytest.approx(1.0, abs=0.02)  # theta_i from 0 to 65 degrees


@pytest.mark.parametrize("index", [1.0, 1.01, 1.2, 2.0, 4.0])
def test_white_furnace_of_other_indices_never_gains(index: float) -> None:
    fibre = replace(CLEAR, index_of_refraction=index, width_r=0.3, width_trt=0.02)
    total = scattered_energy(fibre, np.radians(np.linspace(-80.0, 80.0, 9)))[:, 0]
    assert (total <= 1.01).all()
