"""The two look-up tables of Nguyen and Donnelly 2005, and S itself to measure them by.

Reference: Nguyen and Donnelly 2005, "Hair Animation and Rendering in the Nalu Demo", GPU Gems 2,
chapter 23: one table for M_p and cos theta_d, one for N_p.

Layout; both are square, float32, bottom row first as the GPU has them:
    longitudinal (size, size, 4): column theta_i, row theta_r, each from -pi/2 to pi/2;
        r M_R, g M_TT, b M_TRT, a cos theta_d.
    azimuthal, two textures (size, size, 4): column cos theta_d from 0 to 1, row phi from 0
        (light comes back) to pi (it goes on);
        transmitted: rgb N_TT, a N_R; internal: rgb N_TRT, a unused, 0.
The first and last texels' CENTRES lie on the ends of an axis: u = ((size - 1) x + 0.5) / size.

Two axes differ from the paper's cosines. Angles keep narrow lobes equally sharp everywhere, where
the sines starve grazing light. By cos phi a texel next to phi = 0 would be as wide as a glint, and
N_R would end in a root at phi = pi.

Strengths are left out: the shader multiplies them, and moving them rebuilds nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from .azimuthal import azimuthal_r, azimuthal_trt, azimuthal_tt
from .fibre import Fibre
from .interface import LEAST_COSINE
from .longitudinal import longitudinal_lobes

#: While a slider moves, and at rest: texels along a side.
PREVIEW_SIZE = 64
DEFAULT_SIZE = 256


@dataclass(frozen=True)
class MarschnerTables:
    """The textures, each (size, size, 4) float32 in [row, column]; the lanes are given above."""

    longitudinal: Floats
    transmitted: Floats
    internal: Floats


def marschner_tables(fibre: Fibre, size: int = DEFAULT_SIZE) -> MarschnerTables:
    """Both tables of a fibre."""
    return MarschnerTables(longitudinal_table(fibre, size), *azimuthal_tables(fibre, size))


def longitudinal_table(fibre: Fibre, size: int) -> Floats:
    """M_R, M_TT, M_TRT and cos theta_d by the two inclinations."""
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, size)
    theta_i, theta_r = theta[None, :], theta[:, None]
    table = np.empty((size, size, 4), np.float32)
    for lane, lobe in enumerate(longitudinal_lobes(fibre)):
        table[..., lane] = lobe(theta_i, theta_r)
    table[..., 3] = np.cos(0.5 * (theta_r - theta_i))
    return table


def azimuthal_tables(fibre: Fibre, size: int) -> tuple[Floats, Floats]:
    """N_TT with N_R, and N_TRT, by cos theta_d and phi."""
    axis = np.linspace(0.0, 1.0, size)
    cos_d, phi = axis[None, :], np.pi * axis[:, None]
    transmitted = np.empty((size, size, 4), np.float32)
    transmitted[..., :3] = azimuthal_tt(cos_d, phi, fibre)
    transmitted[..., 3] = azimuthal_r(cos_d, phi, fibre)
    internal = np.zeros((size, size, 4), np.float32)
    internal[..., :3] = azimuthal_trt(cos_d, phi, fibre)
    return transmitted, internal


def marschner(theta_i: Floats, theta_r: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """S(theta_i, theta_r, phi), (..., 3), without tables.

    Times irradiance across the light and cos theta_i it is radiance of the fibre.
    """
    theta_i, theta_r = np.asarray(theta_i), np.asarray(theta_r)
    cos_d = np.cos(0.5 * (theta_r - theta_i))
    lobes = [lobe(theta_i, theta_r) for lobe in longitudinal_lobes(fibre)]
    around = (
        azimuthal_r(cos_d, phi, fibre)[..., None],
        azimuthal_tt(cos_d, phi, fibre),
        azimuthal_trt(cos_d, phi, fibre),
    )
    return _assembled(np.stack(lobes, axis=-1), around, cos_d, fibre)


def look_up(
    tables: MarschnerTables, theta_i: Floats, theta_r: Floats, phi: Floats, fibre: Fibre
) -> Floats:
    """S from the tables, (..., 3), as the shader reads them, for phi in [-pi, pi].

    Of the fibre it asks only the strengths.
    """
    along = bilinear(tables.longitudinal, theta_i / np.pi + 0.5, theta_r / np.pi + 0.5)
    cos_d, turn = along[..., 3], np.abs(phi) / np.pi
    transmitted = bilinear(tables.transmitted, cos_d, turn)
    internal = bilinear(tables.internal, cos_d, turn)
    around = (transmitted[..., 3:], transmitted[..., :3], internal[..., :3])
    return _assembled(along[..., :3], around, cos_d, fibre)


def bilinear(table: Floats, x: Floats, y: Floats) -> Floats:
    """A texture at x (columns) and y (rows) in [0, 1] between the centres of its end texels."""
    rows, columns = table.shape[:2]
    column, right = _between(x, columns)
    row, up = _between(y, rows)
    lower = table[row, column] * (1.0 - right) + table[row, column + 1] * right
    upper = table[row + 1, column] * (1.0 - right) + table[row + 1, column + 1] * right
    return lower * (1.0 - up) + upper * up


def _between(place: Floats, count: int) -> tuple[Ints, Floats]:
    scaled = np.clip(place, 0.0, 1.0) * (count - 1)
    index = np.minimum(scaled.astype(np.int64), count - 2)
    return index, (scaled - index)[..., None]


def _assembled(
    along: Floats, around: tuple[Floats, Floats, Floats], cos_d: Floats, fibre: Fibre
) -> Floats:
    """sum of strength M_p N_p / cos^2 theta_d."""
    terms = [
        strength * along[..., lane, None] * spread
        for lane, (strength, spread) in enumerate(zip(fibre.strengths, around, strict=True))
    ]
    squared = np.maximum(cos_d, LEAST_COSINE)[..., None] ** 2
    return (terms[0] + terms[1] + terms[2]) / squared
