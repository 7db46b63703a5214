"""The command that starts another Python beside this Blender, with the same packages.

Official builds bring a Python along and name it `sys.executable`, the bpy module runs in one, and
those of Linux distributions use the system's. But there it may lack packages that Blender has, or
the libraries that these need. Then Blender itself runs the script, without a window.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import bpy

from ...exchange.files.subprocess_reader import NO_WINDOW, python_program, same_packages
from ...exchange.strand_formats import ALEMBIC, USD, strand_format

#: Packages whose files another process reads, and what of them must load there.
_PACKAGES = {"numpy": "numpy", "alembic3d": "alembic3d", "pxr": "pxr.Usd"}
#: Seconds for a Python to start and load them, on a slow disk too.
_PATIENCE = 30.0


@cache
def python_command() -> tuple[str, ...] | None:
    """The command, to which a script and its arguments are added.

    None: there is no Python with these packages, and no Blender to start either.
    """
    loaded = [module for name, module in _PACKAGES.items() if importlib.util.find_spec(name)]
    for program in _programs():
        if _loads(python_program(program), loaded):
            return python_program(program)
    return blender_command()


def python_for(path: Path) -> tuple[str, ...] | None:
    """The command for reading a file of strands; None where it is read in this process.

    Raises:
        HairloomError: the file's suffix is of no format.
    """
    return python_command() if strand_format(path) in (ALEMBIC, USD) else None


def blender_command() -> tuple[str, ...] | None:
    """Blender itself as a Python; None where it is a module."""
    if not bpy.app.binary_path:
        return None
    quietly = ("--background", "--factory-startup", "--python-exit-code", "1")
    return (bpy.app.binary_path, *quietly, "--python-use-system-env", "--python")


def _programs() -> Iterator[str]:
    """Pythons of this version, the likeliest first."""
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    if Path(sys.executable).stem.lower().startswith("python"):
        yield sys.executable
    for name in (version, "python.exe"):
        own = Path(sys.prefix) / "bin" / name
        if own.is_file():
            yield str(own)
    of_the_system = shutil.which(version)
    if of_the_system:
        yield of_the_system


def _loads(command: tuple[str, ...], modules: list[str]) -> bool:
    try:
        done = subprocess.run(
            [*command, "-c", "import " + ", ".join(modules)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            env=os.environ | same_packages(),
            timeout=_PATIENCE,
            creationflags=NO_WINDOW,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False  # so that the next one is tried
    return done.returncode == 0
