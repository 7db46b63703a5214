"""GPU objects are freed by the thread that made them, wherever their last reference is dropped."""

from __future__ import annotations

import gc
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="runs inside Blender")

import gpu

from hairloom.addon.render import gpu_objects
from hairloom.addon.render.capabilities import FORMATS
from hairloom.addon.render.textures import texture_from

pytestmark = pytest.mark.usefixtures("gpu_context")

_SIDE = 128


def _filled(value: float) -> Any:
    return texture_from(np.full((_SIDE, _SIDE, 4), value, np.float32), "RGBA32F")


def _in_thread(action: Callable[[], object]) -> None:
    thread = threading.Thread(target=action)
    thread.start()
    thread.join()


def _collected_there(box: list[Any]) -> None:
    """Drop the object in a cycle, which the garbage collector frees in another thread."""
    cycle = {"texture": box.pop()}
    cycle["cycle"] = cycle
    del cycle
    _in_thread(gc.collect)


def mine() -> list[Any]:
    """The kept objects that this thread has made."""
    return gpu_objects._OBJECTS.owned[threading.get_ident()].objects


@pytest.mark.parametrize(
    "drop",
    [
        pytest.param(lambda box: _in_thread(box.clear), id="last_reference"),
        pytest.param(_collected_there, id="collector", marks=pytest.mark.slow),
    ],
)
def test_objects_dropped_by_another_thread_wait_for_their_own(
    drop: Callable[[list[Any]], None],
) -> None:
    """On Vulkan, Blender crashes if another thread frees a texture before its upload has run."""
    kept = _filled(1.0)
    for value in range(20):
        box = [_filled(value)]
        texture = id(box[0])
        drop(box)
        assert texture in map(id, mine())
        assert np.asarray(kept.read()).max() == 1.0
    gpu_objects.free_unused()
    assert texture not in map(id, mine())


def test_making_an_object_frees_unused_ones() -> None:
    kept, dropped = _filled(1.0), _filled(2.0)
    before = len(mine())
    del dropped
    for value in range(10):
        _filled(value)
    assert len(mine()) <= before
    assert any(each is kept for each in mine())


def test_a_render_thread_leaves_what_it_made_to_the_main_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The thread has no GPU context here, so a fake class replaces the textures that it makes."""

    class Made:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def read(self) -> None:
            reads.append(1)

    made: list[Made] = []
    reads: list[int] = []

    def render() -> None:
        made.append(gpu_objects.texture((1, 1), format="R32F"))
        gpu_objects.texture((1, 1), format="R32F")  # unused when the thread ends
        gpu_objects.hand_over()

    gpu_objects.free_unused()
    with monkeypatch.context() as context:
        context.setattr(gpu.types, "GPUTexture", Made)
        _in_thread(render)
    assert set(gpu_objects._OBJECTS.owned) == {threading.get_ident()}
    assert [each is made[0] for each in mine() if isinstance(each, Made)] == [True]
    assert reads == [1], "nothing has waited for the thread's commands"
    gpu_objects.hand_over()  # the main thread keeps its own objects
    assert any(each is made[0] for each in mine())


def test_bytes_are_counted_while_they_are_there() -> None:
    def in_use() -> int:
        gpu_objects.free_unused()
        return gpu_objects.bytes_in_use()

    before = in_use()
    image = gpu_objects.texture((64, 32), format="RGBA16F")
    array = gpu_objects.texture((16, 16), layers=3, format="DEPTH_COMPONENT32F")
    corners = gpu_objects.vertex_buffer({"position": np.zeros((5, 3)), "normal": np.ones((5, 3))})
    indices = gpu_objects.index_buffer(np.array([[0, 1, 2], [2, 3, 4]]))
    block = gpu_objects.uniform_buffer(np.zeros(8, np.float32))
    drawn = gpu_objects.batch("TRIS", corners, indices)
    sizes = 64 * 32 * 8, 16 * 16 * 3 * 4, 5 * 6 * 4, 6 * 4, 8 * 4
    assert in_use() - before == sum(sizes)
    assert gpu_objects.peak_bytes() >= before + sum(sizes)
    del image, drawn, corners
    assert in_use() - before == sum(sizes[i] for i in (1, 3, 4))
    del array, indices, block
    assert in_use() == before


def test_all_formats_that_passes_make_have_a_size() -> None:
    assert set(FORMATS) <= set(gpu_objects._TEXEL_BYTES)


def test_nothing_else_makes_gpu_objects() -> None:
    """The module's list is complete only if it creates all objects."""
    addon = Path(gpu_objects.__file__).parents[1]
    makers = {
        path.name
        for path in addon.rglob("*.py")
        if re.search(r"gpu\.types\.GPU\w+\(|batch_for_shader|GPUOffScreen", _code(path))
    }
    assert makers == {"gpu_context.py"}, "a 1 x 1 texture that asks for a context"


def _code(path: Path) -> str:
    """A file's code without descriptions of vertices, shaders and stages, which need no GPU."""
    descriptions = r"gpu\.types\.GPU(VertFormat|ShaderCreateInfo|StageInterfaceInfo)\("
    return re.sub(descriptions, "", path.read_text())
