"""N_p: how a fibre spreads light around itself, for each cone theta_d.

Light that meets the fibre at h = sin gamma (h in [-1, 1] across its width) leaves it turned by

    phi(p, h) = 2 p gamma_t - 2 gamma + p pi.

N_p(phi) = sum over all h that lead to phi of A(p, h) / |2 dphi/dh|, so that the integral of N_p
over the circle is the mean of A(p, h) over h, and the lobes of a clear fibre add up to 1. R and
TT have one such h, in closed form. TRT has up to three, found by Newton's method between the
turning points of phi(2, h), where its caustics are.

References:
    Marschner et al. 2003, section 5.2 and appendix A: N_p and the blurred caustics.
    d'Eon et al. 2011, section 4: the lobes as an energy balance.

Differences: Marschner estimates a caustic's energy from its curvature and a largest width; here it
is the energy that the fade removes, integrated over h, where there is no pole. So a glint strength
of 1 keeps the energy, per colour. For an elliptic fibre, another index sets only the shape of TRT,
not its energy, which would no longer add up with R and TT.

All functions take arrays that broadcast: cos theta_d and phi in [rad].
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from .fibre import MIN_INDEX, Fibre
from .interface import (
    attenuation,
    bravais_index,
    fresnel,
    higher_lobes_energy,
    lobe_energy,
    quarter_turn_quadrature,
    refracted,
)

#: values of cos 2 phi_h that average over a full turn (Gauss-Chebyshev, to degree 7)
_TWIST = tuple(np.cos((np.arange(4) + 0.5) * np.pi / 4.0))

_LAPS = (-2.0 * np.pi, 0.0, 2.0 * np.pi)
_NEWTON_STEPS = 5
_MIN_SLOPE = 1e-6


def azimuthal_r(cos_d: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """N_R, (...): a mirror, gamma = -phi / 2, dphi/dh = -2 / cos gamma."""
    gamma = 0.5 * _folded(phi)
    bravais = bravais_index(fibre.index_of_refraction, cos_d)
    return (
        0.25 * np.maximum(np.cos(gamma), 0.0) * fresnel(gamma, fibre.index_of_refraction, bravais)
    )


def azimuthal_tt(cos_d: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """N_TT, (..., 3): straight on at phi = pi, and up to the angle at which h = 1 leaves.

    gamma - gamma_t = (pi - phi) / 2 =: turn, and with Snell's law
    tan gamma = eta' sin turn / (eta' cos turn - 1).
    """
    turn = 0.5 * (np.pi - _folded(phi))
    bravais = bravais_index(fibre.index_of_refraction, cos_d)
    reach = bravais * np.cos(turn) - 1.0
    gamma = np.arctan2(bravais * np.sin(turn), np.maximum(reach, 0.0))
    density = np.where(reach > 0.0, _density(1, gamma, bravais), 0.0)
    kept = attenuation(1, gamma, cos_d, fibre.index_of_refraction, fibre.absorption)
    return density[..., None] * kept


def azimuthal_trt(
    cos_d: Floats, phi: Floats, fibre: Fibre, half_azimuth: float | None = None
) -> Floats:
    """N_TRT, (..., 3), with its caustics blurred.

    Args:
        half_azimuth: phi_h, middle of the two directions' azimuths, from the longer axis of the
            cross-section, [rad]. Without it, the mean over a strand that twists freely.
    """
    ratio = fibre.eccentricity
    if ratio == 1.0:
        return _blurred_trt(cos_d, phi, fibre, np.asarray(fibre.index_of_refraction))
    turns = _TWIST if half_azimuth is None else [np.cos(2.0 * half_azimuth)]
    lobes = [
        _blurred_trt(cos_d, phi, fibre, elliptic_index(fibre.index_of_refraction, ratio, turn))
        for turn in turns
    ]
    return np.mean(lobes, axis=0) * _round_fraction(np.asarray(cos_d), fibre)


def azimuthal_higher(cos_d: Floats, fibre: Fibre) -> Floats:
    """N_rest, (..., 3): all lobes after TRT, spread evenly over the circle.

    Each is weaker than the one before by Fresnel's reflectance, and all look alike (d'Eon et al.
    2011, section 4; Chiang et al. 2016 combine them too).
    """
    return higher_lobes_energy(cos_d, fibre.index_of_refraction, fibre.absorption) / (2.0 * np.pi)


def elliptic_index(index: float, ratio: float, cos_double: float) -> Floats:
    """The index with which a round fibre has the TRT of an elliptic one.

    Marschner et al. 2003, section 5.2.3, at cos 2 phi_h; not less than MIN_INDEX.
    """
    narrow = 2.0 * (index - 1.0) * ratio**2 - index + 2.0
    wide = 2.0 * (index - 1.0) / ratio**2 - index + 2.0
    middle = 0.5 * ((narrow + wide) + cos_double * (narrow - wide))
    return np.maximum(middle, MIN_INDEX)


def trt_turn(gamma: Floats, bravais: Floats) -> Floats:
    """phi(2, h) - 2 pi = 4 gamma_t - 2 gamma, odd in gamma, within [-pi, pi]."""
    return 4.0 * refracted(gamma, bravais) - 2.0 * gamma


def trt_caustic(bravais: Floats) -> tuple[Floats, Floats]:
    """gamma and phi of TRT's caustic, where phi(2, h) turns; both 0 from index 2 up."""
    cosine = np.sqrt(np.clip((bravais**2 - 1.0) / 3.0, 0.0, 1.0))
    gamma = np.arccos(cosine)
    return gamma, np.maximum(trt_turn(gamma, bravais), 0.0)


