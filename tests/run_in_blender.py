"""Runs the tests inside Blender, in the background:

blender -b --factory-startup --python-exit-code 1 --python tests/run_in_blender.py [-- PYTEST ARGS]

Blender's exit code is pytest's own. Add --gpu-backend vulkan before --python for Vulkan. Packages
that Blender lacks, such as those that the extension's zip brings along, can be in the folder
HAIRLOOM_PACKAGES.
"""

import os
import sys
from pathlib import Path

import gpu

REPOSITORY = Path(__file__).resolve().parents[1]
FOLDERS = ("tests/pure", "tests/gpu", "tests/blender")


def main() -> int:
    try:
        import pytest
    except ImportError:
        print(f"pytest is missing in this Blender: {sys.executable} -m pip install pytest")
        return 1
    if packages := os.environ.get("HAIRLOOM_PACKAGES"):
        sys.path.append(packages)
    gpu.init()
    print(
        f"GPU: {gpu.platform.backend_type_get()}, {gpu.platform.renderer_get()}, "
        f"{gpu.platform.version_get()}"
    )
    # pytest's settings, and the folders in them, are relative to the working directory.
    os.chdir(REPOSITORY)
    extra = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    chosen = any(Path(argument.split("::")[0]).exists() for argument in extra)
    return int(pytest.main([*extra, *(() if chosen else FOLDERS)]))


sys.exit(main())
