"""Runs what a commit has to pass, again and again, beside processes that keep the machine busy.

python tools/load_runs.py [RUNS] [BUSY]      ten runs beside two processes

Prints how each ended and `N of RUNS passed`; keeps the number for `make bench NAME=house`.
"""

import subprocess
import sys
import time

from extension_loader import REPOSITORY
from timings import keep

BUSY = "while True: pass"


def main(arguments: list[str]) -> int:
    runs, busy = (int(each) for each in (*arguments, *("10", "2")[len(arguments) :]))
    others = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(busy)]
    logs, passed = REPOSITORY / "out" / "load_runs", 0
    logs.mkdir(parents=True, exist_ok=True)
    try:
        for number in range(1, runs + 1):
            log, begin = logs / f"{number}.log", time.monotonic()
            with log.open("w") as stream:
                run = subprocess.run([".ci/run"], cwd=REPOSITORY, stdout=stream, stderr=stream)
            passed += run.returncode == 0
            minutes = (time.monotonic() - begin) / 60.0
            print(f"run {number}: exit code {run.returncode}, {minutes:.1f} minutes", flush=True)
    finally:
        for other in others:
            other.kill()
    keep("load_runs_passed", passed)
    keep("load_runs", runs)
    print(f"{passed} of {runs} passed")
    return int(passed < runs)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
