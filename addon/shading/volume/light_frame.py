"""The space of one light's map: its picture of the hair, and the depth along its rays.

A map covers the hair's bounding sphere. For a sun it is a square as wide as the sphere, for a light
at a place the picture of a camera there. Depth runs evenly from 0 at the near end of the sphere to
1 at its far end, so that layers are equally thick whatever the light.

A light may stand within the sphere, such as a lamp close to long hair. Its map then has the widest
angle that a flat picture can have: a point light's looks towards the middle of the hair, a spot's
and a panel's along the beam. Depth begins at the light, and hair beside and behind the light gets
no shadow. Only a point light amidst the hair has no map at all.

The frame depends on light and hair alone, not on the camera. Its centre and size move in steps, so
that the map's texels do not swim while hair sways.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...strands.arc_length import strand_lengths
from ..lights import Light

#: the sphere is a little larger than the hair, so that nothing lies on a map's edge
_ROOM = 1.02
#: a tangent that is shorter in a map than this, in fractions of its side, points along the light
MIN_PROJECTED_LENGTH = 1e-20
#: [m] minimum radius of the sphere, for hair without extent
MIN_RADIUS = 1e-9
#: maximum half angle of a map [rad]: beyond it, few texels would hold most of the picture
MAX_HALF_ANGLE = float(np.radians(75.0))
#: a point light nearer to the middle of the hair than this, in radii, has hair all around it
_MAX_CENTER_DISTANCE = 0.25
#: a light within the sphere with less of it ahead than this, in radii, shines away from it
_MIN_AHEAD = 0.05
#: Factor between sizes of the sphere, and steps of its centre as a fraction of its radius. Ten is a
#: power of the factor, so that hair in another unit gets the same map.
_SIZE_STEP, _PLACE_STEP = 10.0 ** (1.0 / 47.0), 1.0 / 64.0


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

    def is_ahead(self, points: Floats) -> Bools:
        """Whether points (..., 3) [m] lie on the side to which the light looks, (...)."""
        ahead: Bools = points @ self.to_map[3, :3] + self.to_map[3, 3] > 0.0
        return ahead

    def strand_area(self, points: Floats, along: Floats) -> Floats:
        """The fraction of the map that a short piece of a strand of the width 1 m covers, (...).

        Args:
            points: (..., 3) its middle [m]. along: (..., 3) from one end to the other [m].
        """
        projected, breadth = self._projected_tangent(points, along)
        return np.linalg.norm(projected, axis=-1) * breadth

    def strand_breadth(self, points: Floats, along: Floats) -> Floats:
        """Width in the map of a strand that is 1 m wide, as a fraction of the map's side, (...).

        The width is perpendicular to the light's ray, but the rim of a wide map is oblique to it:
        strands appear wider there, the more so the less they run towards the middle.

        Args:
            points: (..., 3) [m], ahead of the light. along: (..., 3) its tangent.
        """
        return self._projected_tangent(points, along)[1]

    def _projected_tangent(self, points: Floats, along: Floats) -> tuple[Floats, Floats]:
        """A strand's tangent projected to the map, (..., 2), and its width there, (...)."""
        homogeneous = np.concatenate([points, np.ones_like(points[..., :1])], axis=-1)
        clip = homogeneous @ self.to_map.T
        w = clip[..., 3, None, None]
        # derivative of the place by the point
        turn = (self.to_map[:2, :3] - clip[..., :2, None] / w * self.to_map[3, :3]) / (2.0 * w)
        projected = np.einsum("...ij,...j->...i", turn, along)
        length = np.linalg.norm(projected, axis=-1, keepdims=True)
        # a strand along the ray is equally wide in all directions of the map
        is_seen = length > MIN_PROJECTED_LENGTH
        unit = np.where(is_seen, projected, [1.0, 0.0]) / np.where(is_seen, length, 1.0)
        across = np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        return projected, np.linalg.norm(np.einsum("...i,...ij->...j", across, turn), axis=-1)


def ball_around(points: Floats) -> Ball:
    """A sphere around points (..., 3) [m], in steps that hide small motion."""
    flat = points.reshape(-1, 3)
    middle = 0.5 * (flat.min(axis=0).astype(np.float64) + flat.max(axis=0))
    return quantized_ball(middle, float(np.sqrt(np.max(np.sum((flat - middle) ** 2, axis=1)))))


def max_reach(points: Floats, offsets: Ints) -> float:
    """Maximum distance of hair from the middle of all roots, as long as it keeps its length, [m].

    Args:
        points, offsets: as in StrandSet [m].
    """
    roots = points[offsets[:-1]].astype(np.float64)
    away = np.linalg.norm(roots - roots.mean(axis=0), axis=1)
    return float(np.max(away + strand_lengths(points, offsets)))


