"""The skin and eyes of the bust, painted by this code onto its UV map, so that no picture ships."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...arrays import Floats
from ...shading.skin.chart import Chart, barycentric, covering
from .bust_data import EYES, load_bust

type Color = tuple[float, float, float]

#: texels along each side of the picture, and the width of the rim around each island in texels
RESOLUTION, _ISLAND_MARGIN = 1024, 4
#: roughness and IOR of the Principled BSDF
SKIN_ROUGHNESS, EYE_ROUGHNESS = 0.45, 0.12
SKIN_IOR, EYE_IOR = 1.4, 1.376


@dataclass(frozen=True)
class Tone:
    """Scene-linear colours. flush: factor on the skin's colour where blood is near the surface."""

    skin: Color
    lips: Color
    iris: Color
    flush: Color


TONES = {
    "light": Tone((0.60, 0.385, 0.29), (0.47, 0.185, 0.165), (0.10, 0.16, 0.17), (1.0, 0.74, 0.74)),
    "medium": Tone(
        (0.39, 0.215, 0.14), (0.295, 0.115, 0.092), (0.085, 0.045, 0.018), (1.0, 0.80, 0.80)
    ),
    "dark": Tone(
        (0.135, 0.066, 0.041), (0.105, 0.040, 0.036), (0.035, 0.017, 0.008), (1.0, 0.86, 0.86)
    ),
}
_SCLERA: Color = (0.66, 0.60, 0.57)
_PUPIL: Color = (0.004, 0.004, 0.004)
#: factor on colours in folds, where red light survives best
_FOLD: Color = (0.36, 0.17, 0.14)
#: factor on skin between the hairs of scalp and brows: darker, so that a parting does not shine,
#: but not so dark that a head with only a beard seems to wear a cap
_BETWEEN_HAIRS: Color = (0.72, 0.68, 0.66)
_BELOW_EYES: Color = (0.90, 0.83, 0.85)
#: where more blood shows: place, on the left side or in the middle [m], reach [m], strength
_FLUSH_SPOTS = (
    ((0.041, -0.073, -0.040), 0.024, 0.5),
    ((0.0, -0.108, -0.043), 0.013, 0.6),
    ((0.083, 0.015, -0.025), 0.030, 0.8),
    ((0.0, -0.090, -0.108), 0.015, 0.35),
    ((0.031, -0.085, 0.004), 0.012, 0.35),
)
#: middle of the shade below the left eye, (x, z) [m]; its reach across and down [m]
_EYE_SHADE, _EYE_SHADE_REACH = (0.029, -0.0205), (0.013, 0.0055)
#: middle of the left eye [m]; rims of pupil and iris, as angles from its axis [degrees]
_EYE, _PUPIL_RIM, _IRIS_RIM = (0.0307767, -0.064535, -0.0065861), 9.2, 25.0
#: size [m] and strength of blotches and pores
_MOTTLE = ((0.016, 0.05), (0.005, 0.04), (0.0016, 0.05))


@lru_cache(maxsize=1)
def skin_picture(tone: str) -> Floats:
    """The picture, (RESOLUTION, RESOLUTION, 4) scene-linear; row 0 is at v = 0.

    Args:
        tone: one of TONES.
    """
    bust, colors = load_bust(), TONES[tone]
    corners, material = bust.triangulated
    place = bust.uv[bust.corner_uv[corners]].astype(np.float64) * RESOLUTION
    chart = Chart(place, np.ones(len(place), bool), (RESOLUTION, RESOLUTION))
    triangle, _ = covering(chart)
    row, column = np.nonzero(triangle >= 0)
    triangles = triangle[row, column]
    fraction = barycentric(place[triangles], np.stack([column + 0.5, row + 0.5], axis=1))
    vertices = bust.corner_vertex[corners[triangles]]

    def at_texels(values: Floats) -> Floats:
        interpolated: Floats = np.einsum("nk,nk...->n...", fraction, values[vertices])
        return interpolated

    points = at_texels(bust.positions)
    weights = {name: at_texels(values)[:, None] for name, values in bust.weights.items()}
    is_eye = material[triangles] == EYES
    color = np.empty((len(points), 3))
    skin_weights = {name: values[~is_eye] for name, values in weights.items()}
    color[~is_eye] = _skin(points[~is_eye], skin_weights, colors)
    color[is_eye] = _eyes(points[is_eye], colors)
    folds = 1.0 - np.clip(weights["cavity"], 0.0, 1.0)
    color *= _mix(np.ones(3), _FOLD, np.clip(1.4 * folds, 0.0, 1.0))
    picture = np.zeros((RESOLUTION, RESOLUTION, 4), np.float32)
    picture[row, column, :3], picture[row, column, 3] = color, 1.0
    for _ in range(_ISLAND_MARGIN):
        _dilate(picture)
    mean = color[~is_eye].mean(axis=0)
    picture[picture[..., 3] == 0.0] = (*mean, 1.0)
    picture.flags.writeable = False
    return picture


