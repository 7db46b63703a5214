"""TressFX, .tfxbone and .hair files, and presets: how fast they are, and what damage and death do.

Fuzzing and killing run in children: one that crashes ends the benchmark with its last words.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import read_hair_file, write_hair_file
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.strands import StrandSet

STRANDS, POINTS, ROUNDS = 100_000, 16, 7
FUZZED, KILLS = 10_000, 100
FUZZED_FORMATS = ("tfx", "tfxbone", "hair", "preset")


def files_figures(fuzzed: int = FUZZED, kills: int = KILLS) -> dict[str, float]:
    """<format>_write_seconds and <format>_read_seconds of STRANDS x POINTS with UVs and thickness,
    medians of some rounds, and the processor's time of the same; fuzz_files and fuzz_failures,
    slowest_seconds and memory_times, the most of all of them; kill_trials, kill_failures and
    kill_amid, of the kills those that left a half-written file beside the target."""
    return {**timings(), **fuzz_figures(fuzzed), **kill_figures(kills)}


def timings() -> dict[str, float]:
    groom = Groom(_strands())
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        tfx, hair = Path(folder) / "groom.tfx", Path(folder) / "groom.hair"
        steps: dict[str, Callable[[], object]] = {
            "tfx_write": lambda: write_tfx(tfx, groom),
            "tfx_read": lambda: read_tfx(tfx),
            "hair_write": lambda: write_hair_file(hair, groom, uv=True),
            "hair_read": lambda: read_hair_file(hair),
        }
        rounds = [{name: _timed(step) for name, step in steps.items()} for _ in range(ROUNDS)]
        for name in steps:
            wall, processor = np.median([each[name] for each in rounds], axis=0)
            found[f"{name}_seconds"] = float(wall)
            found[f"{name}_processor_seconds"] = float(processor)
        found["tfx_megabytes"] = tfx.stat().st_size / 1.0e6
        found["hair_megabytes"] = hair.stat().st_size / 1.0e6
    return found


def fuzz_figures(count: int) -> dict[str, float]:
    """10,000 damaged files of each format by default."""
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda kind: _child("fuzz_files", kind, count), FUZZED_FORMATS))
    failures = [failure for each in found for failure in each["failures"]]
    for failure in failures[:20]:
        print(failure)
    return {
        "fuzz_files": float(sum(each["files"] for each in found)),
        "fuzz_read": float(sum(each["read"] for each in found)),
        "fuzz_refused": float(sum(each["refused"] for each in found)),
        "fuzz_failures": float(len(failures)),
        "fuzz_slowest_seconds": max(each["slowest"] for each in found),
        "fuzz_memory_times": max(each["memory_times"] for each in found),
    }


def kill_figures(trials: int) -> dict[str, float]:
    found = [_child("kill_writes", kind, trials) for kind in FUZZED_FORMATS]
    return {
        "kill_trials": float(sum(each["trials"] for each in found)),
        "kill_failures": float(sum(each["failures"] for each in found)),
        "kill_amid": float(sum(each["amid"] for each in found)),
    }


def _child(tool: str, kind: str, count: int) -> dict[str, Any]:
    """The report of a tool of this repository in a process of its own."""
    in_package = str(REPOSITORY / "tools" / "in_package.py")
    command = [sys.executable, in_package, tool, kind, str(count)]
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(command, capture_output=True, text=True, env=one_thread)
    if run.returncode:
        raise RuntimeError(f"{tool} {kind} ended with {run.returncode}: {run.stderr[-2000:]}")
    return json.loads(run.stdout.splitlines()[-1])


def _strands() -> StrandSet:
    """Strands of random steps."""
    random = np.random.default_rng(0)
    steps = random.normal(scale=0.01, size=(STRANDS, POINTS, 3)).astype(np.float32)
    return StrandSet(
        np.cumsum(steps, axis=1).reshape(-1, 3),
        np.arange(STRANDS + 1) * POINTS,
        np.repeat(random.uniform(2e-5, 9e-5, STRANDS), POINTS),
        np.zeros(STRANDS),
        random.random((STRANDS, 2)),
    )


def _timed(step: Callable[[], object]) -> tuple[float, float]:
    started, processed = time.perf_counter(), time.process_time()
    step()
    return time.perf_counter() - started, time.process_time() - processed
