"""Marschner's model by the settings: the fibre, each strand's absorption, the light it sends out.

Twin of gpu_shaders/lib_marschner.glsl: same names, same order.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from ..kajiya_kay import diffuse_bias, shifted_tangent
from ..settings import ShadingSettings
from ..tint import tip_fraction
from .fibre import Fibre, directions_to_angles
from .pigment import COLOR_FACTOR, absorption_color, color_absorption, melanin_absorption
from .tables import MarschnerTables, look_up

#: Fraction of the pigment, averaged over the colours, that a grey strand keeps: it is white, not
#: glass.
GREY_ABSORPTION = 0.04


def fibre_of(settings: ShadingSettings) -> Fibre:
    """The fibre of the settings, with the absorption at the root."""
    red, green, blue = (float(value) for value in root_absorption(settings))
    return Fibre(
        index_of_refraction=settings.index_of_refraction,
        absorption=(red, green, blue),
        cuticle_tilt=settings.cuticle_tilt,
        width_r=settings.width_r,
        width_tt=settings.width_tt,
        width_trt=settings.width_trt,
        offset_r=settings.offset_r,
        offset_tt=settings.offset_tt,
        offset_trt=settings.offset_trt,
        strength_r=settings.strength_r,
        strength_tt=settings.strength_tt,
        strength_trt=settings.strength_trt,
        strength_higher=settings.strength_higher,
        eccentricity=settings.eccentricity,
        glint_width=settings.glint_width,
        glint_strength=settings.glint_strength,
        azimuthal_width=settings.azimuthal_width,
    )


def pack_fibre(settings: ShadingSettings) -> Floats:
    """`Fibre` of gpu_shaders/struct_fibre.glsl in std140, (20,) float32."""
    root = [*root_absorption(settings), COLOR_FACTOR]
    tip = [*tip_absorption(settings), GREY_ABSORPTION]
    fibre = fibre_of(settings)
    lobes = [*fibre.strengths, *fibre.lobe_widths, *fibre.lobe_shifts]
    return np.array([*root, *tip, *lobes], np.float32)


def root_absorption(settings: ShadingSettings) -> Floats:
    """Absorption at the root, (3,), per radius, by the settings' kind of pigment."""
    match settings.pigment:
        case "melanin":
            return melanin_absorption(settings.melanin, settings.redness)
        case "absorption":
            return np.array(settings.absorption)
        case _:
            return color_absorption(np.array(settings.base_color))


def tip_absorption(settings: ShadingSettings) -> Floats:
    """Absorption of the tip colour, (3,), per radius."""
    return color_absorption(np.array(settings.tip_color))


def strand_absorption(
    settings: ShadingSettings,
    along: Floats,
    color_noise: Floats,
    grey_noise: Floats,
    root: Floats | None = None,
) -> Floats:
    """Absorption at a place of a strand, (..., 3), per radius.

    Args:
        along: 0 at the root to 1 at the tip.
        color_noise, grey_noise: the strand's own, in [0, 1].
        root: (..., 3) absorption without a tint; None: the look's.
    """
    root = root_absorption(settings) if root is None else root
    tip = tip_absorption(settings)
    mixed = root + (tip - root) * tip_fraction(along, settings)[..., None]
    amount = 1.0 + settings.color_variation * (1.0 - 2.0 * np.asarray(color_noise))
    is_grey = (np.asarray(grey_noise) < settings.grey_fraction)[..., None]
    grey = GREY_ABSORPTION * mixed.mean(axis=-1, keepdims=True)
    return np.where(is_grey, grey, mixed) * amount[..., None]


def strand_color(absorption: Floats) -> Floats:
    """Colour of a mass of such hair, (..., 3), for light scattered between strands."""
    return absorption_color(absorption)


def scattered_color(absorption: Floats) -> Floats:
    """The fraction of light that strands scatter between them back to the side it comes from,
    (..., 3); a fit to dual scattering, see docs/dev/shading.md."""
    color = strand_color(absorption)
    return color / (1.0 + color)


def lit_fraction(occlusion: Floats) -> Floats:
    """The fraction of a light without a shadow map that arrives where this fraction of ambient
    light does, (...).

    Hair that half of the surroundings reach is on the outside, and fully lit; a fit to shadow
    maps, see docs/dev/shading.md.
    """
    return np.minimum(2.0 * occlusion, 1.0)


def unscattered_fraction(
    normal: Floats, to_light: Floats, tau: Floats | float, shading: ShadingSettings
) -> Floats:
    """The fraction of light that no strand blocks, (...): exp(-tau) past tau strands.

    A negative tau is unknown: the fraction is then approximated by how much the hair's volume faces
    the light.
    """
    facing = 1.0 + shading.volume_shadow * (diffuse_bias(normal, to_light) - 1.0)
    return np.where(np.asarray(tau) < 0.0, facing, np.exp(-np.maximum(tau, 0.0)))


def strand_angles(
    tangent: Floats,
    normal: Floats,
    to_light: Floats,
    to_eye: Floats,
    shift_noise: Floats,
    shading: ShadingSettings,
) -> tuple[Floats, Floats, Floats]:
    """theta_i, theta_r and |phi| at a strand whose tangent is shifted by a noise in [0, 1]."""
    shift = shading.shift_noise * (shift_noise - 0.5)
    return directions_to_angles(shifted_tangent(tangent, normal, shift), to_light, to_eye)


def single_scattering(
    tables: MarschnerTables,
    angles: tuple[Floats, Floats, Floats],
    sparkle_noise: Floats,
    absorption: Floats,
    shading: ShadingSettings,
    level: Floats | float = 0.0,
) -> Floats:
    """S of a strand on its own, (..., 3): sparkle breaks up TRT alone."""
    strength_r, strength_tt, strength_trt, strength_higher = fibre_of(shading).strengths
    sparkle = 1.0 + shading.sparkle * (np.asarray(sparkle_noise) - 1.0)
    strengths = np.stack(
        np.broadcast_arrays(strength_r, strength_tt, strength_trt * sparkle, strength_higher),
        axis=-1,
    )
    return look_up(tables, *angles, absorption, strengths, level)


def marschner_light(
    tables: MarschnerTables,
    tangent: Floats,
    normal: Floats,
    to_light: Floats,
    to_eye: Floats,
    shift_noise: Floats,
    sparkle_noise: Floats,
    absorption: Floats,
    shading: ShadingSettings,
    level: Floats | float = 0.0,
    tau: Floats | float = -1.0,
) -> Floats:
    """Light of one lamp that hair sends to the eye, (..., 3): times irradiance it is radiance, and
    also times `lit_fraction` where tau is unknown.

    Args:
        tangent, normal, to_light, to_eye: unit vectors, (..., 3), in one space; the normal is that
            of the hair's volume.
        shift_noise, sparkle_noise: in [0, 1].
        absorption: per radius, (..., 3).
        level: see `look_up`.
        tau: mean number of strands that the light passes; negative: unknown.
    """
    angles = strand_angles(tangent, normal, to_light, to_eye, shift_noise, shading)
    scattered = single_scattering(tables, angles, sparkle_noise, absorption, shading, level)
    bias = diffuse_bias(normal, to_light) * np.exp(-np.maximum(tau, 0.0))
    shade = unscattered_fraction(normal, to_light, tau, shading)
    direct = scattered * (np.cos(angles[0]) * shade)[..., None]
    fake = scattered_color(absorption) * (shading.fake_scattering * bias / np.pi)[..., None]
    return direct + fake
