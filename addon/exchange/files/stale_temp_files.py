"""Names of temporary files beside a file, and removal of those that killed writers have left.

A name tells which process writes the file, and where it runs: .groom.hl-3f0c9a1e-4711-5b21c7d0.abc.
The next process that writes into the folder removes those whose writers are gone. Files that belong
together and were complete when their writer was killed are put in place first (see `file_set`).
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

from .file_moves import move_file

#: The part of such a name that identifies its writer.
WRITER_TAG = r"hl-(?P<host>[0-9a-f]{8})-(?P<process>\d{1,10})-[0-9a-f]{8}"
_TEMP_NAME = re.compile(rf"\..*\.{WRITER_TAG}(\.[^.]*)?")
#: Marks a folder of files that belong together as complete.
COMPLETE_MARKER = ".complete"
#: Seconds without a change after which a writer whose process cannot be checked counts as gone.
_ABANDONED = 86_400.0


def temporary_path(path: Path, suffix: str | None = None) -> Path:
    """A unique hidden name in the same folder, with this suffix or that of `path`."""
    # no longer than other names, which have 255 bytes at most
    return path.with_name(
        f".{path.stem[:20]}.{writer_tag()}{path.suffix if suffix is None else suffix}"
    )


def writer_tag() -> str:
    """A unique part of a name that tells which process writes there, see WRITER_TAG."""
    return f"hl-{_host_id()}-{os.getpid()}-{secrets.token_hex(4)}"


def is_temporary(name: str) -> bool:
    """Whether this is the name of a temporary file."""
    return _TEMP_NAME.fullmatch(name) is not None


def is_stale(path: str | Path, name: re.Match[str]) -> bool:
    """Whether the writer of this file or folder is gone.

    Processes of this machine since its start can be checked. Others, such as one that a power cut
    has ended, count as gone after a day without a change.

    Args:
        name: of the file or folder, matched by a pattern with the groups of WRITER_TAG.
    """
    if name["host"] != _host_id() or os.name != "posix":
        return _is_abandoned(path)
    return not _is_running(int(name["process"]))


def remove_stale_files(folder: Path) -> None:
    """Remove temporary files and folders whose writers were killed.

    They stay while another process has the number of their dead writer.

    Raises:
        OSError: the folder cannot be read, or a complete set of files not be put in place.
    """
    with os.scandir(folder) as entries:
        hidden = [entry for entry in entries if entry.name.startswith(".")]
    for entry in hidden:
        name = _TEMP_NAME.fullmatch(entry.name)
        if name is None or not is_stale(entry.path, name):
            continue
        if entry.is_dir(follow_symlinks=False):
            if os.path.isfile(os.path.join(entry.path, COMPLETE_MARKER)):
                finish_file_set(Path(entry.path), folder)
            shutil.rmtree(entry.path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):  # another one may remove it as well
                os.unlink(entry.path)


def finish_file_set(staging: Path, folder: Path) -> None:
    """Move the remaining files of a complete set to their places, but not over newer ones."""
    complete = (staging / COMPLETE_MARKER).stat().st_mtime_ns
    for file in sorted(staging.iterdir()):
        target = Path(os.path.realpath(folder / file.name))  # through a link
        is_newer = target.exists() and target.stat().st_mtime_ns > complete
        if file.is_file() and file.name != COMPLETE_MARKER and not is_newer:
            move_file(file, target)


def _is_abandoned(path: str | Path) -> bool:
    """Whether nobody has changed it for a long time; a folder changes with each of its files."""
    try:
        return time.time() - os.stat(path).st_mtime >= _ABANDONED
    except OSError:  # its writer has just removed it
        return False


def _is_running(process: int) -> bool:
    """Whether the process runs. Not for Windows, where signal 0 would end it."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):  # it is another user's, or no number of a process
        return True
    return True


@cache
def _host_id() -> str:
    """A name for where process numbers are those of this process: machines and containers may share
    folders."""
    numbers, machine = "", ""
    with contextlib.suppress(OSError):  # only Linux has several
        numbers = os.readlink("/proc/self/ns/pid")
    with contextlib.suppress(OSError):  # cloned machines may have one name
        machine = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    return hashlib.sha256(f"{platform.node()} {machine} {numbers}".encode()).hexdigest()[:8]
