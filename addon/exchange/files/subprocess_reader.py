"""Reading a file in another process, so that a library that crashes on it does not end Blender.

That process runs a script that imports none of our modules. It ends with EXIT_REPORTED after an
error that it has written to stderr.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from subprocess import TimeoutExpired

from ...errors import HairloomError
from .child_process import python_program, run_child
from .file_names import check_utf8_name

#: exit codes of a script: after an error that is on stderr; where its results cannot be written
EXIT_REPORTED, EXIT_NO_SPACE = 3, 4
#: Exit codes where Linux or macOS has ended a process, and why: it took too much time, or memory.
_KILLED_BY_SYSTEM = {
    -24: "since it took too long for a file of this size",
    -9: "as when memory runs out",
}
#: Seconds for any file, and bytes that a slow disk reads in each further second.
_MIN_SECONDS, _BYTES_PER_SECOND = 60.0, 4.0e6


def run_reader(
    script: Path,
    path: Path,
    results: Sequence[Path] = (),
    *,
    library: str,
    python: Sequence[str] | None = None,
    environment: Mapping[str, str] | None = None,
) -> None:
    """Run a script on a file, as SCRIPT -- FILE RESULTS, and wait until it has ended well.

    Args:
        library: the name of the library that reads it, for messages.
        python: the command that starts a Python, to which the script and its arguments are added.
            None: this one, where it is a program of its own.
        environment: further environment variables.

    Raises:
        HairloomError: no Python can be started, it takes too long, or it ends otherwise.
    """
    check_utf8_name(path)
    files = [str(each.absolute()) for each in (path, *results)]
    command = [*(python or this_python(path)), str(script.absolute()), "--", *files]
    seconds = _MIN_SECONDS + path.stat().st_size / _BYTES_PER_SECOND
    try:
        finished = run_child(command, seconds=seconds, environment=environment)
    except TimeoutExpired as error:
        raise damaged_error(
            path, f"{library}'s library could not read it within {seconds:.0f} s"
        ) from error
    except OSError as error:
        raise _no_python(path, str(error)) from error
    if finished.returncode == EXIT_REPORTED:
        lines = finished.stderr.decode(errors="replace").strip().splitlines() or ["no reason"]
        raise damaged_error(path, refusal_text(library, lines[-1]))
    if finished.returncode in _KILLED_BY_SYSTEM:
        raise HairloomError(
            "the process that read it was ended by the system, "
            f"{_KILLED_BY_SYSTEM[finished.returncode]}",
            place=str(path),
            remedy="Close other programs and try again; if that does not help, export it again "
            "with fewer strands",
        )
    if finished.returncode == EXIT_NO_SPACE:
        raise HairloomError(
            "the data cannot be written to the folder for temporary files",
            place=str(path),
            remedy=f"Free some space in {tempfile.gettempdir()}",
        )
    if finished.returncode:
        raise damaged_error(path, f"{library}'s library failed on it, code {finished.returncode}")


def this_python(path: Path) -> tuple[str, ...]:
    """The command that starts a Python like this one; `path` is the file to read, for messages.

    Raises:
        HairloomError: this Python is a part of another program.
    """
    if not Path(sys.executable).stem.lower().startswith("python"):
        raise _no_python(path, f"this one is a part of {sys.executable or 'another program'}")
    return python_program(sys.executable)


def refusal_text(library: str, reason: str) -> str:
    return f"{library}'s library cannot read it and says: {reason.rstrip('.')}"


def damaged_error(path: Path, problem: str) -> HairloomError:
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
