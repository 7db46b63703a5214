"""Dual scattering against random strands, stacks of layers, and energy conservation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.look import strand_absorption
from hairloom.addon.shading.marschner.scattering import azimuthal_lobes
from hairloom.addon.shading.marschner.tables import marschner_tables
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.dual import (
    FRACTIONS_SIZE,
    Fractions,
    absorption_at_coordinate,
    backscatter_shape,
    backscattered,
    dual_scattering,
    fractions,
    fractions_at,
    half_gaussian,
    mean_forward,
    reflected_by_skin,
    spread_around,
    straight_and_scattered,
    table_coordinate,
)

FIBRE = Fibre()


@pytest.fixture(scope="module")
def table() -> Fractions:
    return fractions(marschner_tables(FIBRE, 128))


def at(table: Fractions, absorption: float, cos_d: float) -> tuple[np.ndarray, np.ndarray]:
    """Forward and backward fractions of the nearest texel, by lobe."""
    row = round(float(table_coordinate(np.array(absorption))) * (FRACTIONS_SIZE - 1))
    column = round(cos_d * (FRACTIONS_SIZE - 1))
    return table.forward[row, column], table.backward[row, column]


def test_passing_is_the_mean_over_strands_met_at_random() -> None:
    random = np.random.default_rng(1)
    for tau, a_f in ((0.3, 0.8), (2.0, 0.5), (5.0, 0.95)):
        met = random.poisson(tau, 400_000)
        straight, on = straight_and_scattered(np.array(tau), np.array(a_f))
        assert straight == pytest.approx((met == 0).mean(), abs=3e-3)
        assert on == pytest.approx(np.where(met > 0, a_f**met, 0.0).mean(), abs=3e-3)


@pytest.mark.parametrize(("a_f", "a_b"), [(0.8, 0.15), (0.3, 0.3), (0.05, 0.02), (0.0, 0.5)])
def test_what_returns_is_that_of_a_deep_stack(a_f: float, a_b: float) -> None:
    """Against layers that are added one by one, with all reflections between them."""
    back = 0.0
    for _ in range(4000):
        back = a_b + a_f**2 * back / (1.0 - a_b * back)
    assert backscattered(np.array(a_f), np.array(a_b)) == pytest.approx(back, rel=1e-6)


@pytest.mark.parametrize(("a_f", "a_b"), [(0.8, 0.15), (0.3, 0.3), (0.79, 0.209)])
def test_what_a_few_strands_return_is_that_of_as_many_layers(a_f: float, a_b: float) -> None:
    back, on = 0.0, 1.0
    for count in range(1, 9):
        # one more layer in front of the stack
        between = 1.0 / (1.0 - a_b * back)
        back, on = a_b + a_f**2 * back * between, a_f * on * between
        found = backscattered(np.array(a_f), np.array(a_b), count)
        assert found == pytest.approx(back, rel=1e-6)


def test_white_hair_gives_all_light_back_and_no_hair_more() -> None:
    a_f = np.linspace(0.0, 1.0, 41)
    assert (backscattered(a_f, 1.0 - a_f) <= 1.0 + 1e-9).all()
    assert backscattered(np.array(0.8), np.array(0.2)) > 0.95
    assert backscattered(np.array(0.8), np.array(0.19)) < 1.0


def test_shares_are_those_of_the_lobes(table: Fractions) -> None:
    """Against a fine integral over the reference's lobes; they sum to 1 for a clear fibre."""
    turn = (np.arange(4000) + 0.5) / 4000
    for cos_d in (1.0, 16 / 31):
        clear = replace(FIBRE, absorption=(0.0, 0.0, 0.0))
        lobes = azimuthal_lobes(np.array(cos_d), np.pi * turn, clear)[..., 0]
        forward, backward = at(table, 0.0, cos_d)
        expected = 2.0 * np.pi * (lobes * turn[:, None]).mean(axis=0)
        assert np.allclose(forward, expected, atol=0.01)
        assert forward.sum() + backward.sum() == pytest.approx(1.0, abs=0.02)


def test_what_hair_sends_on_is_the_mean_over_strands_that_lie_any_way(table: Fractions) -> None:
    """Against random strands, each weighted by its projected width."""
    alike = ShadingSettings(color_variation=0.0, grey_fraction=0.0)
    absorption = strand_absorption(alike, np.zeros(1), np.full(1, 0.5), np.full(1, 0.5))
    random = np.random.default_rng(6)
    along = random.normal(size=(40_000, 3))
    sine = along[:, 0] / np.linalg.norm(along, axis=1)
    broad = np.sqrt(1.0 - sine**2)
    sent = fractions_at(table.forward, broad, absorption).sum(axis=-1)
    expected = (sent * broad[:, None]).sum(axis=0) / broad.sum()
    assert mean_forward(table.forward, alike) == pytest.approx(expected, rel=5e-3)
    grey = mean_forward(table.forward, replace(alike, grey_fraction=1.0))
    half = mean_forward(table.forward, replace(alike, grey_fraction=0.5))
    assert half == pytest.approx(0.5 * (expected + grey), rel=5e-3)


def test_more_pigment_sends_less_on_and_back(table: Fractions) -> None:
    assert (np.diff(table.forward.sum(axis=-1), axis=0) <= 1e-5).all()
    assert (np.diff(table.backward.sum(axis=-1), axis=0) <= 1e-5).all()
    # black hair reflects only at its surface
    assert table.forward[-1, -1].sum() + table.backward[-1, -1].sum() < 0.1


