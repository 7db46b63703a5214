"""Reads all of a USD file in a separate process: a script, run with the file's path.

It ends with 0 when the library could read everything; with REPORTED and a line on stderr when it
could not. Whatever else a damaged file makes the library do, it does not do to Blender.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

#: as `run_reader` expects it
REPORTED = 3

#: Memory that a file may take beside its own size, and as a multiple of it.
_BESIDE, _MAX_TIMES = 1 << 30, 30


def main(path: Path) -> int:
    from pxr import Tf, Usd

    limit_memory(_BESIDE + _MAX_TIMES * path.stat().st_size)
    first = Usd.TimeCode.EarliestTime()
    try:
        stage = Usd.Stage.Open(str(path))
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
            for attribute in prim.GetAttributes():
                if attribute.Get() is None:
                    attribute.Get(first)
    except (Tf.ErrorException, RuntimeError, ValueError, MemoryError) as error:
        print(ascii(summary(error)), file=sys.stderr)
        return REPORTED
    return 0


def summary(error: BaseException) -> str:
    """An error of the library in one line, without where in its code it was."""
    try:
        text = str(error)
    except UnicodeDecodeError:  # it quotes bytes of a damaged text
        text = ""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    last = lines[-1] if lines else type(error).__name__
    return last.rpartition("-- ")[2].strip("'. ")


def limit_memory(more: int) -> None:
    """Let this process take this many bytes more; only Linux says how many it has."""
    if not sys.platform.startswith("linux"):
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


if __name__ == "__main__":
    code = main(Path(sys.argv[-1]))
    sys.stderr.flush()
    os._exit(code)  # at once: the library's own end may fail on what it has read