def quantized_ball(center: Floats, radius: float) -> Ball:
    """A sphere that holds this one; its centre and size move in steps."""
    radius = max(radius, MIN_RADIUS) * _ROOM
    # larger, to hold all though rounding moves the centre by up to half a step along each axis
    stepped = radius * (1.0 + np.sqrt(3.0) * _PLACE_STEP)
    stepped = float(_SIZE_STEP ** np.ceil(np.log(stepped) / np.log(_SIZE_STEP)))
    step = stepped * _PLACE_STEP
    return Ball(np.round(np.asarray(center, np.float64) / step) * step, stepped)


def light_frame(light: Light, ball: Ball) -> LightFrame | None:
    """The frame of a light's map; None where a light within the ball can have none."""
    if light.kind == "sun":
        return sun_frame(np.asarray(light.vector, np.float64), ball, light.map_roll)
    eye = np.asarray(light.vector, np.float64)
    away = eye - ball.center
    distance = float(np.linalg.norm(away))
    if not is_too_near(light, ball):
        # the cone that touches the ball
        tangent = ball.radius / np.sqrt(distance**2 - ball.radius**2)
        ends = distance - ball.radius, distance + ball.radius
        return perspective_frame(away / distance, eye, float(tangent), ends, light.map_roll)
    axis = shines_along(light)
    if axis is None:
        if distance < _MAX_CENTER_DISTANCE * ball.radius:
            return None
        axis = -away / distance
    ahead = float(-away @ axis)
    if ahead + ball.radius < _MIN_AHEAD * ball.radius:
        return None
    near = max(ahead - ball.radius, 0.0)
    ends = near, ahead + ball.radius
    return perspective_frame(-axis, eye, float(np.tan(MAX_HALF_ANGLE)), ends, light.map_roll)


def is_too_near(light: Light, ball: Ball) -> bool:
    """Whether a light sees the ball under a wider angle than a map can have."""
    if light.kind == "sun":
        return False
    distance = float(np.linalg.norm(np.asarray(light.vector, np.float64) - ball.center))
    return distance * np.sin(MAX_HALF_ANGLE) <= ball.radius


def shines_along(light: Light) -> Floats | None:
    """Unit vector along the middle of a light's beam; None for a point, which has none."""
    if light.panel is not None:
        return np.asarray(light.panel.shines_along, np.float64)
    if light.cone is None:
        return None
    right, up, back = np.asarray(light.cone.axes, np.float64)
    along = np.cross(right, up)
    along *= -np.sign(along @ back) / max(float(np.linalg.norm(along)), 1e-30)
    return along if along.any() else None


def sun_frame(towards: Floats, ball: Ball, roll: float = 0.0) -> LightFrame:
    """The frame of a sun, towards which `towards` (3,) points. roll: see Light.map_roll."""
    right, up, towards = _axes(towards, roll)
    to_map = np.eye(4)
    to_map[:2, :3] = right / ball.radius, up / ball.radius
    to_map[:2, 3] = -to_map[:2, :3] @ ball.center
    to_map[2, :3] = -towards / (2.0 * ball.radius)
    to_map[2, 3] = 0.5 + towards @ ball.center / (2.0 * ball.radius)
    return LightFrame(to_map, to_map[2].copy(), 2.0 * ball.radius)


def perspective_frame(
    towards: Floats, eye: Floats, tangent: float, ends: tuple[float, float], roll: float = 0.0
) -> LightFrame:
    """The frame of a light at the place `eye` that looks against `towards`, each (3,).

    Args:
        tangent: of half the angle of view.
        ends: distances from the light at which depth is 0 and 1 [m].
        roll: see Light.map_roll.
    """
    right, up, towards = _axes(towards, roll)
    near, far = ends
    to_map = np.zeros((4, 4))
    to_map[:2, :3] = right / tangent, up / tangent
    to_map[3, :3] = -towards
    to_map[2] = to_map[3] / (far - near)
    to_map[:, 3] = -to_map[:, :3] @ eye
    to_map[2, 3] -= near / (far - near)
    return LightFrame(to_map, to_map[2].copy(), far - near)


def _axes(towards: Floats, roll: float) -> tuple[Floats, Floats, Floats]:
    """Right, up and the direction itself; they turn smoothly with it but near +Z and -Z.

    Args:
        roll: turn of right and up about the direction [rad].
    """
    towards = towards / np.linalg.norm(towards)
    pole = np.array([0.0, 1.0, 0.0]) if abs(towards[2]) > 0.999 else np.array([0.0, 0.0, 1.0])
    right = np.cross(pole, towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    cosine, sine = np.cos(roll), np.sin(roll)
    return cosine * right + sine * up, cosine * up - sine * right, towards
