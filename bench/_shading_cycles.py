"""Our fibre's lobes against those of Cycles' Principled Hair (Chiang's model).

One straight strand, one sun, and a camera: for each pair of directions the mean radiance over the
strand's width, divided by the sun's irradiance, which is S cos theta_i. Azimuthally, Cycles uses a
logistic distribution; ours is the Gaussian nearest to it. R is measured on black hair; TT and TRT
are what a fibre of little pigment shows beyond R. The usual hair's TRT is so wide that the angle
used in Fresnel's terms matters, so it is measured separately, also with Cycles' angle.

Angles and widths are read off profiles, in degrees: the position of the peak, and the full width at
half maximum over 2.355. Longitudinally they are angles of theta_h.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from _shading_room import CyclesRoom

from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.longitudinal import longitudinal_lobes
from hairloom.addon.shading.marschner.look import fibre_of
from hairloom.addon.shading.marschner.principled import PrincipledHair, settings_from
from hairloom.addon.shading.marschner.scattering import azimuthal_lobes

BLACK = (100.0, 100.0, 100.0)
BLOND = (0.06, 0.12, 0.3)
#: of a picture that the strand nearly fills [pixels]
SIZE = 32
GAUSSIAN_FWHM = 2.3548


@dataclass(frozen=True)
class Hair:
    """Principled Hair's inputs; offset in [rad]."""

    roughness: float
    offset: float
    around: float = 0.3

    def fibre(self, absorption: tuple[float, float, float]) -> Fibre:
        """Our fibre for the same hair, as an artist gets it from the node."""
        node = PrincipledHair(
            parametrization="ABSORPTION",
            absorption_coefficient=absorption,
            roughness=self.roughness,
            radial_roughness=self.around,
            offset=self.offset,
        )
        return fibre_of(settings_from(node)[0])


@dataclass(frozen=True)
class Scan:
    """A path through the directions: the three angles at each `place` along it [degrees]."""

    lobe: str
    place: np.ndarray
    theta_i: np.ndarray
    theta_r: np.ndarray
    phi: np.ndarray

    @classmethod
    def along(cls, lobe: str, half_difference: float, phi: float) -> Scan:
        """theta_h from -45 to 45 degrees at a fixed theta_d and phi."""
        half = np.arange(-46.0, 47.0, 2.0)
        theta_h, theta_d = np.radians(half), np.radians(half_difference)
        return cls(lobe, half, theta_h - theta_d, theta_h + theta_d, np.full_like(half, phi))

    @classmethod
    def around(cls, lobe: str) -> Scan:
        """phi from 60 to 300 degrees, in the plane across the strand."""
        turn = np.arange(60.0, 301.0, 4.0)
        nought = np.zeros_like(turn)
        return cls(lobe, turn, nought, nought, np.radians(turn))


SCANS = {
    "r": Scan.along("r", -10.0, 0.0),
    "r_slanted": Scan.along("r", -25.0, 0.0),
    "trt": Scan.along("trt", -10.0, 0.0),
    "tt": Scan.along("tt", 10.0, np.pi),
    "tt_around": Scan.around("tt"),
}
HAIRS = (
    Hair(0.15, 0.0),
    Hair(0.15, float(np.radians(3.0))),
    Hair(0.2, float(np.radians(2.0)), around=0.5),
)
#: Principled Hair with its defaults: its TRT is 17 degrees wide
USUAL = Hair(0.3, float(np.radians(2.0)))


def lobe_figures() -> dict[str, Any]:
    """The worst differences in degrees, per scan and overall; and ratios of our radiance to
    Cycles'."""
    room = CyclesRoom()
    room.strands(np.array([[[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]]]), 0.45)
    found: dict[str, Any] = {}
    for name, scan in SCANS.items():
        pairs = [
            (peak_of(scan.place, our_profile(scan, hair)), peak_of(scan.place, theirs))
            for hair, theirs in ((hair, cycles_profile(room, scan, hair)) for hair in HAIRS)
        ]
        found[f"cycles_{name}_degrees"] = max(_degrees_apart(*pair) for pair in pairs)
        levels = [ours[2] / theirs[2] for ours, theirs in pairs]
        found[f"cycles_{name}_level_least"] = min(levels)
        found[f"cycles_{name}_level_most"] = max(levels)
    found["cycles_lobe_degrees"] = max(found[f"cycles_{name}_degrees"] for name in SCANS)
    scan = SCANS["trt"]
    theirs = peak_of(scan.place, cycles_profile(room, scan, USUAL))
    for name, is_their_way in (("", False), ("_their_way", True)):
        ours = peak_of(scan.place, our_profile(scan, USUAL, is_their_way))
        found[f"cycles_usual_trt_degrees{name}"] = _degrees_apart(ours, theirs)
    return found | {"cycles_noise": noise(room)}


