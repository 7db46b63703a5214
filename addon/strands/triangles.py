"""Functions of triangles given by their corners (n, 3, 3): areas, quarters, points inside."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: Barycentric coordinates of the corners of a triangle's four quarters.
_QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[0, 1, 1], [1, 0, 1], [1, 1, 0]],
    ]
) / 2.0  # fmt: skip


def area_vectors(corners: Floats) -> Floats:
    """Normals as long as the triangles' areas, (n, 3) [m^2], towards the side from which they are
    counter-clockwise."""
    vectors: Floats = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    return vectors


def areas_of(corners: Floats) -> Floats:
    """The areas of triangles, (n,) [m^2]."""
    area: Floats = np.linalg.norm(area_vectors(corners), axis=1)
    return area


def quartered(values: Floats) -> Floats:
    """Values (n, 3, ...) at triangle corners, interpolated to their quarters', (4 n, 3, ...)."""
    quarters = np.einsum("qck,nk...->nqc...", _QUARTERS, values)
    return quarters.reshape(-1, 3, *values.shape[2:])


def uniform_barycentrics(one: Floats, other: Floats) -> Floats:
    """Barycentric coordinates (n, 3), uniform over a triangle if the two numbers (n,) are uniform
    in [0, 1] (Turk 1990, Graphics Gems)."""
    root = np.sqrt(one)
    return np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
