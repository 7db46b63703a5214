"""Strands as layers: the lists of all pixels, of which some stand for all, shaded and added up.

    count   R32UI 4 x 1:   how many fragments there are, how many pixels that have some, how many
                           fragments are seen, and how many the longest list has
    heads   R32UI:         of each pixel the first one of its list, counted from 1; 0 is none
    pixels  R32UI:         those that have fragments, side by side: x, and y in the upper half
    nodes   RGBA32UI:      the fragments, see lib_layer_packing.glsl; later their colours
    seen    R32UI:         the numbers of those that are seen, side by side, whatever their pixels:
                           no invocation that shades is idle because its pixel has fewer of them
    fronts  RG32F:         of each pixel the depth from which on it hides, and its alpha

That is 16 bytes a pixel, and 20 more for each fragment of a strand that no mesh hides. All grooms
and all views share them, since nothing is kept from one draw to the next.

Fragments that have no room all at once are drawn in parts, see pixel_parts.py: first each pixel
counts its own, then parts that have room are gathered, ordered, shaded and shown one by one. So
memory decides how often strands are drawn, and never what is seen. A part of one pixel that has no
room is drawn by depth, the farthest first, each over what is there: exact but for the colours of
Blender's viewport, which are added up as they are encoded. So is a part with a list too long for a
software driver, whose shaders end after 65,535 rounds of all their loops.

What moves is not waited for: nothing is read back, and as many invocations order and shade as the
view's size suggests, as often as the counts on the GPU say. Room is made beforehand for what was
counted of the view before, and detail_slots.py has no more fragments drawn than have room.
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
from .image_stores import finish_stores
from .kept_picture import KeptPicture
from .pixel_parts import PixelPart, pixel_parts
from .shader_program import ShaderProgram, ShaderRecipe, program, released_with_shaders
from .shader_source import LAYER_ROW, ShaderError
from .strand_drawing import StrandDrawing
from .textures import drawing_rows, drawing_state

#: rows of nodes at first, 20 MiB
FIRST_ROWS = 256
#: of a node and its number among those that are seen
FRAGMENT_BYTES = 20
#: lists are made smaller where they take this much more than there is room for now
_TOO_LARGE = 1.25
#: a count that turned out too small is made this much larger than what was found
_SPARE = 1.25
#: pixels of which the fragments of what moves are shaded by one invocation, one after the other
_SHADED_IN_TURN = 16
#: nodes that a round of a loop takes in software, so that all rounds do for more of them
_NODES_A_ROUND = 8
#: fragments of a pixel that a software driver can order: each takes some five rounds of loops
LONGEST_IN_SOFTWARE = 12288
#: more than any list has
_ANY_LENGTH = (1 << 31) - 1

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
    defines=(("LAYERS", LAYERS), ("NODES_A_ROUND", 1)),
)
#: shades fewer layers
_TURNING_ORDER_RECIPE = replace(
    _ORDER_RECIPE,
    name="strand_layers_order_turning",
    defines=(("LAYERS", TURNING_LAYERS), ("NODES_A_ROUND", 1)),
)


@dataclass(frozen=True)
class LayersDrawn:
    """In how many parts layers were drawn, and how many fragments had no room in any.

    fragments: of strands that nothing hides, how many; 0 where they were not waited for.
    """

    parts: int = 0
    missing: int = 0
    fragments: int = 0


class StrandLayers:
    """What a draw of layers needs on the GPU; making one touches no GPU.

    Args:
        max_rows: of nodes, LAYER_ROW fragments each; None: as many as memory has room for.
    """

    def __init__(self, max_rows: int | None = None) -> None:
        self._wanted_rows = max_rows
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it again."""
        self._max_rows = 0
        #: where a driver has refused more
        self._refused_rows: int | None = None
        self._found = self._pixel_count = self._too_long = 0  # of what was gathered last
        self._size = 0, 0
        self._count: Any = None
        self._heads: Any = None
        self._pixels: Any = None
        self._nodes: Any = None
        self._seen: Any = None
        self._fronts: Any = None
        self._triangle: Any = None
        self._picture: KeptPicture | None = None
        self._is_sample = False

    def draw(
        self,
        drawing: StrandDrawing,
        *,
        is_own_target: bool,
        in_parts: bool = False,
        is_moving: bool = False,
        is_turning: bool = False,
        picture: KeptPicture | None = None,
        is_sample: bool = False,
    ) -> LayersDrawn:
        """Gather, order, shade, and put the result over what is in the bound framebuffer.

        Args:
            is_own_target: nobody else has set a scissor for that framebuffer.
            in_parts: whether it is likely to have no room at once, so that this is not even tried.
            is_moving: the GPU is not waited for, see `room_for`.
            is_turning: so does the whole view, so that fewer layers do.
            picture: takes the result as well.
            is_sample: it takes the colours alone; the framebuffer gets the depths.

        Raises:
            ShaderError: a shader does not compile here, or there is no memory at all.
        """
        self._fit(_viewport_end())
        self._picture, self._is_sample = picture, is_sample
        if is_moving:
            self._store(lambda: drawing.gather(self._images, self._capacity))
            *_, width, height = gpu.state.viewport_get()
            self._order(width * height, _TURNING_ORDER_RECIPE if is_turning else _ORDER_RECIPE)
            self._shade(drawing, -(-width * height // _SHADED_IN_TURN))
            return LayersDrawn(1)
        if not in_parts and self._is_gathered(drawing) and self._is_finished(drawing):
            return LayersDrawn(1, fragments=self._found)
        counts, drawn, missing = self._counted(drawing), 0, 0
        fragments = int(counts.sum(dtype=np.int64))
        self._make_room(fragments)
        expected = drawing.expected_depths()
        waiting = pixel_parts(counts, self._capacity, _longest(), expected)[::-1]
        while waiting:
            part = waiting.pop()
            rows = part.rows(self._heads.width) if is_own_target else None
            beyond = self._gather(drawing, part, rows) - self._capacity
            if beyond > 0 and part.halves:
                waiting += part.halves[::-1]
                continue
            if not self._is_finished(drawing, even_if_too_long=not part.slabs):
                waiting += part.slabs[::-1]
                continue
            drawn, missing = drawn + 1, missing + max(beyond, 0) + self._too_long
        return LayersDrawn(drawn, missing, fragments)

    def room_for(self, count: int) -> int:
        """Make room for this many fragments in the bound viewport, and say how many have some.

        Raises:
            ShaderError: there is no memory at all.
        """
        self._fit(_viewport_end())
        if count > self._capacity:
            self._make_room(int(max(count, _SPARE * self._capacity)))
        return self._capacity

    def _is_gathered(self, drawing: StrandDrawing) -> bool:
        """Gather all fragments at once, where they have room or can be given it."""
        while (found := self._gather(drawing)) > self._capacity:
            if found > self._max_rows * LAYER_ROW or not self._make_room(int(found * _SPARE)):
                return False
        return True

    def _gather(
        self, drawing: StrandDrawing, part: PixelPart | None = None, rows: range | None = None
    ) -> int:
        """Gather all fragments, or those of a part; how many there are, with room or without."""
        self._store(lambda: drawing.gather(self._images, self._capacity, part), rows)
        self._found, self._pixel_count, *_ = self._counts()
        return self._found

    def _counted(self, drawing: StrandDrawing) -> Ints:
        """How many fragments each pixel has, row by row."""
        self._store(lambda: drawing.count(self._images))
        return np.asarray(self._heads.read()).ravel()

    def _store(self, draw: Callable[[], None], rows: range | None = None) -> None:
        """Have a draw write images, which begin at 0, so that they can be read after it."""
        for counter in (self._count, self._heads):
            counter.clear(format="UINT", value=(0,))
        # adds nothing to the colours; with the colour mask off, drivers skip such a draw
        with (
            drawing_state(depth_write=False, blend="ADDITIVE_PREMULT"),
            drawing_rows(rows),
        ):
            draw()
        finish_stores()

    def _is_finished(self, drawing: StrandDrawing, *, even_if_too_long: bool = False) -> bool:
        """Order, shade and show what is gathered; not where a list is too long for that."""
        self._too_long = 0
        pixel_count = self._pixel_count
        if not pixel_count:
            return True
        self._order(pixel_count, longest=None if even_if_too_long else _longest())
        _, _, seen_count, longest = self._counts()
        self._too_long = max(longest - (_longest() or longest), 0)
        if self._too_long and not even_if_too_long:
            return False
        self._shade(drawing, seen_count)
        return True

    def _order(
        self, count: int, recipe: ShaderRecipe = _ORDER_RECIPE, *, longest: int | None = None
    ) -> None:
        """Order all lists that there are, but those that are too long, by as many invocations."""
        if is_software():
            defines = dict(recipe.defines) | {"NODES_A_ROUND": _NODES_A_ROUND}
            recipe = replace(recipe, defines=tuple(defines.items()))
        order = program(recipe)
        order.bind(
            images={name: self._images[name] for _, name, *_ in recipe.images},
            integers={"longest": _ANY_LENGTH if longest is None else longest},
        )
        _dispatch(order, count)

    def _shade(self, drawing: StrandDrawing, count: int) -> None:
        """Shade all that is seen, by as many invocations, and show it."""
        _dispatch(drawing.shade(self._images), count)
        self._show(drawing, writes_color=not self._is_sample)
        if self._picture is not None:
            with self._picture.drawing():
                self._show(drawing)

    def _show(self, drawing: StrandDrawing, *, writes_color: bool = True) -> None:
        """Colours and depths of all lists, into the bound framebuffer."""
        images = self._images
        if writes_color:
            with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
                self._triangle.draw(drawing.show(images, writes_depth=False).shader)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._triangle.draw(drawing.show(images, writes_depth=True).shader)

    def _counts(self) -> tuple[int, int, int, int]:
        """How many fragments there are, pixels that have some, fragments that are seen, and the
        fragments of the longest list."""
        found, pixels, seen, longest = np.asarray(self._count.read()).ravel().tolist()
        return int(found), int(pixels), int(seen), int(longest)

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
        """How many fragments have room."""
        return int(self._nodes.height) * LAYER_ROW

    def _make_room(self, count: int) -> bool:
        """Room for this many fragments, as far as it goes; whether it is more than before."""
        before = self._capacity
        rows = min(-(-count // LAYER_ROW), self._max_rows)
        if rows * LAYER_ROW > before:
            self._make_nodes(rows)
        return self._capacity > before

    def _limit(self) -> None:
        """How many rows there may be now; what is beyond is let go of."""
        held = 0 if self._nodes is None else self._capacity * FRAGMENT_BYTES
        rows = gpu_memory.lists_room(held) // (FRAGMENT_BYTES * LAYER_ROW)
        limits = (max(rows, 1), self._wanted_rows, self._refused_rows)
        self._max_rows = min(limit for limit in limits if limit is not None)
        if self._nodes is not None and self._nodes.height > _TOO_LARGE * self._max_rows:
            self._make_nodes(self._max_rows)

    def _make_nodes(self, rows: int) -> None:
        """This many rows, or as many as there is memory for."""
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
        """Buffers for this many pixels; the old ones, where they are not far too large. Views of
        several shapes that take turns have the same ones.
        """
        self._limit()
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
            self._make_nodes(min(FIRST_ROWS, self._max_rows))
        self._fronts = gpu_objects.texture(size, format="RG32F")
        if self._triangle is None:
            self._triangle = gpu_objects.triangle()


def is_software() -> bool:
    """Whether a processor draws in place of a GPU."""
    return str(gpu.platform.device_type_get()) == "SOFTWARE"


def _longest() -> int | None:
    """How many fragments of a pixel can be ordered; None: all."""
    return LONGEST_IN_SOFTWARE if is_software() else None


def _dispatch(shader: ShaderProgram, count: int) -> None:
    """This many invocations, in rows."""
    shader.dispatch(min(count, LAYER_ROW), -(-count // LAYER_ROW))


def _viewport_end() -> tuple[int, int]:
    """How far the viewport of the bound framebuffer reaches, across and up [pixels]."""
    left, bottom, width, height = gpu.state.viewport_get()
    return left + width, bottom + height


#: of all grooms and views
LAYERS_OF_PIXELS = StrandLayers()