def _skin(points: Floats, weights: dict[str, Floats], colors: Tone) -> Floats:
    across = np.abs(points) * (1, 0, 0) + points * (0, 1, 1)
    color = np.broadcast_to(colors.skin, points.shape).copy()
    flush = np.zeros((len(points), 1))
    for middle, reach, strength in _FLUSH_SPOTS:
        away = np.linalg.norm(across - middle, axis=1, keepdims=True) / reach
        flush += strength * np.exp(-(away**2))
    color *= _mix(np.ones(3), colors.flush, np.minimum(flush, 1.0))
    below = (across[:, [0, 2]] - _EYE_SHADE) / _EYE_SHADE_REACH
    is_front = points[:, 1] < -0.05
    shade = np.exp(-(below**2).sum(axis=1)) * is_front
    color *= _mix(np.ones(3), _BELOW_EYES, shade[:, None])
    for place in ("scalp", "brows"):
        color *= _mix(np.ones(3), _BETWEEN_HAIRS, weights[place])
    color = _mix(color, colors.lips, 0.85 * weights["lips"])
    for size, strength in _MOTTLE:
        light = strength * _noise(points, size)[:, None]
        # blotches are redder, not only darker
        color *= 1.0 + light * np.array([0.6, 1.0, 1.0])
    return color


def _eyes(points: Floats, colors: Tone) -> Floats:
    middle = np.where(points[:, :1] > 0.0, 1.0, -1.0) * (1, 0, 0) * np.array(_EYE)
    away = points - middle - np.array(_EYE) * (0, 1, 1)
    side = np.hypot(away[:, 0], away[:, 2])
    angle = np.degrees(np.arctan2(side, -away[:, 1]))[:, None]
    turn = np.arctan2(away[:, 2], away[:, 0])
    fibre = sum(np.sin(count * turn + 2.0 * count) for count in (9, 17, 26, 41, 58))[:, None] / 5.0
    inward = (_IRIS_RIM - angle) / (_IRIS_RIM - _PUPIL_RIM)
    iris = np.array(colors.iris) * (0.75 + 0.9 * np.clip(inward, 0.0, 1.0) + 0.45 * fibre)
    iris = _mix(iris, np.array(colors.iris) * 0.25, _smoothstep((angle - _IRIS_RIM + 5.0) / 5.0))
    redder = _smoothstep((side[:, None] - 0.008) / 0.007)
    white = _mix(np.array(_SCLERA), np.array(_SCLERA) * (0.95, 0.78, 0.76), redder)
    color = _mix(iris, white, _smoothstep((angle - _IRIS_RIM + 1.2) / 3.0))
    return _mix(np.array(_PUPIL), color, _smoothstep((angle - _PUPIL_RIM + 0.8) / 1.6))


def _mix(one: Floats | Color, other: Floats | Color, fraction: Floats) -> Floats:
    first, second = np.asarray(one), np.asarray(other)
    return first + (second - first) * fraction


def _smoothstep(value: Floats) -> Floats:
    x = np.clip(value, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _noise(points: Floats, size: float) -> Floats:
    """Smooth noise in space from -1 to 1, so that seams do not show, (n,) float32.

    Args:
        size: of its lattice [m].
    """
    lattice = np.random.default_rng(7).uniform(-1.0, 1.0, 32**3).astype(np.float32)
    place = (points / size + 64.0).astype(np.float32)
    cell = place.astype(np.int32)
    x, y, z = _smoothstep(place - cell).T
    at = [((cell + corner) & 31) @ np.array([1, 32, 1024]) for corner in np.ndindex(2, 2, 2)]
    values = [lattice[each] for each in at]
    along_z = [low + (high - low) * z for low, high in zip(values[::2], values[1::2], strict=True)]
    low, high = (one + (other - one) * y for one, other in (along_z[:2], along_z[2:]))
    noise: Floats = low + (high - low) * x
    return noise


def _dilate(picture: Floats) -> None:
    """Paint the texels next to painted ones with the mean of their painted neighbours."""
    is_painted = picture[..., 3] > 0.0
    total = np.zeros_like(picture)
    for axis in (0, 1):
        for step in (-1, 1):
            total += np.roll(picture, step, axis=axis)
    row, column = np.nonzero(~is_painted & (total[..., 3] > 0.0))
    found = total[row, column]
    picture[row, column] = found / found[:, 3:]
