"""Strands as layers: lists of fragments per pixel, of which a selection is shaded and summed.

    count   R32UI 4 x 1:   numbers of fragments, of pixels with fragments and of visible fragments,
                           and the length of the longest list
    heads   R32UI:         for each pixel the first node of its list, counted from 1; 0 for none
    pixels  R32UI:         the pixels with fragments, consecutively: x, and y in the upper half
    nodes   RGBA32UI:      the fragments, see lib_layer_packing.glsl; later their colours
    seen    R32UI:         the numbers of the visible nodes, consecutively for all pixels, so that
                           no shading invocation is idle because its pixel has fewer of them
    fronts  RG32F:         for each pixel the depth from which on it hides, and its alpha

That is 16 bytes per pixel, plus 20 for each fragment of a strand that no mesh hides. All grooms and
all views share these textures, since nothing is kept from one draw to the next.

If not all fragments fit, they are drawn in parts, see pixel_parts.py: the fragments of each pixel
are counted, then parts that fit are gathered, ordered, shaded and shown one after the other. So
memory affects how often strands are drawn, but not the picture. A single pixel that does not fit is
divided by depth, and its parts are blended, the farthest first. That is exact, except in Blender's
viewport, where encoded colours are blended. A part with a list that is too long for a software
driver, whose shaders end after 65,535 iterations of all their loops, is divided in the same way.

While the view moves, the GPU is not waited for: nothing is read back, the number of invocations
that order and shade follows from the view's size, and they loop up to the counts on the GPU. Room
is made beforehand from the counts of the view before, and detail_slots.py limits the fragments to
those that fit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import gpu
import numpy as np

from ..arrays import Ints
from ..shading.volume.transparency import LAYERS, TURNING_LAYERS
from . import gpu_memory, gpu_objects
from .cached_picture import CachedPicture
from .image_stores import finish_stores
from .pixel_parts import PixelPart, pixel_parts
from .shader_program import ShaderProgram, ShaderRecipe, program, released_with_shaders
from .shader_source import LAYER_ROW, ShaderError
from .strand_drawing import StrandDrawing
from .textures import drawing_rows, drawing_state

#: initial rows of nodes, 20 MiB
INITIAL_ROWS = 256
#: bytes of a node and of its number in `seen`
FRAGMENT_BYTES = 20
#: lists are made smaller if they exceed the available memory by this factor
_MAX_OVERSIZE = 1.25
#: margin on a count when lists turned out too small
_SPARE = 1.25
#: pixels per shading invocation while hair moves
_SHADED_PER_INVOCATION = 16
#: nodes per loop iteration with software drivers, whose iterations are limited
_NODES_PER_ROUND = 8
#: most fragments of a pixel that a software driver can order: each takes about five iterations
MAX_LIST_LENGTH_IN_SOFTWARE = 12288
#: larger than the length of any list
_UNLIMITED = (1 << 31) - 1

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
    integers=("longest",),
    group_size=(64, 1),
    defines=(("LAYERS", LAYERS), ("NODES_PER_ROUND", 1)),
)
#: shades fewer layers
_TURNING_ORDER_RECIPE = replace(
    _ORDER_RECIPE,
    name="strand_layers_order_turning",
    defines=(("LAYERS", TURNING_LAYERS), ("NODES_PER_ROUND", 1)),
)


@dataclass(frozen=True)
class LayerStatistics:
    """In how many parts layers were drawn, and how many fragments did not fit into any.

    fragments: number of fragments that nothing hides; 0 if the GPU was not waited for.
    """

    parts: int = 0
    missing: int = 0
    fragments: int = 0


class StrandLayers:
    """The textures for drawing layers. Creating one does not touch the GPU.

    Args:
        max_rows: most rows of nodes, LAYER_ROW fragments each; None: as many as fit into memory.
    """

    def __init__(self, max_rows: int | None = None) -> None:
        self._wanted_rows = max_rows
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._max_rows = 0
        #: most rows after a driver has refused more
        self._refused_rows: int | None = None
        self._found = self._pixel_count = self._too_long = 0  # of the last gathering
        self._size = 0, 0
        self._count: Any = None
        self._heads: Any = None
        self._pixels: Any = None
        self._nodes: Any = None
        self._seen: Any = None
        self._fronts: Any = None
        self._triangle: Any = None
        self._picture: CachedPicture | None = None
        self._is_sample = False

    def draw(
        self,
        drawing: StrandDrawing,
        *,
        is_own_target: bool,
        in_parts: bool = False,
        is_moving: bool = False,
        is_turning: bool = False,
        picture: CachedPicture | None = None,
        is_sample: bool = False,
    ) -> LayerStatistics:
        """Gather, order and shade fragments, and blend the result over the bound framebuffer.

        Args:
            is_own_target: no other code has set a scissor for that framebuffer.
            in_parts: fragments probably do not fit at once, so that this is not even tried.
            is_moving: the GPU is not waited for, see `reserve`.
            is_turning: the whole view moves, so that fewer layers suffice.
            picture: also gets the result.
            is_sample: only the picture gets colours; the framebuffer gets depths.

        Raises:
            ShaderError: a shader does not compile here, or there is no memory at all.
        """
        self._fit(_viewport_end())
        self._picture, self._is_sample = picture, is_sample
        if is_moving:
            self._store(lambda: drawing.gather(self._images, self._capacity))
            *_, width, height = gpu.state.viewport_get()
            self._order(width * height, _TURNING_ORDER_RECIPE if is_turning else _ORDER_RECIPE)
            self._shade(drawing, -(-width * height // _SHADED_PER_INVOCATION))
            return LayerStatistics(1)
        if not in_parts and self._gather_all(drawing) and self._finish(drawing):
            return LayerStatistics(1, fragments=self._found)
        counts, drawn, missing = self._fragment_counts(drawing), 0, 0
        fragments = int(counts.sum(dtype=np.int64))
        self._grow(fragments)
        expected = drawing.expected_depths()
        waiting = pixel_parts(counts, self._capacity, _max_list_length(), expected)[::-1]
        while waiting:
            part = waiting.pop()
            rows = part.rows(self._heads.width) if is_own_target else None
            beyond = self._gather(drawing, part, rows) - self._capacity
            if beyond > 0 and part.halves:
                waiting += part.halves[::-1]
                continue
            if not self._finish(drawing, even_if_too_long=not part.slabs):
                waiting += part.slabs[::-1]
                continue
            drawn, missing = drawn + 1, missing + max(beyond, 0) + self._too_long
        return LayerStatistics(drawn, missing, fragments)

    def reserve(self, count: int) -> int:
        """Make room for this many fragments in the bound viewport, and return how many fit.

        Raises:
            ShaderError: there is no memory at all.
        """
        self._fit(_viewport_end())
        if count > self._capacity:
            self._grow(int(max(count, _SPARE * self._capacity)))
        return self._capacity

    def _gather_all(self, drawing: StrandDrawing) -> bool:
        """Gather all fragments at once, making room if needed; False if they cannot fit."""
        while (found := self._gather(drawing)) > self._capacity:
            if found > self._max_rows * LAYER_ROW or not self._grow(int(found * _SPARE)):
                return False
        return True

    def _gather(
        self, drawing: StrandDrawing, part: PixelPart | None = None, rows: range | None = None
    ) -> int:
        """Gather all fragments, or those of a part; returns their number, also if too many."""
        self._store(lambda: drawing.gather(self._images, self._capacity, part), rows)
        self._found, self._pixel_count, *_ = self._counts()
        return self._found

    def _fragment_counts(self, drawing: StrandDrawing) -> Ints:
        """The number of fragments of each pixel, row by row."""
        self._store(lambda: drawing.count_fragments(self._images))
        return np.asarray(self._heads.read()).ravel()

    def _store(self, draw: Callable[[], None], rows: range | None = None) -> None:
        """Clear the counters, run a draw that writes images, and make its writes visible."""
        for counter in (self._count, self._heads):
            counter.clear(format="UINT", value=(0,))
        # the draw adds black; with the colour mask off, drivers would skip it
        with (
            drawing_state(depth_write=False, blend="ADDITIVE_PREMULT"),
            drawing_rows(rows),
        ):
            draw()
        finish_stores()

    def _finish(self, drawing: StrandDrawing, *, even_if_too_long: bool = False) -> bool:
        """Order, shade and show the gathered fragments; False if a list is too long for that."""
        self._too_long = 0
        pixel_count = self._pixel_count
        if not pixel_count:
            return True
        self._order(pixel_count, max_length=None if even_if_too_long else _max_list_length())
        _, _, seen_count, max_length = self._counts()
        self._too_long = max(max_length - (_max_list_length() or max_length), 0)
        if self._too_long and not even_if_too_long:
            return False
        self._shade(drawing, seen_count)
        return True

    def _order(
        self, count: int, recipe: ShaderRecipe = _ORDER_RECIPE, *, max_length: int | None = None
    ) -> None:
        """Order all lists, except those that are too long, with this many invocations."""
        if is_software():
            defines = dict(recipe.defines) | {"NODES_PER_ROUND": _NODES_PER_ROUND}
            recipe = replace(recipe, defines=tuple(defines.items()))
        order = program(recipe)
        order.bind(
            images={name: self._images[name] for _, name, *_ in recipe.images},
            integers={"longest": _UNLIMITED if max_length is None else max_length},
        )
        _dispatch(order, count)

    def _shade(self, drawing: StrandDrawing, count: int) -> None:
        """Shade all visible nodes with this many invocations, and show them."""
        _dispatch(drawing.shade(self._images), count)
        self._show(drawing, writes_color=not self._is_sample)
        if self._picture is not None:
            with self._picture.drawing():
                self._show(drawing)

    def _show(self, drawing: StrandDrawing, *, writes_color: bool = True) -> None:
        """Draw colours and depths of all lists into the bound framebuffer."""
        images = self._images
        if writes_color:
            with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
                self._triangle.draw(drawing.show(images, writes_depth=False).shader)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._triangle.draw(drawing.show(images, writes_depth=True).shader)

    def _counts(self) -> tuple[int, int, int, int]:
        """The numbers of fragments, of pixels with fragments and of visible fragments, and the
        length of the longest list."""
        found, pixels, seen, max_length = np.asarray(self._count.read()).ravel().tolist()
        return int(found), int(pixels), int(seen), int(max_length)

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

    @property
    def _capacity(self) -> int:
        """The number of fragments that fit."""
        return int(self._nodes.height) * LAYER_ROW

    def _grow(self, count: int) -> bool:
        """Make room for this many fragments, within the limit; whether room has grown."""
        before = self._capacity
        rows = min(-(-count // LAYER_ROW), self._max_rows)
        if rows * LAYER_ROW > before:
            self._make_nodes(rows)
        return self._capacity > before

    def _update_row_limit(self) -> None:
        """Update the limit of rows, and shrink the lists if they are far beyond it."""
        held = 0 if self._nodes is None else self._capacity * FRAGMENT_BYTES
        rows = gpu_memory.fragment_list_budget(held) // (FRAGMENT_BYTES * LAYER_ROW)
        limits = (max(rows, 1), self._wanted_rows, self._refused_rows)
        self._max_rows = min(limit for limit in limits if limit is not None)
        if self._nodes is not None and self._nodes.height > _MAX_OVERSIZE * self._max_rows:
            self._make_nodes(self._max_rows)

    def _make_nodes(self, rows: int) -> None:
        """Make this many rows, or as many as fit into memory."""
        self._nodes = self._seen = None
        while self._nodes is None:
            try:
                nodes = gpu_objects.texture((LAYER_ROW, rows), format="RGBA32UI")
                self._seen = gpu_objects.texture((LAYER_ROW, rows), format="R32UI")
                self._nodes = nodes
            except RuntimeError as error:
                if rows == 1:
                    raise ShaderError("strands as layers: the GPU has no memory left") from error
                self._refused_rows = self._max_rows = rows = rows // 2

    def _fit(self, size: tuple[int, int]) -> None:
        """Make textures for this many pixels, or keep the old ones if they are not far too large.
        They grow to cover all views, so that views drawn alternately share them.
        """
        self._update_row_limit()
        kept, wanted = self._size, size
        is_held = kept[0] >= wanted[0] and kept[1] >= wanted[1]
        is_far_too_large = kept[0] * kept[1] > 4 * max(wanted[0] * wanted[1], 1)
        if is_held and not is_far_too_large:
            return
        if not is_far_too_large:
            size = max(kept[0], wanted[0]), max(kept[1], wanted[1])
        self._size = size
        self._count = gpu_objects.texture((4, 1), format="R32UI")
        self._heads = gpu_objects.texture(size, format="R32UI")
        self._pixels = gpu_objects.texture(size, format="R32UI")
        if self._nodes is None or is_far_too_large:
            self._make_nodes(min(INITIAL_ROWS, self._max_rows))
        self._fronts = gpu_objects.texture(size, format="RG32F")
        if self._triangle is None:
            self._triangle = gpu_objects.triangle()


def is_software() -> bool:
    """Whether a software driver draws instead of a GPU."""
    return str(gpu.platform.device_type_get()) == "SOFTWARE"


def _max_list_length() -> int | None:
    """The most fragments of a pixel that can be ordered; None: any number."""
    return MAX_LIST_LENGTH_IN_SOFTWARE if is_software() else None


def _dispatch(shader: ShaderProgram, count: int) -> None:
    """Dispatch this many invocations, in rows."""
    shader.dispatch(min(count, LAYER_ROW), -(-count // LAYER_ROW))


def _viewport_end() -> tuple[int, int]:
    """The right and the upper end of the bound framebuffer's viewport [pixels]."""
    left, bottom, width, height = gpu.state.viewport_get()
    return left + width, bottom + height


#: shared by all grooms and views
LAYERS_OF_PIXELS = StrandLayers()
