"""Vertices without attributes, from which shaders make ribbons; one strip for all instances."""

from __future__ import annotations

from typing import Any

from . import gpu_objects


class Ribbons:
    """Strips by how many pieces they have room for, and points, made on first use."""

    def __init__(self) -> None:
        self._batches: dict[tuple[str, int], Any] = {}

    def of(self, capacity: int) -> Any:
        """A strip of two vertices a station, and one station more than pieces."""
        return self._batch("TRI_STRIP", 2 * (capacity + 1))

    def points(self, count: int) -> Any:
        """As many vertices, a point each."""
        return self._batch("POINTS", count)

    def _batch(self, kind: str, count: int) -> Any:
        if (kind, count) not in self._batches:
            self._batches[kind, count] = gpu_objects.bare_batch(kind, count)
        return self._batches[kind, count]
