"""Start and end of the deep layers of an opacity map by depth tests, without image atomics.

The depths of the first and of the last hair are drawn into two depth buffers, which are then
reduced to the resolution of `starts`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import gpu_objects
from .opacity_maps import OpacityMaps
from .shader_program import ShaderRecipe, program
from .textures import drawing_into, drawing_state

_STARTS_RECIPE = ShaderRecipe(
    name="opacity_starts_of_depths",
    compute="opacity_starts_of_depths.comp.glsl",
    textures=(("DEPTH_2D", "first_depths"), ("DEPTH_2D", "last_depths")),
    images=(("R32UI", "starts"),),
    integers=("map_index",),
)


def draw_starts(maps: OpacityMaps, number: int, side: int, draw: Callable[[], None]) -> None:
    """Write the depths at which the layers of one map start and end into `maps.starts`.

    Args:
        side: of the depth buffers [texels]; a multiple of that of `starts`.
        draw: draws all hair into the bound depth buffer.
    """
    depths = {
        "first_depths": _depths(side, "LESS_EQUAL", 1.0, draw),
        "last_depths": _depths(side, "GREATER_EQUAL", 0.0, draw),
    }
    shader = program(_STARTS_RECIPE)
    shader.bind(textures=depths, images={"starts": maps.starts}, integers={"map_index": number})
    shader.dispatch(maps.starts.width // 2, maps.starts.width // 2)


def _depths(side: int, depth_test: str, none: float, draw: Callable[[], None]) -> Any:
    """A texture with the depth of the hair that wins the depth test in each texel; `none` where
    there is no hair."""
    depths = gpu_objects.texture((side, side), format="DEPTH_COMPONENT32F")
    target = gpu_objects.framebuffer(depth_slot=depths)
    with drawing_into(target), drawing_state(depth_test=depth_test):
        target.clear(depth=none)
        draw()
    return depths
