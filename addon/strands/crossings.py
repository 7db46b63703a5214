"""Where lines first pass through the triangles of a mesh."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats, Ints
from .surface import Surface
from .triangle_tree import TriangleTree, build_tree
from .triangles import area_vectors

#: Segments processed at once, and the maximum number of their pairs with boxes.
_CHUNK, _PAIR_LIMIT = 1 << 14, 100_000
#: Factor of the squared reach that makes up for rounding, so that no triangle is missed.
_ROUNDING_FACTOR = 1.0 + 1.0e-6
#: A crossing within this fraction of a line's first segment means that it begins on the surface.
_START_TOLERANCE = 1.0e-4


def first_crossings(lines: Floats, surface: Surface) -> Floats:
    """Where each line first passes through the surface, (n,), in segments from its start.

    Infinite where it does not. The start of a line that begins on the surface is no crossing.

    Args:
        lines: (n, count, 3) points, in the space of the surface, which has triangles.
    """
    corners = surface.corners.astype(np.float64)
    tree = build_tree(corners)
    segments = lines.shape[1] - 1
    start = lines[:, :-1].reshape(-1, 3).astype(np.float64)
    end = lines[:, 1:].reshape(-1, 3).astype(np.float64)
    first = np.full(len(start), np.inf)
    for begin in range(0, len(start), _CHUNK):
        some = np.arange(begin, min(begin + _CHUNK, len(start)))
        for segment, triangle in _candidate_pairs(tree, start, end, some):
            place = _crossing_fractions(start[segment], end[segment], corners[triangle])
            place[(segment % segments == 0) & (place < _START_TOLERANCE)] = np.inf
            np.minimum.at(first, segment, place)
    reached = np.arange(segments) + first.reshape(len(lines), segments)
    found: Floats = reached.min(axis=1, initial=np.inf)
    return found


def _candidate_pairs(
    tree: TriangleTree, start: Floats, end: Floats, some: Ints
) -> Iterator[tuple[Ints, Ints]]:
    """Chunks of the pairs of segment and triangle that may meet."""
    middle, half = 0.5 * (start[some] + end[some]), 0.5 * (end[some] - start[some])
    within = np.einsum("ij,ij->i", half, half) * _ROUNDING_FACTOR + 1.0e-30
    found = tree.leaves_within(middle, within, _PAIR_LIMIT)
    if found is None:
        for part in np.array_split(some, 2):
            yield from _candidate_pairs(tree, start, end, part)
        return
    segment, leaf, _ = found
    triangles = tree.leaf_triangles[leaf]
    yield np.repeat(some[segment], triangles.shape[1]), triangles.ravel()


def _crossing_fractions(start: Floats, end: Floats, corners: Floats) -> Floats:
    """Where each segment passes through its triangle, (n,) from 0 to 1, pair by pair; infinite
    where it does not.

    It does if its ends lie on different sides of the plane and its line passes all three edges on
    the same side (the signs of three volumes). Reversing an edge negates its volume exactly, bit
    for bit, so that no segment slips through between two triangles.
    """
    a, b, c = np.moveaxis(corners - start[:, None], 1, 0)
    step = end - start
    normal = area_vectors(corners)
    before, after = (-np.einsum("ij,ij->i", normal, p) for p in (a, a - step))
    volumes = np.stack(
        [np.einsum("ij,ij->i", step, np.cross(*p)) for p in ((a, b), (b, c), (c, a))]
    )
    is_past = (volumes >= 0.0).all(axis=0) | (volumes <= 0.0).all(axis=0)
    is_through = is_past & ((before >= 0.0) != (after >= 0.0))
    place = np.full(len(start), np.inf)
    return np.divide(before, before - after, out=place, where=is_through)
