"""Keeps how long the checks took, for `make bench NAME=house`.

python tools/timings.py NAME COMMAND...     runs the command; its minutes, if it passes
python tools/timings.py NAME=VALUE          keeps a value that was measured elsewhere

out/timings.json holds the last ones. The exit code is that of the command.
"""

import json
import subprocess
import sys
import time

from extension_loader import REPOSITORY

FILE = REPOSITORY / "out" / "timings.json"


def timings() -> dict[str, float]:
    """The stored values."""
    found: dict[str, float] = json.loads(FILE.read_text()) if FILE.is_file() else {}
    return found


def record_timing(name: str, value: float) -> None:
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps(timings() | {name: value}, indent=1) + "\n")


def main(arguments: list[str]) -> int:
    name, *command = arguments
    if not command:
        name, _, value = name.partition("=")
        record_timing(name, float(value))
        return 0
    begin = time.monotonic()
    code = subprocess.run(command, cwd=REPOSITORY, check=False).returncode
    minutes = (time.monotonic() - begin) / 60.0
    print(f"{name}: {minutes:.1f}", flush=True)
    if code == 0:
        record_timing(name, round(minutes, 2))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
