"""OpenUSD's Python modules, which official builds of Blender bring along, and files opened by them.

The bpy module from PyPI has them in a folder that Python does not search: there usd-core takes
their place, in one process with Blender's own. Some Linux distributions build Blender without.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from ...errors import HairloomError
from ..files.subprocess_reader import damaged, refusal, run_reader
from .usd_crate import CRATE, check_crate
from .usd_probe import summary

#: either of both, binary (crate), text
SUFFIXES = (".usd", ".usdc", ".usda")
#: reads all of a binary file first, in another process: damaged ones make the library crash
PROBE = Path(__file__).with_name("usd_probe.py")


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


def opened_stage(path: Path, python: Sequence[str] | None = None) -> Any:
    """The stage of a file, with all its payloads.

    python: the command that starts another Python, see `run_reader`.

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
        # One thread: each further one reserves memory of its own, which would count.
        one_thread = {"PXR_WORK_THREAD_LIMIT": "1"}
        run_reader(PROBE, path, library="USD", python=python, settings=one_thread)
    with damage_reported(path):
        return usd.Usd.Stage.Open(str(path))


@contextmanager
def damage_reported(path: Path) -> Iterator[None]:
    """Let the library's complaints about what a file holds become ours.

    Raises:
        HairloomError: in place of the library's errors.
    """
    usd = usd_library(path)
    try:
        yield
    # Beside its own error the library lets C++ exceptions through, as whatever Python has for them.
    except (usd.Tf.ErrorException, RuntimeError, ValueError, MemoryError) as error:
        raise damaged(path, refusal("USD", summary(error))) from error


def _unusable(path: Path, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=str(path), remedy=remedy)
