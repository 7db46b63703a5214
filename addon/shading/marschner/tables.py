"""The look-up tables of Nguyen and Donnelly 2005, for all colours at once.

Reference: Nguyen and Donnelly 2005, "Hair Animation and Rendering in the Nalu Demo", GPU Gems 2,
chapter 23: one table for M_p and cos theta_d, one for N_p.

Theirs hold the lobes of one hair colour. Ours hold those of a CLEAR fibre and the length of their
light's path inside, l, [radii], with its variance v where several paths lead to one phi:

    N_p(absorption) = N_p(0) exp(-absorption l_p + absorption^2 v_p / 2),

the first terms of the logarithm of a mean of exponentials. So changes of colour, melanin,
variation, tips and strengths need no new tables; only those of the fibre's shape do.

Layout, float32, bottom row first as the GPU has them:
    longitudinal (LEVELS, size, size, 4): column theta_i, row theta_r, each from -pi/2 to pi/2;
        M_R, M_TT, M_TRT, cos theta_d. Level k is the mean over 2^k texels along theta_h.
    azimuthal (size, size, 4): column cos theta_d from 0 to 1, row phi from 0 (light comes back) to
        pi (it goes on); N_R, N_TT, N_TRT, N_rest.
    paths (size, size, 4): the same axes; l_TT, l_TRT, v_TRT, l_rest.
The first and last texels' CENTRES lie on the ends of an axis: u = ((size - 1) x + 0.5) / size; a
level lies at w = (level + 0.5) / LEVELS.

Two axes are angles instead of the paper's cosines. Inclinations keep narrow lobes equally sharp
everywhere, while sines would have few texels for grazing light. With cos phi, a texel next to phi =
0 would be as wide as a glint, and N_R would fall like a square root at phi = pi.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats, Ints
from .azimuthal import azimuthal_higher, azimuthal_r, azimuthal_trt, azimuthal_tt
from .fibre import Fibre
from .interface import MIN_COSINE
from .longitudinal import longitudinal_lobes

#: Texels along a side, while a slider moves and at rest.
PREVIEW_SIZE = 64
DEFAULT_SIZE = 256

#: Levels of the longitudinal table: means over 1, 2, 4, ... texels.
LEVELS = 6

#: The absorptions at which paths are fitted. Rays of TT are nearly alike, so the largest absorption
#: gives their length. Rays of the rest differ, and those that are absorbed least matter most: a
#: small one gives it.
_FITTED = (0.0, 0.1, 1.0)

#: Minimum of a lobe where its paths are defined, and in a logarithm.
_MIN_LIT = 1e-12
_MIN_LIGHT = 1e-100

#: Minimum variance in a quotient: it is 0 where all paths are equally long.
_MIN_VARIANCE = 1e-6


@dataclass(frozen=True)
class MarschnerTables:
    """The textures, float32; shapes and lanes are given above."""

    longitudinal: Floats
    azimuthal: Floats
    paths: Floats


def shape_of(fibre: Fibre) -> Fibre:
    """The fibre without colour and strengths, on which its tables depend."""
    return replace(
        fibre,
        absorption=(0.0, 0.0, 0.0),
        strength_r=1.0,
        strength_tt=1.0,
        strength_trt=1.0,
        strength_higher=1.0,
    )


def marschner_tables(fibre: Fibre, size: int = DEFAULT_SIZE) -> MarschnerTables:
    """All tables of a fibre's shape."""
    return MarschnerTables(longitudinal_table(fibre, size), *azimuthal_tables(fibre, size))


def longitudinal_table(fibre: Fibre, size: int) -> Floats:
    """M_R, M_TT, M_TRT and cos theta_d by the two inclinations, (LEVELS, size, size, 4): rows by
    theta_r, columns by theta_i."""
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, size)
    theta_i, theta_r = theta[None, :], theta[:, None]
    table = np.empty((LEVELS, size, size, 4), np.float32)
    for lane, lobe in enumerate(longitudinal_lobes(fibre)):
        table[0, ..., lane] = lobe(theta_i, theta_r)
    table[..., 3] = np.cos(0.5 * (theta_r - theta_i))
    for level in range(1, LEVELS):
        table[level, ..., :3] = _next_level(table[level - 1, ..., :3], level - 1)
    return table


