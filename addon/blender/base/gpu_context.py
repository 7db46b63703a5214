"""The GPU context of this process, created if there is none, and the GPU's name.

In background mode Blender creates a context only on request. Without a driver that draws, the
request crashes Blender, so another process tests the drivers first.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from subprocess import TimeoutExpired

import bpy
import gpu

from ...errors import HairloomError
from ...exchange.files.child_process import run_child
from ...render import gpu_objects

#: Exits with 0 if OpenGL or Vulkan finds a device without a window, in the way that Blender does.
_DRIVER_TEST = """
import ctypes, sys

def opengl():
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
    egl.eglGetPlatformDisplay.argtypes = [ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    surfaceless = 0x31DD
    displays = egl.eglGetDisplay(None), egl.eglGetPlatformDisplay(surfaceless, None, None)
    return any(each and egl.eglInitialize(each, None, None) for each in displays)

def vulkan():
    vulkan = ctypes.CDLL("libvulkan.so.1")
    class Info(ctypes.Structure):
        _fields_ = [("type", ctypes.c_int)] + [(str(i), ctypes.c_void_p) for i in range(7)]
    info, instance, count = Info(1), ctypes.c_void_p(), ctypes.c_uint32()
    if vulkan.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)):
        return False
    vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    return count.value > 0

def works(test):
    try:
        return test()
    except (OSError, AttributeError):
        return False

sys.exit(0 if works(opengl) or works(vulkan) else 1)
"""


#: Errors of Blender's module start with this if a texture or target cannot be created.
_GPU_ERROR_PREFIX = "gpu."
#: Seconds for a driver to answer, on a busy machine too.
_DRIVER_TIMEOUT = 60.0
#: Seconds between checks for a window context.
_POLL_INTERVAL = 0.05


def ensure_gpu() -> None:
    """A GPU context for this thread in background mode.

    Raises:
        HairloomError: there is no driver for one.
    """
    if not bpy.app.background:
        return
    if not gpu_info()["backend"] and not can_draw():
        raise HairloomError(
            "there is neither a GPU nor a software driver here",
            place="render",
            remedy="Install Mesa's drivers (libegl1, libgl1-mesa-dri) or render on another machine",
        )
    gpu.init()


@cache
def can_draw() -> bool:
    """Whether there is a driver that draws; always, except on Linux."""
    if not sys.platform.startswith("linux"):
        return True
    command = [sys.executable, "-I", "-c", _DRIVER_TEST]
    try:
        return run_child(command, seconds=_DRIVER_TIMEOUT).returncode == 0
    except TimeoutExpired:  # Blender would wait for the same driver
        return False
    except OSError:  # this Blender has no Python executable for the test
        return True


@contextmanager
def converted_gpu_errors() -> Iterator[None]:
    """Turn errors of the GPU inside the block, such as a lack of memory, into a HairloomError.

    Raises:
        HairloomError: the GPU cannot provide something.
    """
    try:
        yield
    except RuntimeError as error:
        if not str(error).startswith(_GPU_ERROR_PREFIX):
            raise
        raise HairloomError(
            f"the GPU cannot provide what drawing needs ({error})",
            place="render",
            remedy="Close other programs that use the GPU, or choose smaller pictures and textures",
        ) from error


def is_context_missing() -> bool:
    """Whether there is no window context, as between the closing of a window and the next
    redraw."""
    if bpy.app.background:
        return False
    try:
        gpu.types.GPUTexture((1, 1))
    except RuntimeError:
        return True
    return False


def schedule_free_unused() -> None:
    """Free unused GPU objects from a timer, when the caller's own references are gone too."""
    is_main = threading.current_thread() is threading.main_thread()
    if bpy.app.background or not is_main or bpy.app.timers.is_registered(_free_unused):
        return
    bpy.app.timers.register(_free_unused, first_interval=0.0, persistent=True)


def _free_unused() -> float | None:
    if is_context_missing():
        return _POLL_INTERVAL
    gpu_objects.free_unused()
    return None


def gpu_info() -> dict[str, str]:
    """Backend, renderer and driver; empty strings where this process has no GPU context."""
    try:
        return {
            "backend": gpu.platform.backend_type_get(),
            "renderer": gpu.platform.renderer_get(),
            "driver": gpu.platform.version_get(),
        }
    except SystemError:  # raised by gpu if no context was ever created
        return {"backend": "", "renderer": "", "driver": ""}
