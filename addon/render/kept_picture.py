"""The picture of one view's strands, kept so that a view in which nothing changed shows it again.

    color RGBA16F: premultiplied, as it goes into the view; for sums RGBA32F, see soft_picture.py
    depth DEPTH32F: of the nearest hair that hides more than half of what lies behind it; 1 is none

That is 12 bytes a pixel. Strands are drawn into the view, depth-tested against what is in it, and
what they add is shown into this picture as well: so it holds for as long as what is in the view has
the same depths. Whoever keeps it says by marks what it was drawn of.
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
    name="kept_picture",
    vertex="whole_target.vert.glsl",
    fragment="kept_picture.frag.glsl",
    textures=(("FLOAT_2D", "kept_color"), ("DEPTH_2D", "kept_depth")),
    integers=("writes_depth",),
    outputs=(("VEC4", "color"),),
)


class KeptPicture:
    """Making one touches no GPU.

    marks: what it is of, see `is_of`; empty: nothing that may be shown again.
    color, depth: the textures above, once it is begun.

    Args:
        color_format: of its colours.
    """

    def __init__(self, color_format: str = "RGBA16F") -> None:
        self._color_format = color_format
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Let go of all that lies on the GPU; the picture is gone."""
        self.marks: tuple[Any, ...] = ()
        self.color: Any = None
        self.depth: Any = None
        self._target: Any = None
        self._triangle: Any = None

    def forget(self) -> None:
        """It is not to be shown again; its textures stay."""
        self.marks = ()

    def is_of(self, marks: tuple[Any, ...]) -> bool:
        """Whether it was drawn of the same objects and of equal numbers."""
        return are_same_marks(self.marks, marks)

    def begin(self) -> None:
        """An empty picture, as large as the viewport reaches."""
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
        """Draw into it, where the bound framebuffer's viewport is."""
        viewport = gpu.state.viewport_get()
        # renders draw in a context of their own, which shares textures and no framebuffers
        self._target = gpu_objects.framebuffer(depth_slot=self.depth, color_slots=(self.color,))
        with drawing_into(self._target):
            gpu.state.viewport_set(*viewport)
            yield

    def show(self) -> None:
        """Put it over what is in the bound framebuffer, as the strands were."""
        with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
            self._draw(writes_depth=False)
        with drawing_state(depth_test="ALWAYS"):
            gpu.state.color_mask_set(False, False, False, False)
            self._draw(writes_depth=True)

    def _draw(self, *, writes_depth: bool) -> None:
        shader = program(_SHOWN_RECIPE)
        shader.bind(
            textures={"kept_color": self.color, "kept_depth": self.depth},
            integers={"writes_depth": int(writes_depth)},
        )
        self._triangle.draw(shader.shader)


def are_same_marks(marks: tuple[Any, ...], others: tuple[Any, ...]) -> bool:
    """Whether both are of the same objects and of equal numbers; no marks are of nothing."""
    return (
        bool(marks)
        and len(marks) == len(others)
        and all(a is b or a == b for a, b in zip(marks, others, strict=True))
    )
