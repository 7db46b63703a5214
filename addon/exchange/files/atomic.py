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
from .file_moves import commit_context, flush_file, flush_folder, move_file, unused_path
from .file_names import check_utf8_name, length_remark
from .stale_temp_files import remove_stale_files, temporary_path

#: reasons why nothing can be written
IS_FOLDER = "a folder has this name"
IS_PROTECTED = "the file of this name is write-protected"
DISK_FULL = os.strerror(errno.ENOSPC)
_NO_RIGHTS = os.strerror(errno.EACCES)
_RIGHTS = "Choose a folder that you may write to"
_SPACE = "Free some space there, or choose a folder on another disk"
_REMEDIES = {
    IS_FOLDER: "Choose another name",
    IS_PROTECTED: "Allow writing to that file, or choose another name",
    DISK_FULL: _SPACE,
    os.strerror(errno.EDQUOT): _SPACE,
    os.strerror(errno.EFBIG): "Choose a folder on a disk that takes files of this size",
    os.strerror(errno.ENAMETOOLONG): "Choose a shorter name",
    os.strerror(errno.EROFS): _RIGHTS,
    # Windows gives the same reason for a file that is open
    _NO_RIGHTS: _RIGHTS if os.name == "posix" else f"{_RIGHTS}, and close what uses the file",
    os.strerror(errno.EPERM): _RIGHTS,
}
_ANY_REMEDY = (
    "Choose a folder that you may write to, with space left, and close other programs that use the "
    "file"
)
#: A disk with fewer free bytes is full: a file system needs some of them itself.
_MIN_FREE_BYTES = 1 << 16


