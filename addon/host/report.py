"""What a run did: progress lines while it works, and report.json when it is done."""

from __future__ import annotations

import json
import platform
import statistics
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..exchange.atomic import write_text_atomic
from .gpu_context import gpu_in_use

_MANIFEST = Path(__file__).parents[2] / "blender_manifest.toml"


class Report:
    """Facts and stage times of one run; written as JSON.

    A stage that runs many times is reported by its median.
    """

    def __init__(self, verb: str) -> None:
        self._times: dict[str, list[float]] = {}
        self.facts: dict[str, Any] = {"verb": verb, "dropped": {}, "outputs": []}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside, under this name."""
        begin = time.perf_counter()
        yield
        self._times.setdefault(name, []).append((time.perf_counter() - begin) * 1000.0)

    def stages_ms(self) -> dict[str, float]:
        return {name: round(statistics.median(times), 3) for name, times in self._times.items()}

    def add_output(self, path: Path) -> None:
        self.facts["outputs"].append(path.name)

    def write(self, path: Path) -> None:
        """Write report.json: facts, median milliseconds of each stage, and what it ran on."""
        content = {**self.facts, "stages_ms": self.stages_ms(), **environment()}
        write_text_atomic(path, json.dumps(content, indent=2) + "\n")


def environment() -> dict[str, str]:
    """What the run ran on; backend and renderer are empty where nothing was drawn."""
    manifest = tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))
    return {
        "hairloom": manifest["version"],
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
        **gpu_in_use(),
    }


class Progress:
    """A line that grows: rewritten in place on a terminal, every tenth of the way elsewhere."""

    def __init__(self, name: str, total: int) -> None:
        self._name, self._total, self._shown = name, total, -1

    def show(self, done: int) -> None:
        tenth = done * 10 // max(self._total, 1)
        if sys.stdout.isatty():
            print(f"\r{self._name}: {done}/{self._total}", end="", flush=True)
            if done >= self._total:
                print()
        elif tenth != self._shown:
            print(f"{self._name}: {done}/{self._total}", flush=True)
        self._shown = tenth
