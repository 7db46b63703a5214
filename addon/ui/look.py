"""The section Look: which parameters act in a model, and where they stand."""

from __future__ import annotations

from typing import Any

_VARIATION = ("color_variation", "grey_share", "shift_noise", "sparkle", "noise_cells")
#: section below Look ("" is Look itself) -> model -> its parameters in order; a model that is not
#: named has none
LOOK: dict[str, dict[str, tuple[str, ...]]] = {
    "": {
        "kajiya_kay": ("model", "ambient"),
        "marschner": ("model", "ambient", "scattered", "volume_shade"),
    },
    "Colour": {
        "kajiya_kay": ("base_color", "tip_tint", "tip_color", "tint_start", "tint_end"),
        "marschner": ("pigment", "base_color", "melanin", "redness", "absorption")
        + ("tip_tint", "tip_color", "tint_start", "tint_end"),
    },
    "First Highlight": {
        "kajiya_kay": ("primary_color", "primary_strength", "primary_exponent", "primary_shift"),
        "marschner": ("strength_r", "width_r", "offset_r"),
    },
    "Second Highlight": {
        "kajiya_kay": ("secondary_color", "secondary_strength", "secondary_exponent")
        + ("secondary_shift",),
        "marschner": ("strength_trt", "width_trt", "offset_trt", "glint_strength", "glint_width"),
    },
    "Rim Light": {"marschner": ("strength_tt", "width_tt", "offset_tt", "strength_rest")},
    "Fibre": {
        "marschner": ("index_of_refraction", "cuticle_tilt", "eccentricity", "azimuthal_width"),
    },
    "Variation": {"kajiya_kay": _VARIATION, "marschner": _VARIATION},
}
#: parameter -> the pigment with which alone it acts in Marschner
_OF_PIGMENT = {
    "base_color": "color",
    "melanin": "melanin",
    "redness": "melanin",
    "absorption": "absorption",
}
_OF_TINT = ("tip_color", "tint_start", "tint_end")


def look_names(section: str, shading: Any) -> list[str]:
    """The parameters that act by these settings, in the order in which they are drawn."""
    names = LOOK[section].get(shading.model, ())
    if shading.model != "marschner":
        return list(names)
    return [name for name in names if _OF_PIGMENT.get(name, shading.pigment) == shading.pigment]


def is_idle(name: str, shading: Any, volume: Any) -> bool:
    """Whether it does nothing at the moment, but would if another setting were changed."""
    if name in _OF_TINT:
        return shading.tip_tint == 0.0
    if volume.shadows == "none":
        return False
    return name == "volume_shade" or (name == "scattered" and volume.scattering)
