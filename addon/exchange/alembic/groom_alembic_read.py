"""Reading groom Alembic: ours, other programs' for Unreal, and Blender's own.

A file is read in another process: damaged ones make Alembic's library crash, and Blender with it.
Several curves objects become one groom; where none of them has group IDs, each is a group.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import HairloomError
from ...strands.clean import clean
from ..files.file_space import FileSpace
from ..files.subprocess_reader import run_reader
from ..groom import Groom
from ..read_groom import ReadGroom, unique_identities, values_of_kept_points
from ..read_motion import valid_motion
from . import alembic_curves
from .alembic_curves import Arrays
from .alembic_library import alembic_library
from .alembic_objects import JoinedCurves, join_curves
from .groom_alembic import is_complete_alembic

#: Hair that extends over more than this in the file's units is in centimetres, not in metres.
MAX_EXTENT_IN_METRES = 5.0


def read_groom_alembic(
    path: Path,
    *,
    space: FileSpace | None = None,
    up: str | None = None,
    factor: float = 1.0,
    with_guides: bool = True,
    python: Sequence[str] | None = None,
) -> ReadGroom:
    """Read all curves of a file, at their first frame, and their motion.

    Args:
        space: the file's unit and axes. None: as our own files record them; else Y up, in metres
            where Blender wrote the file or the hair is smaller than MAX_EXTENT_IN_METRES, and in
            centimetres otherwise.
        up: "Y" or "Z", instead of that of `space`.
        factor: further factor on lengths.
        with_guides: whether strands that are marked as guides are kept.
        python: the command that starts another Python, see `run_reader`.

    Raises:
        HairloomError: no such file, no Alembic, one without curves, a damaged one, no alembic3d,
            or no usable strand.
    """
    _check(path)
    found = _read_in_subprocess(path, python)
    curves = join_curves(found, path)
    notes, space = list(curves.notes), space or _recorded_space(found)
    if space is None:
        space = _guessed_space(curves)
        unit = "metres" if space.units_per_metre == 1.0 else "centimetres"
        notes.append(
            f"it stores no unit and no axes, so it was read in {unit}, {up or space.up} up"
        )
    space = replace(space, up=up or space.up, units_per_metre=space.units_per_metre / factor)
    groom = _groom(curves, space, path, notes)
    if not with_guides:
        groom = groom.without_guides()
    if not groom.strands.strand_count:
        raise _error(path, "it holds only guides", "Read it with its guides")
    notes = [f"{path.name}: {note}." for note in notes]
    return ReadGroom(groom, _version(found), replace(space, units_per_metre=1.0), tuple(notes))


def _check(path: Path) -> None:
    """Refuse a file as far as that is possible without the library."""
    if os.path.isdir(path):
        raise _error(path, "this is a folder, not a file", "Choose an .abc file")
    try:
        size = os.stat(path).st_size
        with path.open("rb") as file:
            start = file.read(8)
    except OSError as error:
        remedy = "Check the path and that you may read it"
        raise _error(path, f"this file cannot be read ({error.strerror})", remedy) from error
    if not size:
        raise _error(path, "the file is empty", "Export the groom again")
    if start == b"\x89HDF\r\n\x1a\n":
        raise _error(path, "this is an old Alembic file, in HDF5", "Export it again as Ogawa")
    if not start.startswith(b"Ogawa"):
        raise _error(path, "this is not an Alembic file", "Choose an .abc file")
    if not is_complete_alembic(path):
        raise _error(path, "it was not written to its end", "Export the groom again")


def _read_in_subprocess(path: Path, python: Sequence[str] | None) -> Arrays:
    """The file's curves, read by another process."""
    alembic_library(str(path))  # for its message, should it be missing
    script = Path(alembic_curves.__file__)
    with tempfile.TemporaryDirectory(prefix="hairloom-") as folder:
        result = Path(folder) / "curves.npz"
        run_reader(script, path, [result], library="Alembic", python=python)
        with np.load(result, allow_pickle=False) as arrays:
            return dict(arrays)


def _recorded_space(found: Arrays) -> FileSpace | None:
    """The space that our own files record, or that all of Blender's have; None of other files."""
    if "blender" in str(found.get("application", "")).lower():
        return FileSpace("Y", 1.0)
    text = str(found.get("groom_properties", ""))
    recorded = dict(each.split("=", 1) for each in text.split(";") if "=" in each)
    try:
        units_per_metre = float(recorded["per_metre"])
        space = FileSpace(recorded["up"], units_per_metre, recorded["mirrored"] == "1")
    except (KeyError, ValueError):
        return None
    return space if space.up in ("Y", "Z") and 1e-6 < units_per_metre < 1e6 else None


def _guessed_space(curves: JoinedCurves) -> FileSpace:
    points = curves.points[np.isfinite(curves.points).all(axis=1)]
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return FileSpace("Y", 1.0 if extent < MAX_EXTENT_IN_METRES else 100.0)


def _groom(curves: JoinedCurves, space: FileSpace, path: Path, notes: list[str]) -> Groom:
    """The usable strands of all curves as a groom; adds to `notes`."""
    # overflow gives infinity, and strands that are not finite are dropped and counted
    with np.errstate(over="ignore", invalid="ignore"):
        points = space.from_file(curves.points)
        radius = None
        if curves.widths is not None:
            radius = curves.widths.astype(np.float32) / np.float32(2.0 * space.units_per_metre)
        cleaned = clean(
            points,
            curves.offsets,
            radius=radius,
            group=curves.group,
            root_uv=curves.root_uv,
            color=curves.color,
            unusable=curves.unusable,
        )
    if not cleaned.strands.strand_count:
        reasons = ", ".join(f"{count} with {why}" for why, count in cleaned.dropped.items())
        problem = f"none of its strands can be used ({reasons})"
        raise _error(path, problem, "Export the groom again")
    curve_indices = cleaned.curve_indices
    identities = {name: values[curve_indices] for name, values in curves.identities.items()}
    optional: dict[str, Any] = unique_identities(identities, notes)
    if curves.is_guide is not None:
        optional["is_guide"] = curves.is_guide[curve_indices]
    if curves.motion is not None:
        times, positions = curves.motion
        with np.errstate(over="ignore", invalid="ignore"):
            placed = space.from_file(positions.reshape(-1, 3)).reshape(positions.shape)
        placed = np.stack([values_of_kept_points(each, curves.offsets, cleaned) for each in placed])
        optional["motion"], note = valid_motion(times, placed)
        notes += [note] if note else []
    return Groom(
        cleaned.strands,
        path.stem,
        group_names=curves.group_names,
        dropped=cleaned.dropped,
        source=path,
        **optional,
    )


def _version(found: Arrays) -> str:
    """The version of the conventions for grooms; "" where the file names none."""
    values = [found.get(f"groom_version_{which}") for which in ("major", "minor")]
    numbers = [int(v.flat[0]) for v in values if v is not None and v.size and v.dtype.kind in "iu"]
    return ".".join(map(str, numbers)) if len(numbers) == 2 and min(numbers) >= 0 else ""


def _error(path: Path, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=str(path), remedy=remedy)
