"""Creation of textures, buffers and framebuffers, with each freed in the thread that made it, and
bytes in use counted.

On Vulkan, Blender immediately destroys an object that is freed in a thread without a GPU context,
even if pending commands use it, and then crashes. Python may free objects in any thread: a job may
drop the last reference, or the garbage collector may run there. So this module also references each
object, until the object's own thread makes another one and finds it otherwise unused.
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

#: bytes per texel; the default format of gpu.types.GPUTexture comes first
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
    """The objects that a thread has made, with their sizes [bytes].

    lock: a render thread that ends hands its objects over to the main thread, which may be using
        its own.
    """

    objects: list[Any] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, made: Any, size: int) -> None:
        with self.lock:
            self.objects.append(made)
            self.sizes.append(size)

    def free_unused(self) -> None:
        with self.lock:
            before = -1
            while len(self.objects) != before:  # a batch must be freed before its vertices
                before, counts = len(self.objects), _counts(self.objects)
                used = [count > _UNUSED for count in counts]
                for values in (self.objects, self.sizes):
                    values[:] = [
                        each for each, is_used in zip(values, used, strict=True) if is_used
                    ]

    def merge(self, other: _Owned) -> None:
        with self.lock:
            self.objects += other.objects
            self.sizes += other.sizes


def _counts(objects: list[Any]) -> list[int]:
    return [sys.getrefcount(each) for each in objects]


#: reference count, in this Python, of an object that only its list references
_UNUSED = _counts([object()])[0]


@dataclass
class _Objects:
    """All objects, by thread, and the peak number of bytes."""

    owned: dict[int, _Owned] = field(default_factory=dict)
    peak: int = 0

    @property
    def size(self) -> int:
        return sum(sum(each.sizes) for each in list(self.owned.values()))


_OBJECTS = _Objects()


def free_unused() -> None:
    """Free this thread's unused objects. In a thread that draws."""
    owned = _OBJECTS.owned.get(threading.get_ident())
    if owned is not None:
        owned.free_unused()


def hand_over() -> None:
    """At the end of a render: free this thread's unused objects, and hand the others over to the
    main thread."""
    main = threading.main_thread().ident
    assert main is not None
    if threading.get_ident() == main:
        free_unused()
        return
    # reading waits until this thread's context has run all its commands
    texture((1, 1), format="R32F").read()
    free_unused()
    mine = _OBJECTS.owned.pop(threading.get_ident(), _Owned())
    _OBJECTS.owned.setdefault(main, _Owned()).merge(mine)


def forget() -> None:
    """At exit: drop all references held here, which frees unused objects."""
    _OBJECTS.owned.clear()


def bytes_in_use() -> int:
    """Bytes of all textures and buffers that have not been freed; drivers may round them up."""
    return _OBJECTS.size


def peak_bytes() -> int:
    """The most bytes in use at once since Blender started."""
    return _OBJECTS.peak


def texture(size: tuple[int, ...], *, format: str, layers: int = 0, data: Any = None) -> Any:
    """As gpu.types.GPUTexture."""
    options = {"layers": layers} if layers else {}
    options |= {} if data is None else {"data": data}
    held = prod(size) * max(layers, 1) * _TEXEL_BYTES[format]
    return _made("GPUTexture", held, size, format=format, **options)


def framebuffer(**slots: Any) -> Any:
    """As gpu.types.GPUFrameBuffer; it takes no memory of its own."""
    return _made("GPUFrameBuffer", 0, **slots)


def vertex_buffer(values: Mapping[str, Floats]) -> Any:
    """A buffer of vertex attributes by name, (vertex_count, length) each."""
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
    """An index buffer of triangles, (triangle_count, 3)."""
    corners = np.ascontiguousarray(triangles, np.int32)
    return _made("GPUIndexBuf", corners.nbytes, type="TRIS", seq=corners)


def uniform_buffer(values: Any) -> Any:
    """As gpu.types.GPUUniformBuf."""
    return _made("GPUUniformBuf", memoryview(values).nbytes, values)


def batch(kind: str, vertices: Any, indices: Any = None) -> Any:
    """As gpu.types.GPUBatch; it takes no memory of its own."""
    options = {} if indices is None else {"elem": indices}
    return _made("GPUBatch", 0, type=kind, buf=vertices, **options)


def bare_batch(kind: str, count: int) -> Any:
    """A batch of vertices without data, which the shader places by gl_VertexID."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
    return batch(kind, _made("GPUVertBuf", 4 * count, layout, count))


def triangle() -> Any:
    """The batch with which whole_target.vert.glsl covers a target."""
    return bare_batch("TRIS", 3)


def _bytes_of(array: Floats) -> int:
    return int(array.nbytes)


def _made(kind: str, size: int, *values: Any, **options: Any) -> Any:
    free_unused()
    made = getattr(gpu.types, kind)(*values, **options)
    _OBJECTS.owned.setdefault(threading.get_ident(), _Owned()).add(made, size)
    _OBJECTS.peak = max(_OBJECTS.peak, _OBJECTS.size)
    return made
