"""Drawing restores the GPU state, and writes the right values for Blender's viewport."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.settings import ShadingSettings, StrandSettings


@pytest.fixture
def offscreen(gpu_context: Any) -> Any:
    offscreen = gpu_context.types.GPUOffScreen(32, 24, format="RGBA32F")
    yield offscreen
    offscreen.free()


@pytest.fixture
def white(gpu_context: Any) -> Any:
    """A snapshot that fills the picture with grey 0.5, and its camera."""
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.snapshot import Snapshot

    strands = np.array([[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]], np.float32)
    snapshot = Snapshot(
        strands,
        np.full((1, 2), 9.0, np.float32),
        ambient=(0.5, 0.5, 0.5),
        shading=ShadingSettings(
            model="kajiya_kay", base_color=(1.0, 1.0, 1.0), color_variation=0.0
        ),
        strand_settings=StrandSettings(tip_width=1.0),
    )
    return snapshot, Camera(look_at((0, -1, 0), (0, 0, 0)), orthographic(1.0, 1.0, 0.0, 3.0))


def state_of(gpu: Any) -> tuple[Any, ...]:
    state = gpu.state
    return (
        state.depth_test_get(),
        state.depth_mask_get(),
        state.blend_get(),
        tuple(state.viewport_get()),
        tuple(state.scissor_get()),
    )


@pytest.mark.parametrize("blend", ["NONE", "ALPHA_PREMULT"])
@pytest.mark.parametrize(("test", "mask"), [("NONE", True), ("GREATER", False)])
def test_state_is_as_it_was_found(
    gpu_context: Any, offscreen: Any, white: Any, test: str, mask: bool, blend: str
) -> None:
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot, camera = white
    state = gpu_context.state
    with offscreen.bind():
        try:
            state.depth_test_set(test)
            state.depth_mask_set(mask)
            state.blend_set(blend)
            state.scissor_set(3, 4, 5, 6)
            before, framebuffer = state_of(gpu_context), state.active_framebuffer_get()
            StrandPass().draw(snapshot, camera, 32, 24)
            assert state_of(gpu_context) == before
            render_image(snapshot, camera, 7, 9, 2)
            assert state_of(gpu_context) == before
            assert state.active_framebuffer_get() == framebuffer
        finally:
            state.depth_test_set("NONE")
            state.depth_mask_set(True)
            state.blend_set("NONE")


def test_state_is_restored_after_an_error(gpu_context: Any, offscreen: Any, white: Any) -> None:
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot, camera = white
    with offscreen.bind():
        before = state_of(gpu_context)
        with pytest.raises(ValueError, match="no_such"):
            StrandPass().draw(snapshot, camera, 32, 24, output="no_such")
        assert state_of(gpu_context) == before


def test_colour_mask_and_culling_of_others_do_not_hinder(
    gpu_context: Any, offscreen: Any, white: Any
) -> None:
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot, camera = white
    with offscreen.bind():
        framebuffer = gpu_context.state.active_framebuffer_get()
        framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        gpu_context.state.face_culling_set("BACK")
        gpu_context.state.color_mask_set(False, False, False, False)
        StrandPass().draw(snapshot, camera, 32, 24)
    assert pixel(offscreen) == pytest.approx([0.5, 0.5, 0.5, 1.0])


def test_viewport_output_shows_what_standard_would(
    gpu_context: Any, offscreen: Any, white: Any
) -> None:
    """A POST_VIEW handler's L is shown as 255 L^(1/2.2); Standard shows 0.5 as 188."""
    from hairloom.addon.render.strand_pass import StrandPass

    snapshot, camera = white
    with offscreen.bind():
        framebuffer = gpu_context.state.active_framebuffer_get()
        framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        StrandPass().draw(snapshot, camera, 32, 24, output="viewport")
    shown = 255.0 * pixel(offscreen)[0] ** (1.0 / 2.2)
    assert shown == pytest.approx(188.0, abs=0.6)


def pixel(offscreen: Any) -> np.ndarray:
    pixels = np.array(offscreen.texture_color.read()).reshape(24, 32, 4)
    return pixels[12, 16]
