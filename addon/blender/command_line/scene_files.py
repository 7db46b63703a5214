"""Scenes (.blend) that a job opens and saves."""

from __future__ import annotations

import os
import shutil
import struct
from collections.abc import Collection
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...errors import HairloomError
from ...exchange.files.atomic import (
    DISK_FULL,
    atomic_write,
    check_writable,
    write_error,
    write_failure_reason,
)
from ...exchange.files.stale_temp_files import temporary_path
from ..bakes.bake_settings import folder_of, shown_folder_of
from ..base.suspension import suspended

#: start and end of compressed files; format of their number of frames, and sizes of a file's end
#: [bytes] to read for them and for plain files
_ZSTD, _SEEK_TABLE = b"\x28\xb5\x2f\xfd", b"\xb1\xea\x92\x8f"
_COUNT, _END_SIZE, _END_BLOCK = struct.Struct("<I"), 64, 32


def open_scene(path: Path) -> None:
    """Open a .blend file instead of the open one.

    Raises:
        HairloomError: there is none, or Blender cannot read it.
    """
    if not os.path.isfile(path):
        raise HairloomError("there is no such file", place=str(path), remedy="Check the path")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    except RuntimeError as error:
        why = str(error).strip().rpartition(": ")[2]
        problem = f"Blender cannot open this file ({why})"
        if "format is not supported" in why:
            problem = "this is not a Blender file"
        raise HairloomError(
            problem,
            place=str(path),
            remedy="Give an undamaged .blend file of this or an older version of Blender",
        ) from error


def remove_startup_cube(named: Collection[str | None]) -> None:
    """Remove the cube of Blender's start-up scene, which would stand around the head; not a cube
    that is named, also if it is misspelt, or that someone has changed.
    """
    cube = bpy.data.objects.get("Cube")
    is_named = any(name is not None and name.casefold() == "cube" for name in named)
    if cube is None or is_named or cube.type != "MESH":
        return
    corners = np.array([vertex.co for vertex in cube.data.vertices])
    is_untouched = corners.shape == (8, 3) and bool((np.abs(corners) == 1.0).all())
    is_used = cube.modifiers or cube.children or cube.data.users > 1
    if is_untouched and cube.matrix_world.is_identity and not is_used:
        bpy.data.batch_remove([cube, cube.data])


def check_scene_output(output: Path | None, *, overwrites: bool) -> None:
    """Check, before any work, that there is exactly one path for the changed scene.

    Args:
        overwrites: whether to save over the scene's own file.

    Raises:
        HairloomError: there is none or two, or no scene can be written there.
    """
    if overwrites == (output is not None):
        raise HairloomError(
            "both --output and --save are given" if overwrites else "no output is given",
            place="the changed scene",
            remedy="Give --output FILE.blend, or --save to save over the scene",
        )
    if output is None and not bpy.data.filepath:
        raise HairloomError(
            "the open scene has no file", place="--save", remedy="Name its file with --scene"
        )
    if output is not None and output.suffix != ".blend":
        raise HairloomError(
            "the file name of a scene must end in .blend", place=str(output), remedy="Add .blend"
        )
    check_writable(Path(bpy.data.filepath) if output is None else output)


def save_scene(path: Path | None = None) -> Path:
    """Save the open scene, over its own file or as another one, completely or not at all.

    When the disk is full while Blender writes a compressed file, it reports nothing and replaces
    the old file with an incomplete one. So it writes a copy here, which is checked first.

    Raises:
        HairloomError: the scene has no file of its own, or the file cannot be written.
    """
    check_scene_output(path, overwrites=path is None)
    own = Path(bpy.data.filepath) if bpy.data.filepath else None
    target = own if path is None or _is_same_file(path, own) else path
    assert target is not None, "check_scene_output refuses it"
    _make_bake_paths_relative(target.resolve().parent)
    with atomic_write(target) as temporary:
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True)
        except RuntimeError as error:
            why = write_failure_reason(target, str(error).removeprefix("Error:").strip())
            raise write_error(target, why) from error
        if not is_complete_blend(temporary):
            raise write_error(target, DISK_FULL)
        if target is own:
            _keep_older_versions(target.resolve())
    return target


def _is_same_file(path: Path, other: Path | None) -> bool:
    return other is not None and os.path.realpath(path) == os.path.realpath(other)


def is_complete_blend(path: Path) -> bool:
    """Whether a .blend file has been written to its end.

    A compressed file consists of frames and a table of their sizes (Zstandard's seekable format);
    others end with a block named ENDB.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        is_compressed = file.read(4) == _ZSTD
        file.seek(max(size - _END_SIZE, 0))
        end = file.read()
        if not is_compressed:
            return end[-_END_BLOCK:].startswith(b"ENDB")
        if len(end) < _END_SIZE or not end.endswith(_SEEK_TABLE):
            return False
        (count,) = _COUNT.unpack_from(end, len(end) - 9)
        table = 8 + 8 * count + 9
        if table > size:
            return False
        file.seek(size - table + 8)
        sizes = np.frombuffer(file.read(8 * count), "<u4")[::2]
    return int(sizes.sum(dtype=np.int64)) + table == size


def _keep_older_versions(path: Path) -> None:
    """Keep the previous file as PATH1, the one before as PATH2 and so on, as Blender does, up to
    the number in the preferences."""
    count = bpy.context.preferences.filepaths.save_version
    names = [path, *(path.with_name(f"{path.name}{n}") for n in range(1, count + 1))]
    for newer, older in reversed(list(pairwise(names[1:]))):
        if newer.exists():
            os.replace(newer, older)
    if count:
        temporary = temporary_path(path)
        try:
            shutil.copy2(path, temporary)
            os.replace(temporary, names[1])
        finally:
            temporary.unlink(missing_ok=True)


def _make_bake_paths_relative(folder: Path) -> None:
    """Make the paths of bakes relative to this folder, which Blender does not do for properties of
    extensions."""
    for obj in bpy.data.objects:
        bake = folder_of(obj)
        if obj.library is None and bake is not None:
            _set_relative_path(obj.hairloom.bake, "folder", bake, folder)
    for curves in bpy.data.hair_curves:
        bake = shown_folder_of(curves)
        if curves.library is None and bake is not None:
            _set_relative_path(curves.hairloom, "baked_in", bake, folder)


def _set_relative_path(owner: Any, name: str, bake: Path, folder: Path) -> None:
    try:
        seen = "//" + Path(os.path.relpath(bake, folder)).as_posix()
    except ValueError:  # on another drive
        seen = str(bake)
    if getattr(owner, name) != seen:
        with suspended():
            setattr(owner, name, seen)
