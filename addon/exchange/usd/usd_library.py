"""OpenUSD's Python modules, which come with official builds of Blender, and what they read.

The bpy module from PyPI has them in a folder that Python does not search: usd-core is used there,
in one process with Blender's own. Some Linux distributions build Blender without them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

from ...errors import HairloomError
from ..files.subprocess_reader import run_reader
from . import usd_reader
from .usd_crate import CRATE, check_crate
from .usd_reader import Arrays

#: either of both, binary (crate), text
SUFFIXES = (".usd", ".usdc", ".usda")


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


def usd_arrays(path: Path, python: Sequence[str] | None = None) -> Arrays:
    """The arrays that another process reads from a file, see `usd_reader`; this one never opens it.

    python: the command that starts another Python, see `run_reader`.

    Raises:
        HairloomError: no OpenUSD, no such file, or none that can be read as USD.
    """
    usd_library(path)  # for its message, should it be missing
    if path.suffix.lower() not in SUFFIXES:
        raise _unusable(path, f"'{path.suffix}' is not a suffix of USD files", "Choose a .usd file")
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
            "this is not a USD file: it begins neither as a binary nor as a text file",
            "Choose a .usd, .usdc or .usda file, or export the groom again",
        )
    with tempfile.TemporaryDirectory(prefix="hairloom-") as folder:
        result = Path(folder) / "curves.npz"
        # one thread: each further one reserves memory, which counts towards the limit
        one_thread = {"PXR_WORK_THREAD_LIMIT": "1"}
        script = Path(usd_reader.__file__)
        run_reader(script, path, [result], library="USD", python=python, environment=one_thread)
        with np.load(result, allow_pickle=False) as arrays:
            return dict(arrays)


def _unusable(path: Path, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=str(path), remedy=remedy)
