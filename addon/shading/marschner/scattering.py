"""S, the scattering function of a fibre, without the approximation of the tables: the reference.

Reference: Marschner et al. 2003, section 3.2: S = sum over the lobes of M_p N_p / cos^2 theta_d.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from .azimuthal import azimuthal_higher, azimuthal_r, azimuthal_trt, azimuthal_tt
from .fibre import Fibre
from .interface import MIN_COSINE
from .longitudinal import longitudinal_lobes

#: Maximum step of the mean over azimuthal_width, [rad]
_SPREAD_STEP = np.radians(1.0)
_SPREAD_REACH = 4.5
_AT_ONCE = 32


def marschner(theta_i: Floats, theta_r: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """S(theta_i, theta_r, phi), (..., 3), without tables.

    Times irradiance across the light and cos theta_i, it is the fibre's radiance.
    """
    theta_i, theta_r = np.asarray(theta_i), np.asarray(theta_r)
    cos_d = np.cos(0.5 * (theta_r - theta_i))
    along = np.stack([lobe(theta_i, theta_r) for lobe in longitudinal_lobes(fibre)], axis=-1)
    factors = np.array(fibre.strengths) * along[..., [0, 1, 2, 2]]
    squared = np.maximum(cos_d, MIN_COSINE)[..., None] ** 2
    return np.sum(factors[..., None] * azimuthal_lobes(cos_d, phi, fibre), axis=-2) / squared


def azimuthal_lobes(cos_d: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """N_R, N_TT, N_TRT and N_rest, (..., 4, 3), spread by azimuthal_width.

    d'Eon et al. 2011, section 5: a rough surface turns the smooth lobes by a Gaussian of phi.
    """
    if fibre.azimuthal_width == 0.0:
        return _smooth_lobes(cos_d, phi, fibre)
    width = fibre.azimuthal_width
    count = int(np.ceil(_SPREAD_REACH * width / min(_SPREAD_STEP, 0.25 * width)))
    turns = np.linspace(-_SPREAD_REACH, _SPREAD_REACH, 2 * count + 1)
    weights = np.exp(-0.5 * turns**2)
    weights /= weights.sum()
    lobes = np.zeros((*np.broadcast_shapes(np.shape(cos_d), np.shape(phi)), 4, 3))
    cone, azimuth = np.asarray(cos_d)[..., None], np.asarray(phi)[..., None]
    for some in np.array_split(np.arange(len(turns)), int(np.ceil(len(turns) / _AT_ONCE))):
        turned = _smooth_lobes(cone, azimuth + turns[some] * width, fibre)
        lobes += np.einsum("t,...tpc->...pc", weights[some], turned)
    return lobes


def _smooth_lobes(cos_d: Floats, phi: Floats, fibre: Fibre) -> Floats:
    """The same for azimuthal_width 0."""
    lobes = np.empty((*np.broadcast_shapes(np.shape(cos_d), np.shape(phi)), 4, 3))
    lobes[..., 0, :] = azimuthal_r(cos_d, phi, fibre)[..., None]
    lobes[..., 1, :] = azimuthal_tt(cos_d, phi, fibre)
    lobes[..., 2, :] = azimuthal_trt(cos_d, phi, fibre)
    lobes[..., 3, :] = azimuthal_higher(cos_d, fibre)
    return lobes
