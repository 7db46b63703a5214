"""Coverage of each pixel, summed over samples: the passes Hair Alpha and Cryptomatte."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...render.cryptomatte import Coverages, metadata
from .engine_passes import CRYPTOMATTE, HAIR_ALPHA, cryptomatte_passes, write


class Mattes:
    """Coverages of one picture."""

    def __init__(self, height: int, width: int, layer: bpy.types.ViewLayer) -> None:
        self._layer = layer
        self._names: dict[str, None] = {}
        self._objects: Coverages | None = None
        if layer.use_pass_cryptomatte_object:
            self._objects = Coverages(height, width, layer.pass_cryptomatte_depth)
        self._hair = np.zeros((height, width), np.float32)
        self._count = 0

    @classmethod
    def of(
        cls, passes: Mapping[str, Any], layer: bpy.types.ViewLayer, width: int, height: int
    ) -> Mattes | None:
        """The mattes of a picture; None if no pass needs them."""
        is_wanted = any(name == HAIR_ALPHA.name or name.startswith(CRYPTOMATTE) for name in passes)
        return cls(height, width, layer) if is_wanted else None

    def add(self, objects: Mapping[str, Floats], hair: Floats) -> None:
        """Add the coverages of one sample, see ScenePass.coverages."""
        self._count += 1
        self._hair += hair
        if self._objects is None:
            return
        for name, coverage in objects.items():
            self._names[name] = None
            self._objects.add(name, coverage)

    def write(self, passes: Mapping[str, Any]) -> None:
        """Write the mattes into Blender's passes."""
        if HAIR_ALPHA.name in passes:
            write(passes[HAIR_ALPHA.name], self._hair / max(self._count, 1))
        if self._objects is None:
            return
        pictures = self._objects.pictures(self._count)
        for each, picture in zip(cryptomatte_passes(self._layer), pictures, strict=True):
            write(passes[each.name], picture)

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata of the Cryptomatte, for files."""
        if self._objects is None:
            return {}
        return metadata(f"{self._layer.name}.{CRYPTOMATTE}", self._names)
