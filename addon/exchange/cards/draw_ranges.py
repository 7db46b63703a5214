"""Which indices of a sorted mesh belong to which group, layer and card."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...arrays import Ints
from ...cards.card_mesh import CardMesh


def group_ranges(mesh: CardMesh, *, by_layer: bool) -> dict[str, list[int]]:
    """Runs of triangles of one group, or of one group and layer, in the order in which they are
    drawn.

    Columns of a table: group, layer, first index, and number of indices.
    """
    names = ("group", "layer") if by_layer else ("group",)
    keys = np.stack([getattr(mesh, name)[mesh.card] for name in names], axis=1)
    runs = _runs(keys)
    columns = keys[[start for start, _ in runs]].T.tolist()
    return {**dict(zip(names, columns, strict=True)), **_indices(runs)}


def card_ranges(mesh: CardMesh) -> dict[str, list[int]] | None:
    """The triangles of each card, in the order in which they are drawn, as a table like that of
    `group_ranges`; None where pieces of a card are sorted separately, and so lie in many places.
    """
    runs = _runs(mesh.card[:, None])
    if len(runs) > mesh.card_count:
        return None
    return {"card": mesh.card[[start for start, _ in runs]].tolist(), **_indices(runs)}


def _indices(runs: list[tuple[int, int]]) -> dict[str, list[int]]:
    return {"first": [3 * start for start, _ in runs], "count": [count for _, count in runs]}


def _runs(keys: Ints) -> list[tuple[int, int]]:
    """(first triangle, count of indices) of each run of equal rows; there is at least one row."""
    starts = np.flatnonzero(np.any(np.diff(keys, axis=0), axis=1)) + 1
    bounds = [0, *starts.tolist(), len(keys)]
    return [(one, 3 * (two - one)) for one, two in pairwise(bounds)]
