"""Hairloom's command line on Blender as a module: no Blender installed, no window, no screen.

python tools/headless.py demo --groom hair.tfx --head head.obj --output out
"""

import importlib
import sys

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
from extension_loader import PACKAGE, load_package


def main(arguments: list[str]) -> int:
    gpu.init()
    load_package().register()
    command_line = importlib.import_module(f"{PACKAGE}.addon.blender.command_line.command_line")
    return int(command_line.run(arguments))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
