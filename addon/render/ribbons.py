"""Vertices without attributes for ribbons, which shaders place; one strip for all instances."""

from __future__ import annotations

from typing import Any

from . import gpu_objects


class Ribbons:
    """Strips by their number of pieces, and points, made on first use."""

    def __init__(self) -> None:
        self._batches: dict[tuple[str, int], Any] = {}

    def strip(self, capacity: int) -> Any:
        """A strip with two vertices per station, and one station more than pieces."""
        return self._batch("TRI_STRIP", 2 * (capacity + 1))

    def points(self, count: int) -> Any:
        """A batch of this many points."""
        return self._batch("POINTS", count)

    def _batch(self, kind: str, count: int) -> Any:
        if (kind, count) not in self._batches:
            self._batches[kind, count] = gpu_objects.bare_batch(kind, count)
        return self._batches[kind, count]
