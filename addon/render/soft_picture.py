"""Soft shadows of a view at rest: hair, and its shadow on meshes, as the mean of many samples.

Each sample is lit by one point of each light, see light_samples.py. Hair is summed scene-linear,
and only the mean is encoded for the view, so that a penumbra is as bright as in a still. For the
shadow on meshes two brightnesses on the screen are summed: that which hair takes, and that without
hair. So samples in which a light shines brighter count more.

    hair_sum, shadow_sum RGBA32F: of all samples
    sample RGBA32F with a depth DEPTH32F: the current sample

That is 52 bytes per pixel while samples are being summed. The result is drawn into a CachedPicture.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gpu

from . import gpu_objects
from .accumulation import Accumulation
from .cached_picture import CachedPicture
from .display import Display
from .feature_programs import UniformBlocks, bound
from .shader_program import ShaderRecipe, released_with_shaders
from .textures import drawing_state

_PIXEL_BYTES = 52
_RECIPE = ShaderRecipe(
    name="soft_picture",
    vertex="whole_target.vert.glsl",
    fragment="soft_picture.frag.glsl",
    textures=(("FLOAT_2D", "hair_sum"), ("FLOAT_2D", "shadow_sum"), ("DEPTH_2D", "hair_depth")),
    integers=("sample_count",),
    outputs=(("VEC4", "color"),),
)


class SoftPicture:
    """The sums of samples of one view. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._hair, self._shadow = Accumulation(), Accumulation()
        self._sample = CachedPicture("RGBA32F")
        self._triangle: Any = None
        released_with_shaders(self)

    @property
    def count(self) -> int:
        """Samples so far."""
        return self._hair.count

    def missing_bytes(self) -> int:
        """Bytes that the next sample of the bound viewport allocates on the GPU."""
        left, bottom, width, height = gpu.state.viewport_get()
        return 0 if self.count else _PIXEL_BYTES * (left + width) * (bottom + height)

    def add(
        self, draw_shadows: Callable[[Any], None], draw_hair: Callable[[CachedPicture], None]
    ) -> None:
        """Add a sample for the bound viewport; the first one after a release, or in a viewport of
        another size, begins a new sum.

        Args:
            draw_shadows: lets BodyShadow store a sample into this texture.
            draw_hair: lets StrandPass draw a sample into this picture.
        """
        self._sample.begin()
        size = self._sample.color.width, self._sample.color.height
        if not self.count or self._hair.size != size:
            for each in (self._hair, self._shadow):
                each.begin(*size)
        draw_shadows(self._sample.color)
        self._shadow.add(self._sample.color)
        self._sample.begin()
        draw_hair(self._sample)
        self._hair.add(self._sample.color)

    def show_in(self, picture: CachedPicture, display: Display | None) -> None:
        """Draw the mean of the samples so far into the kept picture of this viewport.

        Args:
            display: as in StrandPass.draw.
        """
        if self._triangle is None:
            self._triangle = gpu_objects.triangle()
        with picture.drawing(), drawing_state(depth_test="ALWAYS"):
            shader = bound(
                _RECIPE,
                [] if display is None else [display.feature],
                UniformBlocks(),
                textures={
                    "hair_sum": self._hair.total,
                    "shadow_sum": self._shadow.total,
                    "hair_depth": self._sample.depth,
                },
                integers={"sample_count": self.count},
            )
            self._triangle.draw(shader.shader)

    def release(self) -> None:
        """Release everything on the GPU, with all samples."""
        for each in (self._hair, self._shadow, self._sample):
            each.release()
        self._triangle = None
