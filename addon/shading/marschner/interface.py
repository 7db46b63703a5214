"""The surface of the fibre: how much light each path through it keeps.

In the plane across the fibre, the projection of a slanted ray refracts like a ray in that plane,
but with other indices of refraction (Bravais; Marschner et al. 2003, appendix B). This is exact:
with these indices, Fresnel's formulas in the plane are those of the ray in space.
"""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Floats
from .fibre import MIN_INDEX

#: cos theta_d below which a ray runs along the fibre and the effective index has no bounds
MIN_COSINE = 1e-4

#: Minimum loss of a passage, in a quotient: at grazing light, where nothing enters, it is 0.
_MIN_LOSS = 1e-9


def bravais_index(index: Floats | float, cos_d: Floats) -> Floats:
    """eta' of a cone of cos theta_d, for Snell's law in the plane and light polarised across it."""
    index = np.maximum(index, MIN_INDEX)
    cosine = np.clip(cos_d, MIN_COSINE, 1.0)
    return np.sqrt(index**2 - 1.0 + cosine**2) / cosine


def refracted(gamma: Floats, bravais: Floats) -> Floats:
    """Angle to the normal inside, in the plane, of light that meets the surface at gamma, [rad]."""
    return np.arcsin(np.clip(np.sin(gamma) / bravais, -1.0, 1.0))


def fresnel(gamma: Floats, index: Floats | float, bravais: Floats) -> Floats:
    """Reflected fraction of unpolarised light at gamma, from outside and from inside going out.

    eta'' = index^2 / eta' is the index for light polarised in the plane.
    """
    cos_i = np.maximum(np.cos(gamma), 0.0)
    cos_t = np.cos(refracted(gamma, bravais))
    parallel = np.maximum(index, MIN_INDEX) ** 2 / bravais
    across = (cos_i - bravais * cos_t) / (cos_i + bravais * cos_t)
    along = (parallel * cos_i - cos_t) / (parallel * cos_i + cos_t)
    return 0.5 * (across**2 + along**2)


def attenuation(
    order: int,
    gamma: Floats,
    cos_d: Floats,
    index: Floats | float,
    absorption: tuple[float, float, float],
) -> Floats:
    """A(p, h): the fraction left of light that meets the fibre at gamma = asin h, (..., 3).

    Args:
        order: p, 0 for R, 1 for TT, 2 for TRT: passages through the inside.
        gamma, cos_d, index: broadcast.
        absorption: per radius.
    """
    bravais = bravais_index(index, cos_d)
    mirrored = fresnel(gamma, index, bravais)[..., None]
    if order == 0:
        return np.broadcast_to(mirrored, (*mirrored.shape[:-1], 3))
    transmittance = np.exp(
        -chord(gamma, cos_d, index)[..., None] * (order * np.asarray(absorption))
    )
    return (1.0 - mirrored) ** 2 * mirrored ** (order - 1) * transmittance


def chord(gamma: Floats, cos_d: Floats, index: Floats | float) -> Floats:
    """Length of one passage through the inside, [radii], of light that meets the fibre at gamma.

    2 cos gamma_t in the plane and longer by 1 / cos theta_t in space. (Marschner's
    1 + cos 2 gamma_t is a misprint.)
    """
    inside = np.maximum(index, MIN_INDEX)
    cos_t = np.sqrt(1.0 - (1.0 - np.clip(cos_d, MIN_COSINE, 1.0) ** 2) / inside**2)
    return 2.0 * np.cos(refracted(gamma, bravais_index(index, cos_d))) / cos_t


def lobe_energy(
    order: int, cos_d: Floats, index: Floats | float, absorption: tuple[float, float, float]
) -> Floats:
    """Fraction of the fibre's light that leaves in lobe p: the mean of A over h, (..., 3)."""
    gamma, weight = quarter_turn_quadrature()
    transmittance = attenuation(order, gamma, np.asarray(cos_d)[..., None], index, absorption)
    return np.sum(transmittance * (weight * np.cos(gamma))[:, None], axis=-2)


def higher_lobes_energy(
    cos_d: Floats, index: float, absorption: tuple[float, float, float]
) -> Floats:
    """Fraction of the light that leaves after two or more reflections inside, (..., 3).

    The lobes p = 3, 4, ... are a geometric series: each passage keeps F T of the one before.
    """
    gamma, weight = quarter_turn_quadrature()
    cone = np.asarray(cos_d)[..., None]
    mirrored = fresnel(gamma, index, bravais_index(index, cone))[..., None]
    passage = np.exp(-chord(gamma, cone, index)[..., None] * np.asarray(absorption))
    left = (1.0 - mirrored) ** 2 * mirrored**2 * passage**3
    left = left / np.maximum(1.0 - mirrored * passage, _MIN_LOSS)
    return np.sum(left * (weight * np.cos(gamma))[:, None], axis=-2)


@functools.cache
def quarter_turn_quadrature() -> tuple[Floats, Floats]:
    """64 Gauss-Legendre angles in [0, pi/2] and their weights."""
    place, weight = np.polynomial.legendre.leggauss(64)
    return 0.25 * np.pi * (place + 1.0), 0.25 * np.pi * weight
