"""Reading binary files that may be wrong: every read is first checked against the file's size.

Nothing is allocated before the file is known to hold it, so that a file of a few bytes that claims
2^31 points costs nothing. And writing them: block after block, put in place when complete.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import HairloomError
from .atomic import atomic_write

type Layout = str | np.dtype[Any]


class BinaryFile:
    """A file whose reads fail with a message that names the place in it.

    Raises:
        HairloomError: it is a folder, empty, or cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if os.path.isdir(path):
            raise self.error("this is a folder, not a file", "Choose a file")
        try:
            self.size = os.stat(path).st_size
        except OSError as error:
            raise self._unreadable(error) from error
        if not self.size:
            raise self.error("the file is empty", "Export the groom again")

    def array(self, name: str, offset: int, layout: Layout, count: int) -> NDArray[Any]:
        """`count` items from byte `offset`.

        Raises:
            HairloomError: they reach past the end of the file.
        """
        self.check(name, offset, count * np.dtype(layout).itemsize)
        try:
            items = np.fromfile(self.path, layout, count, offset=offset)
        except OSError as error:
            raise self._unreadable(error) from error
        except MemoryError as error:
            raise self._too_large() from error
        if len(items) < count:
            raise self.error(
                f"the {name} is cut short, because the file changed while it was read",
                "Wait until the file is written",
            )
        return items

    def content(self) -> bytes:
        """All bytes."""
        try:
            return self.path.read_bytes()
        except OSError as error:
            raise self._unreadable(error) from error
        except MemoryError as error:
            raise self._too_large() from error

    def check(self, name: str, offset: int, byte_count: int) -> None:
        """Make sure that the file holds these bytes.

        Raises:
            HairloomError: they reach past its end.
        """
        end = offset + byte_count
        if end > self.size:
            raise self.error(
                f"the {name}, bytes {offset:,} to {end:,}, reach past the end of the file, "
                f"which has {self.size:,} bytes",
                "The file is cut short or damaged: copy or export it again",
            )

    def error(self, problem: str, remedy: str) -> HairloomError:
        return HairloomError(problem, place=str(self.path), remedy=remedy)

    def _too_large(self) -> HairloomError:
        return self.error(
            "there is not enough memory to read it",
            "Close other programs, or read it on a machine with more memory",
        )

    def _unreadable(self, error: OSError) -> HairloomError:
        return self.error(
            f"this file cannot be read ({error.strerror or error})",
            "Check the path and that you may read it",
        )


def write_blocks(path: Path, blocks: Iterable[NDArray[Any] | bytes]) -> None:
    """Write a file of these blocks, complete or not at all.

    Raises:
        HairloomError: nothing can be written there.
    """
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        for block in blocks:
            file.write(block if isinstance(block, bytes) else np.ascontiguousarray(block).data)
