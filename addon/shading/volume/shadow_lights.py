"""Which lights cast shadows of hair, and warnings about them for the artist."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Floats
from ..lights import Light, light_irradiance
from .light_frame import (
    MAX_HALF_ANGLE,
    MIN_RADIUS,
    Ball,
    LightFrame,
    is_too_near,
    light_frame,
    shines_along,
)
from .settings import VolumeSettings

#: lights without a shadow are reported if they are more than this fraction of all light
_MUCH_LIGHT = 0.25
#: at this extinction one strand, though it covers a hundredth of a texel, takes most of the light
_HARD_EXTINCTION = 100.0


def shadow_frames(
    lights: Sequence[Light], ball: Ball, settings: VolumeSettings
) -> list[LightFrame | None]:
    """The frame of each light's map; None for lights that cast no shadow."""
    frames: list[LightFrame | None] = [None] * len(lights)
    if settings.shadows != "none":
        casting = [index for index, light in enumerate(lights) if light.casts_shadow]
        for index, frame in _lights_with_maps([lights[each] for each in casting], ball, settings):
            frames[casting[index]] = frame
    return frames


def shadow_warnings(
    lights: Sequence[Light], ball: Ball, settings: VolumeSettings
) -> tuple[str, ...]:
    """Reasons why hair does not cast the shadows that one may expect, each with its remedy.

    Args:
        ball: around all hair.
    """
    if settings.shadows == "none":
        return ()
    lights = [light for light in lights if light.casts_shadow]
    with_maps = [index for index, _ in _lights_with_maps(lights, ball, settings)]
    found = list(_setting_warnings(ball, settings))
    found += [note for index in with_maps for note in _light_warnings(lights[index], ball)]
    strengths = _strengths(lights, ball)
    left_out = 1.0 - float(strengths[with_maps].sum()) / max(float(strengths.sum()), 1e-30)
    if settings.max_lights and len(lights) > len(with_maps) and left_out > _MUCH_LIGHT:
        found.append(
            f"Shadows: only the {settings.max_lights} strongest of {len(lights)} lights cast "
            f"shadows of hair; {left_out:.0%} of the light comes from the others. Raise Max "
            "Lights, or hide those that add least."
        )
    return tuple(found)


def _setting_warnings(ball: Ball, settings: VolumeSettings) -> Iterator[str]:
    if settings.extinction == 0.0:
        yield (
            "Shadows: with an Extinction of 0 hair casts none. Set it to 1, which matches the "
            "strands' width, or set Shadows to None."
        )
    if settings.extinction >= _HARD_EXTINCTION:
        yield (
            "Shadows: with this high an Extinction a single strand blocks all light. Set it to 1, "
            "which matches the strands' width."
        )
    if settings.max_lights == 0:
        yield (
            "Shadows: no light casts any while Max Lights is 0. Raise it, or set Shadows to None."
        )
    if ball.radius < 2.0 * MIN_RADIUS:
        yield (
            "Shadows: the hair has no extent, so it casts no visible shadow. Give its strands a "
            "length."
        )


def _light_warnings(light: Light, ball: Ball) -> Iterator[str]:
    """Warnings about a light that has, or could have, a map."""
    name = light.name or f"A {light.kind} light"
    if _misses(light, ball):
        yield (
            f"{name}: it shines past the hair, so it neither lights it nor casts its shadow. Turn "
            "it to the hair, or hide it."
        )
    elif is_too_near(light, ball) and _is_wide(light):
        clear = f"Move it farther than {1.05 * ball.radius:.2g} m from the middle of the hair"
        if light_frame(light, ball) is None:
            yield f"{name}: it stands inside the hair, which casts no shadow of its light. {clear}."
        else:
            yield (
                f"{name}: it stands within reach of the hair, so hair beside and behind it gets "
                f"no shadow. {clear}, or use a spot light."
            )


def _is_wide(light: Light) -> bool:
    """Whether it lights more than a map can hold."""
    if light.panel is not None:
        return False  # what lies flat beside it has hardly any light
    return light.cone is None or light.cone.max_angle > MAX_HALF_ANGLE


def _misses(light: Light, ball: Ball) -> bool:
    """Whether no place of the ball is in a light's beam."""
    along = shines_along(light)
    if along is None:
        return False
    towards = ball.center - np.asarray(light.vector)
    distance = float(np.linalg.norm(towards))
    if distance <= ball.radius:
        return light_frame(light, ball) is None
    angle = float(np.arccos(np.clip(along @ towards / distance, -1.0, 1.0)))
    half = light.cone.max_angle if light.cone is not None else 0.5 * np.pi
    return angle - float(np.arcsin(ball.radius / distance)) > half


def _strengths(lights: Sequence[Light], ball: Ball) -> Floats:
    """Irradiance of each light at the middle of the hair, summed over rgb, (light_count,)."""
    return np.array([float(light_irradiance(light, ball.center).sum()) for light in lights])


def _lights_with_maps(
    lights: Sequence[Light], ball: Ball, settings: VolumeSettings
) -> Iterator[tuple[int, LightFrame | None]]:
    """The strongest lights, with their frames, until `max_lights` of them have a map."""
    strengths, left = _strengths(lights, ball), settings.max_lights
    for index in sorted(range(len(lights)), key=lambda index: -strengths[index]):
        if left == 0:
            return
        frame = light_frame(lights[index], ball)
        left -= frame is not None
        yield index, frame
