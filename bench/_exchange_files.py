"""Speed of TressFX and .hair files, and what damage and killed writers do to files of all formats.

Fuzzing and killing run in child processes; if one crashes, the benchmark ends with its errors.
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
OUR_FORMATS, LIBRARIES_FORMATS = ("tfx", "hair", "preset"), ("abc", "usdc", "usda")
KILLED_FORMATS = ("tfx", "tfxbone", "hair", "preset", "abc", "usdc", "glb")


def file_timings() -> dict[str, float]:
    """<format>_write_seconds and <format>_read_seconds of STRANDS x POINTS with UVs and thickness,
    medians over ROUNDS; and <format>_..._processor_seconds likewise."""
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


def fuzz_figures(ours: int, libraries: int) -> dict[str, float]:
    """Numbers of damaged files that were read, refused, or neither (failures). Of the formats that
    we parse also the slowest, and peak memory as a multiple of the file; of each format how many
    were read.

    Args:
        ours, libraries: files of each format that we parse, and that a library parses.
    """
    counts = dict.fromkeys(OUR_FORMATS, ours) | dict.fromkeys(LIBRARIES_FORMATS, libraries)
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(counts, pool.map(_fuzzed, counts, counts.values()), strict=True))
    failures = [failure for each in found.values() for failure in each["failures"]]
    for failure in failures[:20]:
        print(failure)
    parsed = [found[kind] for kind in OUR_FORMATS]
    return {
        "fuzz_files": float(sum(each["files"] for each in found.values())),
        "fuzz_failures": float(len(failures)),
        "fuzz_read": float(sum(each["read"] for each in found.values())),
        "fuzz_refused": float(sum(each["refused"] for each in found.values())),
        "fuzz_slowest_seconds": max(each["slowest"] for each in parsed),
        "fuzz_memory_times": max(each["memory_times"] for each in parsed),
        **{f"fuzz_{kind}_read": float(found[kind]["read"]) for kind in found},
    }


def _fuzzed(kind: str, count: int) -> dict[str, Any]:
    return _child("fuzz_files", kind, count)


def kill_figures(trials: int) -> dict[str, float]:
    """Numbers of kills, of files that were neither old nor new, of kills amid a write, of sets of
    old and new files, and of files that were left after one more write (see
    `kill_writes.kill_and_check`).

    Args:
        trials: kills of the writer of each format.
    """
    found = [_child("kill_writes", kind, trials) for kind in KILLED_FORMATS]
    names = ("trials", "failures", "amid", "mixed", "leftovers")
    return {f"kill_{name}": float(sum(each[name] for each in found)) for name in names}


def _child(tool: str, kind: str, count: int) -> dict[str, Any]:
    """The report of a tool of this repository, run in its own process."""
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
