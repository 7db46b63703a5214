"""Reading a file in another process, so that a library that crashes on it does not end Blender.

That process runs a script that imports none of our modules. It ends with REPORTED after an error
that it has written to stderr.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from subprocess import TimeoutExpired

from ...errors import HairloomError
from .child_process import python_program, run_child
from .names import check_name

#: exit codes of a script: after an error that is on stderr; where its results cannot be written
REPORTED, NO_ROOM = 3, 4
#: Exit codes where Linux or macOS has ended a process, and why: it took too much time, or memory.
_ENDED = {-24: "since it took too long for a file of this size", -9: "as when memory runs out"}
#: Seconds for any file, and bytes that a slow disk reads in each further second.
_PATIENCE, _BYTES_A_SECOND = 60.0, 4.0e6


def run_reader(
    script: Path,
    path: Path,
    results: Sequence[Path] = (),
    *,
    library: str,
    python: Sequence[str] | None = None,
    settings: Mapping[str, str] | None = None,
) -> None:
    """Run a script on a file, as SCRIPT -- FILE RESULTS, and wait until it has ended well.

    Args:
        library: the name of the library that reads it, for messages.
        python: the command that starts a Python, to which the script and its arguments are added.
            None: this one, where it is a program of its own.
        settings: further environment variables.

    Raises:
        HairloomError: no Python can be started, it takes too long, or it ends otherwise.
    """
    check_name(path)
    files = [str(each.absolute()) for each in (path, *results)]
    command = [*(python or this_python(path)), str(script.absolute()), "--", *files]
    patience = _PATIENCE + path.stat().st_size / _BYTES_A_SECOND
    try:
        done = run_child(command, seconds=patience, settings=settings)
    except TimeoutExpired as error:
        raise damaged(
            path, f"{library}'s library could not read it within {patience:.0f} s"
        ) from error
    except OSError as error:
        raise _no_python(path, str(error)) from error
    if done.returncode == REPORTED:
        lines = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason"]
        raise damaged(path, refusal(library, lines[-1]))
    if done.returncode in _ENDED:
        raise HairloomError(
            f"the process that read it was ended by the system, {_ENDED[done.returncode]}",
            place=str(path),
            remedy="Close other programs and try again; if that does not help, export it again "
            "with fewer strands",
        )
    if done.returncode == NO_ROOM:
        raise HairloomError(
            "the data cannot be written to the folder for temporary files",
            place=str(path),
            remedy=f"Free some space in {tempfile.gettempdir()}",
        )
    if done.returncode:
        raise damaged(path, f"{library}'s library failed on it, code {done.returncode}")


def this_python(path: Path) -> tuple[str, ...]:
    """The command that starts a Python like this one; `path` is the file to read, for messages.

    Raises:
        HairloomError: this Python is a part of another program.
    """
    if not Path(sys.executable).stem.lower().startswith("python"):
        raise _no_python(path, f"this one is a part of {sys.executable or 'another program'}")
    return python_program(sys.executable)


def refusal(library: str, reason: str) -> str:
    return f"{library}'s library cannot read it and says: {reason.rstrip('.')}"


def damaged(path: Path, problem: str) -> HairloomError:
    """The error for a file that its library cannot read."""
    return HairloomError(
        problem,
        place=str(path),
        remedy="It is cut short, damaged or of another kind: copy or export it again",
    )


def _no_python(path: Path, why: str) -> HairloomError:
    return HairloomError(
        f"no Python can be started to read it apart from Blender ({why})",
        place=str(path),
        remedy="Use another format, such as .tfx, or an official build of Blender",
    )
