"""Frames and folder of a groom's or fin's bake, from the object's properties (see bake_group)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy

from ...errors import HairloomError
from ...exchange.files.file_names import name_key, safe_folder_name
from ..base.objects import OVERRIDE
from .cache import owner_and_file

#: Folder beside Blender files; it holds one folder of bakes for each file.
_CACHE_FOLDER = "//hairloom_cache"


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
    """The folder of the object's bake; None where none is set."""
    return _absolute_path(obj, lambda owner: owner.hairloom.bake.folder)


def shown_folder_of(curves: bpy.types.Curves) -> Path | None:
    """The folder of the bake that curves show in renders; None where they show none."""
    return _absolute_path(curves, lambda owner: owner.hairloom.baked_in)


def _absolute_path(owner: Any, read: Callable[[Any], str]) -> Path | None:
    """The absolute path of a folder property of a data-block; None where it is empty, or relative
    (//) in a file that has not been saved. An override that has not changed the property resolves
    it against the library's file."""
    folder, library, override = read(owner), owner.library, owner.override_library
    if override is not None and override.reference and read(override.reference) == folder:
        return _absolute_path(override.reference, read)
    if not folder or (folder.startswith("//") and not bpy.data.filepath and library is None):
        return None
    return Path(bpy.path.abspath(folder, library=library))


def assign_folder(obj: bpy.types.Object) -> Path:
    """The folder to bake into; an object without a folder of its own is assigned one.

    A bake belongs to one object of one file. A duplicated object still has the folder of its
    original, and a file saved under another name those of the first file; both get new folders.

    Raises:
        HairloomError: a folder beside a file that has not been saved, or a linked object.
    """
    check_not_linked(obj)
    bake = obj.hairloom.bake
    beside = _default_folder(obj)
    is_of_another_file = bake.folder.startswith(f"{_CACHE_FOLDER}/") and not bake.folder.startswith(
        f"{beside}/"
    )
    if not bake.folder or is_of_another_file or _is_folder_shared(obj):
        bake.folder = _own_folder(obj, beside)
    folder = folder_of(obj)
    if folder is None:
        raise HairloomError(
            "the file has not been saved, so the bake has no folder beside it",
            place=obj.name,
            remedy="Save the file, or choose a cache folder with a full path",
        )
    return folder


def check_not_linked(obj: bpy.types.Object) -> None:
    """Refuse a linked object: its bake belongs to the library's file, and is read by every file
    that links it.

    Raises:
        HairloomError: it is linked and not an override.
    """
    if obj.library is not None:
        raise HairloomError(
            f"it is linked from {file_name(obj)}, and its bake belongs to that file",
            place=obj.name,
            remedy=f"{OVERRIDE}, or bake on the command line with --output FOLDER",
        )


def check_owner(obj: bpy.types.Object, folder: Path) -> None:
    """Refuse a folder that holds the bake of another object or another file.

    Raises:
        HairloomError: naming them.
    """
    other = _other_owner(obj, folder)
    if other:
        raise HairloomError(
            f"this folder holds the bake of {other}",
            place=str(folder),
            remedy="Choose another folder for this bake, or delete that one first",
        )


def owns_bake(obj: bpy.types.Object, folder: Path) -> bool:
    """Whether the bake in an object's folder belongs to no other object or file."""
    return not (_is_folder_shared(obj) or _other_owner(obj, folder))


def _other_owner(obj: bpy.types.Object, folder: Path) -> str:
    """Another object or file whose bake is in a folder, by name; empty where there is none."""
    owner, file = owner_and_file(folder)
    if file and file != file_name(obj):
        return f"{owner} in {file}"
    is_own = owner in (obj.name, obj.hairloom.bake.owner)
    return owner if not is_own and owner in bpy.data.objects else ""


def file_name(obj: bpy.types.Object) -> str:
    """The name of the Blender file that the object is from; empty where it was not saved."""
    path = bpy.data.filepath if obj.library is None else obj.library.filepath
    return bpy.path.basename(path)


def folder_names(objects: Sequence[bpy.types.Object]) -> list[str]:
    """A folder name for each object, distinct on every file system."""
    taken: set[str] = set()
    names = []
    for obj in objects:
        names.append(safe_folder_name(obj.name, taken))
        taken.add(name_key(names[-1]))
    return names


def _default_folder(obj: bpy.types.Object) -> str:
    stem = Path(file_name(obj)).stem
    return f"{_CACHE_FOLDER}/{safe_folder_name(stem, fallback='file')}"


def _own_folder(obj: bpy.types.Object, beside: str) -> str:
    named = (other.hairloom.bake.folder for other in _other_objects(obj))
    taken = {name_key(Path(folder).name) for folder in named if folder}
    return f"{beside}/{safe_folder_name(obj.name, taken)}"


def _is_folder_shared(obj: bpy.types.Object) -> bool:
    """Whether another object has the same folder, as a duplicate and its original do."""
    own = _folder_key(obj)
    return bool(own) and own in map(_folder_key, _other_objects(obj))


def _folder_key(obj: bpy.types.Object) -> str:
    """A key of the object's folder, equal for paths that are one folder on some file system; empty
    where none is set."""
    folder = folder_of(obj)
    return "" if folder is None else name_key(str(folder.resolve()))


def _other_objects(obj: bpy.types.Object) -> list[bpy.types.Object]:
    return [other for other in bpy.data.objects if other != obj]
