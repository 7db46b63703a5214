"""The command that starts another Python process with the packages of this Blender.

Official builds of Blender include a Python, which is `sys.executable`; the bpy module runs in one;
and builds of Linux distributions use the system's. That may lack packages that Blender has, or
libraries that these need. Then Blender itself runs the script, without a window.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from subprocess import TimeoutExpired

from ...exchange.files.child_process import python_program, run_child
from ...exchange.strand_formats import ALEMBIC, USD, strand_format
from ..base.blender_program import blender_command

#: Packages that the other process needs, and the module of each that must load there.
_PACKAGES = {"numpy": "numpy", "alembic3d": "alembic3d", "pxr": "pxr.Usd"}
#: Timeout [s] for a Python to start and load them, also from a slow disk.
_TIMEOUT = 30.0


def python_command() -> tuple[str, ...] | None:
    """The command, to which a script and its arguments are added.

    None: there is neither a Python with these packages nor a Blender to start.
    """
    try:
        return find_python() or blender_command()
    except TimeoutExpired:
        return blender_command()


@cache
def find_python() -> tuple[str, ...] | None:
    """The first Python with these packages; the result is cached. None: there is none.

    Raises:
        TimeoutExpired: one was too slow, and no other has them. This is not cached: at the next
            call its files are in memory.
    """
    loaded = [module for name, module in _PACKAGES.items() if importlib.util.find_spec(name)]
    timeout: TimeoutExpired | None = None
    for program in _programs():
        try:
            if _can_import(python_program(program), loaded):
                return python_program(program)
        except TimeoutExpired as error:
            timeout = error
    if timeout is not None:
        raise timeout
    return None


def python_for(path: Path) -> tuple[str, ...] | None:
    """The command for reading a file of strands; None: it is read in this process.

    Raises:
        HairloomError: the suffix belongs to no format.
    """
    return python_command() if strand_format(path) in (ALEMBIC, USD) else None


def _programs() -> Iterator[str]:
    """Pythons of this version, the likeliest first."""
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    if Path(sys.executable).stem.lower().startswith("python"):
        yield sys.executable
    for name in (version, "python.exe"):
        own = Path(sys.prefix) / "bin" / name
        if own.is_file():
            yield str(own)
    yield from _in_search_path(version)


def _in_search_path(name: str) -> Iterator[str]:
    """The system's Python, from absolute folders of PATH alone.

    Relative folders may hold any program. So may the current folder, where Windows looks first:
    Windows is skipped, as all its builds of Blender include a Python.
    """
    for folder in os.get_exec_path() if os.name == "posix" else ():
        program = os.path.join(folder, name)
        if os.path.isabs(folder) and os.access(program, os.X_OK):
            yield program
            return


def _can_import(command: tuple[str, ...], modules: list[str]) -> bool:
    code = ["-c", "import " + ", ".join(modules)]
    try:
        return run_child([*command, *code], seconds=_TIMEOUT).returncode == 0
    except OSError:
        return False  # the next one is tried
