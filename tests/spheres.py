"""A closed surface whose shadow is known."""

from __future__ import annotations

import numpy as np

from hairloom.addon.strands import Surface


def ball(radius: float) -> Surface:
    """A sphere around the origin, faces outwards; radius in metres."""
    up, around = np.meshgrid(
        np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65), indexing="ij"
    )
    points = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], -1)
    row, column = np.meshgrid(np.arange(32), np.arange(64), indexing="ij")
    a = (row * 65 + column).ravel()
    triangles = np.concatenate(
        [np.stack([a, a + 65, a + 66], axis=1), np.stack([a, a + 66, a + 1], axis=1)]
    )
    return Surface(radius * points.reshape(-1, 3), triangles)
