"""Runs the checks for a commit again and again, beside processes that keep the machine busy.

python tools/load_runs.py [RUNS] [BUSY_LOOP]      ten runs beside two processes

Prints how each ended. bench/load_runs.json keeps every run with its commit, and `make bench
NAME=house` counts those that have passed since the last that failed: a run takes more than half
an hour, so ten of them need not follow each other in one night.
"""

import datetime
import json
import subprocess
import sys
import time
from typing import TypedDict

from extension_loader import REPOSITORY

FILE = REPOSITORY / "bench" / "load_runs.json"
BUSY_LOOP = "while True: pass"


class Run(TypedDict):
    """One run: its commit, date of its end, duration, and exit code."""

    commit: str
    date: str
    minutes: float
    code: int


def recorded_runs() -> list[Run]:
    """All runs so far, the last at the end."""
    runs: list[Run] = json.loads(FILE.read_text()) if FILE.is_file() else []
    return runs


def passed_in_a_row(runs: list[Run]) -> int:
    """How many have passed since the last that failed."""
    failed = [number for number, each in enumerate(runs, 1) if each["code"]]
    return len(runs) - max(failed, default=0)


def add_run(run: Run) -> None:
    rows = ",\n".join(json.dumps(each) for each in [*recorded_runs(), run])
    FILE.write_text(f"[\n{rows}\n]\n")


def commit() -> str:
    command = ["git", "rev-parse", "--short=8", "HEAD"]
    return subprocess.check_output(command, cwd=REPOSITORY, text=True).strip()


def main(arguments: list[str]) -> int:
    runs, busy_count = (int(each) for each in (*arguments, *("10", "2")[len(arguments) :]))
    busy_processes = [
        subprocess.Popen([sys.executable, "-c", BUSY_LOOP]) for _ in range(busy_count)
    ]
    logs, codes = REPOSITORY / "out" / "load_runs", []
    logs.mkdir(parents=True, exist_ok=True)
    try:
        for number in range(1, runs + 1):
            log, begin, commit_hash = logs / f"{number}.log", time.monotonic(), commit()
            with log.open("w") as stream:
                finished = subprocess.run([".ci/run"], cwd=REPOSITORY, stdout=stream, stderr=stream)
            minutes = round((time.monotonic() - begin) / 60.0, 1)
            date = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M")
            add_run(Run(commit=commit_hash, date=date, minutes=minutes, code=finished.returncode))
            codes.append(finished.returncode)
            print(f"run {number}: exit code {finished.returncode}, {minutes} minutes", flush=True)
    finally:
        for other in busy_processes:
            other.kill()
    print(f"{codes.count(0)} of {runs} passed, {passed_in_a_row(recorded_runs())} in a row")
    return int(any(codes))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