def _round_fraction(cos_d: Floats, fibre: Fibre) -> Floats:
    """Energy of TRT if the fibre were round, over that of a twisted elliptic one, (..., 1)."""
    own = fibre.index_of_refraction
    others = [elliptic_index(own, fibre.eccentricity, turn) for turn in _TWIST]
    energies = [lobe_energy(2, cos_d, index, (0.0, 0.0, 0.0))[..., :1] for index in others]
    return lobe_energy(2, cos_d, own, (0.0, 0.0, 0.0))[..., :1] / np.mean(energies, axis=0)


def _blurred_trt(cos_d: Floats, phi: Floats, fibre: Fibre, index: Floats) -> Floats:
    phi = _folded(phi)
    raw = _raw_trt(cos_d, phi, fibre, index)
    width = fibre.glint_width
    if width == 0.0:
        return raw
    bravais = bravais_index(index, cos_d)
    caustic = trt_caustic(bravais)[1]
    past = np.clip((bravais - 2.0) / max(fibre.glint_fade, 1e-9), 0.0, 1.0)
    blur = 1.0 - past * past * (3.0 - 2.0 * past)
    removed = _removed_energy(np.asarray(cos_d), caustic, blur, fibre, index)
    near, far = _bells(phi, caustic, width)
    glint = (near + far) * (fibre.glint_strength / (2.0 * np.sqrt(2.0 * np.pi) * width))
    return raw * _fade(near, far, blur)[..., None] + removed * glint[..., None]


def _removed_energy(
    cos_d: Floats, caustic: Floats, blur: Floats, fibre: Fibre, index: Floats
) -> Floats:
    """Energy that the fade takes out of N_TRT, (..., 3), summed over h."""
    gamma, weight = quarter_turn_quadrature()
    cone = cos_d[..., None]
    turn = trt_turn(gamma, bravais_index(index, cone))
    near, far = _bells(turn, caustic[..., None], fibre.glint_width)
    fade = _fade(near, far, blur[..., None])
    kept = attenuation(2, gamma, cone, index, fibre.absorption)
    return np.sum(kept * ((1.0 - fade) * weight * np.cos(gamma))[..., None], axis=-2)


def _fade(near: Floats, far: Floats, blur: Floats) -> Floats:
    return (1.0 - blur * np.minimum(near, 1.0)) * (1.0 - blur * np.minimum(far, 1.0))


