"""The picture of one view's strands, cached to be shown again while nothing changes.

    color RGBA16F: premultiplied, encoded for the view; for sums RGBA32F, see soft_picture.py
    depth DEPTH32F: of the nearest hair that hides more than half of what lies behind it; 1 for none

That is 12 bytes per pixel. Strands are drawn into the view, depth-tested against it, and their
contribution is drawn into this picture as well. So the picture is valid as long as the depths of
the rest of the view stay the same. Its owner sets a key of the data from which it was drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gpu

from . import gpu_objects
from .shader_program import ShaderRecipe, program, released_with_shaders
from .textures import drawing_into, drawing_state

_NOTHING = (0.0, 0.0, 0.0, 0.0)
_SHOWN_RECIPE = ShaderRecipe(
    name="cached_picture",
    vertex="whole_target.vert.glsl",
    fragment="cached_picture.frag.glsl",
    textures=(("FLOAT_2D", "cached_color"), ("DEPTH_2D", "cached_depth")),
    integers=("writes_depth",),
    outputs=(("VEC4", "color"),),
)


class CachedPicture:
    """A picture of strands with depth. Creating one does not touch the GPU.

    key: the data from which it was drawn, see `matches`; empty: it must not be shown again.
    color, depth: the textures above, after `begin`.

    Args:
        color_format: of `color`.
    """

    def __init__(self, color_format: str = "RGBA16F") -> None:
        self._color_format = color_format
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the picture is lost."""
        self.key: tuple[Any, ...] = ()
        self.color: Any = None
        self.depth: Any = None
        self._target: Any = None
        self._triangle: Any = None

    def forget(self) -> None:
        """Clear the key, so that it is not shown again; its textures stay."""
        self.key = ()

    def matches(self, key: tuple[Any, ...]) -> bool:
        """Whether it was drawn from the same objects and equal numbers."""
        return are_same_keys(self.key, key)

    def begin(self) -> None:
        """Clear the picture, resized to cover the viewport."""
        left, bottom, width, height = gpu.state.viewport_get()
        size = left + width, bottom + height
        self.forget()
        if self.color is None or (self.color.width, self.color.height) != size:
            self.color = gpu_objects.texture(size, format=self._color_format)
            self.depth = gpu_objects.texture(size, format="DEPTH_COMPONENT32F")
            self._triangle = gpu_objects.triangle()
        with self.drawing():
            self._target.clear(color=_NOTHING, depth=1.0)

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """A context in which draws go into it, at the viewport of the bound framebuffer."""
        viewport = gpu.state.viewport_get()
        # renders draw in their own context, which shares textures but not framebuffers
        self._target = gpu_objects.framebuffer(depth_slot=self.depth, color_slots=(self.color,))
        with drawing_into(self._target):
            gpu.state.viewport_set(*viewport)
            yield

    def show(self) -> None:
        """Draw it over the bound framebuffer, as the strands were drawn."""
        with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
            self._draw(writes_depth=False)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._draw(writes_depth=True)

    def _draw(self, *, writes_depth: bool) -> None:
        shader = program(_SHOWN_RECIPE)
        shader.bind(
            textures={"cached_color": self.color, "cached_depth": self.depth},
            integers={"writes_depth": int(writes_depth)},
        )
        self._triangle.draw(shader.shader)


def are_same_keys(key: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether both hold the same objects and equal numbers; False if the key is empty."""
    return (
        bool(key)
        and len(key) == len(other)
        and all(a is b or a == b for a, b in zip(key, other, strict=True))
    )
