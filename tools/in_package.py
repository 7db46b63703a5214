"""Runs a tool that works on the package `hairloom` itself, in a process that may crash.

python tools/in_package.py TOOL [arguments of that tool]
"""

import importlib
import sys

from extension_loader import load_package


def main(arguments: list[str]) -> int:
    load_package()
    return int(importlib.import_module(arguments[0]).main(arguments[1:]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
