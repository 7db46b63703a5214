"""Vertices without attributes, from which shaders make ribbons; one strip for all instances."""

from __future__ import annotations

from typing import Any

import gpu

from . import gpu_objects


class Ribbons:
    """Strips by how many pieces they have room for, made on first use."""

    def __init__(self) -> None:
        self._batches: dict[int, Any] = {}

    def of(self, capacity: int) -> Any:
        """A strip of two vertices a station, and one station more than pieces."""
        if capacity not in self._batches:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            vertices = gpu_objects.vertex_buffer(layout, 2 * (capacity + 1))
            self._batches[capacity] = gpu_objects.batch(type="TRI_STRIP", buf=vertices)
        return self._batches[capacity]
