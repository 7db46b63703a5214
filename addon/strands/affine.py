"""Affine motions of many points."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

_BLOCK = 8192  # points moved at once, so that they stay in the cache
_ROUNDING = 1e-5  # of the scales of matrices in single precision


def transform_points(points: Floats, matrix: Floats) -> Floats:
    """Points (n, 3) moved by an affine (4, 4) matrix, float32; the same array for the identity.

    Does not use `@`: BLAS splits such a thin product over threads that wait for each other, and
    takes anything from 2 to 300 ms for 1.6 million points on a busy machine; this takes 13 ms.
    Points that are not finite stay so.
    """
    if np.array_equal(matrix, np.eye(4)):
        return points
    rows = np.asarray(matrix, np.float32)
    result = np.empty(points.shape, np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        for begin in range(0, len(points), _BLOCK):
            x, y, z = np.ascontiguousarray(points[begin : begin + _BLOCK].T)
            for axis in range(3):
                along = x * rows[axis, 0]
                along += y * rows[axis, 1]
                along += z * rows[axis, 2]
                result[begin : begin + _BLOCK, axis] = along + rows[axis, 3]
    return result


def mean_scale(matrix: Floats) -> float:
    """The mean scale of an affine (4, 4) matrix: the cube root of its change of volume."""
    return float(abs(np.linalg.det(np.asarray(matrix, np.float64)[:3, :3])) ** (1.0 / 3.0))


def without_scale(matrix: Floats, origin: Floats) -> Floats:
    """The rigid motion that is nearest to an affine (4, 4) one and moves this point (3,) as it
    does; the same matrix if it is rigid already, or flat.

    Uses the polar decomposition: Higham 1986, "Computing the polar decomposition".
    """
    left, sizes, right = np.linalg.svd(np.asarray(matrix, np.float64)[:3, :3])
    handedness = np.linalg.det(left @ right)
    is_rigid = np.allclose(sizes, 1.0, rtol=0.0, atol=_ROUNDING) and handedness > 0.0
    if is_rigid or not sizes[-1] > _ROUNDING * sizes[0]:
        return matrix
    result = np.eye(4)
    result[:3, :3] = (left * [1.0, 1.0, np.sign(handedness)]) @ right
    result[:3, 3] = matrix[:3, :3] @ origin + matrix[:3, 3] - result[:3, :3] @ origin
    return result


def rotation_about(middle: Floats, angle: float) -> Floats:
    """The (4, 4) rotation by an angle [rad] about the vertical axis through a point (3,)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.eye(4)
    turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
    turn[:3, 3] = middle - turn[:3, :3] @ middle
    return turn
