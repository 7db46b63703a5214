"""Shafts of light around the lights in view: the reference for the shaders.

Nguyen and Donnelly 2005 (Hair animation and rendering in the Nalu demo, GPU Gems 2, chapter 23,
and the talk's "God Rays"): bright regions and what stands before them are taken to polar
coordinates around the light, blurred along the radius, and taken back.

    V(r, angle)  openness: 1 - coverage by what is nearer than the light
    B(r, angle)  the mean of V on the ray out from the light, weighted by exp(-s / l) at a
                 distance s back, so a shaft fades by 1/e in l
    added        E / pi * strength * tint * exp(-r / (2 l)) * B

r is the distance to the light on the screen, l the length of the settings in the same unit, E the
irradiance of the light at the eye. So beside the light, haze is as bright as a matt white surface
that faces it, times the strength. Lengths are set as angles, so that a part of a picture looks as
it does in the whole.

Limitations: only what is in the picture counts. Nothing outside of it casts a shaft, and the
distance of hair does not change the haze. A light that is not in front of the viewer has no place
on the screen and no haze; in an orthographic view no light has any, since light does not spread
from a point there. Shafts from bright parts of the picture are in bright_shafts.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from .lights import Light, light_irradiance
from .shafts_settings import ShaftSettings

#: the haze reaches this many lengths from its light
REACH = 2.0
#: radiance below which a light's haze is left out
FAINTEST = 1.0e-4
#: an orthographic picture is taken to be this high, as an angle of view [rad]
_FLAT_HEIGHT = 2.0 * np.arctan(0.36)
#: length [pixels] up to which there are no shafts
_SHORTEST = 1.0e-3
#: maximum and minimum number of rays out from a light
_MAX_ANGLES, _MIN_ANGLES = 4096, 64


@dataclass(frozen=True)
class LightOnScreen:
    """A light in front of the viewer.

    center: x, y [pixels], the lower left corner of the picture is 0, 0; may lie outside.
    radiance: rgb of its haze, at the light.
    depth: its window depth (0 near, 1 far); only what is nearer stands before it.
    length: of shafts [pixels].
    """

    center: tuple[float, float]
    radiance: tuple[float, float, float]
    depth: float
    length: float


@dataclass(frozen=True)
class PolarGrid:
    """A grid of rays out from a place, which covers a whole picture.

    center: x, y [pixels].
    middle, span: angle of the middle ray, and between the first and the last [rad].
    nearest, farthest: distances at which rays begin and end [pixels].
    angles, radii: number of rays, and of texels on each; a texel's place is its middle.
    """

    center: tuple[float, float]
    middle: float
    span: float
    nearest: float
    farthest: float
    angles: int
    radii: int

    @classmethod
    def over(
        cls,
        center: tuple[float, float],
        width: int,
        height: int,
        radii: int = 0,
        max_angles: int = _MAX_ANGLES,
    ) -> PolarGrid:
        """The grid around a place in or outside of a picture [pixels].

        Args:
            radii: texels on a ray; 0: one per pixel.
            max_angles: maximum number of rays; below it, one per pixel at the farthest corner.
        """
        x, y = center
        corners = np.array([[0, 0], [width, 0], [0, height], [width, height]]) - (x, y)
        farthest = float(np.hypot(*corners.T).max())
        aside = max(-x, 0.0, x - width), max(-y, 0.0, y - height)
        nearest = float(np.hypot(*aside))
        middle, span = 0.0, 2.0 * np.pi
        if nearest > 0.0:
            middle = float(np.arctan2(height / 2.0 - y, width / 2.0 - x))
            span = 2.0 * float(np.abs(_angles_from(middle, corners)).max())
        angles = int(np.clip(np.ceil(span * farthest), _MIN_ANGLES, max_angles))
        radii = radii or max(int(np.ceil(farthest - nearest)), 1)
        return cls((x, y), middle, span, nearest, farthest, angles, radii)

    @property
    def is_round(self) -> bool:
        """Whether the last ray is beside the first."""
        return self.nearest == 0.0

    @property
    def step(self) -> float:
        """Distance between texels of a ray [pixels]."""
        return (self.farthest - self.nearest) / self.radii

    @property
    def places(self) -> tuple[Floats, Floats]:
        """x and y of all texels [pixels], each (angles, radii)."""
        along = (np.arange(self.angles) + 0.5) / self.angles - 0.5
        angle = (self.middle + along * self.span)[:, None]
        radius = self.nearest + (np.arange(self.radii) + 0.5) * self.step
        return self.center[0] + radius * np.cos(angle), self.center[1] + radius * np.sin(angle)


def shaft_length(projection: Floats, height: int, length: float) -> float:
    """A length given as an angle of view, at the middle of the picture [pixels]."""
    is_perspective = projection[3, 3] == 0.0
    # the projection of a part of a picture is larger, as its height is smaller
    halves = projection[1, 1] if is_perspective else 1.0 / np.tan(0.5 * _FLAT_HEIGHT)
    return float(np.tan(length) * halves * height / 2.0)


def has_length(length: float) -> bool:
    return length > _SHORTEST


def lights_on_screen(
    lights: Sequence[Light],
    view: Floats,
    projection: Floats,
    width: int,
    height: int,
    settings: ShaftSettings,
) -> list[LightOnScreen]:
    """The lights whose haze is visible in a picture, the brightest first.

    A sun is at the vanishing point of its direction, other lights are at their positions.

    Args:
        view, projection: (4, 4) world to view to clip space, as in render.camera.
        width, height: of the picture [pixels].
    """
    is_perspective = projection[3, 3] == 0.0
    length = shaft_length(projection, height, settings.length)
    is_wanted = settings.use_shafts and settings.source in ("lights", "both")
    if not (is_wanted and is_perspective and has_length(length)):
        return []
    to_clip = np.asarray(projection, np.float64) @ np.asarray(view, np.float64)
    eye = np.linalg.inv(np.asarray(view, np.float64))[:3, 3]
    found = []
    for light in lights:
        haze = light_irradiance(light, eye) / np.pi * np.asarray(settings.tint) * settings.strength
        found.append(_on_screen(light, haze, to_clip, (width, height), length))
    seen = [light for light in found if light is not None]
    return sorted(seen, key=lambda light: -sum(light.radiance))


def _on_screen(
    light: Light, haze: Floats, to_clip: Floats, size: tuple[int, int], length: float
) -> LightOnScreen | None:
    is_sun = light.kind == "sun"
    place = np.array([*light.vector, 0.0 if is_sun else 1.0], np.float64)
    x, y, z, w = to_clip @ place
    if w <= 0.0:  # behind the viewer, or beside
        return None
    center = (0.5 + 0.5 * x / w) * size[0], (0.5 + 0.5 * y / w) * size[1]
    depth = 1.0 if is_sun else min(0.5 + 0.5 * z / w, 1.0)
    r, g, b = (float(channel) for channel in haze)
    nearest = PolarGrid.over(center, *size, 1, _MIN_ANGLES).nearest
    if max(r, g, b) * np.exp(-nearest / (REACH * length)) < FAINTEST:
        return None
    return LightOnScreen(center, (r, g, b), depth, length)


def light_shafts(
    picture: Floats,
    alpha: Floats,
    depth: Floats,
    lights: Sequence[LightOnScreen],
    samples: int,
) -> Floats:
    """A picture with the haze of these lights, and the shafts in it.

    Args:
        picture: (height, width, 4) scene-linear, premultiplied.
        alpha: (height, width) coverage by what was drawn.
        depth: (height, width) window depth of it; 1 where nothing is, or only thin hair, which is
            taken to stand before all lights.
        samples: steps along each ray.
    """
    height, width = alpha.shape
    result = np.array(picture, np.float64)
    for light in lights:
        grid = PolarGrid.over(light.center, width, height, samples)
        is_before = (depth < light.depth) | (depth >= 1.0)
        casting = np.where(is_before, alpha, 0.0)[..., None]
        open_fraction = 1.0 - to_polar(casting, grid, outside=0.0)
        blurred = radial_blur(open_fraction, grid, light.length)
        haze = np.exp(-_distances(grid, width, height) / (REACH * light.length))[..., None]
        result[..., :3] += haze * from_polar(blurred, grid, width, height) * light.radiance
    return result.astype(np.float32)


def to_polar(picture: Floats, grid: PolarGrid, outside: float | None = None) -> Floats:
    """A picture (height, width, n) as rays from a place, (angles, radii, n), bilinear.

    Args:
        outside: the value beyond the picture's edges; None: that of the edge.
    """
    height, width = picture.shape[:2]
    x, y = grid.places
    values = _bilinear(picture, x - 0.5, y - 0.5, wraps=False)
    if outside is not None:
        is_inside = (x >= 0.0) & (x <= width) & (y >= 0.0) & (y <= height)
        values = np.where(is_inside[..., None], values, outside)
    return values


def radial_blur(rays: Floats, grid: PolarGrid, length: float, start_weight: float = 1.0) -> Floats:
    """Rays (angles, radii, n) blurred outwards.

    Exact at the end of each texel, for values that are constant over texels.

    Args:
        length: over which a value fades by 1/e [pixels].
        start_weight: the value before the first texel.
    """
    blurred = np.empty(rays.shape, np.float64)
    step_decay = np.exp(-grid.step / length)
    weight = -np.expm1(-grid.nearest / length)
    total = start_weight * weight
    for index in range(grid.radii):
        total = rays[:, index] * (1.0 - step_decay) + total * step_decay
        weight = 1.0 - step_decay + weight * step_decay
        blurred[:, index] = total / weight
    return blurred


def from_polar(rays: Floats, grid: PolarGrid, width: int, height: int) -> Floats:
    """The picture (height, width, n) of rays (angles, radii, n), bilinear."""
    away = _away(grid, width, height)
    row = (_angles_from(grid.middle, away) / grid.span + 0.5) * grid.angles - 0.5
    column = (_distances(grid, width, height) - grid.nearest) / grid.step - 0.5
    return _bilinear(rays, column, row, wraps=grid.is_round)


def _away(grid: PolarGrid, width: int, height: int) -> Floats:
    """From the grid's centre to the middle of each pixel, (height, width, 2)."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return np.stack([x, y], axis=-1) - grid.center


def _distances(grid: PolarGrid, width: int, height: int) -> Floats:
    return np.linalg.norm(_away(grid, width, height), axis=-1)


def _angles_from(middle: float, away: Floats) -> Floats:
    """Angles of directions (..., 2) against one of them, from -pi to pi."""
    x, y = away[..., 0], away[..., 1]
    ahead = x * np.cos(middle) + y * np.sin(middle)
    return np.arctan2(y * np.cos(middle) - x * np.sin(middle), ahead)


def _bilinear(texels: Floats, x: Floats, y: Floats, *, wraps: bool) -> Floats:
    """Values at places in texels, bilinear; beyond the sides those of the edge, or rows wrap
    around."""
    height, width = texels.shape[:2]
    left, lower = np.floor(x), np.floor(y)
    across, up = (x - left)[..., None], (y - lower)[..., None]

    def at(column: Floats, row: Floats) -> Floats:
        row = row % height if wraps else np.clip(row, 0, height - 1)
        return texels[row.astype(int), np.clip(column, 0, width - 1).astype(int)]

    below = at(left, lower) * (1.0 - across) + at(left + 1, lower) * across
    above = at(left, lower + 1) * (1.0 - across) + at(left + 1, lower + 1) * across
    return below * (1.0 - up) + above * up
