"""Soft shadows: each sample of a picture sees another point of every light that has a size.

The mean over samples has the light's penumbra, on hair and on meshes, and its highlight is as broad
as the light is. The first sample has the middle of all lights.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Floats
from ..shading.area_lights import Panel
from ..shading.lights import Light
from ..strands.vectors import both_across, triple

#: steps of a sequence that fills a square evenly, and no other sequence of a picture has
_STEPS = np.sqrt([2.0, 3.0]) - 1.0


def lights_at(lights: Sequence[Light], sample: int, center: Floats) -> tuple[Light, ...]:
    """One point of each light in place of all of it; the same ones for equal samples.

    Args:
        sample: its number, from 0.
        center: (3,) [m] what a lamp's disk faces.
    """
    place = (0.5 + sample * _STEPS) % 1.0
    return tuple(_at(light, place, np.asarray(center, np.float64)) for light in lights)


def _at(light: Light, place: Floats, center: Floats) -> Light:
    if light.kind == "sun":
        return light if light.angle <= 0.0 else _of_sun(light, disk_place(place))
    if light.panel is not None:
        return _of_panel(light, light.panel, place)
    return light if light.radius <= 0.0 else _of_lamp(light, disk_place(place), center)


def _of_sun(light: Light, aside: Floats) -> Light:
    """Of the disk that fills its angle, as in Cycles."""
    right, up = both_across(np.array(light.vector))
    x, y = np.tan(0.5 * min(light.angle, 0.99 * np.pi)) * aside
    towards = np.array(light.vector) + x * right + y * up
    return replace(light, vector=triple(towards / np.linalg.norm(towards)))


def _of_lamp(light: Light, aside: Floats, center: Floats) -> Light:
    """Of the disk that faces the hair, as a point; at the middle of the hair as much arrives as of
    the whole lamp. Of a disk without a cone that is so all along its axis."""
    away = center - np.array(light.vector)
    distance = float(np.linalg.norm(away))
    if distance <= light.radius:  # hair inside a lamp sees no side of it
        return light
    right, up = both_across(away / distance)
    x, y = light.radius * aside
    at = triple(np.array(light.vector) + x * right + y * up)
    farther = float(x * x + y * y)
    if light.cone is None and not light.is_ball:
        left = np.sqrt(max(light.radius**2 - farther, 0.0))
        return replace(light, vector=at, radius=float(left))
    # with a radius, a cone would blur its rim by it once more
    factor = (distance**2 + farther) / (distance**2 + light.softening[0])
    power = triple(factor * np.array(light.power))
    return replace(light, vector=at, power=power, radius=0.0)


def _of_panel(light: Light, panel: Panel, place: Floats) -> Light:
    """A panel that is as good as a point, and shines as the whole one does."""
    aside = disk_place(place) if panel.is_round else 2.0 * place - 1.0
    x, y = np.array([panel.half_width, panel.half_height]) * aside
    at = np.array(light.vector) + x * np.array(panel.right) + y * np.array(panel.up)
    point = replace(panel, half_width=0.0, half_height=0.0, is_round=False)
    return replace(light, vector=triple(at), panel=point)


def disk_place(place: Floats) -> Floats:
    """A place of the unit square, (2,), on the unit disk: equal areas stay equal, and the middle is
    the middle (Shirley and Chiu 1997, "A low distortion map between disk and square").
    """
    x, y = 2.0 * np.asarray(place) - 1.0
    if x == 0.0 and y == 0.0:
        return np.zeros(2)
    if abs(x) > abs(y):
        radius, angle = x, 0.25 * np.pi * y / x
    else:
        radius, angle = y, 0.5 * np.pi - 0.25 * np.pi * x / y
    return radius * np.array([np.cos(angle), np.sin(angle)])
