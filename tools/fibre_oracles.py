"""Brute-force references for Marschner's lobes, for tests and benchmarks.

`traced_lobes` traces rays in space through a glass cylinder, the reference for N_p;
`scattered_energy` sums S over the sphere.

The normal plane of the fibre, Bravais indices and closed forms are not used here: hit points,
normals, reflection and refraction are vectors, and Fresnel's formulas are those in space.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.marschner.azimuthal import (
    azimuthal_r,
    azimuthal_trt,
    azimuthal_tt,
    trt_caustic,
)
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.interface import bravais_index
from hairloom.addon.shading.marschner.longitudinal import longitudinal_lobes
from hairloom.addon.shading.marschner.scattering import azimuthal_lobes

BIN_COUNT = 360

#: Width on either side of TRT's caustic, where N_p has a pole, that is not compared [rad]
_CAUSTIC_MARGIN = np.radians(3.0)


def traced_lobes(
    ray_count: int, theta: float, fibre: Fibre, order_count: int = 3, seed: int = 1
) -> tuple[Floats, Floats]:
    """Histograms of phi and energies of the lobes p = 0, 1, ...

    The light comes from azimuth 0 and inclination theta, on a smooth cylinder around z. Only the
    fibre's index and absorption count.

    Returns:
        (order_count, BIN_COUNT, 3) density over phi in [-pi, pi], and (order_count, 3) the fraction
        of the light.
    """
    index = fibre.index_of_refraction
    random = np.random.default_rng(seed)
    h = 2.0 * (np.arange(ray_count) + random.random(ray_count)) / ray_count - 1.0
    light = np.array([-np.cos(theta), 0.0, -np.sin(theta)])
    point = np.stack([np.sqrt(1.0 - h * h), h, np.zeros_like(h)], axis=1)
    cosine = -(point @ light)
    reflectance, cos_in = _fresnel(cosine, 1.0 / index)
    directions = light + 2.0 * cosine[:, None] * point
    inside = light / index + (cosine / index - cos_in)[:, None] * point
    energy = np.repeat((1.0 - reflectance)[:, None], 3, axis=1)
    lobes = [(directions, np.repeat(reflectance[:, None], 3, axis=1))]
    for _ in range(1, order_count):
        flat = inside * [1.0, 1.0, 0.0]
        length = -2.0 * _dot(point, flat) / _dot(flat, flat)
        point = point + length[:, None] * flat
        energy = energy * np.exp(-length[:, None] * np.array(fibre.absorption))
        cosine = np.maximum(_dot(inside, point), 0.0)
        reflectance, cos_out = _fresnel(cosine, index)
        directions = inside * index + (cos_out - index * cosine)[:, None] * point
        lobes.append((directions, energy * (1.0 - reflectance)[:, None]))
        inside = inside - 2.0 * cosine[:, None] * point
        energy = energy * reflectance[:, None]
    histograms = np.stack([_histogram(directions, weight) for directions, weight in lobes])
    return histograms, np.array([weight.mean(axis=0) for _, weight in lobes])


def lobe_errors(traced: Floats, theta: float, fibre: Fibre) -> tuple[float, float, float]:
    """Largest difference of R, TT, TRT from the traced lobes, over each lobe's and colour's peak.

    Args:
        traced: (3 or more, BIN_COUNT, 3).
        fibre: round, its caustics not blurred (glint_width 0).
    """
    bravais = bravais_index(fibre.index_of_refraction, np.array(np.cos(theta)))
    caustic = float(trt_caustic(bravais)[1])
    phi = (np.arange(BIN_COUNT) + 0.5) / BIN_COUNT * 2.0 * np.pi - np.pi
    is_near = np.abs(np.abs(phi) - caustic) < _CAUSTIC_MARGIN
    errors = []
    for order, function in enumerate((azimuthal_r, azimuthal_tt, azimuthal_trt)):
        expected = _bin_means(np.array(np.cos(theta)), function, fibre)
        is_compared = ~is_near if order == 2 else np.full(BIN_COUNT, True)
        difference = np.abs(expected - traced[order])[is_compared].max(axis=0)
        errors.append(float((difference / traced[order][is_compared].max(axis=0)).max()))
    return (errors[0], errors[1], errors[2])


def scattered_energy(fibre: Fibre, theta_i: Floats) -> Floats:
    """The energy that S scatters of unit light from theta_i, (n,), by channel, (n, 3).

    S cos^2 theta_r is summed over the sphere. Azimuthally, S depends on theta_d alone, so that each
    cone's circle is summed once.
    """
    theta_r = ((np.arange(720) + 0.5) / 720 - 0.5) * np.pi
    phi = (np.arange(180) + 0.5) / 180 * np.pi
    theta_d = np.linspace(0.0, 0.5 * np.pi, 129)
    azimuthal = 2.0 * np.pi * azimuthal_lobes(np.cos(theta_d)[:, None], phi, fibre).mean(axis=1)
    theta_d_of_pair = 0.5 * (theta_r - theta_i[:, None])
    measure = np.cos(theta_r) ** 2 / np.cos(theta_d_of_pair) ** 2 * (np.pi / len(theta_r))
    lobes = longitudinal_lobes(fibre)
    total = np.zeros((len(theta_i), 3))
    for order, lobe in enumerate((*lobes, lobes[2])):
        longitudinal = fibre.strengths[order] * lobe(theta_i[:, None], theta_r) * measure
        for channel in range(3):
            energy = np.interp(np.abs(theta_d_of_pair), theta_d, azimuthal[:, order, channel])
            total[:, channel] += (longitudinal * energy).sum(axis=1)
    return total


def _bin_means(
    cos_d: Floats, function: Callable[[Floats, Floats, Fibre], Floats], fibre: Fibre
) -> Floats:
    """Mean of N_p over each bin, (BIN_COUNT, 1 or 3)."""
    count = BIN_COUNT * 32
    phi = (np.arange(count) + 0.5) / count * 2.0 * np.pi - np.pi
    return function(cos_d, phi, fibre).reshape(BIN_COUNT, 32, -1).mean(axis=1)


def _histogram(directions: Floats, weight: Floats) -> Floats:
    azimuth = (np.arctan2(directions[:, 1], directions[:, 0]) + np.pi) * (BIN_COUNT / (2.0 * np.pi))
    bin_index = np.minimum(azimuth.astype(np.int64), BIN_COUNT - 1)
    counts = [np.bincount(bin_index, channel, BIN_COUNT) for channel in weight.T]
    return np.stack(counts, axis=1) * (BIN_COUNT / (2.0 * np.pi) / len(directions))


def _fresnel(cos_in: Floats, ratio: float) -> tuple[Floats, Floats]:
    """Fresnel's reflectance and the cosine of refraction, in space; ratio: n before over n
    behind."""
    cos_out = np.sqrt(np.maximum(1.0 - ratio**2 * (1.0 - cos_in**2), 0.0))
    across = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out)
    along = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out)
    return 0.5 * (across**2 + along**2), cos_out


def _dot(first: Floats, second: Floats) -> Floats:
    return np.einsum("ij,ij->i", first, second)
