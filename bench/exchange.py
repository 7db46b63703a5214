"""Strands as files: how fast they are written and read, how exactly they are kept, and what damaged
files and killed writers do; and cards that move.

See `_exchange_alembic`, `_exchange_usd`, `_exchange_files`, `_exchange_round_trip`,
`_exchange_motion` and `_exchange_blender` for what is measured, and against what.

Limits on the size of USD files and on their memory are twice the values measured when they were
set. Each part prints its wall-clock and processor time; other load affects the former alone.

make bench NAME=exchange                      some minutes, with few damaged files and kills
tools/bench.py exchange whole                 the full numbers of them: an hour or more
tools/bench.py exchange whole kills "damaged files"    of these parts alone
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

from _exchange_alembic import alembic_figures, processor_seconds
from _exchange_blender import blender_figures
from _exchange_files import file_timings, fuzz_figures, kill_figures
from _exchange_motion import motion_figures
from _exchange_round_trip import round_trip_figures
from _exchange_usd import usd_figures
from _report import report, start

#: damaged files of a format that we parse, and of one that a library parses in another process;
#: kills of a format's writer; seconds of motion
FEW, WHOLE = (1_000, 30, 5, 0.5), (10_000, 1_000, 100, 2.0)
REFERENCE = "Blender's own Alembic and USD of the same strands, positions and widths only"
#: counts that must be 0, and limits of sizes [MB]
MAX_LIMITS: dict[str, float] = dict.fromkeys(
    ("fuzz_failures", "kill_failures", "kill_mixed", "kill_leftovers"), 0
)
MAX_LIMITS |= {"usd_file_mb": 81.0, "usd_write_memory_mb": 165.0, "usd_read_memory_mb": 240.0}


def main(chosen: list[str], *, is_whole: bool) -> int:
    start()
    ours, libraries, kills, seconds = WHOLE if is_whole else FEW
    parts: dict[str, Callable[[], dict[str, float]]] = {
        "alembic": alembic_figures,
        "usd": usd_figures,
        "tfx and hair": file_timings,
        "blender": blender_figures,
        "round trips": round_trip_figures,
        "motion": lambda: motion_figures(seconds),
        "kills": lambda: kill_figures(kills),
        "damaged files": lambda: fuzz_figures(ours, libraries),
    }
    found: dict[str, Any] = {}
    for name in chosen or parts:
        measure = parts[name]
        wall_start, processed = time.perf_counter(), processor_seconds()
        figures = measure()
        wall, processor = time.perf_counter() - wall_start, processor_seconds() - processed
        print(f"{name}, {wall:.0f} s, processor {processor:.0f} s", flush=True)
        found |= figures
    return report({**({} if chosen else summary(found)), **found}, REFERENCE, max_limits=MAX_LIMITS)


def summary(found: dict[str, float]) -> dict[str, float]:
    """The main figures, and ratios to Blender's times for as many strands with fewer attributes."""
    reads = ("abc_unreal_read_seconds", "usd_read_seconds", "tfx_read_seconds")
    return {
        "alembic_seconds": found["abc_unreal_write_seconds"],
        "alembic_mb": found["abc_unreal_write_memory"],
        "usd_seconds": found["usd_write_seconds"],
        "tfx_seconds": found["tfx_write_seconds"],
        "import_seconds": max(found[name] for name in reads),
        "alembic_to_blender": ratio(found, "abc_unreal_write", "alembic_write"),
        "usd_to_blender": ratio(found, "usd_write", "usd_write"),
        "import_to_blender": ratio(found, "abc_unreal_read", "alembic_read"),
    }


def ratio(found: dict[str, float], ours: str, blenders: str) -> float:
    return found[f"{ours}_seconds"] / found[f"blender_{blenders}_seconds"]


sys.exit(main([each for each in sys.argv[1:] if each != "whole"], is_whole="whole" in sys.argv))