def test_the_axis_of_absorption_turns_round() -> None:
    values = np.array([0.0, 0.01, 0.5, 3.0, 100.0])
    assert np.allclose(absorption_at_coordinate(table_coordinate(values)), values)
    assert np.isfinite(absorption_at_coordinate(1.0))


def test_spreading_keeps_the_energy() -> None:
    phi = (np.arange(1000) + 0.5) / 1000 * 2.0 * np.pi
    spread = spread_around(np.array(0.6), np.array(0.2), phi)
    assert spread.mean() * 2.0 * np.pi == pytest.approx(0.8)
    assert spread[500] > spread[0] > 0.0


def test_half_gaussian_is_half_of_one() -> None:
    theta_h = np.linspace(-2.0, 2.0, 4001)
    total = half_gaussian(theta_h, np.array(0.1), np.array(0.01)).sum() * 1e-3
    assert total == pytest.approx(0.5, rel=1e-4)
    assert theta_h[half_gaussian(theta_h, np.array(0.1), np.array(0.01)).argmax()] < 0.0


def light_on(table: Fractions, absorption: float, tau: float, density: float = 0.7) -> np.ndarray:
    forward, backward = (np.tile(part, (3, 1)) for part in at(table, absorption, 1.0))
    single = np.array([0.02, 0.02, 0.02])
    zero, beyond = np.array(0.0), np.array(6.0)
    return dual_scattering(
        single, zero, zero, np.array(2.0), forward, backward, np.array(tau), beyond, FIBRE, density
    )


def test_a_strand_alone_in_the_light_is_a_strand_alone(table: Fractions) -> None:
    assert np.allclose(light_on(table, 0.2, 0.0, density=0.0), 0.02)


def test_light_hair_is_brighter_and_carries_light_farther(table: Fractions) -> None:
    pigments = (0.01, 0.1, 0.4, 2.0)
    near = [light_on(table, pigment, 1.0)[1] for pigment in pigments]
    deep = [light_on(table, pigment, 8.0)[1] for pigment in pigments]
    assert near == sorted(near, reverse=True) and deep == sorted(deep, reverse=True)
    assert deep[0] / near[0] > 5.0 * deep[2] / near[2]


def skin_light(a_f: float, a_b: float, skin: float, **more: float) -> float:
    """Light that the skin reflects; by default lit head on, with the eye beside the light."""
    values = {"phi": 0.0, "tau": 0.0, "beyond": 0.0, "facing": 1.0} | more
    lobes = [np.tile([0.0, fraction, 0.0, 0.0], (3, 1)) for fraction in (a_f, a_b)]
    phi, tau, beyond, facing = (np.array(values[name]) for name in values)
    return float(reflected_by_skin(phi, *lobes, tau, beyond, facing, np.full(3, skin))[1])


def test_skin_behind_a_strand_that_hides_nothing_is_lambert() -> None:
    for skin, facing in ((0.5, 1.0), (0.2, 0.3)):
        found = skin_light(1.0, 0.0, skin, facing=facing, beyond=4.0)
        assert found == pytest.approx(skin * facing / np.pi, rel=1e-3)
    # an eye on the other side sees only backward scattering
    assert skin_light(1.0, 0.0, 0.5, phi=np.pi) == pytest.approx(0.0, abs=1e-6)
    assert skin_light(0.6, 0.1, 0.5, phi=np.pi) == pytest.approx(0.1 * 0.5 / np.pi, rel=0.02)


def test_black_skin_and_skin_in_the_dark_give_nothing() -> None:
    assert skin_light(0.7, 0.2, 0.0, tau=1.0, beyond=1.0) == 0.0
    assert skin_light(0.7, 0.2, 0.5, facing=-0.4) == 0.0


@pytest.mark.parametrize("facing", [1.0, 0.5])
@pytest.mark.parametrize("beyond", [0.1, 0.5, 2.0])
def test_even_light_comes_back_through_the_strands_it_meets(beyond: float, facing: float) -> None:
    """Against rays from the skin in all directions, each through strands in proportion to the
    secant of its angle."""
    a_f, skin = 0.7, 0.4
    random = np.random.default_rng(4)
    upward = np.sqrt(random.random(100_000))  # Lambert's
    back = np.exp(-(1.0 - a_f) * beyond * facing / upward).mean()
    there = np.exp(-(1.0 - a_f) * (1.0 + beyond))
    found = skin_light(a_f, 0.0, skin, tau=1.0, beyond=beyond, facing=facing)
    assert found == pytest.approx(skin * facing / np.pi * there * back * a_f, rel=0.07)


@pytest.mark.parametrize("tau", [0.0, 1e-6, 1.0, 1e4])
@pytest.mark.parametrize("absorption", [0.0, 0.3, 1e4])
@pytest.mark.parametrize("density", [0.0, 1.0])
def test_no_end_of_a_range_gives_anything_but_numbers(
    table: Fractions, tau: float, absorption: float, density: float
) -> None:
    found = light_on(table, absorption, tau, density)
    assert np.isfinite(found).all() and (found >= 0.0).all()
    for skin in (0.0, 1.0):
        white = skin_light(1.0 - density, density, skin, tau=tau, beyond=tau)
        assert np.isfinite(white) and white >= 0.0
    forward, backward = at(table, absorption, 0.0)
    for shape in backscatter_shape(forward, backward, FIBRE):
        assert np.isfinite(shape).all()
