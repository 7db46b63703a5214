"""Dual scattering: light that reaches a strand through others and back from others behind it.

Reference: Zinke, Yuksel, Weber and Keyser 2008, "Dual Scattering Approximation for Fast Multiple
Scattering in Hair". Light reaches a place straight, or scattered forward by the n strands between
it and the light. There it lights the place itself and the strands around, which send a part of it
back and forth.

Differences:
    The number of strands between is not a whole number but a mean, tau of the opacity maps. For
        strands that lie at random it has a Poisson distribution, so the mean of a_f^n is
        exp(-tau (1 - a_f)), of which exp(-tau) has met none: no threshold, and no jump.
    Light that returns from the hair behind is summed over all orders, not only three, and for the
        actual number of strands: deep white hair returns all light, a thin layer less.
    Each azimuthal lobe is stored as two numbers, the light that it sends on and back, instead of
        tables of every azimuth: light from half a circle blurs the rest away.
    Skin behind the hair reflects light that passes all strands, see reflected_by_skin. In blond
    hair of
        a groom's density that is nearly half of the light. Skin farther away lights hair too, see
        reflected_by_far_skin.

Colours are given as absorption, so that they may vary along a strand: see `fractions`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ..marschner.fibre import Fibre
from ..marschner.interface import MIN_COSINE
from ..marschner.look import (
    fibre_of,
    single_scattering,
    strand_absorption,
    strand_angles,
    unscattered_fraction,
)
from ..marschner.tables import MarschnerTables, bilinear, lobe_transmittance
from ..settings import ShadingSettings
from ..skin_seen import SkinSeen, far_skin_light, plane_beneath, through_hair

#: number of strands behind a place where it is unknown
DEFAULT_TAU_BEYOND = 4.0
#: Texels of the table of fractions: cos theta_d from 0 to 1, and absorption from 0 to infinity.
FRACTIONS_SIZE = 32
#: Absorption in the middle of that axis.
MIDPOINT = 0.5
#: maximum fraction of light that hair sends on, so that sums converge
_MAX = 0.999
_MAX_SCATTERED = 0.9999
_SMALLEST = 1e-6
#: even light is attenuated as on a path this many times as long as straight up (Elsasser 1942)
_DIFFUSIVITY = 1.66
#: minimum of a fraction of light that is converted to tau
_MIN_LIGHT = 1e-3


@dataclass(frozen=True)
class Fractions:
    """Light that a fibre sends on and back, by lobe: R, TT, TRT and the rest.

    forward, backward: (FRACTIONS_SIZE, FRACTIONS_SIZE, 4) float32; row by absorption, see
        table_coordinate; column by cos theta_d; fractions of the light on the fibre.
    """

    forward: Floats
    backward: Floats


def fractions(tables: MarschnerTables, size: int = FRACTIONS_SIZE) -> Fractions:
    """The fractions of the azimuthal lobes, for all absorptions.

    Of light that comes from anywhere in half a circle and turns by phi, the fraction |phi| / pi
    goes on into the other half (Zinke et al. 2008, equation 6, for azimuths).
    """
    rows = np.linspace(0, len(tables.azimuthal) - 1, 2 * size).round().astype(int)
    columns = np.linspace(0, len(tables.azimuthal) - 1, size).round().astype(int)
    clear, paths = tables.azimuthal[rows][:, columns], tables.paths[rows][:, columns]
    turn = (rows / (len(tables.azimuthal) - 1))[:, None, None]
    # the trapezoidal rule from 0 to pi, and its mirror image
    weight = np.gradient(turn[:, 0, 0])[:, None, None] * 2.0 * np.pi
    weight[[0, -1]] *= 0.5
    forward, backward = np.empty((2, size, size, 4), np.float32)
    for row, coordinate in enumerate(np.linspace(0.0, 1.0, size)):
        transmittance = lobe_transmittance(paths, np.full(1, absorption_at_coordinate(coordinate)))[
            ..., 0
        ]
        weighted = clear * transmittance * weight
        forward[row] = (weighted * turn).sum(axis=0)
        backward[row] = (weighted * (1.0 - turn)).sum(axis=0)
    return Fractions(forward, backward)


def table_coordinate(absorption: Floats) -> Floats:
    """Where an absorption (...) lies in the table, 0 to 1."""
    return absorption / (absorption + MIDPOINT)


def absorption_at_coordinate(coordinate: Floats | float) -> Floats:
    """The absorption at a coordinate (...) of the table; its end is that of black hair."""
    inside = np.minimum(coordinate, 1.0 - 1e-3)
    return np.asarray(MIDPOINT * inside / (1.0 - inside))


def fractions_at(table: Floats, cos_d: Floats, absorption: Floats) -> Floats:
    """Fractions by colour and lobe, (..., 3, 4), from the forward or the backward table.

    Args:
        cos_d: (...). absorption: (..., 3).
    """
    return bilinear(table, cos_d[..., None], table_coordinate(absorption))


def mean_forward(table: Floats, shading: ShadingSettings) -> Floats:
    """The fraction of light that a strand of this hair sends on, by colour, (3,).

    The mean over strands of all directions, which meet light at theta with a frequency and a
    breadth of cos theta each; from root to tip; with grey strands by their fraction.

    Args:
        table: `forward` of Fractions.
    """
    count = 16
    theta = (np.arange(count) + 0.5) / count * 0.5 * np.pi
    along = (np.arange(count) + 0.5) / count
    found = np.zeros(3)
    for grey_noise, fraction in ((0.0, shading.grey_fraction), (1.0, 1.0 - shading.grey_fraction)):
        noises = np.full(count, 0.5), np.full(count, grey_noise)
        absorption = strand_absorption(shading, along, *noises)
        # light that goes on leaves at the inclination at which it came
        forwarded = (
            fractions_at(table, np.cos(theta)[:, None], absorption).sum(axis=-1).mean(axis=1)
        )
        found += fraction * np.average(forwarded, axis=0, weights=np.cos(theta) ** 2)
    return np.minimum(found, _MAX)


def straight_and_scattered(tau: Floats, a_forward: Floats) -> tuple[Floats, Floats]:
    """Light that passes tau strands on average: straight, and sent on by one of them or more.

    Poisson: the chance to meet none is exp(-tau), the mean of a_f^n is exp(-tau (1 - a_f)).
    """
    straight = np.exp(-tau)
    return straight, np.exp(-tau * (1.0 - a_forward)) - straight


def backscattered(a_forward: Floats, a_backward: Floats, count: Floats | float = np.inf) -> Floats:
    """The fraction of light that `count` strands, one behind the other, return.

    Endlessly deep hair returns R, with one more layer on top too: R = a_b + a_f^2 R / (1 - a_b R),
    for any number of turns between the two. From one layer to the next the light keeps
    g = a_f / (1 - a_b R), so that a stack of n returns R (1 - g^2n) / (1 - R^2 g^2n) (Stokes 1862).
    """
    a_forward = np.clip(a_forward, 0.0, np.maximum(_MAX_SCATTERED - a_backward, 0.0))
    middle = 1.0 + a_backward**2 - a_forward**2
    root = np.sqrt(np.maximum(middle**2 - 4.0 * a_backward**2, 0.0))
    # the smaller root, without a difference of near equals
    deep = 2.0 * a_backward / np.maximum(middle + root, _SMALLEST)
    layer_transmittance = a_forward / np.maximum(1.0 - a_backward * deep, _SMALLEST)
    stack_factor = np.clip(layer_transmittance, _SMALLEST, 1.0) ** (2.0 * count)
    return deep * (1.0 - stack_factor) / np.maximum(1.0 - deep**2 * stack_factor, _SMALLEST)


def backscatter_shape(
    forward: Floats, backward: Floats, fibre: Fibre
) -> tuple[Floats, Floats, Floats]:
    """Width and shift in theta_h of backscattered light, and the width that one passage forward
    adds.

    Args:
        forward, backward: by lobe, (..., 4).

    Zinke et al. 2008, equations 16 and 17, with a_f of at most 0.999.
    """
    widths = np.array(fibre.lobe_widths)
    shifts = np.array(fibre.lobe_shifts)
    a_f = np.minimum(forward.sum(axis=-1), _MAX)
    a_b = backward.sum(axis=-1)
    forward_sum, backward_sum = np.maximum(a_f, _SMALLEST), np.maximum(a_b, _SMALLEST)
    wide_f = np.sqrt((forward * widths**2).sum(axis=-1) / forward_sum)
    wide_b = np.sqrt((backward * widths**2).sum(axis=-1) / backward_sum)
    shift_f = (forward * shifts).sum(axis=-1) / forward_sum
    shift_b = (backward * shifts).sum(axis=-1) / backward_sum
    remainder = 1.0 - a_f**2
    shift = shift_b * (1.0 - 2.0 * a_b**2 / remainder**2) + shift_f * (
        (2.0 * remainder**2 + 4.0 * a_f**2 * a_b**2) / remainder**3
    )
    limit = 0.25 * np.pi
    numerator = a_b * np.sqrt(2.0 * wide_f**2 + wide_b**2) + a_b**3 * np.sqrt(
        2.0 * wide_f**2 + 3.0 * wide_b**2
    )
    width = (
        (1.0 + 0.7 * a_f**2)
        * numerator
        / np.maximum(a_b + a_b**3 * (2.0 * wide_f + 3.0 * wide_b), _SMALLEST)
    )
    return width, np.clip(shift, -limit, limit), wide_f


def spread_around(forward: Floats, backward: Floats, phi: Floats) -> Floats:
    """N of a lobe for light that comes from half a circle around its direction, (...).

    A raised cosine on each side: a lobe blurred over half a circle has hardly more detail.
    """
    cosine = np.cos(phi)
    return (forward * (1.0 - cosine) + backward * (1.0 + cosine)) / (2.0 * np.pi)


def half_gaussian(theta_h: Floats, shift: Floats, variance: Floats) -> Floats:
    """Half of the unit Gaussian of theta_h about -shift [rad], (...): Marschner's M_p."""
    variance = np.maximum(variance, _SMALLEST)
    return np.exp(-0.5 * (theta_h + shift) ** 2 / variance) / (
        2.0 * np.sqrt(2.0 * np.pi * variance)
    )


