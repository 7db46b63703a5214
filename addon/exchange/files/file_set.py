"""Writing files that belong together: all of them are there complete, or the old ones stay."""

from __future__ import annotations

import errno
import filecmp
import os
import shutil
from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import HairloomError
from .atomic import IS_PROTECTED, unwritable, why_not_replaced
from .moving import committing, flush, flush_names, free_name, move
from .names import check_name
from .stale_temp_files import COMPLETE, remove_stale_files, temporary_beside


@contextmanager
def written_together(path: Path) -> Iterator[Path]:
    """A new, hidden folder beside `path`; its files move beside `path` when the block succeeds.

    They keep their names, so that they can refer to each other. Missing folders are made. When the
    block fails or is interrupted, or when one of the files cannot be put into its place, all files
    stay as they were before, and folders that were made are removed. What a killed process left in
    the folder is removed.

    Raises:
        HairloomError: nothing can be written there, or the block wrote no file of `path`'s name.
    """
    check_name(path)
    folder = path.parent
    staging = temporary_beside(path, suffix="")
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        remove_stale_files(folder)
        staging.mkdir()
    except OSError as error:
        _remove_empty(missing)
        raise unwritable(path, error.strerror or str(error)) from error
    try:
        (staging / path.name).touch(exist_ok=False)  # fails early for an impossible name
        (staging / path.name).unlink()
        if why := why_not_replaced(path):
            raise unwritable(path, why)
        yield staging
        if not (staging / path.name).is_file():
            raise unwritable(path, "nothing was written")
        try:
            with committing.get()():
                _put_in_place(staging, folder)
        except PermissionError as error:
            raise _kept(staging, path, error) from error
    except OSError as error:
        raise unwritable(path, error.strerror or str(error)) from error
    except HairloomError as error:
        # the message names the path that the caller knows, not the hidden folder
        place = error.place.replace(str(staging), str(folder))
        raise HairloomError(error.problem, place=place, remedy=error.remedy) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        _remove_empty(missing)


def _remove_empty(folders: Sequence[Path]) -> None:
    """Remove empty folders, the innermost first; after success they hold files, and stay."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def kept_aside(staging: Path, path: Path, own: Container[str] = ()) -> tuple[str, ...]:
    """Keep files that a set is about to replace, but that are not of an earlier set of this path.

    The artist has only agreed to replace `path` itself. Each other file is copied to "NAME old",
    unless that exists already.

    Args:
        staging: the folder of `written_together`, with all files in it.
        own: names of files that an earlier set of this path was made of.

    Returns:
        A sentence for each.
    """
    notes = []
    for file in sorted(each for each in staging.iterdir() if each.is_file()):
        there = path.with_name(file.name)
        kept = there.with_name(f"{there.stem} old{there.suffix}")
        is_foreign = file.name != path.name and file.name not in own and there.is_file()
        if is_foreign and not kept.exists() and not filecmp.cmp(file, there, shallow=False):
            shutil.copy2(there, kept)
            notes.append(f"{file.name} already existed, and is kept as {kept.name}.")
    return tuple(notes)


def _put_in_place(staging: Path, folder: Path) -> None:
    """Replace file by file; when one fails, those before it get their old content back.

    A process that is killed in between leaves a complete set, which the next writer puts in place.
    """
    files = sorted(file for file in staging.iterdir() if file.is_file())
    backups = staging / "old"
    backups.mkdir()
    for file in files:
        _check_and_flush(file, folder / file.name)
    (staging / COMPLETE).touch()
    flush_names(staging)
    done: list[tuple[Path, Path]] = []
    try:
        for file in files:
            target = Path(os.path.realpath(folder / file.name))  # through a link
            _keep(target, backups / file.name)
            done.append((file, target))
            move(file, target)
    except BaseException:
        (staging / COMPLETE).unlink()
        for file, target in done:
            _restore(file, target, backups / file.name)
        raise
    flush_names(folder)


def _check_and_flush(file: Path, target: Path) -> None:
    why = why_not_replaced(target)
    if why == IS_PROTECTED:
        raise PermissionError(errno.EACCES, why, str(target))  # so that the new files are kept
    if why:
        raise unwritable(target, why)
    flush(file)  # first, since the old file's mode may not allow it
    if target.exists():
        shutil.copymode(target, file)


def _keep(target: Path, backup: Path) -> None:
    """Keep the old file under a second name, or as a copy where the file system has no links."""
    if not target.exists():
        return
    try:
        os.link(target, backup)
    except OSError:
        shutil.copy2(target, backup)


def _restore(file: Path, target: Path, backup: Path) -> None:
    """The old file again, or none where there was none; the new one is staged again."""
    if not file.exists():
        move(target, file)
    if backup.exists() and not (target.exists() and os.path.samefile(backup, target)):
        move(backup, target)  # unless it was never replaced: moving would wait for its holder again


def _kept(staging: Path, path: Path, error: PermissionError) -> HairloomError:
    """Keep new files, which may have taken minutes to write, where they can be found; the error."""
    for left in (staging / "old").iterdir():
        left.unlink()
    (staging / "old").rmdir()
    kept = free_name(path.with_name(f"{path.stem} new"))
    os.rename(staging, kept)
    return HairloomError(
        f"a file cannot be replaced ({error.strerror or error}); all are as they were",
        place=str(error.filename2 or error.filename or path),
        remedy="Allow writing to it, and close other programs that use it. The new files are "
        f"beside it in {kept.name}",
    )
