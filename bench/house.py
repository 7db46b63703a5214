"""The state of the code: imports between rooms, what a new setting touches, dead code, retired
words, and how long checks take.

Figures are computed from the tree itself; the minutes come from out/timings.json, where `make test`
and `.ci/run` write them, and the runs under load from bench/load_runs.json; `--run` runs these
three first, which takes hours. A figure that was not measured is null. Exit code 1: a limit is
missed.

make bench NAME=house
"""

from __future__ import annotations

import argparse
import subprocess
import sys

import house_rules as house
import words
from _report import report, start
from load_runs import passed_in_a_row, recorded_runs
from timings import timings

from hairloom.addon.parameters import ALL_SETTINGS

REFERENCE = "the tree, and the last runs of make test and of all that a commit has to pass"
SECTIONS = {section: each.__name__ for section, each in ALL_SETTINGS.items()}
#: figure -> upper limit
MAX_LIMITS = {
    "arrows_up": 0,
    "import_circles": 0,
    "module_mutable_names": house.MAX_MUTABLE,
    "names_used_by_tests_only": 0,
    "sections_to_touch_for_a_setting": 1,
    "retired_terms": 0,
    "ci_minutes": 25,
    "test_minutes": 8,
}
MIN_LIMITS = {"load_runs_passed": 10}


def figures() -> dict[str, float | None]:
    minutes = timings()
    return {
        "arrows_up": len(house.upward_imports()),
        "import_circles": int(bool(house.import_circle())),
        "module_mutable_names": len(house.mutable_names()),
        "names_used_by_tests_only": len(house.unused_names()),
        "sections_to_touch_for_a_setting": 1 + len(house.files_that_list_sections(SECTIONS)),
        "addon_lines": house.addon_lines(),
        "retired_terms": sum(words.count_uses(found) for found in words.uses().values()),
        "ci_minutes": minutes.get("ci_minutes"),
        "test_minutes": minutes.get("test_minutes"),
        "load_runs_passed": passed_in_a_row(recorded_runs()),
    }


def run() -> None:
    for command in (["make", "test"], [".ci/run"], [sys.executable, "tools/load_runs.py"]):
        subprocess.run(command, cwd=house.REPOSITORY, check=False, stdout=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(prog="house", description=__doc__)
    parser.add_argument("--run", action="store_true", help="measure the minutes now")
    if parser.parse_args().run:
        run()
    start()
    return report(figures(), REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main())
