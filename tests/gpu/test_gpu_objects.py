"""GPU objects are freed by the thread that made them, wherever their last reference goes."""

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
    """A cycle that only the collector frees, and the thread is where it runs."""
    cycle = {"texture": box.pop()}
    cycle["cycle"] = cycle
    del cycle
    _in_thread(gc.collect)


@pytest.mark.parametrize(
    "drop",
    [
        pytest.param(lambda box: _in_thread(box.clear), id="last_reference"),
        pytest.param(_collected_there, id="collector", marks=pytest.mark.slow),
    ],
)
def test_what_another_thread_drops_waits_for_its_own(drop: Callable[[list[Any]], None]) -> None:
    """On Vulkan a texture that a thread frees before its upload has run crashes Blender."""
    kept = _filled(1.0)
    for value in range(20):
        box = [_filled(value)]
        texture = id(box[0])
        drop(box)
        owned = gpu_objects._OWNED[threading.get_ident()]
        assert texture in map(id, owned)
        assert np.asarray(kept.read()).max() == 1.0
    gpu_objects.free_unused()
    assert texture not in map(id, gpu_objects._OWNED[threading.get_ident()])


def test_making_another_frees_what_nothing_uses() -> None:
    owned = gpu_objects._OWNED
    kept, dropped = _filled(1.0), _filled(2.0)
    before = len(owned[threading.get_ident()])
    del dropped
    for value in range(10):
        _filled(value)
    assert len(owned[threading.get_ident()]) <= before
    assert any(each is kept for each in owned[threading.get_ident()])


def test_a_render_thread_leaves_what_it_made_to_the_main_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The thread has no context here, so what it would make and read is a stand-in."""

    class Made:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def read(self) -> None:
            reads.append(1)

    made: list[Made] = []
    reads: list[int] = []

    def render() -> None:
        made.append(gpu_objects.texture((1, 1)))
        gpu_objects.texture((1, 1))  # of no use any more when the thread ends
        gpu_objects.hand_over()

    gpu_objects.free_unused()
    with monkeypatch.context() as context:
        context.setattr(gpu.types, "GPUTexture", Made)
        _in_thread(render)
    owned = gpu_objects._OWNED
    mine = owned[threading.get_ident()]
    assert set(owned) == {threading.get_ident()}
    assert [each is made[0] for each in mine if isinstance(each, Made)] == [True]
    assert reads == [1], "nothing has waited for the thread's commands"
    gpu_objects.hand_over()  # the main thread's stay its own
    assert any(each is made[0] for each in mine)


def test_nothing_else_makes_gpu_objects() -> None:
    """The module's list is whole only if all objects are made there."""
    addon = Path(gpu_objects.__file__).parents[1]
    makers = {
        path.name
        for path in addon.rglob("*.py")
        if re.search(r"gpu\.types\.GPU\w+\(|batch_for_shader|GPUOffScreen", _code(path))
    }
    assert makers == {"gpu_context.py"}, "a 1 x 1 texture that asks for a context"


def _code(path: Path) -> str:
    """Without what never comes to the GPU: descriptions of vertices, shaders and stages."""
    descriptions = r"gpu\.types\.GPU(VertFormat|ShaderCreateInfo|StageInterfaceInfo)\("
    return re.sub(descriptions, "", path.read_text())
