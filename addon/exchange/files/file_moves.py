"""Moving files to their places, by the rules of every system."""

from __future__ import annotations

import errno
import os
import shutil
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from contextvars import ContextVar
from pathlib import Path

#: Makes the context in which new files replace old ones. Callers that may cancel the work set it;
#: it may raise instead, which leaves all files as they were.
commit_context: ContextVar[Callable[[], AbstractContextManager[object]]] = ContextVar(
    "commit_context", default=nullcontext
)
#: Seconds for which another program may hold a file: a virus scanner, an indexer, a backup. Only
#: Windows refuses to replace a file that is open.
MAX_WAIT = 10.0 if os.name == "nt" else 0.0
_PAUSE = 0.1


def move_file(source: Path, target: Path) -> None:
    """Let a file replace another one, in one step where both are on one disk.

    Raises:
        OSError: it cannot be done, or another program keeps one of them for too long.
    """
    end = time.monotonic() + MAX_WAIT
    while True:
        try:
            os.replace(source, target)
            return
        except PermissionError:
            if time.monotonic() >= end:
                raise
            time.sleep(_PAUSE)
        except OSError as error:
            if error.errno != errno.EXDEV:
                raise
            shutil.move(source, target)
            return


def flush_file(file: Path) -> None:
    """Wait until a file's content is on the disk.

    Raises:
        OSError: the disk is full or fails.
    """
    descriptor = os.open(file, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def flush_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can be asked for that.

    Some network drives refuse it. The files are in their places by then, so that is no failure.
    """
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


def unused_path(path: Path) -> Path:
    """This path, or a numbered one beside it, which does not exist yet."""
    names = (path, *(path.with_name(f"{path.stem} {n}{path.suffix}") for n in range(2, 10_000)))
    return next(each for each in names if not os.path.lexists(each))
