"""Colouring the edges of a mesh: no two edges of a colour share a vertex.

So all edges of a colour can be moved at once without affecting each other, and one colour after the
other is a Gauss-Seidel sweep.
"""

from __future__ import annotations

import heapq

import numpy as np

from ...arrays import Floats, Ints


def unique_edges(triangles: Ints, extra_edges: Ints | None = None) -> Ints:
    """Each edge once, (edge_count, 2) int64 with the lower vertex first, in ascending order.

    Args:
        triangles: (triangle_count, 3).
        extra_edges: (n, 2) edges that belong to no triangle.
    """
    sides = [triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]
    return _unique_pairs(np.concatenate(sides if extra_edges is None else [*sides, extra_edges]))


def opposite_pairs(triangles: Ints) -> Ints:
    """The two vertices opposite each inner edge, (n, 2), each pair once; pairs that are edges
    themselves are left out.

    At an edge of three triangles or more, each is paired with the next.
    """
    triangles = np.asarray(triangles, np.int64)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    outer = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
    sides.sort(axis=1)
    order = np.lexsort((outer, sides[:, 1], sides[:, 0]))
    sides, outer = sides[order], outer[order]
    same = (sides[1:] == sides[:-1]).all(axis=1)
    pairs = _unique_pairs(np.stack([outer[:-1][same], outer[1:][same]], axis=1))
    known = {tuple(edge) for edge in unique_edges(triangles).tolist()}
    kept = [tuple(pair) not in known for pair in pairs.tolist()]
    return pairs[np.array(kept, bool)]


def greedy_colors(pairs: Ints) -> Ints:
    """A colour for each pair (n, 2), the lowest that is free at both vertices, (n,)."""
    used_colors: dict[int, int] = {}  # vertex -> its colours as bits
    colors = np.empty(len(pairs), np.int64)
    for number, (one, other) in enumerate(pairs.tolist()):
        used = used_colors.get(one, 0) | used_colors.get(other, 0)
        free = ~used & (used + 1)
        used_colors[one] = used_colors.get(one, 0) | free
        used_colors[other] = used_colors.get(other, 0) | free
        colors[number] = free.bit_length() - 1
    return colors


def distances_along_edges(
    edges: Ints, length: Floats, seeds: Ints, vertex_count: int
) -> tuple[Floats, Ints]:
    """The shortest path along edges to the nearest seed (Dijkstra 1959).

    Returns:
        Its length (vertex_count,) float64 [m], infinite where there is none, and that seed
        (vertex_count,), -1 where there is none.
    """
    beside: list[list[tuple[int, float]]] = [[] for _ in range(vertex_count)]
    for (one, other), distance in zip(edges.tolist(), length.tolist(), strict=True):
        beside[one].append((other, distance))
        beside[other].append((one, distance))
    best = [np.inf] * vertex_count
    nearest = [-1] * vertex_count
    queue = [(0.0, seed, seed) for seed in seeds.tolist()]
    heapq.heapify(queue)
    while queue:
        distance, vertex, seed = heapq.heappop(queue)
        if distance >= best[vertex]:
            continue
        best[vertex], nearest[vertex] = distance, seed
        for other, step in beside[vertex]:
            if distance + step < best[other]:
                heapq.heappush(queue, (distance + step, other, seed))
    return np.array(best), np.array(nearest)


def _unique_pairs(pairs: Ints) -> Ints:
    """Pairs of two different vertices, the lower first, each once, in ascending order."""
    pairs = np.sort(np.asarray(pairs, np.int64).reshape(-1, 2), axis=1)
    unique: Ints = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    return unique
