"""Accumulation of pictures: the mean of many, summed on the GPU in float32."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Floats
from . import gpu_objects
from .shader_program import ShaderRecipe, program, released_with_shaders
from .textures import drawing_into, drawing_state, texture_to_array

_ADDING = ShaderRecipe(
    name="accumulate",
    compute="accumulate.comp.glsl",
    textures=(("FLOAT_2D", "one_sample"),),
    images=(("RGBA32F", "sum_of_samples", "READ_WRITE"),),
)
_SHOWING = ShaderRecipe(
    name="accumulated",
    vertex="whole_target.vert.glsl",
    fragment="accumulated.frag.glsl",
    textures=(("FLOAT_2D", "sum_of_samples"),),
    integers=("sample_count", "left", "bottom"),
    inputs=(("FLOAT", "unused"),),
    outputs=(("VEC4", "color"),),
)


class Accumulation:
    """The sum of the samples of one picture, all of one size. Creating one does not touch the GPU.

    count: samples so far. total: their sum, an RGBA32F texture, once the size is known.
    """

    def __init__(self) -> None:
        self.count = 0
        self._size = (0, 0)
        self.total: Any = None
        self._triangle: Any = None
        released_with_shaders(self)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels]."""
        return self._size

    def begin(self, width: int, height: int) -> None:
        """Forget all samples, for a picture of this size [pixels]."""
        self.count = 0
        if self._size != (width, height) or self.total is None:
            self._size = width, height
            self.total = gpu_objects.texture(self._size, format="RGBA32F")
        self.total.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))

    def add(self, sample: Any) -> None:
        """Add one picture, a float texture of this size, premultiplied."""
        shader = program(_ADDING)
        shader.bind(textures={"one_sample": sample}, images={"sum_of_samples": self.total})
        width, height = self._size
        shader.dispatch(width, height)
        self.count += 1

    def mean(self) -> Floats:
        """The picture so far, (height, width, 4) float32, row 0 at the bottom."""
        return texture_to_array(self.total) / np.float32(max(self.count, 1))

    def show(self, left: int = 0, bottom: int = 0) -> None:
        """Draw the picture so far over what is in the bound framebuffer.

        Args:
            left, bottom: the pixel of the target at which the picture begins.
        """
        if self._triangle is None:
            self._triangle = gpu_objects.triangle()
        shader = program(_SHOWING)
        with drawing_state(depth_test="NONE", depth_write=False, blend="ALPHA_PREMULT"):
            shader.bind(
                textures={"sum_of_samples": self.total},
                integers={"sample_count": max(self.count, 1), "left": left, "bottom": bottom},
            )
            self._triangle.draw(shader.shader)

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self.count = 0
        self.total = self._triangle = None


class Target:
    """A colour texture with a depth buffer, made again when its size changes."""

    def __init__(self) -> None:
        self._size = (0, 0)
        self._framebuffer: Any = None
        self.color: Any = None
        self.depth: Any = None
        released_with_shaders(self)

    def sized(self, width: int, height: int) -> Target:
        """This target in that size [pixels]."""
        if self._size != (width, height):
            self._size = width, height
            self.color = gpu_objects.texture(self._size, format="RGBA32F")
            self.depth = gpu_objects.texture(self._size, format="DEPTH_COMPONENT32F")
            self._framebuffer = gpu_objects.framebuffer(
                depth_slot=self.depth, color_slots=(self.color,)
            )
        return self

    def clear(self, color: tuple[float, float, float, float]) -> None:
        """Fill it with one colour, and the depth buffer with 1."""
        with drawing_into(self._framebuffer):
            self._framebuffer.clear(color=color, depth=1.0)

    def clear_color(self, color: tuple[float, float, float, float]) -> None:
        """Fill its colours only."""
        with drawing_into(self._framebuffer):
            self._framebuffer.clear(color=color)

    def drawing(self) -> Any:
        """A context manager in which draws go into it."""
        return drawing_into(self._framebuffer)

    def depths(self) -> Floats:
        """The depth buffer, (height, width) float32 in [0, 1]."""
        width, height = self._size
        return np.array(self.depth.read(), np.float32).reshape(height, width)

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self._size = (0, 0)
        self._framebuffer = self.color = self.depth = None
