"""Spheres, closed surfaces whose shadows are known."""

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


def globe(rings: int, radius: float = 0.1) -> Surface:
    """A sphere with this many circles of latitude."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings))
    points = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1
    )
    index = np.arange(2 * rings * rings).reshape(2 * rings, rings)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    quads = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], axis=2)
    return Surface(points.reshape(-1, 3) * radius, quads.reshape(-1, 3))
