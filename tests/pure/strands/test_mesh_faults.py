"""Faults at the edges of a box, against known ones, and coincident places."""

from __future__ import annotations

import numpy as np

from hairloom.addon.strands import Surface
from hairloom.addon.strands.mesh_faults import edges_of
from hairloom.addon.strands.weld import unique_position_indices

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([q[:3] for q in QUADS] + [(q[0], q[2], q[3]) for q in QUADS])


def test_a_whole_box_has_no_faults_however_it_is_parted() -> None:
    whole = Surface(CORNERS, TRIANGLES)
    for surface in (whole, Surface(whole.corners.reshape(-1, 3), np.arange(36).reshape(12, 3))):
        edges = edges_of(surface)
        assert edges.are_closed and len(edges.uses) == 18
        assert (edges.open_count, edges.crowded_count, edges.opposed_count) == (0, 0, 0)


def test_each_fault_is_counted() -> None:
    hole = edges_of(Surface(CORNERS, TRIANGLES[1:]))
    assert not hole.are_closed
    assert (hole.open_count, hole.crowded_count, hole.opposed_count) == (3, 0, 0)
    turned = TRIANGLES.copy()
    turned[0] = turned[0, ::-1]
    odd = edges_of(Surface(CORNERS, turned))
    assert not odd.are_closed
    assert (odd.open_count, odd.crowded_count, odd.opposed_count) == (0, 0, 3)
    # an inner wall along two edges of the box and two diagonals of its faces, edges as well
    wall = np.concatenate([TRIANGLES, [(0, 3, 7), (0, 7, 4)]])
    inner = edges_of(Surface(CORNERS, wall))
    assert not inner.are_closed
    assert (inner.open_count, inner.crowded_count, inner.opposed_count) == (0, 4, 0)


def test_places_are_those_of_sorting() -> None:
    random = np.random.default_rng(3)
    positions = random.integers(-3, 3, (4000, 3)).astype(np.float32) * np.float32(0.1)
    positions[positions == 0.0] *= np.sign(random.normal(size=(positions == 0.0).sum()))
    number = unique_position_indices(positions)
    _, expected = np.unique(positions, axis=0, return_inverse=True)
    pairs = np.unique(np.stack([number, expected.reshape(-1)], axis=1), axis=0)
    assert len(pairs) == number.max() + 1 == expected.max() + 1
    assert len(unique_position_indices(np.zeros((0, 3), np.float32))) == 0
