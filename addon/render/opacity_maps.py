"""The textures of opacity maps, and what a program that reads them has to know.

    starts  R32UI: depths of the first and the last hair, where layers are deep
    meshes  depth array: of the first mesh
    slots   RGBA32F arrays, as many as a framebuffer is given at once, at most six: four layers a
            texel

Each light that throws shadows has a map: in `starts` one square above the other, the last hair's
to the right of the first one's; in the slots as many layers of an array as it takes passes to draw
all its texels, texel t in slot t % slots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gpu

from ..arrays import Floats
from ..shading.volume.map_size import START_TEXELS, MapSize


@dataclass(frozen=True)
class OpacityForm:
    """What a program that reads maps has to know.

    slots: textures of four layers. is_deep: whether each texel's layers have a span of their own.
    passes: layers of each of those arrays that a map takes.
    """

    slots: int
    is_deep: bool
    passes: int

    @property
    def samplers(self) -> tuple[tuple[str, str], ...]:
        """For a recipe."""
        arrays = (("FLOAT_2D_ARRAY", f"opacity_{slot}") for slot in range(self.slots))
        starts = (("UINT_2D", "opacity_starts"),) if self.is_deep else ()
        return (*arrays, ("DEPTH_2D_ARRAY", "opacity_meshes"), *starts)

    @property
    def defines(self) -> tuple[tuple[str, int], ...]:
        """For a recipe."""
        return (("SLOTS", self.slots), ("DEEP", int(self.is_deep)), ("PASSES", self.passes))


@dataclass(frozen=True, eq=False)
class OpacityMaps:
    """What shading reads: the block `Opacity`, and the textures."""

    values: Floats
    size: MapSize
    slots: tuple[Any, ...]
    meshes: Any
    starts: Any = None

    @property
    def form(self) -> OpacityForm:
        return OpacityForm(len(self.slots), self.starts is not None, self.passes)

    @property
    def passes(self) -> int:
        """How many layers of each slot a map has: one a pass that draws it."""
        return self.size.passes

    @property
    def textures(self) -> dict[str, Any]:
        """By their names in the shader."""
        named = {f"opacity_{slot}": array for slot, array in enumerate(self.slots)}
        named["opacity_meshes"] = self.meshes
        return named if self.starts is None else {**named, "opacity_starts": self.starts}

    def forget_starts(self) -> None:
        """As if no light had met any hair."""
        if self.starts is not None:
            self.starts.clear(format="UINT", value=(-1,))  # beyond all depths


def new_maps(values: Floats, size: MapSize) -> OpacityMaps:
    """Textures of this size; what they hold is to be drawn."""
    square = size.side, size.side
    # one texture alone would not be an array
    count = max(size.map_count * size.passes, 2)
    slots = range(size.slots)
    arrays = tuple(gpu.types.GPUTexture(square, layers=count, format="RGBA32F") for _ in slots)
    layers = max(size.map_count, 2)
    meshes = gpu.types.GPUTexture(square, layers=layers, format="DEPTH_COMPONENT32F")
    if not size.is_deep:
        return OpacityMaps(values, size, arrays, meshes)
    side = size.side // START_TEXELS
    starts = gpu.types.GPUTexture((2 * side, side * size.map_count), format="R32UI")
    return OpacityMaps(values, size, arrays, meshes, starts)
