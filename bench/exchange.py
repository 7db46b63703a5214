"""Strands as files: how fast they are written and read, how exactly they come back, and what
damaged files and killed writers do; and cards that move.

See `_exchange_alembic`, `_exchange_usd`, `_exchange_files`, `_exchange_round_trip`,
`_exchange_motion` and `_exchange_blender` for what is measured, and against what.

make bench NAME=exchange              some minutes, most of it damaged files and kills
python bench/exchange.py whole        ten times as many files for libraries, 100 kills a format
"""

from __future__ import annotations

import json
import platform
import sys
from typing import Any

import numpy as np
from _exchange_alembic import alembic_figures
from _exchange_blender import blender_figures
from _exchange_files import (
    ALL_APART,
    ALL_KILLS,
    FUZZED_APART,
    KILLS,
    file_timings,
    fuzz_figures,
    kill_figures,
)
from _exchange_motion import motion_figures
from _exchange_round_trip import round_trip_figures
from _exchange_usd import usd_figures


def main(*, is_whole: bool) -> None:
    found: dict[str, Any] = {
        **alembic_figures(),
        **usd_figures(),
        **file_timings(),
        **blender_figures(),
        **round_trip_figures(),
        **motion_figures(),
        **kill_figures(ALL_KILLS if is_whole else KILLS),
        **fuzz_figures(libraries=ALL_APART if is_whole else FUZZED_APART),
    }
    for name, value in found.items():
        print(f"{name:40} {value:14.6g}")
    print(json.dumps({**summary(found), **found, **machine()}))


def summary(found: dict[str, float]) -> dict[str, float]:
    """The figures that have a limit, and what Blender takes for the same strands with less."""
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


def machine() -> dict[str, str]:
    return {
        "reference": "Blender's own Alembic and USD of the same strands, positions and widths only",
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


main(is_whole="whole" in sys.argv[1:])
