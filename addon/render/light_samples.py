"""Soft shadows: each sample of a picture is lit by another point of every light that has a size.

The mean over samples has the light's penumbra, on hair and on meshes, and highlights as broad as
the light. The first sample uses the middle of all lights.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Floats
from ..shading.area_lights import Panel
from ..shading.lights import Light
from ..strands.vectors import perpendicular_axes, triple

#: steps of a sequence that fills a square evenly, used by no other sequence of a picture
_STEPS = np.sqrt([2.0, 3.0]) - 1.0
#: step of the turn of shadow maps, in quarter turns: the golden ratio fills the circle evenly
_ROLL_STEP = 0.5 * (np.sqrt(5.0) - 1.0)


def lights_at(lights: Sequence[Light], sample: int, center: Floats) -> tuple[Light, ...]:
    """One point of each light instead of the light; the same points for equal samples.

    Args:
        sample: its index, from 0.
        center: (3,) [m] the point that a lamp's disk faces.
    """
    place = (0.5 + sample * _STEPS) % 1.0
    roll = float(0.5 * np.pi * (sample * _ROLL_STEP % 1.0))
    return tuple(_light_sample(light, place, roll, np.asarray(center, float)) for light in lights)


def _light_sample(light: Light, place: Floats, roll: float, center: Floats) -> Light:
    """A point of a light, whose shadow maps are turned; a light without a size stays as it is."""
    at = _point_of(light, place, center)
    return light if at is light else replace(at, map_roll=roll)


def _point_of(light: Light, place: Floats, center: Floats) -> Light:
    if light.kind == "sun":
        return light if light.angle <= 0.0 else _sun_sample(light, disk_place(place))
    if light.panel is not None:
        return _panel_sample(light, light.panel, place)
    return light if light.radius <= 0.0 else _lamp_sample(light, disk_place(place), center)


def _sun_sample(light: Light, offset: Floats) -> Light:
    """A point of the disk that fills a sun's angle, as in Cycles."""
    right, up = perpendicular_axes(np.array(light.vector))
    x, y = np.tan(0.5 * min(light.angle, 0.99 * np.pi)) * offset
    towards = np.array(light.vector) + x * right + y * up
    return replace(light, vector=triple(towards / np.linalg.norm(towards)))


def _lamp_sample(light: Light, offset: Floats, center: Floats) -> Light:
    """A point of the disk that faces the hair, with a power that gives the same irradiance at the
    hair's middle as the whole lamp, for a disk without a cone all along its axis."""
    away = center - np.array(light.vector)
    distance = float(np.linalg.norm(away))
    if distance <= light.radius:  # the middle of the hair is inside the lamp
        return light
    right, up = perpendicular_axes(away / distance)
    x, y = light.radius * offset
    at = triple(np.array(light.vector) + x * right + y * up)
    farther = float(x * x + y * y)
    if light.cone is None and not light.is_ball:
        left = np.sqrt(max(light.radius**2 - farther, 0.0))
        return replace(light, vector=at, radius=float(left))
    # no radius, since that would blur the rim of a cone once more
    factor = (distance**2 + farther) / (distance**2 + light.softening[0])
    power = triple(factor * np.array(light.power))
    return replace(light, vector=at, power=power, radius=0.0)


def _panel_sample(light: Light, panel: Panel, place: Floats) -> Light:
    """A panel of zero size that has the power of the whole one."""
    offset = disk_place(place) if panel.is_round else 2.0 * place - 1.0
    x, y = np.array([panel.half_width, panel.half_height]) * offset
    at = np.array(light.vector) + x * np.array(panel.right) + y * np.array(panel.up)
    point = replace(panel, half_width=0.0, half_height=0.0, is_round=False)
    return replace(light, vector=triple(at), panel=point)


def disk_place(place: Floats) -> Floats:
    """A place (2,) of the unit square mapped to the unit disk, which preserves area and the middle
    (Shirley and Chiu 1997, "A low distortion map between disk and square").
    """
    x, y = 2.0 * np.asarray(place) - 1.0
    if x == 0.0 and y == 0.0:
        return np.zeros(2)
    if abs(x) > abs(y):
        radius, angle = x, 0.25 * np.pi * y / x
    else:
        radius, angle = y, 0.5 * np.pi - 0.25 * np.pi * x / y
    return radius * np.array([np.cos(angle), np.sin(angle)])
