"""Names for what is written beside a file, and what a killed writer leaves of it.

A name says which process writes it and where that runs: .groom.hl-3f0c9a1e-4711-5b21c7d0.abc. The
next who writes into the folder removes those whose processes are gone.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import re
import secrets
import shutil
import time
from functools import cache
from pathlib import Path

_OURS = re.compile(r"\..*\.hl-(?P<place>[0-9a-f]{8})-(?P<process>\d{1,10})-[0-9a-f]{8}(\.[^.]*)?")
#: Seconds without a change after which a file has no writer, where none can be asked for.
_ABANDONED = 86_400.0


def temporary_beside(path: Path, suffix: str | None = None) -> Path:
    """A hidden name in the same folder that nobody else takes, with this or the same suffix."""
    mark = f"hl-{_here()}-{os.getpid()}-{secrets.token_hex(4)}"
    return path.with_name(f".{path.stem}.{mark}{path.suffix if suffix is None else suffix}")


def remove_stale_files(folder: Path) -> None:
    """Remove files and folders with such names whose writers were killed.

    Only writers of this machine are known to be gone. A process that has the number of a dead one
    keeps what that left, for that time.

    Raises:
        OSError: the folder cannot be read.
    """
    with os.scandir(folder) as entries:
        hidden = [entry for entry in entries if entry.name.startswith(".")]
    for entry in hidden:
        name = _OURS.fullmatch(entry.name)
        if name is None or name["place"] != _here() or _is_writing(int(name["process"]), entry):
            continue
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):  # another one may remove it as well
                os.unlink(entry.path)


def _is_writing(process: int, entry: os.DirEntry[str]) -> bool:
    if os.name != "posix":  # there asking for a process by signal 0 would end it
        return time.time() - entry.stat().st_mtime < _ABANDONED
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):  # it is another user's, or no number of a process
        return True
    return True


@cache
def _here() -> str:
    """Where this process has its number: folders may be shared by machines and containers."""
    try:
        numbers = os.readlink("/proc/self/ns/pid")
    except OSError:  # only Linux has several
        numbers = ""
    return hashlib.sha256(f"{platform.node()} {numbers}".encode()).hexdigest()[:8]
