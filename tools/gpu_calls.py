"""Counts a piece of work's calls of the gpu module: readbacks, draws and dispatches."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

#: function of the gpu module -> what it counts as
_CALLS = {
    "GPUTexture.read": "reads",
    "GPUFrameBuffer.read_color": "reads",
    "GPUFrameBuffer.read_depth": "reads",
    "GPUBatch.draw": "draws",
    "GPUBatch.draw_instanced": "draws",
    "GPUBatch.draw_range": "draws",
    "dispatch": "dispatches",
}


def gpu_calls(work: Callable[[], Any]) -> Counter[str]:
    """Number of calls by `work` in this thread, by kind. Types of the gpu module cannot be patched,
    so the interpreter's profiler reports calls of built-in functions.
    """
    counts: Counter[str] = Counter()

    def count_call(_frame: Any, event: str, function: Any) -> None:
        if event == "c_call":
            kind = _CALLS.get(function.__qualname__)
            if kind is not None:
                counts[kind] += 1

    previous = sys.getprofile()
    sys.setprofile(count_call)
    try:
        work()
    finally:
        sys.setprofile(previous)
    return counts
