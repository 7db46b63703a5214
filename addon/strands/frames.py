"""Directions along strands: unit tangents, and frames that do not twist."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .vectors import unit_or

_SMALLEST = 1.0e-6


def tangents(grid: Floats) -> Floats:
    """Unit tangents from root to tip, (..., cv_count, 3), by central differences.

    A CV whose neighbours coincide takes the direction of the CV before it.
    """
    edge = np.diff(grid, axis=-2)
    tangent = np.concatenate(
        [edge[..., :1, :], edge[..., 1:, :] + edge[..., :-1, :], edge[..., -1:, :]], axis=-2
    )
    length = np.linalg.norm(tangent, axis=-1, keepdims=True)
    unit = np.divide(tangent, length, out=np.zeros_like(tangent), where=length > 0.0)
    for cv in range(1, grid.shape[-2]):
        flat = length[..., cv, 0] == 0.0
        unit[..., cv, :] = np.where(flat[..., None], unit[..., cv - 1, :], unit[..., cv, :])
    return unit


def strand_tangents(points: Floats, offsets: Ints) -> Floats:
    """Unit tangents from root to tip, (point_count, 3), of strands that lie one after the other."""
    edge = np.zeros_like(points)
    edge[:-1] = points[1:] - points[:-1]
    edge[offsets[1:] - 1] = 0.0
    both = edge.copy()
    both[1:] += edge[:-1]
    return unit_or(both, np.array([0.0, 0.0, 1.0]))


def transported_normals(tangent: Floats, root_normal: Floats) -> Floats:
    """Normals carried from the root without twist, (..., cv_count, 3).

    Each step turns the normal by the rotation that turns one tangent into the next (parallel
    transport; Bishop 1975), then makes it exactly perpendicular.

    Args:
        tangent: (..., cv_count, 3) unit vectors.
        root_normal: (..., 3) any vector that is not parallel to the first tangent.
    """
    normals = np.empty_like(tangent)
    normals[..., 0, :] = _perpendicular(root_normal, tangent[..., 0, :])
    for cv in range(1, tangent.shape[-2]):
        before, now = tangent[..., cv - 1, :], tangent[..., cv, :]
        axis = np.cross(before, now)
        cosine = np.sum(before * now, axis=-1, keepdims=True)
        normal = normals[..., cv - 1, :]
        # Rodrigues' formula with an axis of length sin; 1 + cos is 0 only for a full reversal
        along = np.sum(axis * normal, axis=-1, keepdims=True)
        turned = normal * cosine + np.cross(axis, normal) + axis * along / (1.0 + cosine + 1e-6)
        normals[..., cv, :] = _perpendicular(turned, now)
    return normals


def volume_normals(point: Floats, tangent: Floats, center: Floats) -> Floats:
    """Normals of the hair's volume: away from its centre, made perpendicular to the strand.

    Where the strand itself points away from the centre, any perpendicular will do.

    Args:
        point: (..., 3) [m]. tangent: (..., 3) unit vectors. center: (3,) [m].
    """
    outward = unit_or(point - center, np.array([0.0, 0.0, 1.0]))
    across = outward - tangent * np.sum(outward * tangent, axis=-1, keepdims=True)
    axis = np.eye(3)[np.abs(tangent).argmin(axis=-1)]
    is_long = np.sum(across * across, axis=-1, keepdims=True) > _SMALLEST
    return unit_or(np.where(is_long, across, np.cross(tangent, axis)), axis)


def _perpendicular(vector: Floats, tangent: Floats) -> Floats:
    """The unit part of `vector` across `tangent`; any perpendicular one where they are parallel."""
    across = vector - tangent * np.sum(vector * tangent, axis=-1, keepdims=True)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    least = np.abs(tangent).argmin(axis=-1)
    substitute = np.cross(tangent, np.eye(3, dtype=np.float32)[least])
    across = np.where(length > 1e-6, across, substitute)
    return (across / np.linalg.norm(across, axis=-1, keepdims=True)).astype(np.float32)
