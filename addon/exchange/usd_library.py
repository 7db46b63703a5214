"""OpenUSD's Python modules, which official builds of Blender bring along, and files opened by them.

The bpy module from PyPI has them in a folder that Python does not search: there usd-core takes
their place, in one process with Blender's own. Some Linux distributions build Blender without.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from ..errors import HairloomError
from .usd_crate import CRATE, check_crate
from .usd_probe import REFUSED, told

#: either of both, binary (crate), text
SUFFIXES = (".usd", ".usdc", ".usda")

#: Seconds for any file, and bytes that a slow disk gives in another one.
_PATIENCE, _BYTES_A_SECOND = 20.0, 4.0e6


def usd_library(place: Path) -> ModuleType:
    """The package `pxr`, with the modules that grooms need.

    Raises:
        HairloomError: this Python has no OpenUSD.
    """
    try:
        import pxr
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, Vt  # noqa: F401 they become attributes of pxr
    except ImportError as error:
        raise HairloomError(
            f"this Blender has no library for USD files ({error})",
            place=str(place),
            remedy="Use an official build of Blender, or another format, such as Alembic or .tfx",
        ) from error
    return pxr


def opened_stage(path: Path) -> Any:
    """The stage of a file, with all its payloads.

    Raises:
        HairloomError: no OpenUSD, no such file, or none that can be read as USD.
    """
    usd = usd_library(path)
    if path.suffix.lower() not in SUFFIXES:
        raise _unusable(path, f"'{path.suffix}' is no suffix of USD files", "Choose a .usd file")
    try:
        with path.open("rb") as file:
            beginning = file.read(8)
    except OSError as error:
        raise _unusable(
            path,
            f"this file cannot be read ({error.strerror or error})",
            "Check the path and that you may read it",
        ) from error
    if not beginning:
        raise _unusable(path, "the file is empty", "Export the groom again")
    if beginning == CRATE:
        check_crate(path)
    elif not beginning.startswith(b"#usda"):
        raise _unusable(
            path,
            "this is no USD file: it begins neither as a binary one nor as a text",
            "Choose a .usd, .usdc or .usda file, or export the groom again",
        )
    if beginning == CRATE:
        _probe(path)
    with damage_told(path):
        return usd.Usd.Stage.Open(str(path))


def _probe(path: Path) -> None:
    """Let another process read a binary file first, where there is a Python to do so.

    Raises:
        HairloomError: that process failed, or took too long.
    """
    if not Path(sys.executable).stem.lower().startswith("python"):
        return
    patience = _PATIENCE + path.stat().st_size / _BYTES_A_SECOND
    script = Path(__file__).with_name("usd_probe.py")
    # One thread: each further one reserves memory of its own, which would count.
    settings = {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "PXR_WORK_THREAD_LIMIT": "1",
    }
    try:
        done = subprocess.run(
            [sys.executable, "-s", "-P", str(script), str(path)],
            capture_output=True,
            env=os.environ | settings,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _damaged(path, f"it takes more than {patience:.0f} s") from error
    except OSError as error:
        raise _unusable(
            path,
            f"no Python can be started to read it ({error})",
            "Export it as text, .usda, or use another format",
        ) from error
    if done.returncode == REFUSED:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        raise _damaged(path, lines[-1] if lines else "no reason given")
    if done.returncode:
        raise _damaged(path, f"it failed with code {done.returncode}")


@contextmanager
def damage_told(path: Path) -> Iterator[None]:
    """Let the library's complaints about what a file holds become ours.

    Raises:
        HairloomError: in place of the library's errors.
    """
    usd = usd_library(path)
    try:
        yield
    # Beside its own error the library lets C++ exceptions through, as whatever Python has for them.
    except (usd.Tf.ErrorException, RuntimeError, ValueError, MemoryError) as error:
        raise _damaged(path, told(error)) from error


def _damaged(path: Path, why: str) -> HairloomError:
    return _unusable(
        path,
        f"USD's library cannot read it ({why})",
        "The file is cut short or damaged: copy or export it again",
    )


def _unusable(path: Path, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=str(path), remedy=remedy)