@contextmanager
def atomic_write(path: Path, *, keep_on_failure: bool = True) -> Iterator[Path]:
    """A path beside `path` to write to; it replaces `path` when the block succeeds.

    The temporary path has the same suffix, so that exporters accept it. Missing folders are made.
    When the block fails or is interrupted, what was at `path` before stays as it was. What a killed
    process left in the folder is removed.

    Args:
        keep_on_failure: if another program holds the old file, keep the complete new one beside it,
            since it may have taken minutes to write.

    Raises:
        HairloomError: nothing can be written there, or the block wrote no file.
    """
    target = Path(os.path.realpath(path))  # through a link, as plain writing goes
    temporary = temporary_path(target)
    try:
        _check_writable(target)
    except OSError as error:
        raise write_error(path, error.strerror or str(error)) from error
    try:
        yield temporary
        if not temporary.is_file():
            raise write_error(path, "nothing was written")
        flush_file(temporary)  # first, since the old file's mode may not allow it
        if target.exists():
            shutil.copymode(target, temporary)
        try:
            with commit_context.get()():
                move_file(temporary, target)
        except PermissionError as error:
            if not keep_on_failure:
                raise
            raise _keep_new_file(temporary, target, path, error) from error
        flush_folder(target.parent)
    except OSError as error:
        raise write_error(path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes_atomic(path: Path, content: bytes | bytearray | memoryview) -> None:
    """Write a whole file at once.

    Raises:
        HairloomError: nothing can be written there.
    """
    with atomic_write(path, keep_on_failure=False) as temporary:
        temporary.write_bytes(content)


def write_text_atomic(path: Path, text: str) -> None:
    """Write a whole text file as UTF-8 with the same line ends everywhere.

    Raises:
        HairloomError: nothing can be written there.
    """
    write_bytes_atomic(path, text.encode("utf-8"))


def _check_writable(target: Path) -> None:
    """Fail now rather than after a long export."""
    check_utf8_name(target)
    with suppress(FileNotFoundError):
        os.stat(target)  # a name that is too long, or below a file
    why = reason_not_replaceable(target)
    if why:
        raise PermissionError(errno.EACCES, why)
    target.parent.mkdir(parents=True, exist_ok=True)
    remove_stale_files(target.parent)
    # under another name, so that nobody else can see the right one before it is used
    trial = temporary_path(target)
    trial.touch(exist_ok=False)
    trial.unlink()


def _keep_new_file(temporary: Path, target: Path, path: Path, error: OSError) -> HairloomError:
    kept = unused_path(target.with_name(f"{target.stem} new{target.suffix}"))
    os.rename(temporary, kept)
    return HairloomError(
        f"this file cannot be replaced ({error.strerror or error}); it is as it was",
        place=str(path),
        remedy=f"Close other programs that use it. The new file is beside it as {kept.name}",
    )


def check_writable(path: Path) -> None:
    """Refuse a place that nothing can be written to before long work begins; writes nothing.

    Raises:
        HairloomError: what has this name cannot be replaced, or no file can be made in its folder.
    """
    check_utf8_name(path)
    if not path.name:
        raise HairloomError(
            "this names a folder, not a file",
            place=str(path),
            remedy="Give a file name",
        )
    try:
        why = reason_not_replaceable(path) or reason_not_creatable(path)
    except OSError as error:  # a name that is too long
        why = error.strerror or str(error)
    if why:
        raise write_error(path, why)


def check_folder_writable(folder: Path) -> None:
    """Refuse a folder that files cannot be written into; it need not be there yet.

    Raises:
        HairloomError: a file has this name, or no file can be made there.
    """
    check_utf8_name(folder)
    try:
        is_file, why = (
            folder.exists() and not folder.is_dir(),
            reason_not_creatable(folder / "file"),
        )
    except OSError as error:  # a name that is too long
        is_file, why = False, error.strerror or str(error)
    if is_file:
        raise HairloomError(
            "a file has this name", place=str(folder), remedy="Choose a folder, or a new name"
        )
    if why:
        raise folder_write_error(folder, why)


def reason_not_replaceable(path: Path) -> str:
    """Why what is at this path cannot be replaced by a file; empty where it can."""
    if path.is_dir():
        return IS_FOLDER
    return IS_PROTECTED if path.exists() and not os.access(path, os.W_OK) else ""


def folder_write_error(folder: Path, why: str) -> HairloomError:
    """The message for a folder that nothing can be written into."""
    return HairloomError(
        f"nothing can be written into this folder ({why})",
        place=str(folder),
        remedy=remedy_for(why),
    )


def reason_not_creatable(path: Path) -> str:
    """Why no file can be made here, nor the folders that it needs; empty where one can.

    Raises:
        OSError: a name is too long.
    """
    with suppress(FileNotFoundError, NotADirectoryError):
        path.lstat()  # from Python 3.14, `exists` says only that there is no such file
    folder = next(each for each in path.absolute().parents if each.exists())
    if not folder.is_dir():
        return f"{folder.name} is not a folder"
    return "" if os.access(folder, os.W_OK | os.X_OK) else _NO_RIGHTS


def write_error(path: Path, why: str) -> HairloomError:
    """The message for a place where nothing can be written.

    why: as the system says it, or as one of the reasons above.
    """
    remark = length_remark(temporary_path(path), why)
    return HairloomError(
        f"this file cannot be written ({why}{remark})",
        place=str(path),
        remedy="Choose a folder with a shorter path" if remark else remedy_for(why),
    )


def remedy_for(why: str) -> str:
    """What to do where nothing can be written for this reason."""
    return _REMEDIES.get(why, _ANY_REMEDY)


def write_failure_reason(path: Path, why: str) -> str:
    """Why a library could not write beside this path: a full disk, which few libraries report, or
    else what the library says."""
    free = shutil.disk_usage(path.parent).free if path.parent.is_dir() else _MIN_FREE_BYTES
    return DISK_FULL if free < _MIN_FREE_BYTES else why


def check_free_space(path: Path, size: int) -> None:
    """Make sure that `size` more bytes fit into the folder of `path` now.

    For use before a library writes that does not survive a full disk.

    Where the system can reserve space this is tried, since quotas and limits do not show in the
    free space of a disk.

    Raises:
        OSError: there is no room.
    """
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    if hasattr(os, "posix_fallocate"):
        with tempfile.TemporaryFile(dir=path.parent) as file:
            os.posix_fallocate(file.fileno(), 0, size)
