"""The space of one light's map: its picture of the hair, and the depth along its rays.

A map covers the hair's bounding sphere. Of a sun it is a square as wide as the sphere; of a light
at a place it is the picture of a camera there. Depth runs evenly from 0 at the near end of the
sphere to 1 at its far end, so that layers are equally thick whatever the light.

The frame hangs on light and hair alone: what the camera does changes nothing in it. Its centre and
size move in steps, so that hair which sways does not make the map's texels swim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ..lights import Light

#: the sphere is a little larger than the hair, so that nothing lies on a map's edge
_ROOM = 1.02
#: [m] hair smaller than this gets a map as if it were so large
_LEAST_RADIUS = 1e-4
#: a light must be this many radii from the middle of the hair; else it is inside
_LEAST_DISTANCE = 1.1
#: sizes of the sphere come in such steps, and its centre in such shares of its radius
_SIZE_STEP, _PLACE_STEP = 1.05, 1.0 / 64.0


@dataclass(frozen=True)
class Ball:
    """A sphere around hair: centre (3,) [m], world space, and radius [m]."""

    center: Floats
    radius: float


@dataclass(frozen=True)
class LightFrame:
    """How a light sees a ball.

    to_map: (4, 4) world to homogeneous map coordinates; after the division x and y are in -1..1.
    to_depth: (4,) depth = dot(to_depth, (x, y, z, 1)), 0 to 1 through the ball.
    thickness: of the whole ball along the light [m].
    """

    to_map: Floats
    to_depth: Floats
    thickness: float

    def places(self, points: Floats) -> tuple[Floats, Floats]:
        """Map coordinates in 0..1, (..., 2), and depths, (...), of points (..., 3) [m].

        Points behind a light get a place outside of the map.
        """
        homogeneous = np.concatenate([points, np.ones_like(points[..., :1])], axis=-1)
        clip = homogeneous @ self.to_map.T
        w = clip[..., 3:]
        place = np.where(w > 0.0, 0.5 * clip[..., :2] / np.where(w > 0.0, w, 1.0) + 0.5, -1.0)
        return place, homogeneous @ self.to_depth

    def texel_width(self, points: Floats, resolution: int) -> Floats:
        """Side of a texel at points (..., 3), (...) [m]."""
        homogeneous = np.concatenate([points, np.ones_like(points[..., :1])], axis=-1)
        w = homogeneous @ self.to_map[3]
        return 2.0 * w / (np.linalg.norm(self.to_map[0, :3]) * resolution)


def ball_around(points: Floats) -> Ball:
    """A sphere around points (..., 3) [m], in steps that hide small motion."""
    flat = points.reshape(-1, 3)
    middle = 0.5 * (flat.min(axis=0).astype(np.float64) + flat.max(axis=0))
    return stepped_ball(middle, float(np.sqrt(np.max(np.sum((flat - middle) ** 2, axis=1)))))


def reach_of(strands: Floats) -> float:
    """How far from the middle of all roots hair can get as long as it keeps its length, [m].

    Args:
        strands: (strand_count, cv_count, 3) [m].
    """
    roots = strands[:, 0].astype(np.float64)
    lengths = np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)
    return float(np.max(np.linalg.norm(roots - roots.mean(axis=0), axis=1) + lengths))


def stepped_ball(center: Floats, radius: float) -> Ball:
    """A sphere that holds this one; its centre and size move in steps."""
    radius = max(radius, _LEAST_RADIUS) * _ROOM
    # a step up: the centre may move by half a step along each axis, and it still holds all
    stepped = radius * (1.0 + np.sqrt(3.0) * _PLACE_STEP)
    stepped = float(_SIZE_STEP ** np.ceil(np.log(stepped) / np.log(_SIZE_STEP)))
    step = stepped * _PLACE_STEP
    return Ball(np.round(np.asarray(center, np.float64) / step) * step, stepped)


def light_frame(light: Light, ball: Ball) -> LightFrame | None:
    """The frame of a light's map; None where the light stands in the hair and throws no shadow."""
    if light.kind == "sun":
        return _of_sun(np.asarray(light.vector, np.float64), ball)
    away = np.asarray(light.vector, np.float64) - ball.center
    distance = float(np.linalg.norm(away))
    if distance < _LEAST_DISTANCE * ball.radius:
        return None
    return _of_place(away / distance, distance, ball)


def _of_sun(towards: Floats, ball: Ball) -> LightFrame:
    right, up, towards = _axes(towards)
    to_map = np.eye(4)
    to_map[:2, :3] = right / ball.radius, up / ball.radius
    to_map[:2, 3] = -to_map[:2, :3] @ ball.center
    to_map[2] = _depth(towards, ball)
    return LightFrame(to_map, to_map[2].copy(), 2.0 * ball.radius)


def _of_place(towards: Floats, distance: float, ball: Ball) -> LightFrame:
    right, up, towards = _axes(towards)
    # the cone that touches the ball
    tangent = ball.radius / np.sqrt(distance**2 - ball.radius**2)
    eye = ball.center + distance * towards
    to_map = np.zeros((4, 4))
    to_map[:2, :3] = right / tangent, up / tangent
    to_map[:2, 3] = -to_map[:2, :3] @ eye
    to_map[2] = _depth(towards, ball)
    to_map[3, :3] = -towards
    to_map[3, 3] = towards @ eye
    return LightFrame(to_map, to_map[2].copy(), 2.0 * ball.radius)


def _depth(towards: Floats, ball: Ball) -> Floats:
    row = np.zeros(4)
    row[:3] = -towards / (2.0 * ball.radius)
    row[3] = 0.5 + towards @ ball.center / (2.0 * ball.radius)
    return row


def _axes(towards: Floats) -> tuple[Floats, Floats, Floats]:
    """Right, up and the direction itself; they turn smoothly with it but at one pole."""
    towards = towards / np.linalg.norm(towards)
    pole = np.array([0.0, 1.0, 0.0]) if abs(towards[2]) > 0.999 else np.array([0.0, 0.0, 1.0])
    right = np.cross(pole, towards)
    right /= np.linalg.norm(right)
    return right, np.cross(towards, right), towards
