"""Cameras as pairs of matrices, in OpenGL's convention: view looks along -z, clip z from -1 to 1.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from.

    view: (4, 4) world to view space, a rigid motion.
    projection: (4, 4) view to clip space, perspective or orthographic.
    sample: index of the picture's sample, from 0; hashed alpha discards other fragments in each.
    Both multiply columns: clip = projection @ view @ (x, y, z, 1).
    """

    view: Floats
    projection: Floats
    sample: int = 0

    @property
    def eye(self) -> Floats:
        """The eye in homogeneous world coordinates, (4,).

        xyz is its position and w 1 for a perspective; xyz is the unit direction towards it and w 0
        for an orthographic projection. So `eye.xyz - eye.w * point` points from a point to the eye.
        """
        is_perspective = self.projection[3, 3] == 0.0
        seen = np.array([0.0, 0.0, 0.0, 1.0] if is_perspective else [0.0, 0.0, 1.0, 0.0])
        return np.linalg.inv(np.asarray(self.view, np.float64)) @ seen


def look_at(
    eye: Sequence[float] | Floats,
    target: Sequence[float] | Floats,
    up: Sequence[float] = (0.0, 0.0, 1.0),
) -> Floats:
    """View matrix (4, 4) of an eye [m] that looks at a target [m].

    Raises:
        ValueError: eye and target are one point, or `up` is the direction of view.
    """
    position = np.asarray(eye, np.float64)
    backward = position - np.asarray(target, np.float64)
    right = np.cross(np.asarray(up, np.float64), backward)
    if not (np.linalg.norm(backward) > 0.0 and np.linalg.norm(right) > 0.0):
        raise ValueError(f"no view from {eye} to {target} with {up} up")
    backward /= np.linalg.norm(backward)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(backward, right), backward
    view[:3, 3] = -view[:3, :3] @ position
    return view


def perspective(field_of_view: float, aspect: float, near: float, far: float) -> Floats:
    """Projection (4, 4) with a vertical field of view [rad]; aspect is width / height."""
    if not (0.0 < field_of_view < np.pi and aspect > 0.0 and 0.0 < near < far):
        raise ValueError(f"no projection from {field_of_view=}, {aspect=}, {near=}, {far=}")
    focal = 1.0 / np.tan(field_of_view / 2.0)
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = focal / aspect, focal
    projection[2, 2] = (far + near) / (near - far)
    projection[2, 3] = 2.0 * far * near / (near - far)
    projection[3, 2] = -1.0
    return projection


def orthographic(height: float, aspect: float, near: float, far: float) -> Floats:
    """Projection (4, 4) that shows `height` [m] from bottom to top."""
    if not (height > 0.0 and aspect > 0.0 and near < far):
        raise ValueError(f"no projection from {height=}, {aspect=}, {near=}, {far=}")
    return np.array(
        [
            [2.0 / (height * aspect), 0.0, 0.0, 0.0],
            [0.0, 2.0 / height, 0.0, 0.0],
            [0.0, 0.0, -2.0 / (far - near), -(far + near) / (far - near)],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def frame_camera(
    bounds: tuple[Floats, Floats],
    direction: Sequence[float] | Floats,
    field_of_view: float,
    aspect: float,
    *,
    margin: float = 1.08,
) -> Camera:
    """The perspective camera whose picture just contains a bounding box, all eight corners.

    Args:
        bounds: lowest and highest corner, each (3,) [m], world space.
        direction: from the box towards the eye.
        field_of_view: vertical [rad].
        margin: factor of the picture around the box, 1 is tight.
    """
    low, high = (np.asarray(corner, np.float64) for corner in bounds)
    center = (low + high) / 2.0
    size = max(float(np.linalg.norm(high - low)), 1.0e-9)
    turn = look_at(center + np.asarray(direction, np.float64), center)[:3, :3]
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    seen = (low + corners * (high - low) - center) @ turn.T
    # A corner at (x, y, z) of view space is inside when |y| < (distance - z) tan(fov / 2).
    slope = np.tan(field_of_view / 2.0) / margin
    distance = float(
        np.max(seen[:, 2] + np.maximum(np.abs(seen[:, 1]), np.abs(seen[:, 0]) / aspect) / slope)
    )
    distance = max(distance, 0.01 * size)
    near = max(distance - size, 0.02 * distance)
    view = look_at(center + turn[2] * distance, center)
    return Camera(view, perspective(field_of_view, aspect, near, distance + size))


def frame_points(
    points: Floats,
    direction: Sequence[float] | Floats,
    field_of_view: float,
    aspect: float,
    *,
    margin: float = 1.08,
) -> Camera:
    """The perspective camera whose picture just contains points, centred.

    Args:
        points: (n, 3) [m], world space, at least one. Others as in `frame_camera`.
    """
    places = np.asarray(points, np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    center = (low + high) / 2.0
    turn = look_at(np.asarray(direction, np.float64), np.zeros(3))[:3, :3]
    seen = (places - center) @ turn.T
    # A point at (x, y, z) of view space is inside for an eye at (u, v, distance) when
    # |x - u| < (distance - z) slope_x and |y - v| < (distance - z) slope_y.
    slope = np.tan(field_of_view / 2.0) / margin * np.array([aspect, 1.0])
    right = (seen[:, :2] + seen[:, 2:] * slope).max(axis=0)
    left = (seen[:, 2:] * slope - seen[:, :2]).max(axis=0)
    size = max(float(np.linalg.norm(high - low)), 1.0e-9)
    distance = max(float(((left + right) / (2.0 * slope)).max()), 0.01 * size)
    eye = center + turn.T @ np.array([*(right - left) / 2.0, distance])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = turn, -turn @ eye
    return Camera(view, perspective(field_of_view, aspect, 0.05 * distance, distance + 8.0 * size))
