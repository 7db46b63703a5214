"""Meshes from files, by Blender's own importers: as data, or as objects in the scene."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...errors import HairloomError
from ...exchange.referenced_files import missing_materials
from ...exchange.usd.usd_crate import CRATE, check_crate
from ...strands import Surface
from ..base.parts import new_blocks_removed, new_blocks_removed_on_error
from .surfaces import read_surface, uv_map_note

_IMPORTERS: dict[str, Callable[[str], Any]] = {
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_import(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_import(filepath=path),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".fbx": lambda path: bpy.ops.wm.fbx_import(filepath=path),
    ".usd": lambda path: bpy.ops.wm.usd_import(filepath=path),
    ".usdc": lambda path: bpy.ops.wm.usd_import(filepath=path),
    ".usda": lambda path: bpy.ops.wm.usd_import(filepath=path),
}


def read_mesh_file(path: Path, *, need_uv: bool) -> tuple[Surface, tuple[str, ...]]:
    """All meshes of a file as one Surface, in metres, Z up, and notes; the scene is not changed.

    Raises:
        HairloomError: no such file, a format that Blender does not read, no faces, or no UVs
            where they are needed.
    """
    with meshes_of_file(path) as meshes:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        parts = [read_surface(mesh, depsgraph, need_uv=need_uv, place=str(path)) for mesh in meshes]
        notes = (*filter(None, map(uv_map_note, meshes)), *_missing_notes(path))
    return merged_surfaces(parts), notes


@contextmanager
def meshes_of_file(path: Path) -> Iterator[list[bpy.types.Object]]:
    """The file's mesh objects, sorted by name, in the open scene; removed at the end of the block.

    Raises:
        HairloomError: no such file, or a format that Blender does not read.
    """
    with new_blocks_removed():
        yield _imported(path)


def import_mesh_file(path: Path, scale: float = 1.0) -> tuple[bpy.types.Object, tuple[str, ...]]:
    """The mesh of a file, added to the open scene and scaled about the origin, and notes.

    Several meshes, as of a head with its eyes, are joined to one.

    Raises:
        HairloomError: no such file, or a format that Blender does not read.
    """
    meshes = _imported(path)
    names = [each.name for each in meshes]
    bpy.context.view_layer.update()
    mesh = max(meshes, key=lambda each: max(each.dimensions))  # the joined mesh has its name
    notes = _missing_notes(path)
    if len(meshes) > 1:
        _join(mesh, meshes)
        joined = f"its {len(names)} meshes ({', '.join(names)}) were joined into {mesh.name}"
        notes = (f"{path.name}: {joined}", *notes)
    if scale != 1.0:
        scale_object(mesh, scale)
    return mesh, notes


def _join(target: bpy.types.Object, meshes: list[bpy.types.Object]) -> None:
    """Join all meshes into the target, with one UV map from the active map of each."""
    for each in meshes:
        if each.data.users > 1:  # so that each linked duplicate becomes a part
            each.data = each.data.copy()
        if each.data.uv_layers.active is not None:
            each.data.uv_layers.active.name = "UVMap"
    with bpy.context.temp_override(
        active_object=target, object=target, selected_editable_objects=meshes
    ):
        bpy.ops.object.join()


def scale_object(obj: bpy.types.Object, scale: float) -> None:
    """Scale an object about the world's origin, as if its file had been in another unit."""
    bpy.context.view_layer.update()
    obj.matrix_world = Matrix.Scale(scale, 4) @ obj.matrix_world
    bpy.context.view_layer.update()


def _imported(path: Path) -> list[bpy.types.Object]:
    """The file's mesh objects, added to the scene, sorted by name; at least one."""
    importer = _IMPORTERS.get(path.suffix.lower())
    if importer is None:
        raise HairloomError(
            f"'{path.suffix}' is not a mesh format that Hairloom reads",
            place=str(path),
            remedy="Use one of " + ", ".join(_IMPORTERS),
        )
    if not os.path.isfile(path):
        raise HairloomError("there is no such file", place=str(path), remedy="Check the path")
    _check_before_reading(path)
    before = {obj.session_uid for obj in bpy.data.objects}
    with new_blocks_removed_on_error() as added:
        try:
            importer(str(path))
        except RuntimeError as error:
            raise _unreadable(path, str(error).strip()) from error
        finally:
            added()
        new = [obj for obj in bpy.data.objects if obj.session_uid not in before]
        meshes = [obj for obj in new if obj.type == "MESH"]
        if not meshes:
            raise _unreadable(path, "it holds no mesh")
    return sorted(meshes, key=lambda obj: obj.name)


def _check_before_reading(path: Path) -> None:
    """Refuse damaged binary USD files: Blender's importer may fill the memory with them.

    Raises:
        HairloomError: the file cannot be opened, or is damaged.
    """
    try:
        with path.open("rb") as file:
            beginning = file.read(len(CRATE))
    except OSError as error:
        raise _unreadable(path, error.strerror or str(error)) from error
    if beginning == CRATE:
        check_crate(path)


def _missing_notes(path: Path) -> tuple[str, ...]:
    """A note on material files that are missing."""
    missing = ", ".join(missing_materials(path))
    if not missing:
        return ()
    return (f"{path.name}: its materials are plain. Missing beside it: {missing}",)


def merged_surfaces(parts: list[Surface]) -> Surface:
    """Several surfaces as one; it has UVs only if every part has them."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts[:-1])])
    has_uv = all(part.corner_uv is not None for part in parts)
    return Surface(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([p.triangles + start for p, start in zip(parts, starts, strict=True)]),
        np.concatenate([p.corner_uv for p in parts if p.corner_uv is not None]) if has_uv else None,
    )


def _unreadable(path: Path, why: str) -> HairloomError:
    return HairloomError(
        f"this mesh cannot be read ({why})",
        place=str(path),
        remedy="Open it in Blender to see what is wrong, or export it again",
    )
