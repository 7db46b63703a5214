"""Strands by hashed alpha: of each pixel the nearest strand that chance lets stay, shaded last.

Chance has two turns a draw, each with textures of its own:

    hair   RGBA32F:  x the strand, y the place along it, z the depth; w 0 without hair
    light  RGBA32F:  the colour, and the depth

That is 68 bytes a pixel with a depth buffer, whatever the strands, and neither lists nor atomics:
it is what drivers without them draw in place of layers. A sample is noisy. The mean of samples
comes to layers, since each leaves out another part (hashed_alpha.py). All grooms and all views
share the textures.
"""

from __future__ import annotations

from typing import Any

import gpu

from . import gpu_objects
from .shader_program import ShaderRecipe, program, released_with_shaders
from .strand_drawing import StrandDrawing
from .textures import drawing_into, drawing_state

_NOBODY = (0.0, 0.0, 0.0, 0.0)
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
    """What a draw of hashed strands needs on the GPU; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it again."""
        self._size = 0, 0
        self._hair: tuple[Any, ...] = ()
        self._light: tuple[Any, ...] = ()
        self._depth: Any = None
        self._triangle: Any = None

    def draw(self, drawing: StrandDrawing) -> None:
        """Find who is seen, shade it, and put it over what is in the bound framebuffer.

        Depth is written where both turns have found hair.

        Raises:
            ShaderError: a shader does not compile here.
        """
        left, bottom, width, height = gpu.state.viewport_get()
        self._fit((width, height))
        # renders draw in a context of their own, which shares textures and no framebuffers
        for turn, hair in enumerate(self._hair):
            target = gpu_objects.framebuffer(depth_slot=self._depth, color_slots=(hair,))
            with drawing_into(target), drawing_state():
                gpu.state.viewport_set(0, 0, width, height)
                target.clear(color=_NOBODY, depth=1.0)
                drawing.hash(turn)
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
        """Targets for this many pixels; the old ones, where they are not far too large."""
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


#: of all grooms and views
HASHED_STRANDS = HashedStrands()
