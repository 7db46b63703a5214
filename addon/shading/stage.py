"""The stage for pictures without a scene: three lights and a backdrop.

Everything is relative to the ball around what is shown, so that hair of any size looks the same.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats
from .lights import Color, Light
from .stage_settings import StageSettings
from .volume.light_frame import Ball

#: radius of each light, in radii of the ball
_LIGHT_RADIUS = 0.5
#: colour of the main light at full warmth, and of the other lights
_WARM, _COOL = np.array([1.12, 0.98, 0.74]), np.array([0.84, 0.99, 1.22])
#: falloff of the backdrop: in the corners it nearly has the colour of the edge
_VIGNETTE = 3.2


def stage_lights(
    stage: StageSettings, view: Floats, ball: Ball, *, is_mirrored: bool = False
) -> tuple[Light, ...]:
    """Key, fill and rim light, which are attached to the camera and fall off with the distance.

    Args:
        view: (4, 4) world to view space, a rigid motion.
        ball: around what is shown.
        is_mirrored: whether left and right are swapped, for a face that looks to the right of the
            picture: the main light then falls on the visible side of the hair, broad lighting of a
            portrait.
    """
    to_world = np.linalg.inv(np.asarray(view, np.float64))[:3, :3]
    radius, distance = _LIGHT_RADIUS * ball.radius, stage.distance * ball.radius
    power = 4.0 * np.pi * (distance * distance + radius * radius)
    sides = np.array([-1.0 if is_mirrored else 1.0, 1.0, 1.0])
    return tuple(
        Light.point(
            ball.center + distance * to_world @ (sides * towards), tint, power * strength, radius
        )
        for towards, tint, strength in _lights(stage)
        if strength > 0.0
    )


def _lights(stage: StageSettings) -> Iterator[tuple[Floats, Color, float]]:
    """Direction in view space, colour and irradiance [W/m^2] of each light."""
    warm, cool = _tint(stage.warmth), _tint(-stage.warmth)
    yield direction(stage.key_side, stage.key_height), warm, stage.key
    yield direction(stage.fill_side, stage.fill_height), cool, stage.fill
    yield direction(stage.rim_side, stage.rim_height), cool, stage.rim


def direction(side: float, height: float) -> Floats:
    """Unit vector in view space (x right, y up, z to the eye) by angles [rad] from the eye's."""
    across = np.cos(height)
    return np.array([np.sin(side) * across, np.sin(height), np.cos(side) * across])


def _tint(warmth: float) -> Color:
    end = _WARM if warmth > 0.0 else _COOL
    red, green, blue = (1.0 + abs(warmth) * (end - 1.0)).tolist()
    return red, green, blue


def backdrop(stage: StageSettings, width: int, height: int) -> Floats:
    """The backdrop behind the hair, (height, width, 3) scene-linear: the colour of its centre fades
    to that of its edge, evenly to all sides.
    """
    y, x = np.indices((height, width), dtype=np.float64) + 0.5
    squared = (x - 0.5 * width) ** 2 + (y - 0.5 * height) ** 2
    nearness = np.exp(-_VIGNETTE * squared / (0.25 * (width**2 + height**2)))[..., None]
    edge = np.array(stage.backdrop_edge)
    return (edge + nearness * (np.array(stage.backdrop_center) - edge)).astype(np.float32)


def over_backdrop(picture: Floats, backdrop_color: Floats) -> Floats:
    """A premultiplied picture (..., 4) over a backdrop, (..., 3): opaque."""
    alpha = picture[..., 3:]
    color = picture[..., :3] + (1.0 - alpha) * backdrop_color
    return np.concatenate([color, np.ones_like(alpha)], axis=-1)
