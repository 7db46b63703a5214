"""Makes textures, buffers and framebuffers, each of which is freed by the thread that made it.

Blender on Vulkan destroys at once what a thread without a GPU context frees, even where commands
that it has not run yet still use it, and then crashes. Python frees in any thread: a job drops the
last reference, or the collector of reference cycles happens to run there. So each object is also
referenced from here, until its own thread makes another one and finds it in no other use.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any

import gpu

_OWNED: dict[int, list[Any]] = {}


def _counts(objects: list[Any]) -> list[int]:
    return [sys.getrefcount(each) for each in objects]


#: of an object that only its list references, as this Python counts them
_UNUSED = _counts([object()])[0]


def free_unused() -> None:
    """Free what this thread has made and nothing uses any more; in a thread that draws."""
    owned, before = _OWNED.get(threading.get_ident(), []), -1
    while len(owned) != before:  # a batch goes before its vertices
        before, counts = len(owned), _counts(owned)
        owned[:] = [each for each, count in zip(owned, counts, strict=True) if count > _UNUSED]


def hand_over() -> None:
    """At the end of a render thread: what is still in use belongs to the main thread."""
    main = threading.main_thread().ident
    assert main is not None
    if threading.get_ident() == main:
        return
    # reading waits for all that this thread's context has still to do
    texture((1, 1), format="R32F").read()
    free_unused()
    _OWNED.setdefault(main, []).extend(_OWNED.pop(threading.get_ident(), []))


def forget() -> None:
    """At exit, and for unregistering: free what nothing uses, and keep nothing else alive."""
    _OWNED.clear()


def _owned(kind: str) -> Callable[..., Any]:
    def make(*values: Any, **options: Any) -> Any:
        free_unused()
        made = getattr(gpu.types, kind)(*values, **options)
        _OWNED.setdefault(threading.get_ident(), []).append(made)
        return made

    return make


texture = _owned("GPUTexture")
framebuffer = _owned("GPUFrameBuffer")
vertex_buffer = _owned("GPUVertBuf")
index_buffer = _owned("GPUIndexBuf")
uniform_buffer = _owned("GPUUniformBuf")
batch = _owned("GPUBatch")


def triangle() -> Any:
    """Three vertices with nothing in them, by which strand_layers.vert.glsl covers a target."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
    return batch(type="TRIS", buf=vertex_buffer(layout, 3))
