"""Starting another process: the only place where that is done.

A child runs no code that somebody has put into the current folder or the environment. It works in
a folder that comes with Python, Python's variables are not handed on, and the modules that it finds
are those of this process. It gets no input, shows no window and has an end.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

#: for a process on Windows, which else would show one
_NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)


def run_child(
    command: Sequence[str], *, seconds: float, settings: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a command until it ends.

    Args:
        command: the program, by its full path, and its arguments.
        seconds: after which it is killed.
        settings: further environment variables.

    Raises:
        OSError: it cannot be started. subprocess.TimeoutExpired: it was killed.
    """
    return subprocess.run(
        list(command),
        cwd=Path(os.__file__).parent,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env=_environment() | dict(settings or {}),
        timeout=seconds,
        creationflags=_NO_WINDOW,
    )


def python_program(program: str) -> tuple[str, ...]:
    """The command of a Python that takes modules from its own folders and from ours alone."""
    return (program, "-s", "-P")


def same_packages() -> dict[str, str]:
    """What a Python's environment must hold so that it finds all packages that this one does.

    Relative folders are left out: for the child they would be others, such as a stranger's.
    """
    return {"PYTHONPATH": os.pathsep.join(folder for folder in sys.path if os.path.isabs(folder))}


def _environment() -> dict[str, str]:
    """This process's, but for what Python takes from it."""
    others = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return others | same_packages()
