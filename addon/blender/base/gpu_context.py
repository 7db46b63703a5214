"""The GPU that this process draws with: made where there is none yet, and its name."""

from __future__ import annotations

import bpy
import gpu


def ensure_gpu() -> None:
    """A GPU context in background mode, where Blender makes one only when asked."""
    if bpy.app.background:
        gpu.init()


def is_interrupted() -> bool:
    """Whether the window's context is gone: between a window's closing and the next redraw."""
    if bpy.app.background:
        return False
    try:
        gpu.types.GPUTexture((1, 1))
    except RuntimeError:
        return True
    return False


def gpu_in_use() -> dict[str, str]:
    """Backend, renderer and driver; empty strings where this process has no GPU context."""
    try:
        return {
            "backend": gpu.platform.backend_type_get(),
            "renderer": gpu.platform.renderer_get(),
            "driver": gpu.platform.version_get(),
        }
    except SystemError:  # what gpu raises where no context was ever made
        return {"backend": "", "renderer": "", "driver": ""}