def dual_scattering(
    single: Floats,
    theta_i: Floats,
    theta_r: Floats,
    phi: Floats,
    forward: Floats,
    backward: Floats,
    tau: Floats,
    beyond: Floats,
    fibre: Fibre,
    density: float,
) -> Floats:
    """S of a strand among others, (..., 3): times irradiance and cos theta_i, it is radiance.

    Args:
        single: S of the strand alone, (..., 3).
        forward, backward: fractions at this theta_d by colour and lobe, (..., 3, 4).
        tau: strands between the place and the light, on average, (...).
        beyond: strands behind the place, seen from the light, (...).
        density: d_f and d_b of the paper.
    """
    theta_h, theta_d = 0.5 * (theta_i + theta_r), 0.5 * (theta_r - theta_i)
    squared = np.maximum(np.cos(theta_d), MIN_COSINE)[..., None] ** 2
    a_f, a_b = forward.sum(axis=-1), backward.sum(axis=-1)
    straight, scattered = straight_and_scattered(tau[..., None], a_f)
    # widths are the same for all colours: those of green
    width, shift, wide_f = backscatter_shape(forward[..., 1, :], backward[..., 1, :], fibre)
    added = np.maximum(tau, 1.0) * wide_f**2
    # what the strand itself sends back is in `single`
    stack = backscattered(a_f, a_b, 1.0 + beyond[..., None]) - backscattered(a_f, a_b, 1.0)
    back = np.maximum(stack, 0.0) / (np.pi * squared)
    back_straight = back * half_gaussian(theta_h, shift, width**2)[..., None]
    back_scattered = back * half_gaussian(theta_h, shift, width**2 + added)[..., None]
    around = spread_around(forward, backward, phi[..., None, None])
    widths = np.array(fibre.lobe_widths)
    shifts = np.array(fibre.lobe_shifts)
    along = half_gaussian(theta_h[..., None], shifts, widths**2 + added[..., None])
    forward_part = np.sum(along[..., None, :] * around, axis=-1) / squared
    return straight * (single + density * back_straight) + scattered * density * (
        forward_part + density * back_scattered
    )


