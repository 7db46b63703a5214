"""Strands as layers: the lists of all pixels, from which the nearest are shaded and put together.

    count   R32UI 1 x 1:   how many fragments there are
    heads   R32UI:         of each pixel the last one of its list, counted from 1; 0 is none
    nodes   RGBA32UI:      the fragments, see lib_layer_packing.glsl
    colors  RGBA32F, fronts R32F:   what each pixel shows, and from which depth on it hides

That is 24 bytes a pixel, and 16 more for each fragment of a strand that no mesh hides. All grooms
and all views share them, since nothing is kept from one draw to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gpu
import numpy as np

from .shader_program import ShaderProgram, program, released_with_shaders
from .shader_source import LAYER_ROW
from .strand_recipe import DONE_RECIPE, SHOWN_RECIPE
from .textures import drawing_state

#: rows of nodes at first, and at most: 32 Mi fragments, 512 MiB. What comes after that is missing:
#: the farthest, since near strands are drawn first.
FIRST_ROWS, MOST_ROWS = 256, 8192
#: a count that turned out too small is made this much larger than what was found
_SPARE = 1.25

Images = dict[str, Any]


class StrandLayers:
    """What a draw of layers needs on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it anew."""
        self._size = 0, 0
        self._count: Any = None
        self._heads: Any = None
        self._nodes: Any = None
        self._colors: Any = None
        self._fronts: Any = None
        self._triangle: Any = None

    def draw(
        self,
        gather: Callable[[Images, int], None],
        shade: Callable[[Images], ShaderProgram],
    ) -> None:
        """Gather, shade, and put the result over what is in the bound framebuffer.

        Args:
            gather: draws all strands with these images and room for so many fragments.
            shade: binds the program that shades, with these images.
        """
        left, bottom, width, height = gpu.state.viewport_get()
        size = left + width, bottom + height
        self._fit(size)
        while not self._gathered(gather):
            pass
        shader = shade(
            {
                "layer_heads": self._heads,
                "layer_nodes": self._nodes,
                "layer_colors": self._colors,
                "layer_fronts": self._fronts,
            }
        )
        gpu.compute.dispatch(shader.shader, -(-size[0] // 8), -(-size[1] // 8), 1)
        with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
            self._show(writes_depth=False)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._show(writes_depth=True)

    def _gathered(self, gather: Callable[[Images, int], None]) -> bool:
        """Whether all fragments had room; where not, there is more of it now."""
        for counter in (self._count, self._heads):
            counter.clear(format="UINT", value=(0,))
        capacity = self._nodes.height * LAYER_ROW
        # adds nothing to the colours; with the colour mask off, drivers skip such a draw
        with drawing_state(depth_write=False, blend="ADDITIVE_PREMULT"):
            gather(
                {
                    "layer_count": self._count,
                    "layer_heads": self._heads,
                    "layer_nodes": self._nodes,
                },
                capacity,
            )
        done = program(DONE_RECIPE)
        done.bind()
        gpu.compute.dispatch(done.shader, 1, 1, 1)
        gpu.shader.unbind()
        found = int(np.asarray(self._count.read()).ravel()[0])
        if found <= capacity or self._nodes.height == MOST_ROWS:
            return True
        rows = min(int(found * _SPARE) // LAYER_ROW + 1, MOST_ROWS)
        self._nodes = gpu.types.GPUTexture((LAYER_ROW, rows), format="RGBA32UI")
        return False

    def _show(self, *, writes_depth: bool) -> None:
        shader = program(SHOWN_RECIPE)
        shader.bind(
            textures={"layer_colors": self._colors, "layer_fronts": self._fronts},
            integers={"writes_depth": int(writes_depth)},
        )
        self._triangle.draw(shader.shader)

    def _fit(self, size: tuple[int, int]) -> None:
        """Buffers that hold so many pixels, those of before where they are not far too large."""
        kept, wanted = self._size, size
        is_held = kept[0] >= wanted[0] and kept[1] >= wanted[1]
        if is_held and kept[0] * kept[1] <= 4 * max(wanted[0] * wanted[1], 1):
            return
        self._size = size
        self._count = gpu.types.GPUTexture((1, 1), format="R32UI")
        self._heads = gpu.types.GPUTexture(size, format="R32UI")
        self._nodes = gpu.types.GPUTexture((LAYER_ROW, FIRST_ROWS), format="RGBA32UI")
        self._colors = gpu.types.GPUTexture(size, format="RGBA32F")
        self._fronts = gpu.types.GPUTexture(size, format="R32F")
        if self._triangle is None:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            corners = gpu.types.GPUVertBuf(layout, 3)
            self._triangle = gpu.types.GPUBatch(type="TRIS", buf=corners)


#: of all grooms and views
LAYERS_OF_PIXELS = StrandLayers()
