"""S and its tables: reciprocity, the white furnace, the tables' error, the ends of every range."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.marschner.azimuthal import azimuthal_r, azimuthal_trt, azimuthal_tt
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.interface import lobe_energy
from hairloom.addon.shading.marschner.longitudinal import longitudinal_lobes
from hairloom.addon.shading.marschner.pigment import (
    absorption_color,
    color_absorption,
    melanin_absorption,
    roughness_widths,
)
from hairloom.addon.shading.marschner.tables import (
    DEFAULT_SIZE,
    PREVIEW_SIZE,
    bilinear,
    look_up,
    marschner,
    marschner_tables,
)

CLEAR = Fibre(absorption=(0.0, 0.0, 0.0))


def hair(melanin: float, redness: float = 0.0) -> Fibre:
    red, green, blue = melanin_absorption(melanin, redness)
    return Fibre(absorption=(float(red), float(green), float(blue)))


HAIRS = [CLEAR, hair(0.25), hair(0.6, 0.9), hair(0.95)]


def random_angles(count: int, limit: float = 89.0) -> tuple[Floats, Floats, Floats]:
    random = np.random.default_rng(5)
    theta = np.radians(random.uniform(-limit, limit, (2, count)))
    return theta[0], theta[1], random.uniform(-np.pi, np.pi, count)


@pytest.mark.parametrize("fibre", [*HAIRS, Fibre(eccentricity=0.85)])
def test_reciprocity(fibre: Fibre) -> None:
    theta_i, theta_r, phi = random_angles(3000)
    there = marschner(theta_i, theta_r, phi, fibre)
    back = marschner(theta_r, theta_i, -phi, fibre)
    assert np.abs(there - back).max() <= 1e-6 * there.max()
    assert there == pytest.approx(back, rel=1e-6, abs=1e-12)


def scattered_energy(fibre: Fibre, theta_i: Floats) -> Floats:
    """All that S scatters over the sphere, with p = 3 to 8 by their energy, for unit light."""
    theta_r = ((np.arange(360) + 0.5) / 360 - 0.5) * np.pi
    phi = (np.arange(180) + 0.5) / 180 * np.pi
    scattered = marschner(theta_i[:, None, None], theta_r[:, None], phi[None, None], fibre)
    kept = scattered[..., 0] * np.cos(theta_r[:, None]) ** 2
    total = kept.mean(axis=(1, 2)) * 2.0 * np.pi**2
    for order in range(3, 9):
        index = fibre.index_of_refraction
        total += lobe_energy(order, np.cos(theta_i), index, CLEAR.absorption)[:, 0]
    return total


def test_white_furnace() -> None:
    theta_i = np.radians(np.linspace(-75.0, 75.0, 31))
    total = scattered_energy(replace(CLEAR, cuticle_tilt=0.0), theta_i)
    assert total == pytest.approx(1.0, abs=0.02)
    assert (total <= 1.01).all()


@pytest.mark.parametrize(("tilt", "least"), [(2.0, 0.86), (3.0, 0.80), (8.0, 0.56)])
def test_white_furnace_of_tilted_scales(tilt: float, least: float) -> None:
    """Nothing gains at any angle; on one side, tilted scales lose light to their edges."""
    fibre = replace(CLEAR, cuticle_tilt=np.radians(tilt))
    theta_i = np.radians(np.linspace(-85.0, 85.0, 35))
    total = scattered_energy(fibre, theta_i)
    assert (total <= 1.01).all() and (total > least).all()
    assert total[17] == pytest.approx(1.0, abs=0.02)
    assert total[17:31] == pytest.approx(1.0, abs=0.02)  # theta_i from 0 to 65 degrees


@pytest.mark.parametrize("index", [1.01, 1.2, 2.0, 3.0])
def test_white_furnace_of_other_indices_never_gains(index: float) -> None:
    fibre = replace(CLEAR, index_of_refraction=index, width_r=0.3, width_trt=0.02)
    total = scattered_energy(fibre, np.radians(np.linspace(-80.0, 80.0, 9)))
    assert (total <= 1.01).all()


@pytest.mark.parametrize("fibre", HAIRS)
def test_tables_of_the_default_size_are_within_half_a_percent_of_each_peak(fibre: Fibre) -> None:
    tables = marschner_tables(fibre, DEFAULT_SIZE)
    random = np.random.default_rng(7)
    theta = np.radians(random.uniform(-80.0, 80.0, (2, 30_000)))
    found = bilinear(tables.longitudinal, theta[0] / np.pi + 0.5, theta[1] / np.pi + 0.5)
    for lane, lobe in enumerate(longitudinal_lobes(fibre)):
        peak = lobe(np.array(0.0), np.linspace(-0.5, 0.5, 2001)).max()
        assert np.abs(found[:, lane] - lobe(*theta)).max() < 0.005 * peak
    assert found[:, 3] == pytest.approx(np.cos(0.5 * (theta[1] - theta[0])), abs=1e-4)
    cos_d, turn = random.random((2, 30_000))
    phi = np.pi * turn
    transmitted = bilinear(tables.transmitted, cos_d, turn)
    internal = bilinear(tables.internal, cos_d, turn)
    expected = (
        (transmitted[:, 3:], azimuthal_r(cos_d, phi, fibre)[:, None]),
        (transmitted[:, :3], azimuthal_tt(cos_d, phi, fibre)),
        (internal[:, :3], azimuthal_trt(cos_d, phi, fibre)),
    )
    for looked_up, exact in expected:
        assert np.abs(looked_up - exact).max() < 0.005 * exact.max()


@pytest.mark.parametrize("fibre", HAIRS)
def test_looked_up_s_agrees_with_s(fibre: Fibre) -> None:
    fibre = replace(fibre, strength_r=0.5, strength_trt=2.0)
    tables = marschner_tables(fibre, DEFAULT_SIZE)
    theta_i, theta_r, phi = random_angles(20_000, 60.0)
    exact = marschner(theta_i, theta_r, phi, fibre)
    found = look_up(tables, theta_i, theta_r, phi, fibre)
    assert np.abs(found - exact).max() < 0.005 * exact.max()


def test_a_preview_is_quick() -> None:
    """Under 30 ms; the shortest of many rounds, since others share the machine."""
    fibre = hair(0.5)
    marschner_tables(fibre, PREVIEW_SIZE)
    seconds = []
    for _ in range(10):
        start = time.perf_counter()
        marschner_tables(fibre, PREVIEW_SIZE)
        seconds.append(time.perf_counter() - start)
    assert min(seconds) < 0.030


@pytest.mark.parametrize(
    "change",
    [
        {"index_of_refraction": 1.0},
        {"index_of_refraction": 3.0},
        {"absorption": (0.0, 1e-9, 1e6)},
        {"cuticle_tilt": 0.5},
        {"cuticle_tilt": -0.5},
        {"width_r": 0.0, "width_tt": 0.0, "width_trt": 0.0},
        {"width_r": 10.0, "width_tt": 10.0, "width_trt": 10.0},
        {"offset_r": -0.7, "offset_tt": 0.7, "offset_trt": 0.7},
        {"eccentricity": 0.1},
        {"eccentricity": 10.0},
        {"glint_width": 1e-4},
        {"glint_width": 10.0},
        {"glint_strength": 0.0, "glint_fade": 0.0},
        {"strength_r": 0.0, "strength_tt": 0.0, "strength_trt": 0.0},
    ],
)
def test_no_end_of_a_range_gives_anything_but_numbers(change: dict) -> None:
    fibre = Fibre(**change)
    tables = marschner_tables(fibre, 32)
    for table in (tables.longitudinal, tables.transmitted, tables.internal):
        assert np.isfinite(table).all()
        assert (table >= 0.0).all()
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 19)
    phi = np.linspace(-np.pi, np.pi, 17)
    grid = (theta[:, None, None], theta[None, :, None], phi[None, None])
    for scattered in (marschner(*grid, fibre), look_up(tables, *grid, fibre)):
        assert np.isfinite(scattered).all()


@pytest.mark.parametrize(
    "change",
    [
        {"index_of_refraction": 0.9},
        {"absorption": (0.1, -0.1, 0.1)},
        {"absorption": (0.1, 0.1)},
        {"width_r": float("nan")},
        {"eccentricity": 0.0},
        {"glint_strength": float("inf")},
    ],
)
def test_values_without_meaning_are_refused(change: dict) -> None:
    with pytest.raises(HairloomError, match="hair fibre"):
        Fibre(**change)


def test_melanin_is_what_blender_makes_of_it() -> None:
    """The manual's formula, by hand: -ln(1 - melanin) x the pigments' mixture."""
    assert melanin_absorption(0.5, 0.0) == pytest.approx(
        np.log(2.0) * np.array([0.506, 0.841, 1.653])
    )
    assert melanin_absorption(0.5, 1.0) == pytest.approx(
        np.log(2.0) * np.array([0.343, 0.733, 1.924])
    )
    assert melanin_absorption(0.0, 0.3).tolist() == [0.0, 0.0, 0.0]
    assert np.isfinite(melanin_absorption(1.0, 0.5)).all()
    assert melanin_absorption(np.array([0.2, 0.4]), 0.5).shape == (2, 3)


def test_colors_come_back() -> None:
    colors = np.array([[0.8, 0.5, 0.2], [1.0, 0.01, 0.3]])
    assert absorption_color(color_absorption(colors, 0.4), 0.4) == pytest.approx(colors)
    at_rest = 5.969 - 0.215 * 0.3 + 2.532 * 0.09 - 10.73 * 0.027 + 5.574 * 0.0081 + 0.245 * 0.00243
    assert color_absorption(np.full(3, 0.5)) == pytest.approx((np.log(0.5) / at_rest) ** 2)
    assert np.isfinite(color_absorption(np.array([0.0, 2.0, -1.0]))).all()


def test_roughness_gives_widths_of_theta_h() -> None:
    widths = roughness_widths(0.3)
    assert widths[0] == pytest.approx(0.5 * (0.726 * 0.3 + 0.812 * 0.09), rel=1e-6)
    assert widths == pytest.approx((widths[0], 0.5 * widths[0], 2.0 * widths[0]))
