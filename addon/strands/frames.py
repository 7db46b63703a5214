"""Directions along strands: unit tangents, and normals that do not twist."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints, pieces_of_rows
from .vectors import dot_rows, unit_or

#: Shortest usable normal before it is normalized, squared; shortest vector with a direction [m].
_MIN_SQUARED_NORMAL, _MIN_LENGTH = 1.0e-6, np.float32(1.0e-6)


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
    """Unit tangents from root to tip of concatenated strands; points and result are rows
    (3, point_count)."""
    edge = np.zeros_like(points)
    np.subtract(points[:, 1:], points[:, :-1], out=edge[:, :-1])
    edge[:, offsets[1:] - 1] = 0.0
    both = edge.copy()
    both[:, 1:] += edge[:, :-1]
    return _unit_or_up(both)


def tangents_at(points: Floats, offsets: Ints, chosen: Ints) -> Floats:
    """`strand_tangents` at the chosen ones (k,) of the points (point_count, 3), rows (3, k)."""
    strand = pieces_of_rows(chosen, offsets)
    after = points.take(np.minimum(chosen + 1, offsets[strand + 1] - 1), axis=0)
    after -= points.take(np.maximum(chosen - 1, offsets[strand]), axis=0)
    return _unit_or_up(np.ascontiguousarray(after.T))


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
    away, along = np.broadcast_arrays(point - center, tangent)
    rows = (np.ascontiguousarray(each.reshape(-1, 3).T) for each in (away, along))
    return np.ascontiguousarray(volume_normal_rows(*rows).T).reshape(away.shape)


def volume_normal_rows(away: Floats, tangent: Floats) -> Floats:
    """`volume_normals` as rows (3, n), where `away` is the vector from the centre."""
    outward = _unit_or_up(away)
    across: Floats = outward - tangent * dot_rows(outward, tangent)
    squared = dot_rows(across, across)
    is_parallel = squared <= _MIN_SQUARED_NORMAL
    if is_parallel.any():
        own = tangent[:, is_parallel].T
        axis = np.eye(3)[np.abs(own).argmin(axis=-1)]
        across[:, is_parallel] = unit_or(np.cross(own, axis), axis).T
        squared[is_parallel] = 1.0
    across /= np.sqrt(squared)
    return across


def _unit_or_up(rows: Floats) -> Floats:
    """Vectors in rows (3, n), scaled to length 1; (0, 0, 1) for those without length."""
    length = np.sqrt(dot_rows(rows, rows))
    found: Floats = rows / np.maximum(length, _MIN_LENGTH)
    is_short = length <= _MIN_LENGTH
    if is_short.any():
        found[:, is_short] = np.array([[0.0], [0.0], [1.0]])
    return found


def _perpendicular(vector: Floats, tangent: Floats) -> Floats:
    """The unit vector along the part of `vector` across `tangent`; any perpendicular if they are
    parallel."""
    across = vector - tangent * np.sum(vector * tangent, axis=-1, keepdims=True)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    smallest_axis = np.abs(tangent).argmin(axis=-1)
    substitute = np.cross(tangent, np.eye(3, dtype=np.float32)[smallest_axis])
    across = np.where(length > 1e-6, across, substitute)
    return (across / np.linalg.norm(across, axis=-1, keepdims=True)).astype(np.float32)
