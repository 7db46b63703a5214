"""Reflection at the boundary of a dielectric, by microfacets of the GGX distribution.

References: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz
2014, "Understanding the Masking-Shadowing Function", with the height-correlated form of Smith;
Karis 2014, "Physically Based Shading on Mobile", for the fraction of light from all around. As in
Blender's Principled BSDF, the width of the lobe is the square of the roughness, and reflected light
does not reach the layer below.

Twin: gpu_shaders/lib_microfacet.glsl.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: minimum roughness: smoother surfaces would show lights without size as less than a pixel
MIN_ROUGHNESS = 0.08


def dielectric_fresnel(cosine: Floats, specular: float) -> Floats:
    """The fraction of light that a smooth dielectric reflects.

    Args:
        cosine: (...) of the angle between light and normal, 0 to 1.
        specular: that fraction at normal incidence, which determines the index of refraction.
    """
    root = np.sqrt(min(specular, 0.999))
    ior = (1.0 + root) / (1.0 - root)
    refracted = np.sqrt(ior * ior - 1.0 + cosine * cosine)
    across = (refracted - cosine) / np.maximum(refracted + cosine, 1e-6)
    along = (cosine * refracted - 1.0 + cosine * cosine) / (
        cosine * refracted + 1.0 - cosine * cosine
    )
    return 0.5 * across * across * (1.0 + along * along)


def smith_height(cosine: Floats, alpha_squared: float) -> Floats:
    """The root in the shadowing function of Smith for GGX, at the cosine of an angle, (...)."""
    return np.sqrt(alpha_squared + (1.0 - alpha_squared) * cosine * cosine)


def ggx_reflection(
    normal: Floats, to_light: Floats, to_eye: Floats, specular: float, roughness: float
) -> Floats:
    """The BRDF of the boundary [1/sr], (...,), for unit vectors (..., 3)."""
    cos_light = np.sum(normal * to_light, axis=-1)
    cos_eye = np.sum(normal * to_eye, axis=-1)
    half_sum = to_light + to_eye
    length = np.linalg.norm(half_sum, axis=-1)
    half_vector = half_sum / np.maximum(length, 1e-20)[..., None]
    alpha_squared = max(roughness, MIN_ROUGHNESS) ** 4
    sine_vector = np.cross(normal, half_vector)
    cos_half = np.sum(normal * half_vector, axis=-1)
    spread = np.sum(sine_vector * sine_vector, axis=-1) + alpha_squared * cos_half * cos_half
    facets = alpha_squared / (np.pi * spread * spread)
    is_visible = (np.minimum(cos_light, cos_eye) > 0.0) & (length > 0.0)
    heights = cos_light * smith_height(cos_eye, alpha_squared) + cos_eye * smith_height(
        cos_light, alpha_squared
    )
    visible = 0.5 / np.where(is_visible, heights, 1.0)
    cosine = np.clip(np.sum(half_vector * to_eye, axis=-1), 0.0, 1.0)
    return np.where(is_visible, facets * visible * dielectric_fresnel(cosine, specular), 0.0)


def reflected_fraction(cos_eye: Floats, specular: float, roughness: float) -> Floats:
    """Approximate fraction of light from all around that the boundary reflects to the eye.

    Args:
        cos_eye: (...) cosine of the angle between eye and normal.
    """
    if specular <= 0.0:
        return np.zeros_like(cos_eye)
    first = 1.0 - roughness
    second = 0.0425 - 0.0275 * roughness
    scale = 1.04 - 0.572 * roughness
    bias = 0.022 * roughness - 0.04
    grazing = np.minimum(first * first, np.exp2(-9.28 * np.maximum(cos_eye, 0.0))) * first + second
    return np.clip(specular * (scale - 1.04 * grazing) + bias + 1.04 * grazing, 0.0, 1.0)
