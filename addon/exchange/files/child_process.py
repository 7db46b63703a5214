"""Starting another process: the only place where that is done.

A child runs no code that somebody has put into the current folder or the environment. It works in
a folder that comes with Python, Python's variables are not passed on, and the modules that it finds
are those of this process. It gets no input, shows no window, and is killed after a time limit, or
earlier by a caller that no longer waits for it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from contextvars import ContextVar
from pathlib import Path

#: for Windows, where a process would show a window otherwise
_NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)

#: Makes the context of a child's run, from the function that kills the child. Callers that may
#: cancel the work set it; it may raise instead.
kill_context: ContextVar[Callable[[Callable[[], None]], AbstractContextManager[object]]] = (
    ContextVar("kill_context", default=nullcontext)
)


def run_child(
    command: Sequence[str], *, seconds: float, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a command until it ends.

    Args:
        command: the program, by its full path, and its arguments.
        seconds: after which it is killed.
        environment: further environment variables.

    Raises:
        OSError: it cannot be started. subprocess.TimeoutExpired: it was killed.
    """
    child = subprocess.Popen(
        list(command),
        cwd=Path(os.__file__).parent,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=_environment() | dict(environment or {}),
        creationflags=_NO_WINDOW,
    )
    with child:
        try:
            with kill_context.get()(child.kill):
                output, errors = child.communicate(timeout=seconds)
        finally:
            child.kill()  # where it has ended this does nothing
    return subprocess.CompletedProcess(list(command), child.returncode, output, errors)


def python_program(program: str) -> tuple[str, ...]:
    """The command of a Python that takes modules from its own folders and from ours alone."""
    return (program, "-s", "-P")


def same_packages() -> dict[str, str]:
    """The environment variables by which another Python finds all packages that this one does.

    Relative folders are left out: for the child they would be others, such as a stranger's.
    """
    return {"PYTHONPATH": os.pathsep.join(folder for folder in sys.path if os.path.isabs(folder))}


def _environment() -> dict[str, str]:
    """This process's environment without the variables of Python, but with `same_packages`."""
    others = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return others | same_packages()
