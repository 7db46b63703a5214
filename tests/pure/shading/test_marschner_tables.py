"""The tables against S itself: errors, levels, speed, and the ends of every range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.marschner.fibre import Fibre, directions_to_angles
from hairloom.addon.shading.marschner.longitudinal import longitudinal_lobes
from hairloom.addon.shading.marschner.pigment import (
    absorption_color,
    color_absorption,
    melanin_absorption,
    roughness_widths,
)
from hairloom.addon.shading.marschner.scattering import azimuthal_lobes, marschner
from hairloom.addon.shading.marschner.tables import (
    DEFAULT_SIZE,
    LEVELS,
    azimuthal_tables,
    bilinear,
    lobe_transmittance,
    longitudinal_table,
    look_up,
    marschner_tables,
    shape_of,
    trilinear,
)

HAIRS = {
    "white": np.zeros(3),
    "blond": melanin_absorption(0.25, 0.3),
    "brown": melanin_absorption(0.75, 0.3),
    "red": melanin_absorption(0.6, 0.9),
    "black": melanin_absorption(0.98, 0.3),
}


def random_angles(count: int, limit: float) -> tuple[Floats, Floats, Floats]:
    random = np.random.default_rng(5)
    theta = np.radians(random.uniform(-limit, limit, (2, count)))
    return theta[0], theta[1], random.uniform(-np.pi, np.pi, count)


SHAPES = [Fibre(), Fibre(eccentricity=0.85), Fibre(azimuthal_width=np.radians(10.0))]


@pytest.mark.parametrize("shape", SHAPES)
def test_lobes_from_the_tables_are_within_half_a_percent_of_their_clear_peak(shape: Fibre) -> None:
    """For every absorption, relative to the peak of the lobe without absorption.

    Higher orders are an exception at cos theta_d below 0.3, where they are trapped light with very
    different path lengths: their own error reaches 4 %, but that of the sum of all lobes stays
    below 0.3 %.
    """
    tables = marschner_tables(shape, DEFAULT_SIZE)
    cos_d, turn = np.random.default_rng(7).random((2, 1000))
    clear = azimuthal_lobes(cos_d, np.pi * turn, replace(shape, absorption=(0.0, 0.0, 0.0)))
    peaks = clear[..., 0].max(axis=0)
    for absorption in ((0.0, 0.05, 0.1), (0.2, 0.3, 0.5), (0.75, 1.0, 1.5), (2.0, 3.0, 4.0)):
        fibre = replace(shape, absorption=absorption)
        expected = azimuthal_lobes(cos_d, np.pi * turn, fibre)
        kept = lobe_transmittance(bilinear(tables.paths, cos_d, turn), np.array(absorption))
        found = bilinear(tables.azimuthal, cos_d, turn)[..., None] * kept
        error = np.abs(found - expected)
        assert (error[:, :3].max(axis=(0, 2)) < 0.005 * peaks[:3]).all()
        assert error[:, 3].max() < 0.04 * peaks[3]
        assert error[cos_d > 0.3, 3].max() < 0.005 * peaks[3]
        total = expected.sum(axis=1).max(axis=0)
        assert (np.abs(found.sum(axis=1) - expected.sum(axis=1)).max(axis=0) < 0.003 * total).all()


def test_the_longitudinal_table_is_within_half_a_percent_of_each_peak() -> None:
    table = longitudinal_table(Fibre(), DEFAULT_SIZE)[0]
    theta = np.radians(np.random.default_rng(7).uniform(-80.0, 80.0, (2, 30_000)))
    found = bilinear(table, theta[0] / np.pi + 0.5, theta[1] / np.pi + 0.5)
    for lane, lobe in enumerate(longitudinal_lobes(Fibre())):
        peak = lobe(np.array(0.0), np.linspace(-0.5, 0.5, 2001)).max()
        assert np.abs(found[:, lane] - lobe(*theta)).max() < 0.005 * peak
    assert found[:, 3] == pytest.approx(np.cos(0.5 * (theta[1] - theta[0])), abs=1e-4)


@pytest.mark.alike
@pytest.mark.parametrize("absorption", HAIRS.values(), ids=HAIRS.keys())
@pytest.mark.parametrize("shape", SHAPES)
def test_looked_up_s_is_within_half_a_percent_of_its_peak(shape: Fibre, absorption: Floats) -> None:
    """For each hair colour, relative to the peak of S for that colour, channel by channel."""
    red, green, blue = absorption
    fibre = replace(shape, absorption=(red, green, blue), strength_r=0.5, strength_trt=2.0)
    tables = marschner_tables(fibre, DEFAULT_SIZE)
    theta_i, theta_r, phi = random_angles(1000, 60.0)
    exact = marschner(theta_i, theta_r, phi, fibre)
    found = look_up(tables, theta_i, theta_r, phi, absorption, np.array(fibre.strengths))
    assert (np.abs(found - exact).max(axis=0) < 0.005 * exact.max(axis=0)).all()


def test_tables_hang_on_the_shape_alone() -> None:
    painted = Fibre(absorption=(0.1, 2.0, 5.0), strength_r=0.0, strength_higher=3.0)
    assert shape_of(painted) == shape_of(Fibre())
    assert shape_of(Fibre(glint_strength=2.0)) != shape_of(Fibre())
    there, here = marschner_tables(painted, 32), marschner_tables(shape_of(painted), 32)
    for name in ("longitudinal", "azimuthal", "paths"):
        assert np.array_equal(getattr(there, name), getattr(here, name))
        assert getattr(there, name).dtype == np.float32


def test_the_sum_of_the_table_keeps_the_light_of_a_rough_fibre() -> None:
    """Each cone of the clear azimuthal table integrates to 1, for any azimuthal width."""
    for width in np.radians([0.0, 1.0, 15.0, 60.0]):
        fibre = Fibre(azimuthal_width=width)
        table = azimuthal_tables(fibre, 128)[0].sum(axis=-1)
        total = (table.sum(axis=0) - 0.5 * (table[0] + table[-1])) * (2.0 * np.pi / 127)
        assert total[32:] == pytest.approx(1.0, abs=5e-3)


def test_levels_are_means_along_theta_h() -> None:
    """Level k is the mean of M_p over 2^k steps of theta_h on the same cone."""
    fibre, size = Fibre(), DEFAULT_SIZE
    table = longitudinal_table(fibre, size)
    step = np.pi / (size - 1)
    some = slice(40, 216, 11)
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, size)[some]
    for level in range(1, LEVELS):
        within = ((np.arange(256) + 0.5) / 256 - 0.5) * 2**level * step
        theta_i, theta_r = theta[None, :, None] + within, theta[:, None, None] + within
        for lane, lobe in enumerate(longitudinal_lobes(fibre)):
            expected = lobe(theta_i, theta_r).mean(axis=-1)
            found = table[level, some, some, lane]
            assert np.abs(found - expected).max() < 0.005 * table[0, ..., lane].max()
    assert (table[1:, ..., 3] == table[0, ..., 3]).all()


def test_levels_lie_between_their_neighbours() -> None:
    tables = marschner_tables(Fibre(), 64)
    x, y = np.random.default_rng(2).random((2, 50))
    low, high = (bilinear(tables.longitudinal[level], x, y) for level in (2, 3))
    between = trilinear(tables.longitudinal, x, y, np.full(50, 2.25))
    assert between == pytest.approx(0.75 * low + 0.25 * high)
    for level, end in ((-1.0, 0), (99.0, LEVELS - 1)):
        found = trilinear(tables.longitudinal, x, y, level)
        assert found == pytest.approx(bilinear(tables.longitudinal[end], x, y))


def test_prefiltering_comes_closer_to_the_mean_over_a_pixel() -> None:
    """On a strand over a ball, ten degrees per pixel, prefiltered samples have less than a quarter
    of the squared error against the mean."""
    tables = marschner_tables(Fibre(width_r=np.radians(2.0), width_tt=np.radians(1.0)), 256)
    random = np.random.default_rng(3)
    strengths, absorption, inside = np.ones(4), np.array([0.1, 0.2, 0.5]), 64
    turn = (np.arange(18 * inside) + 0.5) / inside * np.radians(10.0)
    errors = np.zeros(2)
    for _ in range(40):
        to_light, to_eye = random.normal(size=(2, 3))
        directions = (to_light / np.linalg.norm(to_light), to_eye / np.linalg.norm(to_eye))

        def seen(
            turn: Floats, level: Floats, directions: tuple[Floats, Floats] = directions
        ) -> Floats:
            tangent = np.stack([np.cos(turn), 0.0 * turn, -np.sin(turn)], axis=1)
            angles = directions_to_angles(tangent, *directions)
            return look_up(tables, *angles, absorption, strengths, level)

        def theta_h(turn: Floats, directions: tuple[Floats, Floats] = directions) -> Floats:
            tangent = np.stack([np.cos(turn), 0.0 * turn, -np.sin(turn)], axis=1)
            theta_i, theta_r, _ = directions_to_angles(tangent, *directions)
            return 0.5 * (theta_i + theta_r)

        mean = seen(turn, np.zeros_like(turn)).reshape(18, inside, 3).mean(axis=1)
        middle = turn.reshape(18, inside).mean(axis=1)
        half = np.radians(5.0)
        covered = np.abs(theta_h(middle + half) - theta_h(middle - half)) * 255.0 / np.pi
        for which, level in enumerate((np.zeros(18), np.log2(np.maximum(covered, 1.0)))):
            errors[which] += ((seen(middle, level) - mean) ** 2).sum()
    assert errors[1] < 0.25 * errors[0]


@pytest.mark.alike
@pytest.mark.parametrize(
    "change",
    [
        {"index_of_refraction": 1.0},
        {"index_of_refraction": 4.0},
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
        {"strength_r": 0.0, "strength_tt": 0.0, "strength_trt": 0.0, "strength_higher": 0.0},
        {"azimuthal_width": 1e-6},
        {"azimuthal_width": np.radians(60.0)},
    ],
)
def test_no_end_of_a_range_gives_anything_but_numbers(change: dict) -> None:
    fibre = Fibre(**change)
    tables = marschner_tables(fibre, 32)
    for table in (tables.longitudinal, tables.azimuthal, tables.paths):
        assert np.isfinite(table).all()
        assert (table >= 0.0).all()
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
    phi = np.linspace(-np.pi, np.pi, 9)
    grid = np.broadcast_arrays(theta[:, None, None], theta[None, :, None], phi[None, None])
    assert np.isfinite(marschner(*grid, fibre)).all()
    for absorption in (np.zeros(3), np.array(fibre.absorption), np.full(3, 1e6)):
        found = look_up(tables, *grid, absorption, np.array(fibre.strengths), 7.0)
        assert np.isfinite(found).all() and (found >= 0.0).all()


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
    """Against the formula of Blender's manual: -ln(1 - melanin) x the mixture of pigments."""
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
