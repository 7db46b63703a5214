"""Strands as layers: the lists of all pixels, of which some stand for all, shaded and added up.

    count   R32UI 3 x 1:   how many fragments there are, how many pixels that have some, and how
                           many fragments are seen
    heads   R32UI:         of each pixel the first one of its list, counted from 1; 0 is none
    pixels  R32UI:         those that have fragments, side by side: x, and y in the upper half
    nodes   RGBA32UI:      the fragments, see lib_layer_packing.glsl; later their colours
    seen    R32UI:         the numbers of those that are seen, side by side, whatever their pixels:
                           no invocation that shades is idle because its pixel has fewer of them
    fronts  RG32F:         of each pixel the depth from which on it hides, and its alpha

That is 16 bytes a pixel, and 20 more for each fragment of a strand that no mesh hides. All grooms
and all views share them, since nothing is kept from one draw to the next.
"""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..shading.volume.transparency import LAYERS
from .shader_program import ShaderProgram, ShaderRecipe, program, released_with_shaders
from .shader_source import LAYER_ROW
from .strand_drawing import StrandDrawing
from .textures import drawing_state

#: rows of nodes at first, and at most: 32 Mi fragments, 640 MiB. What comes after that is missing:
#: the farthest, since near strands are drawn first.
FIRST_ROWS, MAX_ROWS = 256, 8192
#: a count that turned out too small is made this much larger than what was found
_SPARE = 1.25

_ORDER_RECIPE = ShaderRecipe(
    name="strand_layers_order",
    compute="strand_layers_order.comp.glsl",
    images=(
        ("R32UI", "layer_count", "READ_WRITE"),
        ("R32UI", "layer_heads", "READ_WRITE"),
        ("R32UI", "layer_pixels", "READ"),
        ("RGBA32UI", "layer_nodes", "READ_WRITE"),
        ("R32UI", "layer_seen"),
        ("RG32F", "layer_fronts"),
    ),
    integers=("pixel_count",),
    group_size=(64, 1),
    defines=(("LAYERS", LAYERS),),
)
_DONE_RECIPE = ShaderRecipe(
    name="strand_layers_done", compute="strand_layers_done.comp.glsl", group_size=(1, 1)
)


class StrandLayers:
    """What a draw of layers needs on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it again."""
        self._size = 0, 0
        self._count: Any = None
        self._heads: Any = None
        self._pixels: Any = None
        self._nodes: Any = None
        self._seen: Any = None
        self._fronts: Any = None
        self._triangle: Any = None

    def draw(self, drawing: StrandDrawing) -> None:
        """Gather, order, shade, and put the result over what is in the bound framebuffer."""
        left, bottom, width, height = gpu.state.viewport_get()
        size = left + width, bottom + height
        self._fit(size)
        while not self._gathered(drawing):
            pass
        _, pixel_count, _ = self._counts()
        if not pixel_count:
            return
        images = self._images
        order = program(_ORDER_RECIPE)
        order.bind(
            images={name: images[name] for _, name, *_ in _ORDER_RECIPE.images},
            integers={"pixel_count": pixel_count},
        )
        _dispatch(order, pixel_count, self._pixels.width)
        _, _, seen_count = self._counts()
        _dispatch(drawing.shade(images, seen_count), seen_count, LAYER_ROW)
        with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
            self._triangle.draw(drawing.show(images, writes_depth=False).shader)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._triangle.draw(drawing.show(images, writes_depth=True).shader)

    def _gathered(self, drawing: StrandDrawing) -> bool:
        """Whether all fragments had room; where not, there is more of it now."""
        for counter in (self._count, self._heads):
            counter.clear(format="UINT", value=(0,))
        capacity = self._nodes.height * LAYER_ROW
        # adds nothing to the colours; with the colour mask off, drivers skip such a draw
        with drawing_state(depth_write=False, blend="ADDITIVE_PREMULT"):
            drawing.gather(self._images, capacity)
        done = program(_DONE_RECIPE)
        done.bind()
        gpu.compute.dispatch(done.shader, 1, 1, 1)
        gpu.shader.unbind()
        found, _, _ = self._counts()
        if found <= capacity or self._nodes.height == MAX_ROWS:
            return True
        self._make_nodes(min(int(found * _SPARE) // LAYER_ROW + 1, MAX_ROWS))
        return False

    def _counts(self) -> tuple[int, int, int]:
        """How many fragments there are, pixels that have some, and fragments that are seen."""
        found, pixels, seen = np.asarray(self._count.read()).ravel().tolist()
        return int(found), int(pixels), int(seen)

    @property
    def _images(self) -> dict[str, Any]:
        return {
            "layer_count": self._count,
            "layer_heads": self._heads,
            "layer_pixels": self._pixels,
            "layer_nodes": self._nodes,
            "layer_seen": self._seen,
            "layer_fronts": self._fronts,
        }

    def _make_nodes(self, rows: int) -> None:
        self._nodes = gpu.types.GPUTexture((LAYER_ROW, rows), format="RGBA32UI")
        self._seen = gpu.types.GPUTexture((LAYER_ROW, rows), format="R32UI")

    def _fit(self, size: tuple[int, int]) -> None:
        """Buffers for this many pixels; the old ones, where they are not far too large."""
        kept, wanted = self._size, size
        is_held = kept[0] >= wanted[0] and kept[1] >= wanted[1]
        if is_held and kept[0] * kept[1] <= 4 * max(wanted[0] * wanted[1], 1):
            return
        self._size = size
        self._count = gpu.types.GPUTexture((3, 1), format="R32UI")
        self._heads = gpu.types.GPUTexture(size, format="R32UI")
        self._pixels = gpu.types.GPUTexture(size, format="R32UI")
        self._make_nodes(FIRST_ROWS)
        self._fronts = gpu.types.GPUTexture(size, format="RG32F")
        if self._triangle is None:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            corners = gpu.types.GPUVertBuf(layout, 3)
            self._triangle = gpu.types.GPUBatch(type="TRIS", buf=corners)


def _dispatch(shader: ShaderProgram, count: int, across: int) -> None:
    """One invocation for each of the first `count` texels of a texture `across` texels wide."""
    columns = -(-min(count, across) // shader.recipe.group_size[0])
    gpu.compute.dispatch(shader.shader, columns, -(-count // across), 1)


#: of all grooms and views
LAYERS_OF_PIXELS = StrandLayers()
