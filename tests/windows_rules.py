"""Windows' rules for files, on any system: path length, names without case, open files.

Only the calls that Hairloom's writers make obey them; what a test checks afterwards does not.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import shutil
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from hairloom.addon.exchange.files import file_names

MAX_PATH_LENGTH = 259
#: functions that take a path first, and those that take two
_ONE_PATH_CALLS = (
    *("open", "mkdir", "rmdir", "unlink", "stat", "lstat", "scandir", "listdir", "chmod"),
    *("access", "utime", "listxattr", "getxattr", "setxattr"),
)
_TWO_PATH_CALLS = ("replace", "rename", "link")
#: these fail if another program has the file open
_CALLS_REFUSED_IF_OPEN = ("rmdir", "unlink", "replace", "rename")


@contextmanager
def windows_rules(open_files: Collection[Path] = ()) -> Iterator[None]:
    """Apply the rules within this context.

    Args:
        held: files that another program has open.
    """

    def checked(real: Callable[..., Any], count: int) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            paths = [_path_in_stored_case(each) for each in arguments[:count]]
            if real.__name__ in _CALLS_REFUSED_IF_OPEN:
                for path in paths:
                    _refuse_open_files(path, open_files)
            return real(*paths, *arguments[count:], **options)

        return call

    with ExitStack() as stack:
        stack.enter_context(mock.patch.object(file_names, "MAX_PATH", MAX_PATH_LENGTH))
        stack.enter_context(mock.patch.object(shutil, "_use_fd_functions", new=False))
        if hasattr(shutil, "_rmtree_impl"):  # from Python 3.14
            unsafe = shutil._rmtree_unsafe  # type: ignore[attr-defined]
            stack.enter_context(mock.patch.object(shutil, "_rmtree_impl", unsafe))
        for module, name, count in (
            *((os, name, 1) for name in _ONE_PATH_CALLS if hasattr(os, name)),
            *((os, name, 2) for name in _TWO_PATH_CALLS),
            (builtins, "open", 1),
            (io, "open", 1),
        ):
            wrapped = checked(getattr(module, name), count)
            stack.enter_context(mock.patch.object(module, name, wrapped))
        yield


_real_listdir = os.listdir


def _path_in_stored_case(path: Any) -> Any:
    """The path of an existing file whose name differs only in case, or the path itself.

    Raises:
        FileNotFoundError: the path is too long.
    """
    if not isinstance(path, (str, os.PathLike)):
        return path
    text = os.fspath(path)
    if len(os.path.abspath(text)) > MAX_PATH_LENGTH:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), text)
    folder, name = os.path.split(os.path.abspath(text))
    try:
        there = _real_listdir(folder)
    except OSError:
        return path
    if name in there:
        return path
    return next(
        (os.path.join(folder, each) for each in there if each.casefold() == name.casefold()), path
    )


def _refuse_open_files(path: Any, open_files: Collection[Path]) -> None:
    if any(each == Path(path) or each.is_relative_to(path) for each in open_files):
        raise PermissionError(errno.EACCES, "Access is denied", os.fspath(path), None, None)
