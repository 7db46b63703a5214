"""Panoramas as suns and spherical harmonics, against known integrals."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.environment import (
    COLUMNS,
    OCTANT_BLUR,
    ROWS,
    Environment,
    diffuse_light,
    downsampled,
    environment_of,
    hair_ambient,
    octant_direction,
    octant_light,
    panorama_directions,
    path_from_openness,
    radiance_from,
)
from hairloom.addon.shading.marschner.look import fibre_of, marschner_light
from hairloom.addon.shading.marschner.tables import (
    DEFAULT_SIZE,
    PREVIEW_SIZE,
    marschner_tables,
    table_level,
)
from hairloom.addon.shading.settings import ShadingSettings

DIRECTIONS, ANGLES = panorama_directions(ROWS, COLUMNS)
UP = DIRECTIONS[..., 2:]
WHITE = np.ones(3)
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def whole(environment: Environment) -> np.ndarray:
    """The integral of its light over all directions [W/m^2]."""
    return 4.0 * np.pi * np.array(environment.ambient) + sum(
        (np.array(sun.power) for sun in environment.suns), np.zeros(3)
    )


def test_directions_are_blenders() -> None:
    """The middle of a panorama is +X, its left half +Y, its top +Z."""
    assert DIRECTIONS[ROWS // 2, COLUMNS // 2] == pytest.approx([1.0, 0.0, 0.0], abs=0.02)
    assert DIRECTIONS[ROWS // 2, COLUMNS // 4] == pytest.approx([0.0, 1.0, 0.0], abs=0.02)
    assert DIRECTIONS[-1, 0, 2] > 0.99
    assert ANGLES.sum() == pytest.approx(4.0 * np.pi)


def test_an_even_world_is_its_color_alone() -> None:
    color = np.array([0.2, 0.5, 3.0])
    found = environment_of(np.ones((9, 20, 3)) * color)
    assert found.ambient == pytest.approx(color, rel=1e-9)
    assert found.harmonics is None and not found.suns


@pytest.mark.parametrize(
    ("radiance", "irradiance"),
    [
        # a sky that is bright above, and one that is bright at zenith and nadir
        (1.0 + 0.5 * UP, lambda z: 1.0 + 0.5 * 2.0 / 3.0 * z),
        (1.0 + 0.25 * (3.0 * UP**2 - 1.0), lambda z: 1.0 + 0.25 * 0.25 * (3.0 * z**2 - 1.0)),
    ],
)
def test_irradiance_of_an_analytic_sky(radiance: np.ndarray, irradiance: object) -> None:
    found = environment_of(radiance * WHITE)
    normals = DIRECTIONS[::8, ::8]
    expected = irradiance(normals[..., 2])  # type: ignore[operator]
    assert diffuse_light(found, normals)[..., 0] == pytest.approx(expected, abs=1e-3)
    assert radiance_from(found, DIRECTIONS) == pytest.approx(radiance * WHITE, abs=2e-3)


def test_irradiance_of_half_a_sky() -> None:
    """(1 + cos) / 2 on a slanted surface, to which order 2 comes within 4 %."""
    found = environment_of(np.where(UP > 0.0, 1.0, 0.0) * WHITE)
    normals = DIRECTIONS[::8, ::8]
    assert not found.suns
    expected = 0.5 * (1.0 + normals[..., 2])
    assert diffuse_light(found, normals)[..., 1] == pytest.approx(expected, abs=0.04)
    assert whole(found) == pytest.approx(2.0 * np.pi * WHITE)


@pytest.mark.parametrize("degrees", [1.0, 5.0])
def test_a_bright_disk_is_a_sun(degrees: float) -> None:
    towards = np.array([0.5, -0.6, 0.4])
    towards /= np.linalg.norm(towards)
    color = np.array([900.0, 700.0, 300.0])
    is_sun = (DIRECTIONS @ towards > np.cos(np.radians(degrees)))[..., None]
    found = environment_of(np.where(is_sun, color, 0.2))
    (sun,) = found.suns
    # the centre of a disk of few pixels is off by part of a pixel
    assert np.degrees(np.arccos(min(towards @ sun.vector, 1.0))) < 0.7
    angle = float((ANGLES * is_sun[..., 0]).sum())
    assert sun.power == pytest.approx(color * angle, rel=0.02)
    assert found.ambient == pytest.approx(0.2 * WHITE, rel=0.05)
    assert sun.is_from_world and sun.casts_shadow
    # as wide as the pixels that it covers; a single pixel is a point
    width = 2.0 * np.arccos(1.0 - angle / (2.0 * np.pi))
    assert sun.angle == pytest.approx(width if is_sun.sum() > 1 else 0.0, rel=0.15)


def test_no_light_is_lost_between_suns_and_the_rest() -> None:
    random = np.random.default_rng(7)
    radiance = random.gamma(0.3, 1.0, (ROWS, COLUMNS, 3)) ** 3
    radiance[80:90, 100:110] += 50.0
    radiance[60:64, 200:220] += 30.0
    expected = np.einsum("rc,rcn->n", ANGLES, radiance)
    found = environment_of(radiance)
    assert len(found.suns) == 2
    assert whole(found) == pytest.approx(expected)


@pytest.mark.parametrize("size", [(1, 1), (7, 13), (130, 259), (300, 701), (512, 1024)])
def test_reduced_pictures_have_the_same_light(size: tuple[int, int]) -> None:
    picture = np.random.default_rng(3).random((*size, 3))
    _, angles = panorama_directions(*size)
    expected = np.einsum("rc,rcn->n", angles, picture)
    assert whole(environment_of(picture)) == pytest.approx(expected)
    assert downsampled(picture).shape[0] <= ROWS and downsampled(picture).shape[1] <= COLUMNS


def test_pixels_that_are_no_light_are_black() -> None:
    """One non-finite channel makes its pixel black, as in Cycles; negative values count as 0."""
    picture = np.full((64, 128, 3), 0.5)
    black = picture.copy()
    black[10, 20] = black[30, 40] = black[50, 60] = 0.0
    picture[10, 20, 0], picture[30, 40, 1], picture[50, 60] = np.nan, np.inf, -1e30
    assert downsampled(picture) == pytest.approx(downsampled(black))


def test_a_pixel_of_a_million_is_a_sun() -> None:
    picture = np.full((64, 128, 3), 0.5)
    picture[40, 20] = 1.0e6
    directions, angles = panorama_directions(64, 128)
    (sun,) = environment_of(picture).suns
    assert sun.vector == pytest.approx(directions[40, 20], abs=1e-3)
    assert sun.power == pytest.approx(WHITE * 1.0e6 * angles[40, 20], rel=1e-3)
    assert environment_of(picture).ambient == pytest.approx(0.5 * WHITE, rel=0.01)


def test_a_quarter_turn_is_a_shift_of_columns() -> None:
    random = np.random.default_rng(5)
    picture = random.random((32, 64, 3))
    picture[20:22, 5:7] = 80.0
    turned, shifted = (
        environment_of(picture, QUARTER),
        environment_of(np.roll(picture, -16, axis=1)),
    )
    assert turned.ambient == pytest.approx(shifted.ambient)
    assert turned.harmonics == pytest.approx(shifted.harmonics, abs=1e-5)
    assert turned.suns[0].vector == pytest.approx(shifted.suns[0].vector)
    still = environment_of(picture)
    assert QUARTER @ still.suns[0].vector == pytest.approx(turned.suns[0].vector)
    assert radiance_from(turned, DIRECTIONS @ QUARTER.T) == pytest.approx(
        radiance_from(still, DIRECTIONS), abs=1e-5
    )


def test_eight_octants_have_all_light() -> None:
    """And the right part from above: the upper half of a sky of 1 + z has 3 pi of 4 pi."""
    found = environment_of((1.0 + UP) * WHITE)
    lights = octant_light(found, np.arange(8))
    assert lights.sum(axis=0) == pytest.approx(4.0 * np.pi * WHITE, rel=1e-4)
    from_above = lights[octant_direction(np.arange(8))[:, 2] > 0.0].sum(axis=0)
    assert from_above == pytest.approx(3.0 * np.pi * WHITE, rel=1e-3)


@pytest.mark.parametrize("size", [PREVIEW_SIZE, DEFAULT_SIZE])
def test_white_hair_in_a_white_world_is_white(size: int) -> None:
    """The white furnace: without absorption and occlusion, hair reflects on average as much light
    as it receives."""
    look = ShadingSettings(fake_scattering=0.0, volume_shadow=0.0, sparkle=0.0, shift_noise=0.0)
    tables = marschner_tables(fibre_of(look), size)
    random, count = np.random.default_rng(3), 4000
    tangent, to_eye, other = random.normal(size=(3, count, 3))
    normal = np.cross(tangent, other)
    for vectors in (tangent, to_eye, normal):
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    half, white = np.full(count, 0.5), np.zeros((count, 3))
    found = hair_ambient(
        Environment((1.0, 1.0, 1.0)),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        lambda towards, path: marschner_light(
            tables,
            tangent,
            normal,
            towards,
            to_eye,
            half,
            half,
            white,
            look,
            level=table_level(OCTANT_BLUR, size),
            tau=path[..., 0],
        ),
    )
    assert found.mean() == pytest.approx(1.0, abs=0.1)


def test_paths_of_openness() -> None:
    """With half a sky, as above a head, the path is 0 upwards and the maximum downwards."""
    openness = np.array([0.5, 0.0, 0.0, 0.75])
    up, down = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
    assert path_from_openness(openness, up) == pytest.approx([0.0, np.log(1000.0)])
    assert path_from_openness(openness, down) == pytest.approx([np.log(1000.0), 0.0])
    assert path_from_openness(openness, np.array([1.0, 0.0, 0.0])) == pytest.approx(
        [np.log(2.0)] * 2
    )
