"""Strands with hashed alpha: the nearest fragment that is not discarded in each pixel, shaded last.

Each draw takes two such samples, called turns, with their own textures:

    hair   RGBA32F:  x the strand, y the place along it, z the depth; w 0 without hair
    light  RGBA32F:  the colour, and the depth

With a depth buffer that is 68 bytes per pixel for any number of strands. It needs neither lists nor
atomics, so it is the fallback for layers on drivers without these. One sample is noisy; the mean of
samples converges to layers, since each discards other fragments (hashed_alpha.py). All grooms and
all views share the textures.
"""

from __future__ import annotations

from typing import Any

import gpu

from . import gpu_objects
from .shader_program import ShaderRecipe, program, released_with_shaders
from .strand_drawing import StrandDrawing
from .textures import drawing_into, drawing_state

_NO_STRAND = (0.0, 0.0, 0.0, 0.0)
#: beyond all depths
_DARK = (0.0, 0.0, 0.0, 2.0)
_SHOWN_RECIPE = ShaderRecipe(
    name="strand_hashed_shown",
    vertex="whole_target.vert.glsl",
    fragment="strand_hashed_shown.frag.glsl",
    textures=(("FLOAT_2D", "first_light"), ("FLOAT_2D", "second_light")),
    integers=("are_both", "left", "bottom"),
    outputs=(("VEC4", "color"),),
)


class HashedStrands:
    """The textures for drawing hashed strands. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._size = 0, 0
        self._hair: tuple[Any, ...] = ()
        self._light: tuple[Any, ...] = ()
        self._depth: Any = None
        self._triangle: Any = None

    def draw(self, drawing: StrandDrawing) -> None:
        """Find the visible fragments, shade them, and blend them over the bound framebuffer.

        Depth is written where both turns have found hair.

        Raises:
            ShaderError: a shader does not compile here.
        """
        left, bottom, width, height = gpu.state.viewport_get()
        self._fit((width, height))
        # renders draw in their own context, which shares textures but not framebuffers
        for turn, hair in enumerate(self._hair):
            target = gpu_objects.framebuffer(depth_slot=self._depth, color_slots=(hair,))
            with drawing_into(target), drawing_state():
                gpu.state.viewport_set(0, 0, width, height)
                target.clear(color=_NO_STRAND, depth=1.0)
                drawing.draw_hashed(turn)
        shaded = gpu_objects.framebuffer(color_slots=self._light)
        with drawing_into(shaded), drawing_state(depth_test="NONE", depth_write=False):
            gpu.state.viewport_set(0, 0, width, height)
            shaded.clear(color=_DARK)
            self._triangle.draw(drawing.shade_hashed(self._hair).shader)
        with drawing_state(depth_write=False, blend="ALPHA_PREMULT"):
            self._show(left, bottom, are_both=False)
        with drawing_state():
            self._show(left, bottom, are_both=True)

    def _show(self, left: int, bottom: int, *, are_both: bool) -> None:
        shader = program(_SHOWN_RECIPE)
        shader.bind(
            textures=dict(zip(("first_light", "second_light"), self._light, strict=True)),
            integers={"are_both": int(are_both), "left": left, "bottom": bottom},
        )
        self._triangle.draw(shader.shader)

    def _fit(self, size: tuple[int, int]) -> None:
        """Make textures for this many pixels, or keep the old ones if they are not far too
        large."""
        kept = self._size
        is_held = kept[0] >= size[0] and kept[1] >= size[1]
        if is_held and kept[0] * kept[1] <= 4 * max(size[0] * size[1], 1):
            return
        self._size = size
        textures = [gpu_objects.texture(size, format="RGBA32F") for _ in range(4)]
        self._hair, self._light = tuple(textures[:2]), tuple(textures[2:])
        self._depth = gpu_objects.texture(size, format="DEPTH_COMPONENT32F")
        if self._triangle is None:
            self._triangle = gpu_objects.triangle()


#: shared by all grooms and views
HASHED_STRANDS = HashedStrands()
