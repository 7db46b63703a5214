"""From Blender's Principled Hair to our settings: a starting point that answers light as it does.

References:
    Blender's manual, "Principled Hair BSDF", and Cycles, which it describes.
    Chiang et al. 2016, equations 7 and 8: what the two roughnesses are.
    Huang, Hullin and Hanika 2022, "A Microfacet-based Hair Scattering Model": the other model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..settings import ShadingSettings
from .pigment import absorption_color, color_absorption, melanin_absorption, roughness_widths

type Color = tuple[float, float, float]

WHITE: Color = (1.0, 1.0, 1.0)

#: standard deviation of the Gaussian nearest to a logistic, over the logistic's scale: of all their
#: distribution functions come closest (Camilli 1994)
_NEAREST_GAUSSIAN = 1.702
#: Cycles blurs caustics by the width around alone; ours need a little [rad]
_GLINT_WIDTH = float(np.radians(2.0))


@dataclass(frozen=True, kw_only=True)
class PrincipledHair:
    """The node's inputs, as Blender names them and with its defaults. offset is in radians.

    model: "CHIANG" or "HUANG". parametrization: "COLOR", "MELANIN" or "ABSORPTION".
    reflection, transmission, secondary_reflection, aspect_ratio: of Huang's model alone.
    radial_roughness, coat: of Chiang's alone.
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


def settings_from(
    hair: PrincipledHair, before: ShadingSettings | None = None
) -> tuple[ShadingSettings, tuple[str, ...]]:
    """Settings of the model Marschner, and notes on what could not be taken over as it is.

    Args:
        before: supplies what the node does not have: noise, sparkle, scattered light.
    """
    notes: list[str] = []
    values = _pigment(hair, notes) | _shape(hair, notes)
    if hair.random_roughness > 0.0:
        notes.append("Random Roughness is left out: all strands are equally rough")
    values |= {"model": "marschner", "tip_tint": 0.0, "grey_fraction": 0.0}
    return replace(before or ShadingSettings(), **_in_range(values, notes)), tuple(notes)


def azimuthal_width(roughness: float) -> float:
    """Standard deviation around the fibre for Blender's radial roughness in [0, 1], [rad].

    Of the Gaussian nearest to Chiang's logistic of s = sqrt(pi / 8) (0.265 b + 1.194 b^2 +
    5.372 b^22), which is 1.702 times as wide (Camilli 1994). (It is trimmed to the circle there,
    which counts only beyond 0.7.)
    """
    scale = np.sqrt(np.pi / 8.0) * (
        0.265 * roughness + 1.194 * roughness**2 + 5.372 * roughness**22
    )
    return float(_NEAREST_GAUSSIAN * scale)


def _pigment(hair: PrincipledHair, notes: list[str]) -> dict[str, Any]:
    """What colours the hair; with pigment and dye at once, both as one absorption."""
    radial = _around(hair)
    variation = 0.0
    if hair.parametrization == "MELANIN":
        melanin, redness = (
            _between(value, 0.0, 1.0) for value in (hair.melanin, hair.melanin_redness)
        )
        absorption = melanin_absorption(melanin, redness)
        pigment, values = "melanin", {"melanin": melanin, "redness": redness}
        variation = _between(hair.random_color, 0.0, 1.0)
        if hair.tint != WHITE:
            absorption = absorption + color_absorption(np.array(hair.tint), radial)
            pigment = "absorption"
            notes.append("Tint and Melanin became one Absorption")
    elif hair.parametrization == "ABSORPTION":
        absorption = np.maximum(hair.absorption_coefficient, 0.0)
        pigment, values = "absorption", {}
    else:
        absorption = color_absorption(np.array(hair.color), radial)
        pigment, values = "color", {}
    # our colour goes by a radial roughness of 0.3: another one asks for another colour
    color = tuple(absorption_color(absorption).tolist())
    return values | {
        "pigment": pigment,
        "base_color": color,
        "absorption": tuple(absorption.tolist()),
        "color_variation": variation,
    }


def _shape(hair: PrincipledHair, notes: list[str]) -> dict[str, Any]:
    """What light does at the fibre."""
    roughness = _between(hair.roughness, 0.001, 1.0)
    coat = _between(hair.coat, 0.0, 1.0) if hair.model == "CHIANG" else 0.0
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
        "azimuthal_width": azimuthal_width(_around(hair)),
        "glint_width": _GLINT_WIDTH,
        "eccentricity": 1.0,
        "strength_r": 1.0,
        "strength_tt": 1.0,
        "strength_trt": 1.0,
        "strength_higher": 1.0,
    }
    if hair.model == "HUANG":
        notes.append("Huang's model is drawn as Chiang's: its Roughness counts in both directions")
        values |= {
            "eccentricity": hair.aspect_ratio,
            "strength_r": hair.reflection,
            "strength_tt": hair.transmission,
            "strength_trt": hair.secondary_reflection,
        }
    return values


def _around(hair: PrincipledHair) -> float:
    """Roughness around the fibre; Huang's model has but one roughness."""
    roughness = hair.radial_roughness if hair.model == "CHIANG" else hair.roughness
    return _between(roughness, 0.001, 1.0)


def _in_range(values: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """All within what our settings may be; a note for each that was not."""
    kept = dict(values)
    for parameter in ShadingSettings.parameters():
        if parameter.name not in values or parameter.hard_range is None:
            continue
        low, high = parameter.hard_range
        value = values[parameter.name]
        if parameter.kind == "color":
            within: Any = tuple(_between(channel, low, high) for channel in value)
        else:
            within = _between(value, low, high)
        if within != value:
            notes.append(f"{parameter.label} was taken into its range, {low:g} to {high:g}")
        kept[parameter.name] = within
    return kept


def _between(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))
