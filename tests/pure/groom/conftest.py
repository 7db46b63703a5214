"""A head for the tests of `groom/`: an egg with UVs, upright, facing -Y."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands import Surface

ROWS, COLUMNS = 24, 48
SEMI_AXES = (0.08, 0.1, 0.12)  # [m]


@pytest.fixture(scope="session")
def egg() -> Surface:
    """An ellipsoid around the origin, its vertices exactly on x^2/a^2 + y^2/b^2 + z^2/c^2 = 1."""
    up, around = np.meshgrid(
        np.linspace(0.0, np.pi, ROWS + 1), np.linspace(0.0, 2.0 * np.pi, COLUMNS + 1), indexing="ij"
    )
    ball = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1)
    uv = np.stack([around / (2.0 * np.pi), 1.0 - up / np.pi], axis=-1).reshape(-1, 2)
    row, column = np.meshgrid(np.arange(ROWS), np.arange(COLUMNS), indexing="ij")
    a = (row * (COLUMNS + 1) + column).ravel()
    b, c, d = a + 1, a + COLUMNS + 1, a + COLUMNS + 2
    triangles = np.concatenate(
        [np.stack([a, c, d], axis=1)[: ROWS * COLUMNS], np.stack([a, d, b], axis=1)]
    )
    positions = (ball * SEMI_AXES).reshape(-1, 3)
    corners = positions[triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    triangles = triangles[area > 1e-12]
    welded = _welded(positions)
    return Surface(positions, welded[triangles], uv[triangles])


def _welded(positions: np.ndarray) -> np.ndarray:
    """For each vertex the first one at its place, so that normals have no seam."""
    _, first, inverse = np.unique(
        positions.round(9), axis=0, return_index=True, return_inverse=True
    )
    return first[inverse.ravel()]
