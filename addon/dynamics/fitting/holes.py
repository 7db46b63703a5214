"""Closing the holes of a mesh by fans, so that it certainly has an inside."""

from __future__ import annotations

import numpy as np

from ...arrays import Ints
from ...strands import Surface


def close_holes(surface: Surface) -> tuple[Surface, Ints]:
    """The surface with a fan over each ring of open edges, and the indices of the fans' triangles,
    (n,).

    Coincident vertices count as one, so that seams of UVs or normals are no holes. A fan connects a
    ring's middle with its edges, with the same orientation as the neighbouring faces.
    """
    _, merged = np.unique(surface.positions, axis=0, return_inverse=True)
    merged = merged.reshape(-1)
    corners = merged[surface.triangles]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    edges = np.concatenate(
        [surface.triangles[whole][:, [one, (one + 1) % 3]] for one in range(3)], axis=0
    )
    ends = np.sort(merged[edges], axis=1)
    _, which, used = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    open_edges = edges[used[which.reshape(-1)] == 1]
    if not len(open_edges):
        return surface, np.zeros(0, np.int64)
    ring = _rings(merged[open_edges], len(merged))
    names, ring = np.unique(ring, return_inverse=True)
    middle = np.zeros((len(names), 3))
    np.add.at(middle, ring, surface.positions[open_edges].mean(axis=1))
    middle /= np.bincount(ring)[:, None]
    hub = len(surface.positions) + ring
    fans = np.stack([open_edges[:, 1], open_edges[:, 0], hub], axis=1)
    positions = np.concatenate([surface.positions, middle.astype(np.float32)])
    triangles = np.concatenate([surface.triangles, fans])
    return Surface(positions, triangles), len(surface.triangles) + np.arange(len(fans))


def _rings(edges: Ints, vertex_count: int) -> Ints:
    """A number for each edge (n, 2), the same for connected edges."""
    label = np.arange(vertex_count)
    while True:
        least = label[edges].min(axis=1)
        before = label[edges].sum()
        np.minimum.at(label, edges[:, 0], least)
        np.minimum.at(label, edges[:, 1], least)
        label = label[label]  # pointer jumping, so that long rings need few rounds
        if label[edges].sum() == before:
            result: Ints = label[edges[:, 0]]
            return result
