"""Conversion of Blender's Principled Hair to our settings and back, so that both look alike.

References:
    Blender's manual, "Principled Hair BSDF", and Cycles, which it describes.
    Chiang et al. 2016, equations 7 and 8: what the two roughnesses are.
    Huang, Hullin and Hanika 2022, "A Microfacet-based Hair Scattering Model": the other model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..settings import ShadingSettings
from .look import root_absorption
from .pigment import absorption_color, color_absorption, melanin_absorption, roughness_widths

type Color = tuple[float, float, float]

WHITE: Color = (1.0, 1.0, 1.0)

#: standard deviation, over a logistic's scale, of the Gaussian whose distribution function is
#: closest to the logistic's (Camilli 1994)
_NEAREST_GAUSSIAN = 1.702
#: Cycles blurs caustics by the azimuthal width alone; ours need a little more [rad]
_GLINT_WIDTH = float(np.radians(2.0))
#: Widths of TT and TRT that differ by more than this factor from one roughness are worth a note.
_UNEVEN = 1.5
#: Strength of a highlight up to which Huang's model is chosen: in Cycles it is darker than ours by
#: a third, so it is better only where Chiang's would be more wrong than that.
_MIN_STRENGTH = 0.5
#: Limits of the reflectance at normal incidence that is converted to an index of refraction
_REFLECTANCES = 0.01, 0.25


@dataclass(frozen=True, kw_only=True)
class PrincipledHair:
    """The node's inputs, as Blender names them and with its defaults. offset is in radians.

    model: "CHIANG" or "HUANG". parametrization: "COLOR", "MELANIN" or "ABSORPTION".
    reflection, transmission, secondary_reflection, aspect_ratio: only in Huang's model.
    radial_roughness, coat: only in Chiang's.
    """

    model: str = "CHIANG"
    parametrization: str = "COLOR"
    color: Color = (0.017513, 0.005763, 0.002059)
    melanin: float = 0.8
    melanin_redness: float = 1.0
    tint: Color = WHITE
    absorption_coefficient: Color = (0.245531, 0.52, 1.365)
    roughness: float = 0.3
    radial_roughness: float = 0.3
    coat: float = 0.0
    ior: float = 1.55
    offset: float = float(np.radians(2.0))
    random_color: float = 0.0
    random_roughness: float = 0.0
    aspect_ratio: float = 0.85
    reflection: float = 1.0
    transmission: float = 1.0
    secondary_reflection: float = 1.0

    @property
    def azimuthal_roughness(self) -> float:
        """Azimuthal roughness; Huang's model has only one roughness."""
        roughness = self.radial_roughness if self.model == "CHIANG" else self.roughness
        return _clamped(roughness, 0.001, 1.0)


def settings_from(
    hair: PrincipledHair, base_settings: ShadingSettings | None = None
) -> tuple[ShadingSettings, tuple[str, ...]]:
    """Settings of the model Marschner, and notes on what could not be converted exactly.

    Args:
        base_settings: supplies what the node does not have: noise, sparkle, scattered light.
    """
    notes: list[str] = []
    values = _pigment(hair, notes) | _shape(hair, notes)
    if hair.random_roughness > 0.0:
        notes.append("Random Roughness is left out: all strands are equally rough")
    values |= {"model": "marschner", "tip_tint": 0.0, "grey_fraction": 0.0}
    return replace(base_settings or ShadingSettings(), **_in_range(values, notes)), tuple(notes)


def hair_from(settings: ShadingSettings) -> tuple[PrincipledHair, tuple[str, ...]]:
    """The node that matches this look at the roots, the inverse of `settings_from`, and notes on
    settings that the node has no input for.

    Noise, sparkle and variation along or between strands are not part of the node, except the
    variation of melanin.
    """
    notes: list[str] = []
    is_fibre = settings.model == "marschner"
    shape = _node_of_fibre(settings, notes) if is_fibre else _node_of_highlights(settings, notes)
    hair = PrincipledHair(**shape)
    absorption = root_absorption(settings if is_fibre else replace(settings, pigment="color"))
    color = tuple(absorption_color(absorption, hair.azimuthal_roughness).tolist())
    inputs: dict[str, Any] = {
        "color": color,
        "absorption_coefficient": tuple(absorption.tolist()),
        "melanin": settings.melanin,
        "melanin_redness": settings.redness,
        "parametrization": settings.pigment.upper() if is_fibre else "COLOR",
    }
    if inputs["parametrization"] == "MELANIN":
        inputs["random_color"] = settings.color_variation
    return replace(hair, **inputs), tuple(notes)


