"""Kajiya-Kay shading of hair with Scheuermann's two shifted highlights: the reference.

Twin of gpu_shaders/lib_kajiya_kay.glsl: same names, same order.

References:
    Kajiya and Kay 1989, "Rendering Fur with Three Dimensional Textures".
    Scheuermann 2004, "Practical Real-Time Hair Rendering and Shading".

With T from root to tip, a positive shift moves the highlight to the TIP: T' = T + s N tilts the
tangent outwards, and the place where T' is perpendicular to the half vector lies further down the
strand. (A translation of Scheuermann's slides says root; the geometry and the slides themselves say
tip, and a test checks it.)

All directions are unit vectors in one space, (..., 3), and broadcast.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..strands.frames import volume_normals
from ..strands.vectors import dot, unit_or
from .settings import ShadingSettings
from .tint import tip_fraction

#: colour of grey strands; in lib_kajiya_kay
GREY_COLOR = (0.42, 0.42, 0.43)
_SMALLEST = 1.0e-6


def strand_normal(point: Floats, tangent: Floats, center: Floats) -> Floats:
    """Normal of the hair's volume at a strand; cards have the same at their vertices."""
    return volume_normals(point, tangent, center)


def diffuse_bias(normal: Floats, to_light: Floats) -> Floats:
    """max(0, 0.75 N.L + 0.25): light wraps around the hair, which is not quite opaque."""
    return np.maximum(0.0, 0.75 * dot(normal, to_light) + 0.25)


def shifted_tangent(tangent: Floats, normal: Floats, shift: Floats | float) -> Floats:
    """normalize(T + s N); `shift` is (...)."""
    return unit_or(tangent + np.asarray(shift)[..., None] * normal, tangent)


def strand_specular(tangent: Floats, half_vector: Floats, exponent: float) -> Floats:
    """smoothstep(-1, 0, T.H) sin(T, H)^p: a highlight where the strand is perpendicular to H."""
    along = dot(tangent, half_vector)
    across_squared = np.maximum(0.0, 1.0 - along * along)
    rise = np.clip(along + 1.0, 0.0, 1.0)
    return rise * rise * (3.0 - 2.0 * rise) * across_squared ** (0.5 * exponent)


def kajiya_kay(
    tangent: Floats,
    normal: Floats,
    to_light: Floats,
    to_eye: Floats,
    shift_noise: Floats,
    sparkle_noise: Floats,
    shading: ShadingSettings,
) -> Floats:
    """(diffuse + specular) of one light, (..., 3) rgb.

    Times irradiance / pi, base colour and occlusion, it is radiance. Noises are in [0, 1].
    """
    diffuse = diffuse_bias(normal, to_light)[..., None]
    half_vector = unit_or(to_light + to_eye, normal)
    shift = shading.shift_noise * (shift_noise - 0.5)
    primary_tangent = shifted_tangent(tangent, normal, shading.primary_shift + shift)
    secondary_tangent = shifted_tangent(tangent, normal, shading.secondary_shift + shift)
    primary = strand_specular(primary_tangent, half_vector, shading.primary_exponent)
    secondary = strand_specular(secondary_tangent, half_vector, shading.secondary_exponent)
    secondary = secondary * (1.0 + shading.sparkle * (sparkle_noise - 1.0))
    specular = primary[..., None] * (shading.primary_strength * np.array(shading.primary_color))
    specular = specular + secondary[..., None] * (
        shading.secondary_strength * np.array(shading.secondary_color)
    )
    return diffuse + diffuse * specular


def strand_base(
    along: Floats,
    color_noise: Floats,
    grey_noise: Floats,
    shading: ShadingSettings,
    root: Floats | None = None,
) -> Floats:
    """The hair's colour at places of strands, (..., 3).

    The base colour blended to the tips', or grey, with its brightness varied by each strand's
    noise.

    Args:
        along: 0 at the root, 1 at the tip.
        color_noise, grey_noise: of each strand, in [0, 1]; strands of the lowest grey noise are
            grey.
        root: (..., 3) the base colour; None: the look's.
    """
    base, tip = np.array(shading.base_color if root is None else root), np.array(shading.tip_color)
    color = base + (tip - base) * tip_fraction(along, shading)[..., None]
    color = np.where((grey_noise < shading.grey_fraction)[..., None], GREY_COLOR, color)
    brightness = 1.0 + shading.color_variation * (2.0 * color_noise - 1.0)
    return color * brightness[..., None]
