"""Scenes (.blend) that a job opens and saves."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from ...errors import HairloomError
from ...exchange.files.atomic import unwritable
from ..bakes.bake_settings import absolute, folder_of
from ..base.suspension import suspended


def open_scene(path: Path) -> None:
    """Open a .blend file in place of the open one.

    Raises:
        HairloomError: there is none, or Blender cannot read it.
    """
    if not path.is_file():
        raise HairloomError("there is no such file", place=str(path), remedy="Check the path")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    except RuntimeError as error:
        raise HairloomError(
            f"Blender cannot open this file ({str(error).strip()})",
            place=str(path),
            remedy="Give a .blend file of this Blender or an older one",
        ) from error


def check_saving(output: Path | None, *, over: bool) -> None:
    """Before any work: it is said where the changed scene goes, and said once.

    Args:
        over: whether over the scene's own file.

    Raises:
        HairloomError: it is not, or no scene can be written there.
    """
    if over == (output is not None):
        raise HairloomError(
            "it is said twice where it goes" if over else "it is not said where it goes",
            place="the changed scene",
            remedy="Give --output FILE.blend, or --save to save over the scene",
        )
    if output is None and not bpy.data.filepath:
        raise HairloomError(
            "the open scene has no file", place="--save", remedy="Name its file with --scene"
        )
    if output is not None and output.suffix != ".blend":
        raise HairloomError(
            "a scene's file name ends in .blend", place=str(output), remedy="Add .blend"
        )


def save_scene(path: Path | None = None) -> Path:
    """Save the open scene, over its own file or as another one.

    Blender writes beside the file and renames at the end, so that it is there whole or not at all.

    Raises:
        HairloomError: it has no file of its own, or it cannot be written.
    """
    check_saving(path, over=path is None)
    target = Path(bpy.data.filepath) if path is None else path
    _keep_bakes(target.resolve().parent)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _backups(path is None):
            bpy.ops.wm.save_as_mainfile(filepath=str(target.resolve()))
    except (OSError, RuntimeError) as error:
        raise unwritable(target, str(error).strip()) from error
    return target


@contextmanager
def _backups(are_kept: bool) -> Iterator[None]:
    """An artist's own file keeps its backups (.blend1); what a job makes needs none."""
    paths = bpy.context.preferences.filepaths
    count = paths.save_version
    if not are_kept:
        paths.save_version = 0
    try:
        yield
    finally:
        paths.save_version = count


def _keep_bakes(folder: Path) -> None:
    """Have objects name their bakes as seen from this folder, which Blender does not do by itself
    for properties of extensions."""
    for obj in bpy.data.objects:
        bake = folder_of(obj)
        if obj.library is None and bake is not None:
            _rename(obj.hairloom.bake, "folder", bake, folder)
    for curves in bpy.data.hair_curves:
        bake = absolute(curves.hairloom.baked_in, curves.library)
        if curves.library is None and bake is not None:
            _rename(curves.hairloom, "baked_in", bake, folder)


def _rename(owner: Any, name: str, bake: Path, folder: Path) -> None:
    try:
        seen = "//" + Path(os.path.relpath(bake, folder)).as_posix()
    except ValueError:  # on another drive
        seen = str(bake)
    if getattr(owner, name) != seen:
        with suspended():
            setattr(owner, name, seen)
