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
from .atomic import IS_PROTECTED, reason_not_replaceable, write_error
from .file_moves import commit_context, flush_file, flush_folder, move_file, unused_path
from .file_names import check_utf8_name
from .stale_temp_files import COMPLETE_MARKER, remove_stale_files, temporary_path


@contextmanager
def atomic_file_set(path: Path) -> Iterator[Path]:
    """A new, hidden folder beside `path`; its files move beside `path` when the block succeeds.

    They keep their names, so that they can refer to each other. Missing folders are made. When the
    block fails or is interrupted, or when one of the files cannot be put into its place, all files
    stay as they were before, and folders that were made are removed. What a killed process left in
    the folder is removed.

    Raises:
        HairloomError: nothing can be written there, or the block wrote no file of `path`'s name.
    """
    check_utf8_name(path)
    folder = path.parent
    staging = temporary_path(path, suffix="")
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        remove_stale_files(folder)
        staging.mkdir()
    except OSError as error:
        _remove_empty(missing)
        raise write_error(path, error.strerror or str(error)) from error
    try:
        (staging / path.name).touch(exist_ok=False)  # fails early for an impossible name
        (staging / path.name).unlink()
        if why := reason_not_replaceable(path):
            raise write_error(path, why)
        yield staging
        if not (staging / path.name).is_file():
            raise write_error(path, "nothing was written")
        try:
            with commit_context.get()():
                _replace_files(staging, folder)
        except PermissionError as error:
            raise _keep_new_files(staging, path, error) from error
    except OSError as error:
        raise write_error(path, error.strerror or str(error)) from error
    except HairloomError as error:
        # the message names the path that the caller knows, not the hidden folder
        raise error.at(error.place.replace(str(staging), str(folder))) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        _remove_empty(missing)


def _remove_empty(folders: Sequence[Path]) -> None:
    """Remove empty folders, the innermost first; after success they hold files, and stay."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def back_up_foreign_files(
    staging: Path, path: Path, own_names: Container[str] = ()
) -> tuple[str, ...]:
    """Keep files that a set is about to replace, but that are not of an earlier set of this path.

    The artist has only agreed to replace `path` itself. Each other file is copied to "NAME old",
    unless that exists already.

    Args:
        staging: the folder of `atomic_file_set`, with all files in it.
        own_names: names of files that an earlier set of this path was made of.

    Returns:
        A sentence for each.
    """
    notes = []
    for file in sorted(each for each in staging.iterdir() if each.is_file()):
        existing = path.with_name(file.name)
        kept = existing.with_name(f"{existing.stem} old{existing.suffix}")
        is_foreign = file.name != path.name and file.name not in own_names and existing.is_file()
        if is_foreign and not kept.exists() and not filecmp.cmp(file, existing, shallow=False):
            shutil.copy2(existing, kept)
            notes.append(f"{file.name} already existed, and is kept as {kept.name}.")
    return tuple(notes)


def _replace_files(staging: Path, folder: Path) -> None:
    """Replace file by file; when one fails, those before it get their old content back.

    A process that is killed in between leaves a complete set, which the next writer puts in place.
    """
    files = sorted(file for file in staging.iterdir() if file.is_file())
    backups = staging / "old"
    backups.mkdir()
    for file in files:
        _check_and_flush(file, folder / file.name)
    (staging / COMPLETE_MARKER).touch()
    flush_folder(staging)
    done: list[tuple[Path, Path]] = []
    try:
        for file in files:
            target = Path(os.path.realpath(folder / file.name))  # through a link
            _back_up(target, backups / file.name)
            done.append((file, target))
            move_file(file, target)
    except BaseException:
        (staging / COMPLETE_MARKER).unlink()
        for file, target in done:
            _restore(file, target, backups / file.name)
        raise
    flush_folder(folder)


def _check_and_flush(file: Path, target: Path) -> None:
    why = reason_not_replaceable(target)
    if why == IS_PROTECTED:
        raise PermissionError(errno.EACCES, why, str(target))  # so that the new files are kept
    if why:
        raise write_error(target, why)
    flush_file(file)  # first, since the old file's mode may not allow it
    if target.exists():
        shutil.copymode(target, file)


def _back_up(target: Path, backup: Path) -> None:
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
        move_file(target, file)
    if backup.exists() and not (target.exists() and os.path.samefile(backup, target)):
        move_file(
            backup, target
        )  # unless it was never replaced: moving would wait for its holder again


def _keep_new_files(staging: Path, path: Path, error: PermissionError) -> HairloomError:
    """Keep new files, which may have taken minutes to write, where they can be found; the error."""
    for left in (staging / "old").iterdir():
        left.unlink()
    (staging / "old").rmdir()
    kept = unused_path(path.with_name(f"{path.stem} new"))
    os.rename(staging, kept)
    return HairloomError(
        f"a file cannot be replaced ({error.strerror or error}); all are as they were",
        place=str(error.filename2 or error.filename or path),
        remedy="Allow writing to it, and close other programs that use it. The new files are "
        f"beside it in {kept.name}",
    )
