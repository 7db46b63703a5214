"""How a light sees all meshes of a scene, for the map of their depths.

An opacity map covers the hair alone. Meshes cast shadows on meshes everywhere, so each light has
maps of its own for them, one or more frames of light_frame.py: a sun has a square over all meshes,
a spot its cone, other lights the cone that holds all meshes, and a light amidst them the sides of a
cube.

A ground is large and would take most texels. A flat mesh casts no shadow on itself, and other
meshes in its shadow lie in the frames anyway. So the frames leave out the largest flat mesh, but it
is drawn as far as it lies in them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ...strands import Surface
from ..lights import LIGHT_CAPACITY, Light
from .light_frame import (
    Ball,
    LightFrame,
    perspective_frame,
    quantized_ball,
    shines_along,
    sun_frame,
)

#: maximum number of frames of all lights: each light amidst meshes sees them in the sides of a cube
MESH_FRAME_CAPACITY = 6 * LIGHT_CAPACITY
#: maximum half angle of one frame [rad]; wider views take the sides of a cube
_WIDEST = float(np.radians(55.0))
#: tangent of half the angle of a cube's side, with room for the filter at its border
_SIDE = 1.02
#: maximum distance of a flat mesh's vertices from its plane, as a fraction of its size
_FLAT = 1e-5
#: vertices that are tested before all are
_FEW = 64


@dataclass(frozen=True, eq=False)
class Extent:
    """Where a mesh is: lowest and highest corner of its box, (3,) [m]; is_flat: in one plane."""

    low: Floats
    high: Floats
    is_flat: bool

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.high - self.low))

    @property
    def corners(self) -> Floats:
        """(8, 3) [m]."""
        ends = np.array([self.low, self.high], np.float64)
        x, y, z = np.indices((2, 2, 2)).reshape(3, 8)
        return np.stack([ends[x, 0], ends[y, 1], ends[z, 2]], axis=1)


def extent_of(surface: Surface) -> Extent:
    """The extent of a mesh with vertices."""
    low, high = surface.bounds()
    return Extent(low, high, _is_flat(surface.positions, float(np.linalg.norm(high - low))))


def ball_of_casters(extents: Sequence[Extent]) -> Ball | None:
    """The ball around all meshes between which shadows may fall; None where none can."""
    flat = max((each for each in extents if each.is_flat), key=lambda e: e.size, default=None)
    counted = [each for each in extents if each is not flat]
    if not counted:
        return None
    low = np.min([each.low for each in counted], axis=0)
    high = np.max([each.high for each in counted], axis=0)
    return quantized_ball(0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)))


def mesh_frames(light: Light, ball: Ball) -> tuple[LightFrame, ...]:
    """The frames in which a light sees all meshes; none for a light that casts no shadow, or shines
    past them.

    Args:
        ball: around the meshes. Places beyond it have the depth of its far end.
    """
    if not light.casts_shadow:
        return ()
    if light.kind == "sun":
        return (sun_frame(np.asarray(light.vector, np.float64), ball, light.map_roll),)
    eye = np.asarray(light.vector, np.float64)
    away = eye - ball.center
    distance = float(np.linalg.norm(away))
    ends = max(distance - ball.radius, 0.0), distance + ball.radius
    axis, tangent = shines_along(light), _cone_tangent(light)
    is_around = distance * np.sin(_WIDEST) <= ball.radius
    reach = np.inf if is_around else ball.radius / np.sqrt(distance**2 - ball.radius**2)
    if axis is not None and tangent < min(reach, float(np.tan(_WIDEST))):
        return (perspective_frame(-axis, eye, tangent, (0.0, ends[1]), light.map_roll),)
    if not is_around:
        return (perspective_frame(away / distance, eye, float(reach), ends, light.map_roll),)
    sides = _sides(axis)
    return tuple(
        perspective_frame(-side, eye, _SIDE, (0.0, ends[1]))
        for side in sides
        if _sees(side, -away, ball)
    )


def _is_flat(positions: Floats, size: float) -> bool:
    """Whether all vertices lie in the plane through three that are far apart."""
    for places in (positions[:_FEW], positions):
        offset = places - places[0].astype(np.float64)
        first = offset[np.argmax((offset**2).sum(axis=1))]
        normals = np.cross(first, offset)
        lengths = np.linalg.norm(normals, axis=1)
        normal = normals[np.argmax(lengths)] / max(float(lengths.max()), 1e-30)
        if np.abs(offset @ normal).max() > _FLAT * size:
            return False
    return True


def _cone_tangent(light: Light) -> float:
    """Tangent of half the angle of a spot's cone; infinite for all else."""
    return np.inf if light.cone is None else max(float(np.tan(light.cone.max_angle)), 1e-3)


def _sides(axis: Floats | None) -> Iterator[Floats]:
    """Directions in which a light looks: along its beam and across it, or along all axes."""
    rows = np.eye(3)
    if axis is not None:
        rows = np.linalg.qr(np.column_stack([axis, np.eye(3)]))[0].T
        rows[0] *= np.sign(rows[0] @ axis)
    for number, row in enumerate(rows):
        yield row
        if number or axis is None:  # a beam has no back
            yield -row


def _sees(side: Floats, center: Floats, ball: Ball) -> bool:
    """Whether any of the ball may lie in a cube's side. center: of the ball, from the light."""
    distance = float(np.linalg.norm(center))
    if distance <= ball.radius:
        return True
    away = np.arccos(np.clip(center @ side / distance, -1.0, 1.0))
    corner = np.arctan(np.sqrt(2.0) * _SIDE)
    return bool(away < corner + np.arcsin(ball.radius / distance))
