"""M_p: how far light leaves the cone on which a smooth fibre would scatter it.

With S = sum of M_p N_p / cos^2 theta_d, the power that leaves the fibre for unit power coming in
is the integral of S cos^2 theta_r dtheta_r dphi: one cosine for the width that the fibre shows to
the eye, one for the solid angle. So M_p is normalised in this measure:

    integral of M_p(theta_i, theta_r) cos^2 theta_r / cos^2 theta_d dtheta_r = 1, for each theta_i.

Marschner's Gaussian of theta_h fulfils this only for narrow lobes across the fibre; at grazing
light it gains energy on one side and loses it beyond the ends on the other. d'Eon et al. 2011 fix
this with a kernel on the sphere, whose measure has one cosine; ours has two, which is the measure
of the sphere in four dimensions. The same step there (von Mises-Fisher, concentration k) gives

    M / cos^2 theta_d = k / (pi I1(k)) exp(-k sin_i sin_r) sinh(k cos_i cos_r) / (k cos_i cos_r),

normalised exactly at every width, and reciprocal. With k = 1 / (2 width)^2 its narrow limit is
Marschner's Gaussian: half of the unit Gaussian of theta_h, since theta_r changes twice as fast as
theta_h.

The tilt turns both directions by the shift, and the lobe is normalised in the measure of the
turned directions. In the measure of the true ones it gains energy on one side and loses it on the
other, by 2 tan theta_i tan shift: no tilted lobe can be reciprocal and keep all light at every
angle, since S(a, b) = S(b, a) while the measure differs at a and b. (Spreading the loss evenly, as
Kelemen and Szirmay-Kalos 2001 do, shows as a haze over the head, so it stays lost.) Moreover
Fresnel's terms change within the width of a lobe at grazing light. So in a fibre each M_p is
multiplied by balance_i balance_r, which is reciprocal: the factor that makes the lobes of a clear
fibre sum to 1 at theta or at -theta, whichever has more (Sinkhorn and Knopp 1967), limited so that
no theta sends out more than came in.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats
from .fibre import Fibre
from .interface import lobe_energy

_SMALLEST = 1e-12
_BALANCE_STEPS = 120
_BALANCE_ROUNDS = 8


@dataclass(frozen=True)
class LongitudinalLobe:
    """One M_p as a function.

    Args:
        concentration: k of the kernel.
        shift: of the highlight towards the tip, in theta_h, [rad].
        factor: k e^k / (pi I1(k)).
        balance: factor at even steps of theta from -pi/2 to pi/2, for both directions; None: 1.
    """

    concentration: float
    shift: float
    factor: float
    balance: Floats | None = None

    def __call__(self, theta_i: Floats, theta_r: Floats) -> Floats:
        """M_p, (...), of inclinations that broadcast, [rad]."""
        turned_i, turned_r = theta_i + self.shift, theta_r + self.shift
        both = np.maximum(np.cos(turned_i), 0.0) * np.maximum(np.cos(turned_r), 0.0)
        exponent = both - np.sin(turned_i) * np.sin(turned_r) - 1.0
        twice = np.maximum(2.0 * self.concentration * both, _SMALLEST)
        kernel = self.factor * np.exp(self.concentration * exponent) * -np.expm1(-twice) / twice
        lobe = kernel * np.cos(0.5 * (theta_r - theta_i)) ** 2
        if self.balance is None:
            return lobe
        ends = np.linspace(-0.5 * np.pi, 0.5 * np.pi, len(self.balance))
        balance_i = np.interp(theta_i, ends, self.balance)
        return lobe * balance_i * np.interp(theta_r, ends, self.balance)


def longitudinal_lobe(width: float, shift: float) -> LongitudinalLobe:
    """M_p of a width, the standard deviation of theta_h, and a highlight's shift to the tip."""
    concentration = 1.0 / (2.0 * width) ** 2
    return LongitudinalLobe(concentration, shift, _kernel_factor(concentration))


def longitudinal_lobes(fibre: Fibre) -> tuple[LongitudinalLobe, ...]:
    """M_R, M_TT and M_TRT, balanced with one another; the rest has that of TRT."""
    pairs = zip(fibre.widths, fibre.highlight_shifts, strict=True)
    lobes = [longitudinal_lobe(width, shift) for width, shift in pairs]
    balance = _balance(lobes, fibre.index_of_refraction)
    return tuple(replace(lobe, balance=balance) for lobe in lobes)


def _balance(lobes: list[LongitudinalLobe], index: float) -> Floats:
    """Factor of all lobes at even steps of theta, from the energy that a clear fibre would send
    out.

    The last line only lowers it. Without a tilt every theta then sends out all light, to 1e-3.
    """
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _BALANCE_STEPS + 1)
    theta_r = 0.5 * (theta[1:] + theta[:-1])
    theta_d = 0.5 * (theta_r - theta[:, None])
    measure = np.cos(theta_r) ** 2 / np.cos(theta_d) ** 2 * (np.pi / _BALANCE_STEPS)
    steep = np.linspace(0.0, 0.5 * np.pi, 49)
    energies = [lobe_energy(order, np.cos(steep), index, (0.0, 0.0, 0.0))[:, 0] for order in (0, 1)]
    energies.append(1.0 - energies[0] - energies[1])  # TRT and the rest
    kept = np.zeros_like(theta_d)
    for lobe, energy in zip(lobes, energies, strict=True):
        kept += lobe(theta[:, None], theta_r) * np.interp(np.abs(theta_d), steep, energy) * measure
    balance = np.ones_like(theta)
    for _ in range(_BALANCE_ROUNDS):
        fraction = balance * (kept @ np.interp(theta_r, theta, balance))
        balance = balance / np.sqrt(np.maximum(fraction, fraction[::-1]))
    fraction = balance * (kept @ np.interp(theta_r, theta, balance))
    return balance / np.maximum(fraction, 1.0)


def _kernel_factor(concentration: float) -> float:
    """k e^k / (pi I1(k)) from the integral of exp(k (cos t - 1)) sin^2 t over half a circle."""
    step = np.pi / 2048
    angle = (np.arange(2048) + 0.5) * step
    decay = np.exp(concentration * (np.cos(angle) - 1.0))
    return float(1.0 / (np.sum(decay * np.sin(angle) ** 2) * step))