def cycles_profile(room: CyclesRoom, scan: Scan, hair: Hair) -> np.ndarray:
    """A lobe's green radiance along a scan, extracted from that of the whole fibre."""

    def shown(absorption: tuple[float, float, float]) -> np.ndarray:
        room.hair(
            absorption,
            Roughness=hair.roughness,
            Radial_Roughness=hair.around,
            Offset=hair.offset,
        )
        directions = zip(scan.theta_i, scan.theta_r, scan.phi, strict=True)
        return np.array([strand_radiance(room, *angles) for angles in directions])

    black = shown(BLACK)
    return black if scan.lobe == "r" else shown(BLOND) - black


def our_profile(scan: Scan, hair: Hair, is_their_way: bool = False) -> np.ndarray:
    """The same for our fibre.

    Args:
        is_their_way: azimuthal scattering depends on theta_r, as in Cycles, which is not
            reciprocal; in Marschner's model and ours it depends on theta_d.
    """
    theta_d = 0.5 * (scan.theta_r - scan.theta_i)
    cone = np.cos(scan.theta_r if is_their_way else theta_d)

    def shown(absorption: tuple[float, float, float]) -> np.ndarray:
        fibre = hair.fibre(absorption)
        lobes = longitudinal_lobes(fibre)
        along = np.stack([lobe(scan.theta_i, scan.theta_r) for lobe in lobes], axis=-1)
        around = azimuthal_lobes(cone, scan.phi, fibre)[..., 1]
        scattered = np.sum(along[..., [0, 1, 2, 2]] * around, axis=-1)
        return scattered * np.cos(scan.theta_i) / np.cos(theta_d) ** 2

    black = shown(BLACK)
    return black if scan.lobe == "r" else shown(BLOND) - black


def strand_radiance(
    room: CyclesRoom, theta_i: float, theta_r: float, phi: float, seed: int = 0
) -> float:
    """Mean green radiance over the strand's width, for a sun of 1 W/m^2."""
    strand = np.array([np.cos(theta_r), 0.0, np.sin(theta_r)])
    to_eye = np.array([-np.sin(theta_r), 0.0, np.cos(theta_r)])  # across the strand
    aside = np.array([0.0, -1.0, 0.0])
    around = np.cos(phi) * to_eye + np.sin(phi) * aside
    room.tilt(theta_r)
    room.sun(np.sin(theta_i) * strand + np.cos(theta_i) * around)
    pixels = room.picture(SIZE, 1.0, seed)
    return float(pixels[..., 1].sum() / pixels[..., 3].sum())


def noise(room: CyclesRoom) -> float:
    """Relative standard deviation of a radiance over eight seeds."""
    room.hair(BLOND, Roughness=0.15, Radial_Roughness=0.3, Offset=0.0)
    seen = [strand_radiance(room, 0.1, 0.0, 0.1, seed) for seed in range(8)]
    return float(np.std(seen) / np.mean(seen))


def peak_of(place: np.ndarray, profile: np.ndarray) -> tuple[float, float, float]:
    """Where a profile is highest, its width as that of a Gaussian, and its height.

    The peak is a parabola through the logarithms of the three highest samples; at half maximum,
    samples are interpolated linearly.
    """
    top = int(np.clip(profile.argmax(), 1, len(profile) - 2))
    step = place[1] - place[0]
    low, middle, high = np.log(np.maximum(profile[top - 1 : top + 2], 1e-12))
    bend = low - 2.0 * middle + high
    aside = 0.5 * (low - high) / bend
    height = float(np.exp(middle - 0.25 * (low - high) * aside))
    above = np.flatnonzero(profile > 0.5 * height)
    first, last = above[0], above[-1]
    start = np.interp(0.5 * height, profile[first - 1 : first + 1], place[first - 1 : first + 1])
    end = np.interp(-0.5 * height, -profile[last : last + 2], place[last : last + 2])
    return float(place[top] + aside * step), float((end - start) / GAUSSIAN_FWHM), height


def _degrees_apart(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    """The larger of the differences in place and in width."""
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]))