def _node_of_fibre(settings: ShadingSettings, notes: list[str]) -> dict[str, Any]:
    """The inputs for the shape of the highlights; one roughness replaces three widths."""
    inner = 0.5 * (2.0 * settings.width_tt + 0.5 * settings.width_trt)
    if max(2.0 * settings.width_tt, 0.5 * settings.width_trt) > _UNEVEN * inner:
        notes.append("Rim Width and Second Width were combined into one Roughness")
    if settings.offset_r or settings.offset_tt or settings.offset_trt:
        notes.append("offsets of single highlights are left out: the node has only one Offset")
    roughness = _roughness_of(inner)
    outer = _roughness_of(settings.width_r)
    # glints have at least the azimuthal blur of all else
    around = max(settings.azimuthal_width, settings.glint_width)
    values: dict[str, Any] = {
        "roughness": roughness,
        "radial_roughness": _inverse(azimuthal_width, around),
        "coat": _clamped(1.0 - outer / roughness, 0.0, 1.0) if roughness > 0.0 else 0.0,
        "ior": settings.index_of_refraction,
        "offset": settings.cuticle_tilt,
    }
    strengths = {
        "reflection": settings.strength_r,
        "transmission": settings.strength_tt,
        "secondary_reflection": settings.strength_trt,
    }
    if settings.eccentricity == 1.0 and min(strengths.values()) > _MIN_STRENGTH:
        if settings.strength_tt != 1.0 or settings.strength_trt != 1.0:
            notes.append("Rim Strength and Second Strength were set to 1: the node has none")
        values["ior"] = _index_for_strength(settings.index_of_refraction, settings.strength_r)
        return values
    notes.append("the node uses Huang's model, which has strengths but a single Roughness")
    if max(strengths.values()) > 1.0 or settings.eccentricity > 1.0:
        notes.append("strengths and Eccentricity above 1 were lowered to 1")
    within = {name: _clamped(value, 0.0, 1.0) for name, value in strengths.items()}
    return values | within | {"model": "HUANG", "aspect_ratio": min(settings.eccentricity, 1.0)}


def _index_for_strength(index: float, strength: float) -> float:
    """The index of refraction that reflects `strength` times as much light at normal incidence.

    Fresnel's reflectance there is ((n - 1) / (n + 1))^2.
    """
    if strength == 1.0:
        return index
    reflectance = _clamped(strength * ((index - 1.0) / (index + 1.0)) ** 2, *_REFLECTANCES)
    root = float(np.sqrt(reflectance))
    return (1.0 + root) / (1.0 - root)


def _node_of_highlights(settings: ShadingSettings, notes: list[str]) -> dict[str, Any]:
    """The same for Kajiya-Kay's two highlights: cos^n of an angle is nearly a Gaussian of 1 /
    sqrt(n)."""
    notes.append("Kajiya-Kay is not a fibre model: only colour, width and shift were copied")
    first, second = (
        float(1.0 / np.sqrt(exponent))
        for exponent in (settings.primary_exponent, settings.secondary_exponent)
    )
    roughness, outer = _roughness_of(0.5 * second), _roughness_of(first)
    return {
        "roughness": roughness,
        "coat": _clamped(1.0 - outer / roughness, 0.0, 1.0),
        "offset": float(np.arctan(settings.primary_shift)),
    }


def _roughness_of(width: float) -> float:
    """Blender's roughness at which R has this width [rad]."""
    return _inverse(lambda roughness: roughness_widths(roughness)[0], width)