def reflected_by_skin(
    phi: Floats,
    forward: Floats,
    backward: Floats,
    tau: Floats,
    beyond: Floats,
    facing: Floats,
    skin: Floats,
) -> Floats:
    """Light off the skin behind the hair that a strand sends to the eye, (..., 3): times
    irradiance, it is radiance.

    The skin is a Lambertian plane, with the hair above it. Light reaches it through tau + beyond
    strands, 1 / facing times as many along the slanted ray as straight up. The skin reflects it
    evenly, and it bounces between skin and hair. Of light from behind, a strand sends a_f to an eye
    on the light's side, and a_b to an eye on the other side.

    Args:
        forward, backward: fractions at this theta_d by colour and lobe, (..., 3, 4).
        tau: strands between the place and the light, on average, (...).
        beyond: strands behind the place, seen from the light, (...).
        facing: cosine between the light and the skin's normal, above 0 where it is lit, (...).
        skin: the skin's albedo, (3,); black where there is none.
    """
    facing = np.maximum(facing, 0.0)[..., None]
    a_f, a_b = forward.sum(axis=-1), backward.sum(axis=-1)
    behind = np.asarray(beyond)[..., None]
    strands = np.asarray(tau)[..., None] + behind * (1.0 + _DIFFUSIVITY * facing)
    lost = np.maximum(1.0 - skin * backscattered(a_f, a_b, behind), 1.0 - _MAX)
    lit = skin * facing / (np.pi * lost)
    cosine = np.cos(phi)[..., None]
    onward = 0.5 * (a_f * (1.0 + cosine) + a_b * (1.0 - cosine))
    return lit * np.exp(-strands * (1.0 - a_f)) * onward


