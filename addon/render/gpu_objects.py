"""Makes textures, buffers and framebuffers, each of which is freed by the thread that made it, and
counts the bytes of all that are there.

Blender on Vulkan destroys at once what a thread without a GPU context frees, even where commands
that it has not run yet still use it, and then crashes. Python frees in any thread: a job drops the
last reference, or the collector of reference cycles happens to run there. So each object is also
referenced from here, until its own thread makes another one and finds it in no other use.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import prod
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats, Ints

#: bytes a texel; gpu.types.GPUTexture's own format comes first
_TEXEL_BYTES = {
    "RGBA8": 4,
    "R8": 1,
    "SRGB8_A8": 4,
    "R16F": 2,
    "RGBA16F": 8,
    "R32F": 4,
    "RG32F": 8,
    "RGBA32F": 16,
    "R32UI": 4,
    "RGBA32UI": 16,
    "DEPTH_COMPONENT32F": 4,
}


@dataclass
class _Owned:
    """What a thread has made, and how many bytes each takes.

    lock: a render thread that ends gives what it has made to the main thread, which works on.
    """

    objects: list[Any] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def keep(self, made: Any, size: int) -> None:
        with self.lock:
            self.objects.append(made)
            self.sizes.append(size)

    def free_unused(self) -> None:
        with self.lock:
            before = -1
            while len(self.objects) != before:  # a batch goes before its vertices
                before, counts = len(self.objects), _counts(self.objects)
                used = [count > _UNUSED for count in counts]
                for values in (self.objects, self.sizes):
                    values[:] = [
                        each for each, is_used in zip(values, used, strict=True) if is_used
                    ]

    def take(self, other: _Owned) -> None:
        with self.lock:
            self.objects += other.objects
            self.sizes += other.sizes


def _counts(objects: list[Any]) -> list[int]:
    return [sys.getrefcount(each) for each in objects]


#: of an object that only its list references, as this Python counts them
_UNUSED = _counts([object()])[0]


@dataclass
class _Kept:
    """All that is there, by thread, and the most bytes that there were at once."""

    owned: dict[int, _Owned] = field(default_factory=dict)
    peak: int = 0

    @property
    def size(self) -> int:
        return sum(sum(each.sizes) for each in list(self.owned.values()))


_KEPT = _Kept()


def free_unused() -> None:
    """Free what this thread has made and nothing uses any more; in a thread that draws."""
    owned = _KEPT.owned.get(threading.get_ident())
    if owned is not None:
        owned.free_unused()


def hand_over() -> None:
    """At the end of a render: what is unused is freed, what is still in use belongs to the main
    thread."""
    main = threading.main_thread().ident
    assert main is not None
    if threading.get_ident() == main:
        free_unused()
        return
    # reading waits for all that this thread's context has still to do
    texture((1, 1), format="R32F").read()
    free_unused()
    mine = _KEPT.owned.pop(threading.get_ident(), _Owned())
    _KEPT.owned.setdefault(main, _Owned()).take(mine)


def forget() -> None:
    """At exit: free what nothing uses, and keep nothing else alive."""
    _KEPT.owned.clear()


def bytes_in_use() -> int:
    """Of all textures and buffers that have not been freed; a driver may round them up."""
    return _KEPT.size


def peak_bytes() -> int:
    """The most that there were at once since Blender started."""
    return _KEPT.peak


def texture(size: tuple[int, ...], *, format: str, layers: int = 0, data: Any = None) -> Any:
    """As gpu.types.GPUTexture."""
    options = {"layers": layers} if layers else {}
    options |= {} if data is None else {"data": data}
    held = prod(size) * max(layers, 1) * _TEXEL_BYTES[format]
    return _made("GPUTexture", held, size, format=format, **options)


def framebuffer(**slots: Any) -> Any:
    """As gpu.types.GPUFrameBuffer; it has no memory of its own."""
    return _made("GPUFrameBuffer", 0, **slots)


def vertex_buffer(values: Mapping[str, Floats]) -> Any:
    """Attributes of vertices by name, (vertex_count, length) each."""
    layout = gpu.types.GPUVertFormat()
    # attr_fill checks neither dtype nor order
    arrays = {name: np.ascontiguousarray(array, np.float32) for name, array in values.items()}
    for name, array in arrays.items():
        layout.attr_add(id=name, comp_type="F32", len=array.shape[1], fetch_mode="FLOAT")
    (count,) = {len(array) for array in arrays.values()}
    vertices = _made("GPUVertBuf", sum(map(_bytes_of, arrays.values())), layout, count)
    for name, array in arrays.items():
        vertices.attr_fill(name, array)
    return vertices


def index_buffer(triangles: Ints) -> Any:
    """Of triangles, (triangle_count, 3)."""
    corners = np.ascontiguousarray(triangles, np.int32)
    return _made("GPUIndexBuf", corners.nbytes, type="TRIS", seq=corners)


def uniform_buffer(values: Any) -> Any:
    """As gpu.types.GPUUniformBuf."""
    return _made("GPUUniformBuf", memoryview(values).nbytes, values)


def batch(kind: str, vertices: Any, indices: Any = None) -> Any:
    """As gpu.types.GPUBatch; it has no memory of its own."""
    options = {} if indices is None else {"elem": indices}
    return _made("GPUBatch", 0, type=kind, buf=vertices, **options)


def bare_batch(kind: str, count: int) -> Any:
    """Vertices with nothing in them, which their shader puts somewhere by their numbers."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
    return batch(kind, _made("GPUVertBuf", 4 * count, layout, count))


def triangle() -> Any:
    """By which whole_target.vert.glsl covers a target."""
    return bare_batch("TRIS", 3)


def _bytes_of(array: Floats) -> int:
    return int(array.nbytes)


def _made(kind: str, size: int, *values: Any, **options: Any) -> Any:
    free_unused()
    made = getattr(gpu.types, kind)(*values, **options)
    _KEPT.owned.setdefault(threading.get_ident(), _Owned()).keep(made, size)
    _KEPT.peak = max(_KEPT.peak, _KEPT.size)
    return made
