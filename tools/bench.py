"""Run one benchmark, bench/NAME.py, with the package `hairloom` importable.

python tools/bench.py NAME [arguments of that benchmark]
"""

import runpy
import sys

import bpy  # noqa: F401  it must come before gpu, which lives inside it
from extension_loader import REPOSITORY, load_package

BENCHMARKS = REPOSITORY / "bench"


def main(arguments: list[str]) -> int:
    names = sorted(path.stem for path in BENCHMARKS.glob("[!_]*.py"))
    if not arguments or arguments[0] not in names:
        print(f"Which benchmark? make bench NAME=x, x one of: {', '.join(names) or '(none yet)'}")
        return 2
    load_package()
    path = BENCHMARKS / f"{arguments[0]}.py"
    sys.argv = [str(path), *arguments[1:]]
    sys.path.insert(0, str(BENCHMARKS))
    runpy.run_path(str(path), run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
