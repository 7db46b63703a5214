"""Damaged files of every format that Hairloom reads must give a clear error or a valid groom.

python tools/in_package.py fuzz_files FORMAT COUNT [SEED]    a line of JSON

The files are those of `damaged_files`. A failure is an exception other than HairloomError, one
without a place or a remedy, an invalid groom, more than MAX_SECONDS seconds, or more memory than
MAX_MEMORY_FACTOR the file and MAX_EXTRA_MEMORY. For Alembic and USD, which libraries parse in
another process, memory does not count, and the limit is MAX_SECONDS_IN_SUBPROCESS seconds.
"""

from __future__ import annotations

import json
import resource
import signal
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from damaged_files import LIBRARY_FORMATS, damaged_content

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic
from hairloom.addon.exchange.hair_file import read_hair_file
from hairloom.addon.exchange.read_groom import ReadGroom
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import Preset, read_any_preset

MAX_SECONDS = 2.0
#: with another process to be started, on a busy machine
MAX_SECONDS_IN_SUBPROCESS = 20.0
MAX_MEMORY_FACTOR, MAX_EXTRA_MEMORY = 10, 1_000_000
MAX_MESSAGE_LENGTH = 2000
#: address space of the child beyond what it has at the start [bytes]
MAX_ADDRESS_SPACE = 1 << 29


def read_preset_file(path: Path) -> Preset[Any]:
    return read_any_preset(path, ALL_SETTINGS)


READERS: dict[str, Callable[[Path], Any]] = {
    "tfx": read_tfx,
    "hair": read_hair_file,
    "preset": read_preset_file,
    "abc": read_groom_alembic,
    "usdc": read_usd,
    "usda": read_usd,
}


def main(arguments: list[str]) -> int:
    kind, count, seed = arguments[0], int(arguments[1]), int((arguments[2:] or ["0"])[0])
    if kind not in LIBRARY_FORMATS:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + MAX_ADDRESS_SPACE
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    result = fuzz(kind, count, seed)
    print(json.dumps(result))
    return 0


def fuzz(kind: str, count: int, seed: int = 0) -> dict[str, Any]:
    """Read `count` damaged files of a format; failures are named with their numbers."""
    outcomes = {"read": 0, "refused": 0}
    failures: list[str] = []
    slowest, max_memory_factor = 0.0, 0.0
    max_seconds = MAX_SECONDS_IN_SUBPROCESS if kind in LIBRARY_FORMATS else MAX_SECONDS
    max_factor = np.inf if kind in LIBRARY_FORMATS else MAX_MEMORY_FACTOR
    tracemalloc.start()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"damaged.{kind}"
        for number in range(count):
            content = damaged_content(kind, seed, number)
            path.write_bytes(content)
            outcome, seconds, peak = read_and_judge(READERS[kind], path, max_seconds)
            slowest = max(slowest, seconds)
            max_memory_factor = max(
                max_memory_factor, (peak - MAX_EXTRA_MEMORY) / max(len(content), 1)
            )
            if peak > max_factor * len(content) + MAX_EXTRA_MEMORY:
                outcome = f"{peak:,} bytes of memory for a file of {len(content):,}"
            if seconds > max_seconds:
                outcome = f"{seconds:.1f} s"
            if outcome in outcomes:
                outcomes[outcome] += 1
            else:
                failures.append(f"{kind} {seed} {number}: {outcome}")
    tracemalloc.stop()
    return {
        "files": count,
        "failures": failures,
        **outcomes,
        "slowest": slowest,
        "memory_times": max_memory_factor,
    }


def read_and_judge(
    read: Callable[[Path], Any], path: Path, max_seconds: float = MAX_SECONDS
) -> tuple[str, float, int]:
    """The outcome of reading a file: "read", "refused" or the problem; seconds; peak bytes."""
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    started = time.perf_counter()
    try:
        with _interrupted_after(3.0 * max_seconds):
            outcome = fault_of(read(path)) or "read"
    except HairloomError as error:
        is_complete = bool(error.problem and error.remedy and path.name in error.place)
        is_clear = is_complete and len(str(error)) < MAX_MESSAGE_LENGTH
        outcome = "refused" if is_clear else f"an unclear message: {error}"
    except (Exception, _Hang) as error:
        outcome = f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - started
    return outcome, seconds, tracemalloc.get_traced_memory()[1] - before


def _are_valid(color: Any, offsets: Any) -> bool:
    """Whether each strand has colours all along or none at all."""
    is_none = np.isnan(color).all(axis=1)
    is_none_in_strand = np.repeat(is_none[offsets[:-1]], np.diff(offsets))
    colors = color[~is_none]
    return bool(
        (is_none == is_none_in_strand).all() and (colors >= 0.0).all() and np.isfinite(colors).all()
    )


def fault_of(result: Any) -> str:
    """What is wrong with a reader's result; empty if nothing is."""
    if isinstance(result, ReadGroom):
        strands, color = result.strands, result.groom.color
        checks = [
            strands.strand_count > 0,
            np.isfinite(strands.points).all(),
            np.isfinite(strands.radius).all() and (strands.radius > 0.0).all(),
            strands.root_uv is None or np.isfinite(strands.root_uv).all(),
            color is None or _are_valid(color, strands.offsets),
        ]
        return "" if all(checks) else f"a groom that is not sound: {checks}"
    return "" if isinstance(result, Preset) else f"a {type(result).__name__}"


class _Hang(BaseException):
    """Reading hangs; no reader may catch this."""


@contextmanager
def _interrupted_after(seconds: float) -> Iterator[None]:
    def interrupt(*_: object) -> None:
        raise _Hang(f"still reading after {seconds:g} s")

    previous_handler = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous_handler)
