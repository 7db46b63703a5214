"""Reports of a run: progress lines while it works, and report.json when it is done or fails."""

from __future__ import annotations

import json
import platform
import statistics
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...errors import HairloomError
from ...exchange.files.atomic import write_text_atomic
from .gpu_context import gpu_info
from .gpu_preferences import peak_memory
from .interruption import raise_if_interrupted

_MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
#: Styles of progress lines: for a reader, or for a runner of Open Job Description.
STYLES = ("lines", "openjd")


class Report:
    """Facts and stage times of one run; written as JSON.

    A stage that runs many times is reported by its median.

    style: of STYLES. openjd: also lines that a farm shows as status and progress, after
        github.com/OpenJobDescription/openjd-specifications, "Stdout/Stderr Messages".
    inputs, outputs: files and folders that were read and written.
    """

    def __init__(self, verb: str, style: str = "lines") -> None:
        self._times: dict[str, list[float]] = {}
        self._style, self._stage = style, ""
        self.inputs: list[Path] = []
        self.outputs: list[Path] = []
        self.facts: dict[str, Any] = {"verb": verb, "status": "begun", "dropped": {}, "outputs": []}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block as a stage of this name."""
        raise_if_interrupted()
        if self._style == "openjd" and name != self._stage:
            print(f"openjd_status: {name}", flush=True)
        self._stage = name
        start = time.perf_counter()
        yield
        self._times.setdefault(name, []).append((time.perf_counter() - start) * 1000.0)

    def stages_ms(self) -> dict[str, float]:
        return {name: round(statistics.median(times), 3) for name, times in self._times.items()}

    def add_input(self, path: Path) -> None:
        """Add a file or folder that the result depends on, other than those in options."""
        self.inputs.append(path)

    def add_output(self, path: Path) -> None:
        """Add a file or folder that was written."""
        self.outputs.append(path)
        self.facts["outputs"].append(path.name)

    def progress(self, name: str, total: int) -> Progress:
        """The progress of a long step."""
        return Progress(name, total, self._style)

    def steps(self, name: str) -> Callable[[str], None]:
        """A function that prints the name of each step of long work once."""
        shown = set[str]()

        def show(step: str) -> None:
            raise_if_interrupted()
            if step not in shown:
                print(f"{name}: {step[:1].lower()}{step[1:]}", flush=True)
            shown.add(step)

        return show

    def finish(self, status: str) -> None:
        """Record that the job is "done", or "skipped" because its result exists."""
        self.facts["status"] = status

    def fail(self, error: HairloomError) -> None:
        """Record why the job failed."""
        self._record_failure("failed", error.problem, error.place, error.remedy)
        if self._style == "openjd":
            print(f"openjd_fail: {error}", flush=True)

    def interrupt(self, signal_name: str) -> None:
        """Record that the job was interrupted."""
        self._record_failure("interrupted", "the job was interrupted", signal_name, "Run it again")

    def _record_failure(self, status: str, problem: str, place: str, remedy: str) -> None:
        error = {"problem": problem, "place": place, "remedy": remedy}
        self.facts.update(status=status, error=error)

    def write(self, path: Path) -> None:
        """Write report.json: facts, median milliseconds of each stage, and the environment."""
        memory = {"gpu_memory_mb": round(peak_memory(), 1)}
        content = {**self.facts, "stages_ms": self.stages_ms(), **memory, **environment()}
        write_text_atomic(path, json.dumps(content, indent=2) + "\n")


def environment() -> dict[str, str]:
    """Versions and GPU of this run; backend, renderer and driver are empty if nothing was drawn."""
    return {
        "hairloom": hairloom_version(),
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "numpy": np.__version__,
        **gpu_info(),
    }


def hairloom_version() -> str:
    manifest = tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))
    return str(manifest["version"])


class Progress:
    """A progress line: rewritten in place on a terminal, printed at each tenth elsewhere, and at
    each hundredth for a farm."""

    def __init__(self, name: str, total: int, style: str = "lines") -> None:
        self._name, self._total, self._style, self._last_part = name, total, style, -1

    def show(self, done: int) -> None:
        raise_if_interrupted()
        parts = 100 if self._style == "openjd" else 10
        part = done * parts // max(self._total, 1)
        if self._style == "openjd":
            if part != self._last_part:
                print(f"openjd_progress: {min(part, 100)}", flush=True)
        elif sys.stdout.isatty():
            print(f"\r{self._name}: {done}/{self._total}", end="", flush=True)
            if done >= self._total:
                print()
        elif part != self._last_part:
            print(f"{self._name}: {done}/{self._total}", flush=True)
        self._last_part = part
