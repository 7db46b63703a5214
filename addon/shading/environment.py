"""Light from all around, on hair and meshes: a world's panorama in a few numbers.

A panorama is radiance [W/(m^2 sr)] over latitudes and longitudes, (rows, columns, 3), row 0 at the
bottom, its middle towards +X and its left half towards +Y, as Blender's Environment Texture. It
becomes
- suns: lobes that are small and much brighter than the rest, each a light of its own, with
  highlight and shadow;
- ambient and harmonics: what remains, as spherical harmonics up to order 2, a quadratic polynomial
  of the direction (Ramamoorthi and Hanrahan 2001, "An Efficient Representation for Irradiance
  Environment Maps"). The light on a matt surface is the same polynomial with each order damped.

Marschner's hair is lit from the middles of the eight octants as by eight more lights, each for the
light from an eighth of all directions; their occlusion comes from a grid (ambient.openness_field),
not from maps. Kajiya-Kay's is lit as a matt surface. Twin of gpu_shaders/lib_environment.glsl, and
of `hair_ambient` in lib_hair_light.glsl.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from .lights import Color, Light
from .luminance import LUMINANCE

#: size of the downsampled panorama, from which suns and harmonics are found [pixels]
ROWS, COLUMNS = 128, 256
#: damping of orders 1 and 2 by Lambert's cosine, relative to order 0
LAMBERT_DAMPING = (2.0 / 3.0, 1.0 / 4.0)
#: damping of orders 1 and 2 by the mean over an eighth of all directions, at its middle
OCTANT_DAMPING = (0.5 * np.sqrt(3.0), 2.0 / np.pi)
#: minimum fraction of a direction's light that arrives: that is seven strands
MIN_OPENNESS = 1.0e-3
#: angle over which light from an eighth of all directions blurs a highlight along the strand [rad]
OCTANT_BLUR = np.pi / 8.0
#: a lobe's minimum brightness over the mean around it; its radius [rad]; its minimum fraction of
#: all light
_MIN_CONTRAST, _LOBE_RADIUS, _MIN_LOBE_FRACTION = 3.0, np.radians(25.0), 0.03
_MAX_SUNS = 2
#: number of the brightest pixels, which may be a lobe's middle; radius of the light summed around
#: each [rad]
_CANDIDATES, _SMOOTHING_RADIUS = 1024, np.radians(12.0)
#: harmonics are left out if all are below this fraction of the ambient light
_MIN_VARIATION = 1e-3
#: mean squares of the eight harmonics over all directions
_MEAN_SQUARES = np.array([1 / 3, 1 / 3, 1 / 3, 1 / 15, 1 / 15, 4 / 5, 1 / 15, 4 / 15])


@dataclass(frozen=True, eq=False)
class Environment:
    """ambient: mean radiance without the suns.

    harmonics: (8, 3), how radiance varies by direction, see `harmonics_at`; None: it does not.
    suns: directional lights that replace the brightest lobes.
    """

    ambient: Color = (0.0, 0.0, 0.0)
    harmonics: Floats | None = None
    suns: tuple[Light, ...] = ()

    @property
    def is_black(self) -> bool:
        return not any(self.ambient) and not self.suns


def world_suns(lights: tuple[Light, ...]) -> tuple[Light, ...]:
    """The lights that are bright lobes of the world."""
    return tuple(light for light in lights if light.is_from_world)


def environment_of(panorama: Floats, turn: Floats | None = None) -> Environment:
    """The environment of a panorama, of any size.

    Args:
        turn: (3, 3) from the panorama's directions to those of the world; None: they are the same.
    """
    radiance = downsampled(panorama)
    directions, weights = panorama_directions(*radiance.shape[:2])
    if turn is not None:
        directions = directions @ np.asarray(turn).T
    directions, weights = directions.reshape(-1, 3), weights.ravel()
    remainder, suns = _split_suns(radiance.reshape(-1, 3), directions, weights)
    ambient = weights @ remainder / (4.0 * np.pi)
    projected = (harmonics_at(directions) * weights[:, None]).T @ remainder
    harmonics = projected / (4.0 * np.pi * _MEAN_SQUARES[:, None])
    is_uniform = bool(
        (np.abs(harmonics) <= _MIN_VARIATION * max(float(ambient.max()), 1e-30)).all()
    )
    red, green, blue = ambient.tolist()
    return Environment(
        (red, green, blue), None if is_uniform else harmonics.astype(np.float32), tuple(suns)
    )


def panorama_directions(rows: int, columns: int) -> tuple[Floats, Floats]:
    """The middle of each pixel of a panorama, (rows, columns, 3), and its solid angle."""
    edges = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows + 1)
    height = (0.5 * (edges[1:] + edges[:-1]))[:, None]
    turn = (0.5 - (np.arange(columns)[None, :] + 0.5) / columns) * 2.0 * np.pi
    flat = np.cos(height)
    directions = np.stack(
        [flat * np.cos(turn), flat * np.sin(turn), np.sin(height) + 0.0 * turn], axis=-1
    )
    band = np.diff(np.sin(edges))[:, None] * (2.0 * np.pi / columns)
    return directions, np.broadcast_to(band, (rows, columns))


def downsampled(panorama: Floats) -> Floats:
    """A panorama of about ROWS x COLUMNS pixels at most, with the same light: every pixel counts,
    and small panoramas have theirs divided.

    Pixels that are not finite are black, as in Cycles, and so are negative values.
    """
    for axis, count in enumerate((ROWS, COLUMNS)):
        panorama = np.repeat(panorama, max(count // panorama.shape[axis], 1), axis=axis)
    edges = np.linspace(-0.5 * np.pi, 0.5 * np.pi, len(panorama) + 1)
    by_rows = _area_means(panorama, ROWS, np.diff(np.sin(edges)))
    by_columns = np.moveaxis(by_rows, 1, 0)
    return np.moveaxis(_area_means(by_columns, COLUMNS, np.ones(len(by_columns))), 0, 1)


def _area_means(picture: Floats, max_count: int, weights: Floats) -> Floats:
    """Weighted means of at most `max_count` equal parts of the first axis."""
    count = len(picture)
    edges = np.linspace(0.0, count, min(count, max_count) + 1)
    found = []
    for low, high in itertools.pairwise(edges):
        inside = np.arange(int(low), min(int(np.ceil(high - 1e-9)), count))
        # a pixel that lies in two parts counts in each by its overlap
        cover = np.minimum(inside + 1.0, high) - np.maximum(inside, low)
        cover = cover * weights[inside]
        found.append(np.tensordot(cover / cover.sum(), _finite_radiance(picture[inside]), 1))
    return np.array(found)


def _finite_radiance(pixels: Floats) -> Floats:
    """Pixels as Cycles reads them: black where a channel is not finite."""
    is_finite = np.isfinite(pixels).all(axis=-1, keepdims=True)
    return np.where(is_finite, np.maximum(pixels, 0.0), 0.0).astype(np.float64)


def _split_suns(
    radiance: Floats, directions: Floats, weights: Floats
) -> tuple[Floats, list[Light]]:
    """What remains of the radiance, and the brightest lobes as suns, brightest first."""
    total = float(weights @ radiance @ LUMINANCE)
    suns: list[Light] = []
    while len(suns) < _MAX_SUNS and total > 0.0:
        bright = radiance @ LUMINANCE
        # the remainder of a lobe is not another sun
        for sun in suns:
            bright[directions @ np.array(sun.vector) > np.cos(2.0 * _LOBE_RADIUS)] = 0.0
        is_near = directions @ _brightest_direction(bright * weights, directions) > np.cos(
            _LOBE_RADIUS
        )
        around = float(weights[~is_near] @ bright[~is_near] / weights[~is_near].sum())
        excess = np.maximum(bright - _MIN_CONTRAST * around, 0.0) / np.maximum(bright, 1e-30)
        lobe = radiance * np.where(is_near, excess, 0.0)[:, None]
        flux = lobe @ LUMINANCE * weights
        if flux.sum() < _MIN_LOBE_FRACTION * total:
            break
        middle = flux @ directions
        # of a disk: 1 - cos is on average half of that at its rim
        depth = 1.0 - float(np.linalg.norm(middle)) / float(flux.sum())
        angle = 2.0 * float(np.arccos(np.clip(1.0 - 2.0 * depth, 0.0, 1.0)))
        light = Light.sun(-middle, weights @ lobe, 1.0, angle)
        suns.append(replace(light, is_from_world=True, name="World"))
        radiance = radiance - lobe
    return radiance, suns


def _brightest_direction(flux: Floats, directions: Floats) -> Floats:
    """The direction with the most flux around it."""
    strongest = np.argsort(flux)[-_CANDIDATES:]
    around = directions[strongest] @ directions[strongest].T > np.cos(_SMOOTHING_RADIUS)
    middle: Floats = directions[strongest[(around @ flux[strongest]).argmax()]]
    return middle


def harmonics_at(directions: Floats) -> Floats:
    """The eight harmonics of orders 1 and 2 at unit vectors (..., 3), (..., 8)."""
    x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
    return np.stack([x, y, z, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y], axis=-1)


def radiance_from(
    environment: Environment, directions: Floats, damping: tuple[float, float] = (1.0, 1.0)
) -> Floats:
    """Radiance from directions (..., 3) without the suns, with orders 1 and 2 damped by
    `damping`."""
    ambient = np.broadcast_to(environment.ambient, np.shape(directions))
    if environment.harmonics is None:
        return ambient
    damped = np.repeat(damping, (3, 5))[:, None] * environment.harmonics
    return np.maximum(ambient + harmonics_at(directions) @ damped, 0.0)


def diffuse_light(environment: Environment, normals: Floats) -> Floats:
    """Irradiance over pi on surfaces with normals (..., 3), without the suns."""
    return radiance_from(environment, normals, LAMBERT_DAMPING)


def octant_direction(octant: Ints) -> Floats:
    """The direction that represents an eighth of all directions, 0 to 7, (..., 3)."""
    sides = np.stack([octant & 1, (octant >> 1) & 1, octant >> 2], axis=-1)
    found: Floats = (2.0 * sides - 1.0) / np.sqrt(3.0)
    return found


def octant_light(environment: Environment, octant: Ints) -> Floats:
    """Irradiance from an octant on a surface that faces its middle, (..., 3)."""
    return 0.5 * np.pi * radiance_from(environment, octant_direction(octant), OCTANT_DAMPING)


def path_from_openness(openness: Floats, towards: Floats) -> Floats:
    """Number of strands between a place of hair and a direction, and beyond the place, (..., 2).

    Args:
        openness: (..., 4), see ambient.openness_field. towards: (..., 3).
    """
    mean, directional = openness[..., 0], np.sum(openness[..., 1:] * towards, axis=-1)
    openings: Floats = np.stack([mean + directional, mean - directional], axis=-1)
    return -np.log(np.clip(openings, MIN_OPENNESS, 1.0))


def hair_ambient(
    environment: Environment, openness: Floats, hair_light: Callable[[Floats, Floats], Floats]
) -> Floats:
    """The world's light without the suns that Marschner's hair sends to the eye, (..., 3).

    Args:
        openness: (..., 4), see ambient.openness_field.
        hair_light: light of one lamp that hair sends out, (..., 3), radiance over irradiance, by
            the direction towards the lamp (..., 3) and `path_from_openness` there (..., 2).
    """
    found = np.zeros((*openness.shape[:-1], 3))
    octants = np.arange(8)
    for power, toward in zip(
        octant_light(environment, octants), octant_direction(octants), strict=True
    ):
        towards = np.broadcast_to(toward, found.shape)
        found += power * hair_light(towards, path_from_openness(openness, towards))
    return found


def openness_from_occlusion(occlusion: Floats, away: Floats) -> Floats:
    """Openness (..., 4) where only occlusion (...) is known: towards `away`, outwards of the hair,
    (..., 3)."""
    ahead = np.concatenate([np.ones((*away.shape[:-1], 1)), away], axis=-1)
    found: Floats = 0.5 * occlusion[..., None] * ahead
    return found
