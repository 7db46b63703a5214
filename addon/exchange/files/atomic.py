"""Writing a file so that it is there complete or not at all: write beside it, then replace."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import HairloomError
from .moving import committing, flush, flush_names, free_name, move
from .names import check_name, length_remark
from .stale_temp_files import remove_stale_files, temporary_beside


@contextmanager
def atomic_write(path: Path, *, keeps: bool = True) -> Iterator[Path]:
    """A path beside `path` to write to; it takes the place of `path` when the block ends well.

    The temporary path has the same suffix, so that exporters accept it. Missing folders are made.
    When the block fails or is interrupted, what was at `path` before stays as it was. What a killed
    process left in the folder is removed.

    Args:
        keeps: keep a file that is whole but cannot take its place, since another program holds the
            old one, beside it; it may have taken minutes to write.

    Raises:
        HairloomError: nothing can be written there, or the block wrote no file.
    """
    target = Path(os.path.realpath(path))  # through a link, as plain writing would go
    temporary = temporary_beside(target)
    try:
        _check_writable(target)
    except OSError as error:
        raise unwritable(path, error.strerror or str(error)) from error
    try:
        yield temporary
        if not temporary.is_file():
            raise unwritable(path, "nothing was written")
        if target.exists():
            shutil.copymode(target, temporary)
        flush(temporary)
        try:
            with committing.get()():
                move(temporary, target)
        except PermissionError as error:
            if not keeps:
                raise
            raise _kept(temporary, target, path, error) from error
        flush_names(target.parent)
    except OSError as error:
        raise unwritable(path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes_atomic(path: Path, content: bytes | bytearray | memoryview) -> None:
    """Write a whole file at once.

    Raises:
        HairloomError: nothing can be written there.
    """
    with atomic_write(path, keeps=False) as temporary:
        temporary.write_bytes(content)


def write_text_atomic(path: Path, text: str) -> None:
    """Write a whole text file as UTF-8 with the same line ends everywhere.

    Raises:
        HairloomError: nothing can be written there.
    """
    write_bytes_atomic(path, text.encode("utf-8"))


def _check_writable(target: Path) -> None:
    """Fail now rather than after a long export."""
    check_name(target)
    with suppress(FileNotFoundError):
        os.stat(target)  # a name that is too long, or below a file
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "a folder has this name")
    target.parent.mkdir(parents=True, exist_ok=True)
    remove_stale_files(target.parent)
    # under another name: nobody else shall know the right one before it is taken
    trial = temporary_beside(target)
    trial.touch(exist_ok=False)
    trial.unlink()


def _kept(temporary: Path, target: Path, path: Path, error: OSError) -> HairloomError:
    kept = free_name(target.with_name(f"{target.stem} new{target.suffix}"))
    os.rename(temporary, kept)
    return HairloomError(
        f"this file cannot be replaced ({error.strerror or error}); it is as it was",
        place=str(path),
        remedy=f"Close other programs that use it. The new file is beside it as {kept.name}",
    )


def check_place(path: Path) -> None:
    """Refuse a place that nothing can be written to before long work begins; writes nothing.

    Raises:
        HairloomError: a folder has this name, or no file can be made in its folder.
    """
    check_name(path)
    if path.is_dir():
        raise unwritable(path, "a folder has this name")
    folder = next(each for each in path.absolute().parents if each.exists())
    if not folder.is_dir():
        raise unwritable(path, f"{folder.name} is no folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise unwritable(path, "permission denied")


def unwritable(path: Path, why: str) -> HairloomError:
    """The message for a place where nothing can be written."""
    remark = length_remark(temporary_beside(path), why)
    return HairloomError(
        f"this file cannot be written ({why}{remark})",
        place=str(path),
        remedy="Choose a folder with a shorter path"
        if remark
        else "Choose a folder that you may write to, with space left, "
        "and close other programs that use the file",
    )


def check_free_space(path: Path, size: int) -> None:
    """Make sure that `size` more bytes fit into the folder of `path` now.

    Asked before a library writes that does not survive a full disk.

    Where the system can set space aside it is asked to, since quotas and limits do not show in the
    free space of a disk.

    Raises:
        OSError: there is no room.
    """
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    if hasattr(os, "posix_fallocate"):
        with tempfile.TemporaryFile(dir=path.parent) as file:
            os.posix_fallocate(file.fileno(), 0, size)
