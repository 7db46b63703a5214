"""Faults while files are written, and malicious files: nothing may be lost, no foreign code run.

See `_fault_runs`, `_verb_faults` and `_usd_attacks` for what is done. Exit code 1: a limit is
missed.

make bench NAME=faults                  half an hour
tools/bench.py faults runs 1000         one part: runs, verbs, usda, planted, waits or autosave
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from _fault_runs import fault_runs, forget_sources
from _report import report, start
from _usd_attacks import usd_attacks
from _verb_faults import verb_fault_runs
from extension_loader import REPOSITORY
from waits import endless_waits

from hairloom.addon.blender.base.gpu_context import can_draw
from hairloom.addon.blender.strands.child_python import find_python, python_command
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.exchange.usd.usd_library import usd_library

REFERENCE = "the result before, or the new one; a limit of the system on what a file may take"
SEED = 22
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "fault_losses": 0,
    "fault_mixed": 0,
    "fault_untrue_messages": 0,
    "verb_losses": 0,
    "verb_mixed": 0,
    "verb_untrue_messages": 0,
    "usda_crashes": 0,
    "longest_seconds": 10.0,  # under other load, run with nice -n -15
    "longest_processor_seconds": 10.0,
    "memory_mb": 1024.0,
    "planted_code_runs": 0,
    "endless_waits": 0,
}
MIN_LIMITS = {"autosaves_while_playing": 1}
_PLANTED = "import pathlib; pathlib.Path(__file__).with_name('it_ran').touch()"


def runs(count: int = 1000) -> dict[str, Any]:
    try:
        found, problems = fault_runs(count, SEED)
    finally:
        forget_sources()
    print("\n".join(problems), flush=True)
    return {
        "fault_runs": found.runs,
        "faults_in_time": found.broken,
        "fault_losses": found.losses,
        "fault_mixed": found.mixed,
        "fault_untrue_messages": found.untrue,
    }


def verbs(count: int = 255) -> dict[str, Any]:
    found, problems = verb_fault_runs(count, SEED)
    print("\n".join(problems), flush=True)
    return {
        "verb_runs": found.runs,
        "verb_faults_in_time": found.broken,
        "verb_losses": found.losses,
        "verb_mixed": found.mixed,
        "verb_untrue_messages": found.untrue,
    }


def planted() -> dict[str, int]:
    """Whether modules planted in the current folder or the environment run in any child process."""
    before, run_count = os.getcwd(), 0
    usd_library(Path())  # otherwise this process, which is no Blender, would find the planted one
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for module in ("ctypes", "numpy", "pxr", "sitecustomize", "usercustomize", "json", "site"):
            (folder / f"{module}.py").write_text(_PLANTED, encoding="utf-8")
        (folder / "hair.usda").write_text("#usda 1.0\n", encoding="utf-8")
        os.chdir(folder)
        sys.path.insert(0, "")
        os.environ["PYTHONPATH"] = os.environ["PYTHONUSERBASE"] = name
        try:
            for begin in (find_python, can_draw):
                begin.cache_clear()
                begin()
                run_count += (folder / "it_ran").exists()
            try:
                read_usd(folder / "hair.usda", python=python_command())
            except HairloomError as error:
                print(error)  # it has no curves
            run_count += (folder / "it_ran").exists()
        finally:
            os.chdir(before)
            sys.path.remove("")
            del os.environ["PYTHONPATH"], os.environ["PYTHONUSERBASE"]
    return {"planted_code_runs": run_count}


def autosave() -> dict[str, int]:
    """Autosaves of a Blender with a window that plays hair for two minutes."""
    subprocess.run(["make", "test-ui", "SESSIONS=session_autosave"], cwd=REPOSITORY, check=False)
    logs = (REPOSITORY / "out" / "window").glob("autosave-*.log")
    texts = (log.read_text(encoding="utf-8", errors="replace") for log in logs)
    saved = [n for text in texts for n in re.findall(r"autosaves while playing: (\d+)", text)]
    return {"autosaves_while_playing": min(map(int, saved), default=0)}


PARTS: dict[str, Callable[..., dict[str, Any]]] = {
    "runs": runs,
    "verbs": verbs,
    "usda": lambda count=500: usd_attacks(count, SEED),
    "planted": planted,
    "waits": lambda: {"endless_waits": len(endless_waits())},
    "autosave": autosave,
}


def main(arguments: list[str]) -> int:
    start()
    chosen = PARTS if not arguments else {arguments[0]: PARTS[arguments[0]]}
    found: dict[str, Any] = {}
    for part in chosen.values():
        found |= part(*map(int, arguments[1:]))
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
