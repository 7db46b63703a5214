"""Whether a disk has room, asked before a library writes that does not survive a full one."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from pathlib import Path


def check_room(path: Path, size: int) -> None:
    """Make sure that `size` bytes more can be written in the folder of `path`, now at least.

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
