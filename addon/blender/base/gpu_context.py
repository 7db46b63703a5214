"""The GPU context of this process, created if there is none, and the GPU's name."""

from __future__ import annotations

import bpy
import gpu


def ensure_gpu() -> None:
    """A GPU context in background mode, where Blender makes one only when asked."""
    if bpy.app.background:
        gpu.init()


def is_interrupted() -> bool:
    """Whether there is no window context, as between a window's closing and the next redraw."""
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
    except SystemError:  # what gpu raises if no context was ever created
        return {"backend": "", "renderer": "", "driver": ""}
