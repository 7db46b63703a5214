"""Triangles by their corners (n, 3, 3): areas, quarters, points within."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: The four quarters of a triangle: for each the barycentric coordinates of its corners.
_QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[0, 1, 1], [1, 0, 1], [1, 1, 0]],
    ]
) / 2.0  # fmt: skip


def area_vectors(corners: Floats) -> Floats:
    """Across triangles, to where they are seen counter-clockwise, as long as their areas, (n, 3)
    [m^2]."""
    vectors: Floats = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    return vectors


def areas_of(corners: Floats) -> Floats:
    """(n,) [m^2]."""
    area: Floats = np.linalg.norm(area_vectors(corners), axis=1)
    return area


def quartered(values: Floats) -> Floats:
    """Values (n, 3, ...) at the corners of triangles, at those of their quarters, (4 n, 3, ...)."""
    quarters = np.einsum("qck,nk...->nqc...", _QUARTERS, values)
    return quarters.reshape(-1, 3, *values.shape[2:])


def evenly_within(one: Floats, other: Floats) -> Floats:
    """Barycentric coordinates (n, 3), even over a triangle as two numbers (n,) are from 0 to 1
    (Turk 1990, Graphics Gems)."""
    root = np.sqrt(one)
    return np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
