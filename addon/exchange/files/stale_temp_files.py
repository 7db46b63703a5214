"""Names for what is written beside a file, and what a killed writer leaves of it.

A name says which process writes it and where that runs: .groom.hl-3f0c9a1e-4711-5b21c7d0.abc. The
next who writes into the folder removes those whose processes are gone. Files that belong together
and were complete when their writer was killed are put in place first (see `file_set`).
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

from .moving import move

#: What such a name holds.
MARK = r"hl-(?P<place>[0-9a-f]{8})-(?P<process>\d{1,10})-[0-9a-f]{8}"
_OURS = re.compile(rf"\..*\.{MARK}(\.[^.]*)?")
#: In a folder of files that belong together: all of them are there.
COMPLETE = ".complete"
#: Seconds without a change after which a file has no writer, where none can be asked for.
_ABANDONED = 86_400.0


def temporary_beside(path: Path, suffix: str | None = None) -> Path:
    """A hidden name in the same folder that nobody else takes, with this or the same suffix."""
    # no longer than other names, which have 255 bytes at most
    return path.with_name(f".{path.stem[:20]}.{mark()}{path.suffix if suffix is None else suffix}")


def mark() -> str:
    """A part of a name that tells which process writes there; nobody else takes it."""
    return f"hl-{_here()}-{os.getpid()}-{secrets.token_hex(4)}"


def is_temporary(name: str) -> bool:
    """Whether it is such a name."""
    return _OURS.fullmatch(name) is not None


def is_stale(path: str | Path, name: re.Match[str]) -> bool:
    """Whether the writer of this file or folder is gone.

    Those of this machine since it was started can be asked for. Others, such as one that a power
    cut has ended, are taken for gone after a day without a change.

    Args:
        name: of it, matched by a pattern with the groups of `mark`.
    """
    if name["place"] != _here() or os.name != "posix":
        return _is_abandoned(path)
    return not _is_writing(int(name["process"]))


def remove_stale_files(folder: Path) -> None:
    """Remove files and folders with such names whose writers were killed.

    A process that has the number of a dead one keeps what that left, for that time.

    Raises:
        OSError: the folder cannot be read, or a complete set of files not be put in place.
    """
    with os.scandir(folder) as entries:
        hidden = [entry for entry in entries if entry.name.startswith(".")]
    for entry in hidden:
        name = _OURS.fullmatch(entry.name)
        if name is None or not is_stale(entry.path, name):
            continue
        if entry.is_dir(follow_symlinks=False):
            if os.path.isfile(os.path.join(entry.path, COMPLETE)):
                put_in_place(Path(entry.path), folder)
            shutil.rmtree(entry.path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):  # another one may remove it as well
                os.unlink(entry.path)


def put_in_place(staging: Path, folder: Path) -> None:
    """Move the files of a complete set that are still to be moved, but over no newer ones."""
    complete = (staging / COMPLETE).stat().st_mtime_ns
    for file in sorted(staging.iterdir()):
        target = Path(os.path.realpath(folder / file.name))  # through a link
        is_newer = target.exists() and target.stat().st_mtime_ns > complete
        if file.is_file() and file.name != COMPLETE and not is_newer:
            move(file, target)


def _is_abandoned(path: str | Path) -> bool:
    """Whether nobody has changed it for a long time; a folder changes with each of its files."""
    try:
        return time.time() - os.stat(path).st_mtime >= _ABANDONED
    except OSError:  # its writer has just removed it
        return False


def _is_writing(process: int) -> bool:
    """Not for Windows, where asking for a process by signal 0 would end it."""
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
    numbers, machine = "", ""
    with contextlib.suppress(OSError):  # only Linux has several
        numbers = os.readlink("/proc/self/ns/pid")
    with contextlib.suppress(OSError):  # cloned machines may have one name
        machine = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    return hashlib.sha256(f"{platform.node()} {machine} {numbers}".encode()).hexdigest()[:8]
