"""Transfer of arrays to the GPU and back, and contexts that set and restore the drawing state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from . import gpu_objects

_CHANNELS = {"R16F": 1, "R32F": 1, "RG32F": 2, "RGBA32F": 4, "RGBA16F": 4}


def texture_from(pixels: Floats, texture_format: str) -> Any:
    """A 2D texture from a float32 array (height, width, channels), filtered linearly."""
    height, width, channels = pixels.shape
    assert channels == _CHANNELS[texture_format], (pixels.shape, texture_format)
    # Buffer reads the array's memory directly: dtype and order must be right.
    pixels = np.ascontiguousarray(pixels, np.float32)
    data = gpu.types.Buffer("FLOAT", pixels.shape, pixels)
    return gpu_objects.texture((width, height), format=texture_format, data=data)


def volume_from(texels: Floats) -> Any:
    """An RGBA32F 3D texture from a float32 array (depth, height, width, 4), filtered linearly."""
    depth, height, width, channels = texels.shape
    assert channels == 4, texels.shape
    texels = np.ascontiguousarray(texels, np.float32)
    data = gpu.types.Buffer("FLOAT", texels.shape, texels)
    return gpu_objects.texture((width, height, depth), format="RGBA32F", data=data)


def cleared_texture(size: tuple[int, int]) -> Any:
    """An RGBA32F 2D texture of this width and height that is 0 everywhere."""
    texture = gpu_objects.texture(size, format="RGBA32F")
    texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
    return texture


def texture_to_array(texture: Any) -> Floats:
    """A float texture as (height, width, channels) float32, row 0 at the bottom."""
    pixels = np.asarray(texture.read(), np.float32)  # a view of the memory read, without a copy
    return pixels.reshape(texture.height, texture.width, -1)


class UniformBlock:
    """A uniform buffer that is updated when its values change; made on first use."""

    def __init__(self) -> None:
        self._values: Floats | None = None
        self._buffer: Any = None

    def holding(self, values: Floats) -> Any:
        """The buffer with these std140 values, (n,) float32, n a multiple of 4."""
        values = np.ascontiguousarray(values, np.float32)
        assert values.size % 4 == 0, values.size
        if self._values is None or self._values.size != values.size:
            self._buffer = gpu_objects.uniform_buffer(values)
        elif self._values.tobytes() != values.tobytes():
            self._buffer.update(values)
        self._values = values.copy()
        return self._buffer

    @property
    def buffer(self) -> Any:
        """The buffer as it was last filled."""
        return self._buffer


@contextmanager
def drawing_state(
    *, depth_test: str = "LESS_EQUAL", depth_write: bool = True, blend: str = "NONE"
) -> Iterator[None]:
    """Set all state that a draw depends on, and restore it, also after exceptions.

    Culling, facing and colour mask cannot be queried; they are reset to Blender's defaults. The
    viewport and scissor are those of the framebuffer and are not changed.
    """
    state = gpu.state
    before = state.depth_test_get(), state.depth_mask_get(), state.blend_get()
    try:
        state.depth_test_set(depth_test)
        state.depth_mask_set(depth_write)
        state.blend_set(blend)
        _set_unreadable_defaults()
        yield
    finally:
        state.depth_test_set(before[0])
        state.depth_mask_set(before[1])
        state.blend_set(before[2])
        _set_unreadable_defaults()
        gpu.shader.unbind()


@contextmanager
def drawing_into(framebuffer: Any) -> Iterator[None]:
    """Draw into a framebuffer of our own; the previous one is restored with its state."""
    scissor, viewport = gpu.state.scissor_get(), gpu.state.viewport_get()
    with framebuffer.bind():
        yield
    # when a framebuffer is bound again, Vulkan resets both to all of it
    gpu.state.viewport_set(*viewport)
    gpu.state.scissor_set(*scissor)


@contextmanager
def drawing_rows(rows: range | None) -> Iterator[None]:
    """Draw only into these rows; None: all. Only for a framebuffer of our own, since it cannot be
    queried whether another one uses a scissor test.
    """
    if rows is None:
        yield
        return
    scissor = left, _, width, _ = gpu.state.scissor_get()
    gpu.state.scissor_set(left, rows.start, width, len(rows))
    gpu.state.scissor_test_set(True)
    try:
        yield
    finally:
        gpu.state.scissor_test_set(False)
        gpu.state.scissor_set(*scissor)


def _set_unreadable_defaults() -> None:
    gpu.state.face_culling_set("NONE")
    gpu.state.front_facing_set(False)
    gpu.state.color_mask_set(True, True, True, True)
