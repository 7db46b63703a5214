"""Lines of the 3D view's overlay."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("gpu_context")


def test_a_line_is_drawn_through_what_is_in_front_of_it() -> None:
    import gpu
    from mathutils import Matrix

    from hairloom.addon.blender.viewport.debug_lines import Lines, draw_lines

    offscreen: Any = gpu.types.GPUOffScreen(32, 32, format="RGBA16F")
    points = np.array([[-1.0, 0.03, 0.5], [1.0, 0.03, 0.5]], np.float32)
    with offscreen.bind():
        framebuffer = gpu.state.active_framebuffer_get()
        framebuffer.clear(color=(0.0, 0.0, 0.0, 1.0), depth=0.0)
        gpu.matrix.load_matrix(Matrix.Identity(4))
        gpu.matrix.load_projection_matrix(Matrix.Identity(4))
        gpu.state.depth_test_set("LESS_EQUAL")
        draw_lines(Lines((0.0, 1.0, 0.0, 1.0), points))
        assert gpu.state.depth_test_get() == "LESS_EQUAL"
        gpu.state.depth_test_set("NONE")
        read = framebuffer.read_color(0, 0, 32, 32, 4, 0, "FLOAT")
    read.dimensions = 32 * 32 * 4
    picture = np.array(read, np.float32).reshape(32, 32, 4)
    offscreen.free()
    assert (picture[16, 2:30, 1] > 0.9).all()
    assert picture[..., 1].sum() == pytest.approx(32.0, abs=3.0)
    assert picture[..., 0].max() == 0.0
