"""The hair fibre of Marschner's model: a dielectric cylinder with tilted scales and pigment.

Reference: Marschner, Jensen, Cammarano, Worley and Hanrahan 2003, "Light Scattering from Human
Hair Fibers", sections 4 and 5 and table 1.

Angles. T points from root to tip. An inclination theta is the angle of a direction above the
plane across the fibre, positive towards the TIP, in [-pi/2, pi/2]; phi is the azimuth around T
between the two directions, 0 when light comes back where it came from and pi when it goes on.
Both directions point away from the fibre. theta_h = (theta_i + theta_r) / 2 and
theta_d = (theta_r - theta_i) / 2.

The tilt. The scales open towards the tip, so their outer normals lean to the root by the tilt.
Light across the fibre leaves R leaning to the root by 2 tilts, TT to the tip by 1 and TRT to the
tip by 4 (Chiang et al. 2016; Marschner's table gives TRT 3, two-dimensional ray tracing 4.2 for
an index of 1.55). The eye must stand where the ray goes, so it sees the opposite: on a head the
HIGHLIGHT of R lies nearer to the tip and that of TRT nearer to the root. Offsets here refer to
highlights, as in Kajiya-Kay: positive moves a highlight to the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError

#: Below this index all light would leave in one direction, and N_TT would have no bounds.
MIN_INDEX = 1.01

#: Standard deviation of theta_h below which a lobe would be a spike, [rad]
MIN_WIDTH = np.radians(0.5)

#: Minimum of tilts and offsets, towards the root, [rad]; the settings end at 45 degrees
_MAX_TURNED = -1.0


@dataclass(frozen=True, kw_only=True)
class Fibre:
    """How one kind of hair scatters light; angles are in radians.

    Args:
        index_of_refraction: of the hair relative to what surrounds it, 1 or more.
        absorption: red, green, blue, per fibre RADIUS, as in Blender's Principled Hair: light that
            crosses the axis keeps exp(-2 absorption).
        cuticle_tilt: angle of the scales.
        width_r, width_tt, width_trt: standard deviation of theta_h. A highlight's spread in
            theta_r is twice as wide. Widths under MIN_WIDTH count as that.
        offset_r, offset_tt, offset_trt: moves a highlight towards the tip, in theta_h, in addition
            to the tilt.
        strength_r, strength_tt, strength_trt, strength_higher: factor of a lobe; 1 is physical.
            `higher` is light reflected inside twice or more.
        eccentricity: one axis of the cross-section over the other, 1 for a round hair. It acts
            on TRT through a changed index only (Marschner section 5.2.3).
        glint_width: w_c, standard deviation in phi of the blurred caustics of TRT; 0 leaves them
            sharp and unbounded.
        glint_strength: k_G; 1 gives back the energy that blurring takes out.
        glint_fade: Delta eta', how far beyond index 2, where caustics end, glints fade out.
        azimuthal_width: standard deviation in phi by which a rough surface spreads each lobe.

    Raises:
        HairloomError: a value is too small or not finite.
    """

    index_of_refraction: float = 1.55
    absorption: tuple[float, float, float] = (0.25, 0.42, 0.83)
    cuticle_tilt: float = np.radians(3.0)
    width_r: float = np.radians(5.0)
    width_tt: float = np.radians(3.0)
    width_trt: float = np.radians(8.0)
    offset_r: float = 0.0
    offset_tt: float = 0.0
    offset_trt: float = 0.0
    strength_r: float = 1.0
    strength_tt: float = 1.0
    strength_trt: float = 1.0
    strength_higher: float = 1.0
    eccentricity: float = 1.0
    glint_width: float = np.radians(10.0)
    glint_strength: float = 1.0
    glint_fade: float = 0.3
    azimuthal_width: float = 0.0

    def __post_init__(self) -> None:
        limits = {
            "index_of_refraction": 1.0,
            "eccentricity": 0.1,
            **dict.fromkeys(("width_r", "width_tt", "width_trt"), 0.0),
            **dict.fromkeys(("strength_r", "strength_tt", "strength_trt", "strength_higher"), 0.0),
            **dict.fromkeys(("glint_width", "glint_strength", "glint_fade"), 0.0),
            "azimuthal_width": 0.0,
            **dict.fromkeys(("cuticle_tilt", "offset_r", "offset_tt", "offset_trt"), _MAX_TURNED),
        }
        for name, minimum in limits.items():
            _require(name, getattr(self, name), minimum)
        if len(self.absorption) != 3:
            raise HairloomError(
                f"absorption has {len(self.absorption)} values",
                place="hair fibre",
                remedy="Give red, green and blue",
            )
        for value in self.absorption:
            _require("absorption", value, 0.0)

    @property
    def widths(self) -> tuple[float, float, float]:
        """Standard deviations of theta_h of R, TT and TRT, at least MIN_WIDTH."""
        minimum = float(MIN_WIDTH)
        return (
            max(self.width_r, minimum),
            max(self.width_tt, minimum),
            max(self.width_trt, minimum),
        )

    @property
    def highlight_shifts(self) -> tuple[float, float, float]:
        """Shifts of the highlights of R, TT and TRT towards the tip; a lobe peaks at minus its
        shift.

        In theta_h, so half of the change of theta_r: +1, -1/2 and -2 tilts, and the offsets.
        """
        tilt = self.cuticle_tilt
        return (
            self.offset_r + tilt,
            self.offset_tt - 0.5 * tilt,
            self.offset_trt - 2.0 * tilt,
        )

    @property
    def strengths(self) -> tuple[float, float, float, float]:
        """Factors of R, TT, TRT and the rest."""
        return (self.strength_r, self.strength_tt, self.strength_trt, self.strength_higher)

    @property
    def lobe_widths(self) -> tuple[float, float, float, float]:
        """Widths of R, TT, TRT and the rest, which is spread as TRT is."""
        return (*self.widths, self.widths[2])

    @property
    def lobe_shifts(self) -> tuple[float, float, float, float]:
        """Shifts of R, TT, TRT and the rest, see highlight_shifts."""
        return (*self.highlight_shifts, self.highlight_shifts[2])


def directions_to_angles(
    tangent: Floats, to_light: Floats, to_eye: Floats
) -> tuple[Floats, Floats, Floats]:
    """theta_i, theta_r and |phi| of unit vectors (..., 3) in one space; each (...)."""
    sin_i = np.clip(np.sum(tangent * to_light, axis=-1), -1.0, 1.0)
    sin_r = np.clip(np.sum(tangent * to_eye, axis=-1), -1.0, 1.0)
    across_light = to_light - tangent * sin_i[..., None]
    across_eye = to_eye - tangent * sin_r[..., None]
    cosine = np.sum(across_light * across_eye, axis=-1)
    sine = np.linalg.norm(np.cross(across_light, across_eye), axis=-1)
    return np.arcsin(sin_i), np.arcsin(sin_r), np.arctan2(sine, cosine)


def _require(name: str, value: float, minimum: float) -> None:
    if not (np.isfinite(value) and value >= minimum):
        raise HairloomError(
            f"{name} is {value}", place="hair fibre", remedy=f"Give a number from {minimum:.3g} up"
        )
