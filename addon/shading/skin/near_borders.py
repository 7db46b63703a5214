"""Which border of its island is nearest to each texel of a UV map."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats, Ints, number_in_piece
from .seams import Borders

#: [texels] step along a border between the seeds of the search
_SEED_STEP = 0.5
_NEIGHBOURS = tuple((x, y) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y)


def nearest_borders(
    borders: Borders, place: Floats, triangle_island: Ints, island: Ints, reach: float
) -> Ints:
    """The number of the nearest border of each texel, (rows, columns), -1 where none is in reach.

    For a texel inside an island only that island's borders count, outside all of them do. The
    search spreads from the borders, one ring of texels after the other.

    Args:
        island: (rows, columns) of covered texels; -1 outside, -2 for texels to leave out.
        reach: [texels].
    """
    rows, columns = island.shape
    flat = island.ravel()
    start = place[borders.triangle, borders.start]
    end = place[borders.triangle, borders.end]
    of_border = triangle_island[borders.triangle]
    nearest = np.full(rows * columns, -1)
    distance = np.full(rows * columns, np.inf)
    seeds = _seeds(start, end, columns, rows)
    # the texels that a border runs through may all lie on its other side
    texel, border = (
        np.concatenate(p) for p in zip(seeds, _spread(*seeds, columns, rows), strict=True)
    )
    while len(texel):
        middle = np.stack([texel % columns + 0.5, texel // columns + 0.5], axis=1)
        far = _distance(middle, start[border], end[border])
        is_own = (flat[texel] == -1) | (flat[texel] == of_border[border])
        is_better = is_own & (far <= reach) & (far < distance[texel] - 1e-9)
        texel, border, far = texel[is_better], border[is_better], far[is_better]
        # the last write to a texel wins: its nearest border, of equal ones the first
        order = np.lexsort([-border, -far])
        distance[texel[order]], nearest[texel[order]] = far[order], border[order]
        ring = np.unique(texel)
        texel, border = _spread(ring, nearest[ring], columns, rows)
    return nearest.reshape(rows, columns)


def along_border(points: Floats, start: Floats, end: Floats) -> Floats:
    """Where on an edge the place nearest to each point lies, (n,), 0 at its start and 1 at its end.

    All are (n, 2).
    """
    edge = end - start
    squared = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-18)
    fraction: Floats = np.clip(np.einsum("ij,ij->i", points - start, edge) / squared, 0.0, 1.0)
    return fraction


def _distance(points: Floats, start: Floats, end: Floats) -> Floats:
    nearest = start + along_border(points, start, end)[:, None] * (end - start)
    distance: Floats = np.linalg.norm(points - nearest, axis=1)
    return distance


def _seeds(start: Floats, end: Floats, columns: int, rows: int) -> tuple[Ints, Ints]:
    """Texels along each border, and the border of each."""
    count = np.ceil(np.linalg.norm(end - start, axis=1) / _SEED_STEP).astype(int) + 1
    border = np.repeat(np.arange(len(start)), count)
    number = number_in_piece(count)
    fraction = (number / np.maximum(count - 1, 1)[border])[:, None]
    point = start[border] + fraction * (end[border] - start[border])
    column, row = np.clip(np.floor(point), 0, [columns - 1, rows - 1]).astype(int).T
    return row * columns + column, border


def _spread(texel: Ints, border: Ints, columns: int, rows: int) -> tuple[Ints, Ints]:
    """The texels around these, with the same borders."""
    found = []
    for x, y in _NEIGHBOURS:
        column, row = texel % columns + x, texel // columns + y
        is_there = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found.append((row[is_there] * columns + column[is_there], border[is_there]))
    return np.concatenate([t for t, _ in found]), np.concatenate([b for _, b in found])
