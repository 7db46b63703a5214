"""Thin lines in the 3D view, by Blender's own shader."""

from __future__ import annotations

from dataclasses import dataclass

import gpu

from ...arrays import Floats


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of one colour. points: (2n, 3) float32 [m] world, two for each line."""

    color: tuple[float, float, float, float]
    points: Floats


def draw_lines(points: Floats, color: tuple[float, float, float, float]) -> None:
    """Into the view that is being drawn, in front of everything; leaves the state as it was."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    depth, blend = gpu.state.depth_test_get(), gpu.state.blend_get()
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("ALPHA")
    try:
        shader.bind()
        shader.uniform_float("color", color)
        layout = gpu.types.GPUVertFormat()
        layout.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
        vertices = gpu.types.GPUVertBuf(layout, len(points))
        vertices.attr_fill("pos", points)
        gpu.types.GPUBatch(type="LINES", buf=vertices).draw(shader)
    finally:
        gpu.state.depth_test_set(depth)
        gpu.state.blend_set(blend)