def azimuthal_tables(fibre: Fibre, size: int) -> tuple[Floats, Floats]:
    """N_p of the clear fibre and the lengths of their paths, (size, size, 4) each: rows by phi,
    columns by cos theta_d."""
    axis = np.linspace(0.0, 1.0, size)
    cos_d, phi = axis[None, :], np.pi * axis[:, None]
    fibre, width = replace(fibre, absorption=_FITTED), fibre.azimuthal_width
    through = _blurred_azimuthally(azimuthal_tt(cos_d, phi, fibre), width)
    back = _blurred_azimuthally(azimuthal_trt(cos_d, phi, fibre), width)
    rest = azimuthal_higher(cos_d, fibre)
    azimuthal, paths = np.empty((2, size, size, 4), np.float32)
    azimuthal[..., 0] = _blurred_azimuthally(azimuthal_r(cos_d, phi, fibre), width)
    for lane, lobe in enumerate((through, back, rest), start=1):
        azimuthal[..., lane] = lobe[..., 0]
    paths[..., 0] = _extrapolated(_mean_path(through, 2), through)
    length, variance = _path_and_variance(back)
    paths[..., 1] = _extrapolated(length, back)
    paths[..., 2] = _extrapolated(variance, back)
    paths[..., 3] = _mean_path(rest, 1)
    return azimuthal, paths


def look_up(
    tables: MarschnerTables,
    theta_i: Floats,
    theta_r: Floats,
    phi: Floats,
    absorption: Floats,
    strengths: Floats,
    level: Floats | float = 0.0,
) -> Floats:
    """S from the tables, (..., 3), as the shader reads them.

    Args:
        theta_i, theta_r, phi: [rad]; phi in [-pi, pi].
        absorption: per radius, (..., 3).
        strengths: of R, TT, TRT and the rest, (..., 4).
        level: of the longitudinal table: log2 of the number of steps of theta_h, pi / (size - 1),
            in a pixel.
    """
    along = trilinear(tables.longitudinal, theta_i / np.pi + 0.5, theta_r / np.pi + 0.5, level)
    cos_d, turn = along[..., 3], np.abs(phi) / np.pi
    clear = bilinear(tables.azimuthal, cos_d, turn)
    transmittance = lobe_transmittance(bilinear(tables.paths, cos_d, turn), absorption)
    factors = strengths * along[..., [0, 1, 2, 2]] * clear
    squared = np.maximum(cos_d, MIN_COSINE)[..., None] ** 2
    return np.sum(factors[..., None] * transmittance, axis=-2) / squared


def table_level(angle: float, size: int) -> float:
    """The level at which a longitudinal table of this size is blurred over an angle of theta_h."""
    return float(np.log2(max(angle * (size - 1) / np.pi, 1.0)))


def lobe_transmittance(paths: Floats, absorption: Floats) -> Floats:
    """The fractions of R, TT, TRT and the rest that absorption leaves, (..., 4, 3).

    Where the fitted parabola would rise again, it stays at its minimum.
    """
    l_tt, l_trt, v_trt, l_rest = np.moveaxis(paths[..., None], -2, 0)
    limited_absorption = np.minimum(absorption, l_trt / np.maximum(v_trt, _MIN_VARIANCE))
    return np.stack(
        [
            np.ones(np.broadcast_shapes(l_tt.shape, absorption.shape)),
            np.exp(-absorption * l_tt),
            np.exp(-limited_absorption * (l_trt - 0.5 * limited_absorption * v_trt)),
            np.exp(-absorption * l_rest),
        ],
        axis=-2,
    )


