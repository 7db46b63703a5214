"""How and where a groom or a fin is baked, by the properties of its object (see bake_group)."""

from __future__ import annotations

import re
from pathlib import Path

import bpy

from ...errors import HairloomError

#: Folder for all bakes of a file, beside it.
_BESIDE = "//hairloom_cache"
#: What a file name may hold on every system.
_UNSAFE = re.compile(r"[^\w\-. ]+")


def frames_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> range:
    """The scene frames to bake.

    Raises:
        HairloomError: the last one comes before the first.
    """
    bake = obj.hairloom.bake
    own = bake.use_own_range
    first, last = (bake.first, bake.last) if own else (scene.frame_start, scene.frame_end)
    return frame_range(first, last, obj.name)


def frame_range(first: int, last: int, place: str) -> range:
    """All frames from the first to the last one.

    Raises:
        HairloomError: the last one comes before the first.
    """
    if last < first:
        raise HairloomError(
            f"the last frame, {last}, comes before the first, {first}",
            place=place,
            remedy="Correct the frame range",
        )
    return range(first, last + 1)


def folder_of(obj: bpy.types.Object) -> Path | None:
    """The folder that the object's bake is in; None where it names none."""
    return absolute(obj.hairloom.bake.folder, obj.library)


def absolute(folder: str, library: bpy.types.Library | None) -> Path | None:
    """A path of Blender's, which may begin with // for the folder of the file."""
    if not folder or (folder.startswith("//") and not bpy.data.filepath and library is None):
        return None
    return Path(bpy.path.abspath(folder, library=library))


def choose_folder(obj: bpy.types.Object) -> Path:
    """The folder to bake into, written to the object where it named none of its own.

    An object that was duplicated names the folder of its original; it gets another one.

    Raises:
        HairloomError: a folder beside a file that has not been saved.
    """
    bake = obj.hairloom.bake
    if not bake.folder or bake.folder in folders_of_others(obj):
        bake.folder = _own_folder(obj)
    folder = folder_of(obj)
    if folder is None:
        raise HairloomError(
            "the file has not been saved, so there is no place beside it",
            place=obj.name,
            remedy="Save the file, or choose a cache folder with a full path",
        )
    return folder


def _own_folder(obj: bpy.types.Object) -> str:
    taken = folders_of_others(obj)
    name = _UNSAFE.sub("_", obj.name).strip(". ") or "hair"
    choices = (f"{_BESIDE}/{name}{ending}" for ending in ("", *(f"_{n}" for n in range(2, 10000))))
    return next(folder for folder in choices if folder not in taken)


def folders_of_others(obj: bpy.types.Object) -> set[str]:
    """The folders that other objects name, as a duplicate names that of its original."""
    return {other.hairloom.bake.folder for other in bpy.data.objects if other != obj}