def _bells(phi: Floats, caustic: Floats, width: float) -> tuple[Floats, Floats]:
    """exp(-angle^2 / 2 width^2) of the angles to both caustics, summed over the circle's laps."""
    near, far = (
        np.sum([np.exp(-0.5 * ((angle + lap) / width) ** 2) for lap in _LAPS], axis=0)
        for angle in (phi - caustic, phi + caustic)
    )
    return near, far


def _raw_trt(cos_d: Floats, phi: Floats, fibre: Fibre, index: Floats) -> Floats:
    """N_TRT with its poles, for phi in [0, pi]: the sum over the roots between turning points.

    By symmetry, the piece below -gamma_c sends to phi what the piece above gamma_c sends to -phi.
    """
    cone, azimuth = np.broadcast_arrays(cos_d, phi)
    bravais = bravais_index(index, cone)
    gamma_c, caustic = trt_caustic(bravais)
    edge = np.full_like(gamma_c, 0.5 * np.pi)
    last = trt_turn(edge, bravais)
    zero = np.zeros_like(gamma_c)
    pieces = (
        (azimuth, zero, zero, azimuth < caustic),
        (azimuth, edge, last, (azimuth < caustic) & (azimuth >= last)),
        (-azimuth, edge, last, -azimuth >= last),
    )
    total = np.zeros((*cone.shape, len(fibre.absorption)))
    for target, end, end_turn, is_met in pieces:
        place = np.nonzero(is_met)
        top = (gamma_c[place], caustic[place])
        gamma = _root(target[place], top, (end[place], end_turn[place]), bravais[place])
        kept = attenuation(2, gamma, cone[place], index, fibre.absorption)
        total[place] += _density(2, gamma, bravais[place])[..., None] * kept
    return total


def _root(
    target: Floats, top: tuple[Floats, Floats], end: tuple[Floats, Floats], bravais: Floats
) -> Floats:
    """gamma, between a turning point and the end of its piece, at which trt_turn equals the target.

    Newton's method, from the parabola with trt_turn's value and slope at the turning point and its
    value at the end. (From index 2 up the turn falls from gamma = 0 on, where its slope is not 0.)
    The error in turn is below 2e-6.

    Args:
        top, end: gamma and turn of both.
    """
    span = np.abs(end[0] - top[0])
    slope = 2.0 - 4.0 * np.cos(top[0]) / np.sqrt(bravais**2 - np.sin(top[0]) ** 2)
    bend = (top[1] - end[1] - slope * span) / np.maximum(span, _MIN_SLOPE) ** 2
    due = top[1] - target
    reach = np.sqrt(np.maximum(slope**2 + 4.0 * bend * due, 0.0))
    step = 2.0 * due / np.maximum(slope + reach, _MIN_SLOPE)
    gamma = top[0] + np.sign(end[0] - top[0]) * step
    low, high = np.minimum(top[0], end[0]), np.maximum(top[0], end[0])
    for _ in range(_NEWTON_STEPS):
        gamma = np.clip(gamma, low, high)
        sine = np.sin(gamma)
        cosine = np.sqrt(np.maximum(bravais**2 - sine**2, 1e-12))
        excess = 4.0 * np.arcsin(sine / bravais) - 2.0 * gamma - target
        slope = 4.0 * np.cos(gamma) / cosine - 2.0
        gamma = gamma - excess / np.where(np.abs(slope) < _MIN_SLOPE, _MIN_SLOPE, slope)
    return np.clip(gamma, low, high)


def _density(order: int, gamma: Floats, bravais: Floats) -> Floats:
    """1 / |2 dphi/dh|, from dphi/dgamma = 2 p cos gamma / (eta' cos gamma_t) - 2."""
    cosine = np.maximum(np.cos(gamma), 0.0)
    slope = 2.0 * order * cosine / (bravais * np.cos(refracted(gamma, bravais))) - 2.0
    return 0.5 * cosine / np.maximum(np.abs(slope), _MIN_SLOPE)


def _folded(phi: Floats) -> Floats:
    """|phi| after whole turns, in [0, pi]: the lobes of a round fibre are even."""
    return np.abs(np.remainder(np.asarray(phi) + np.pi, 2.0 * np.pi) - np.pi)