def _blurred_azimuthally(lobes: Floats, width: float) -> Floats:
    """Lobes (size of phi, ...) convolved with a Gaussian of phi over the circle.

    The kernel sums to 1 over the circle's texels, of which the lobes, being even, hold one half.
    """
    if width == 0.0:
        return lobes
    half = len(lobes) - 1
    turn = np.arange(2 * half) * (np.pi / half)
    kernel = np.sum(
        [np.exp(-0.5 * ((turn - 2.0 * np.pi * lap) / width) ** 2) for lap in range(-2, 4)], axis=0
    )
    row, column = np.arange(half + 1)[:, None], np.arange(half + 1)
    matrix = kernel[np.abs(row - column)] + kernel[(row + column) % (2 * half)]
    matrix[:, [0, -1]] *= 0.5
    return np.tensordot(matrix / kernel.sum(), lobes, axes=1)


def _mean_path(lobe: Floats, lane: int) -> Floats:
    """l, (...), with which exp(-absorption l) is exact at one absorption of _FITTED."""
    fraction = np.maximum(lobe[..., lane], _MIN_LIGHT) / np.maximum(lobe[..., 0], _MIN_LIGHT)
    return -np.log(fraction) / _FITTED[lane]


def _path_and_variance(lobe: Floats) -> tuple[Floats, Floats]:
    """l and v, each (...), exact at both absorptions."""
    near, far = _mean_path(lobe, 1), _mean_path(lobe, 2)
    variance = np.maximum(2.0 * (near - far) / (_FITTED[2] - _FITTED[1]), 0.0)
    return near + 0.5 * _FITTED[1] * variance, variance


def _extrapolated(path: Floats, lobe: Floats) -> Floats:
    """Paths (size of phi, size of cos theta_d), continued to where their lobe has no light.

    The texture is interpolated, so a path must not jump at the border of its lobe.
    """
    is_lit = lobe[..., 0] > _MIN_LIT
    last = np.maximum.accumulate(np.where(is_lit, np.arange(len(path))[:, None], -1), axis=0)
    return np.take_along_axis(path, np.where(last < 0, is_lit.argmax(axis=0), last), 0)


def _next_level(table: Floats, level: int) -> Floats:
    """Means over twice as many texels along theta_h, the ends repeated.

    Along theta_h both indices increase together. Each mean joins two boxes of 2^level texels, side
    by side. At level 0 a box of two texels is centred on a texel, so that the outer texels have
    half of their weight.
    """
    reach = max(1 << level, 2) >> 1
    padded = np.pad(table, [(reach, reach), (reach, reach), (0, 0)], mode="edge")
    ends = padded[: -2 * reach, : -2 * reach] + padded[2 * reach :, 2 * reach :]
    return 0.25 * ends + 0.5 * table if level == 0 else 0.5 * ends


def trilinear(table: Floats, x: Floats, y: Floats, level: Floats | float) -> Floats:
    """A texture of levels, (levels, rows, columns, 4), interpolated between two levels."""
    place = np.clip(level, 0.0, len(table) - 1.0)
    below = np.minimum(np.floor(place).astype(np.int64), len(table) - 2)
    lower, upper = bilinear(table, x, y, below), bilinear(table, x, y, below + 1)
    return lower + (upper - lower) * (place - below)[..., None]


def bilinear(table: Floats, x: Floats, y: Floats, *level: Ints) -> Floats:
    """A texture at x (columns) and y (rows) in [0, 1] between the centres of its end texels.

    `level` selects one of a texture of levels.
    """
    rows, columns = table.shape[-3:-1]
    column, right = _texels_around(x, columns)
    row, up = _texels_around(y, rows)
    lower = table[*level, row, column] * (1.0 - right) + table[*level, row, column + 1] * right
    row = row + 1
    upper = table[*level, row, column] * (1.0 - right) + table[*level, row, column + 1] * right
    return lower * (1.0 - up) + upper * up


def _texels_around(place: Floats, count: int) -> tuple[Ints, Floats]:
    scaled = np.clip(place, 0.0, 1.0) * (count - 1)
    index = np.minimum(scaled.astype(np.int64), count - 2)
    return index, (scaled - index)[..., None]