def _inverse(function: Callable[[float], float], value: float) -> float:
    """Where in [0, 1] a rising function has this value; an end of the range if it is out of
    reach."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) < value else (low, middle)
    return 0.5 * (low + high)


def azimuthal_width(roughness: float) -> float:
    """Standard deviation around the fibre for Blender's radial roughness in [0, 1], [rad].

    Of the Gaussian nearest to Chiang's logistic, 1.702 s (Camilli 1994), with the logistic's scale
    s = sqrt(pi / 8) (0.265 b + 1.194 b^2 + 5.372 b^22). (Chiang trims the logistic to the circle,
    which matters only beyond 0.7.)
    """
    scale = np.sqrt(np.pi / 8.0) * (
        0.265 * roughness + 1.194 * roughness**2 + 5.372 * roughness**22
    )
    return float(_NEAREST_GAUSSIAN * scale)


def _pigment(hair: PrincipledHair, notes: list[str]) -> dict[str, Any]:
    """The settings of colour; melanin and tint together become one absorption."""
    radial = hair.azimuthal_roughness
    variation = 0.0
    if hair.parametrization == "MELANIN":
        melanin, redness = (
            _clamped(value, 0.0, 1.0) for value in (hair.melanin, hair.melanin_redness)
        )
        absorption = melanin_absorption(melanin, redness)
        pigment, values = "melanin", {"melanin": melanin, "redness": redness}
        variation = _clamped(hair.random_color, 0.0, 1.0)
        if hair.tint != WHITE:
            absorption = absorption + color_absorption(np.array(hair.tint), radial)
            pigment = "absorption"
            notes.append("Tint and Melanin were combined into Absorption")
    elif hair.parametrization == "ABSORPTION":
        absorption = np.maximum(hair.absorption_coefficient, 0.0)
        pigment, values = "absorption", {}
    else:
        absorption = color_absorption(np.array(hair.color), radial)
        pigment, values = "color", {}
    # our colour assumes a radial roughness of 0.3: another roughness needs another colour
    color = tuple(absorption_color(absorption).tolist())
    return values | {
        "pigment": pigment,
        "base_color": color,
        "absorption": tuple(absorption.tolist()),
        "color_variation": variation,
    }


def _shape(hair: PrincipledHair, notes: list[str]) -> dict[str, Any]:
    """The settings of the fibre and its highlights."""
    roughness = _clamped(hair.roughness, 0.001, 1.0)
    coat = _clamped(hair.coat, 0.0, 1.0) if hair.model == "CHIANG" else 0.0
    width_r, width_tt, width_trt = roughness_widths(roughness)
    values = {
        "index_of_refraction": hair.ior,
        "cuticle_tilt": hair.offset,
        "offset_r": 0.0,
        "offset_tt": 0.0,
        "offset_trt": 0.0,
        "width_r": width_r if coat == 0.0 else roughness_widths(roughness * (1.0 - coat))[0],
        "width_tt": width_tt,
        "width_trt": width_trt,
        "azimuthal_width": azimuthal_width(hair.azimuthal_roughness),
        "glint_width": _GLINT_WIDTH,
        "eccentricity": 1.0,
        "strength_r": 1.0,
        "strength_tt": 1.0,
        "strength_trt": 1.0,
        "strength_higher": 1.0,
    }
    if hair.model == "HUANG":
        notes.append("Huang's model is drawn as Chiang's: its Roughness is used in both directions")
        values |= {
            "eccentricity": hair.aspect_ratio,
            "strength_r": hair.reflection,
            "strength_tt": hair.transmission,
            "strength_trt": hair.secondary_reflection,
        }
    return values


def _in_range(values: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """The values clamped to the ranges of our settings, with a note for each that was outside."""
    kept = dict(values)
    for parameter in ShadingSettings.parameters():
        if parameter.name not in values or parameter.hard_range is None:
            continue
        low, high = parameter.hard_range
        value = values[parameter.name]
        if parameter.kind == "color":
            within: Any = tuple(_clamped(channel, low, high) for channel in value)
        else:
            within = _clamped(value, low, high)
        if within != value:
            notes.append(f"{parameter.label} was clamped to its range, {low:g} to {high:g}")
        kept[parameter.name] = within
    return kept


def _clamped(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))