def reflected_by_far_skin(
    outward: Floats,
    forward: Floats,
    backward: Floats,
    to_light: Floats,
    skin_seen: SkinSeen,
    skin: Floats,
) -> Floats:
    """Light off skin farther away that a strand sends to the eye, (..., 3): times irradiance, it is
    radiance.

    As `reflected_by_skin`, from the part of half of all directions that is skin. On the way strands
    scatter light back and forth, so that each attenuates it by sqrt((1 - a_f)^2 - a_b^2) (Kubelka
    and Munk 1931).

    Args:
        outward: cosine between the eye and the normal of the hair's volume, (...).
        forward, backward: fractions at this theta_d by colour and lobe, (..., 3, 4).
    """
    a_f, a_b = forward.sum(axis=-1), backward.sum(axis=-1)
    absorbed = np.sqrt(np.maximum((1.0 - a_f) ** 2 - a_b**2, 0.0))
    cosine = outward[..., None]
    onward = 0.5 * (a_f * (1.0 + cosine) + a_b * (1.0 - cosine))
    lit = 2.0 / np.pi * skin * far_skin_light(skin_seen.received, to_light)[..., None]
    return lit * through_hair(skin_seen.depth[..., None], absorbed) * onward


def scattering_light(
    tables: MarschnerTables,
    sides: Fractions,
    tangent: Floats,
    normal: Floats,
    to_light: Floats,
    to_eye: Floats,
    shift_noise: Floats,
    sparkle_noise: Floats,
    absorption: Floats,
    shading: ShadingSettings,
    density: float,
    skin: Floats,
    level: Floats | float = 0.0,
    tau: Floats | float = -1.0,
    beyond: Floats | float = DEFAULT_TAU_BEYOND,
    skin_seen: SkinSeen | None = None,
) -> Floats:
    """Light of one lamp that a strand among others sends to the eye, (..., 3).

    As look.marschner_light, without the colour that approximates light from strand to strand.

    Args:
        density: d_f and d_b of Zinke et al. 2008.
        skin: (3,), albedo of what lies behind the hair.
        skin_seen: skin seen from the strand; None: skin directly beneath alone, with the volume's
            normal.
    """
    angles = strand_angles(tangent, normal, to_light, to_eye, shift_noise, shading)
    single = single_scattering(tables, angles, sparkle_noise, absorption, shading, level)
    theta_i, theta_r, phi = angles
    cos_d = np.cos(0.5 * (theta_r - theta_i))
    straight = unscattered_fraction(normal, to_light, tau, shading)
    passed_tau = np.where(
        np.asarray(tau) < 0.0, -np.log(np.maximum(straight, _MIN_LIGHT)), np.asarray(tau)
    )
    forward = fractions_at(sides.forward, cos_d, absorption)
    backward = fractions_at(sides.backward, cos_d, absorption)
    scattered = dual_scattering(
        single,
        theta_i,
        theta_r,
        phi,
        forward,
        backward,
        passed_tau,
        np.asarray(beyond),
        fibre_of(shading),
        density,
    )
    skin_seen = skin_seen or plane_beneath(normal)
    facing = np.sum(skin_seen.beneath * to_light, axis=-1)
    outward = np.sum(normal * to_eye, axis=-1)
    return (
        scattered * np.cos(theta_i)[..., None]
        + reflected_by_skin(phi, forward, backward, passed_tau, np.asarray(beyond), facing, skin)
        + reflected_by_far_skin(outward, forward, backward, to_light, skin_seen, skin)
    )
