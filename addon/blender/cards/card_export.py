"""Hair cards into a GLB, FBX, USD or OBJ, through Blender's own exporters.

They keep the order of the triangles as long as they are not asked to triangulate, which they need
not: cards are triangles already.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import bpy

from ...arrays import Floats
from ...cards.card_mesh import CardMesh
from ...errors import HairloomError
from ...exchange.cards.card_formats import FBX, GLB, OBJ, USD, CardFormat
from .card_scene import CardLook, card_scene, shown


def write_card_mesh(
    path: Path,
    levels: Sequence[CardMesh],
    file_format: CardFormat,
    look: CardLook,
    *,
    name: str,
    portable: bool = True,
    texels: Sequence[Floats] = (),
) -> None:
    """Write each level as one object whose order of triangles is that of `triangles`.

    Args:
        path: in a folder of its own, for exporters that write more than one file; see
            `exchange.files.file_set.written_together`.
        name: of the hair in the file.
        portable: without custom attributes, which some engines refuse.
        texels: of each level, (vertex_count, 2) for a third UV map, see `card_scene`.

    Raises:
        HairloomError: no cards, or Blender's exporter is missing or fails.
    """
    check_cards(levels, str(path))
    check_exporter(file_format, str(path))
    scene_of_cards = card_scene(levels, name, look, file_format, portable=portable, texels=texels)
    with scene_of_cards as scene, shown(scene):
        try:
            with redirect_stdout(StringIO()):  # running commentary; errors go to stderr
                _EXPORTERS[file_format.name](path, portable)
        except RuntimeError as error:
            raise HairloomError(
                f"Blender's exporter of {file_format.title} failed ({_reason(error)})",
                place=path.name,
                remedy="Try another file name or folder",
            ) from error


def check_cards(levels: Sequence[CardMesh], place: str) -> None:
    """Refuse to write nothing.

    Raises:
        HairloomError: a level has no cards.
    """
    if not levels or not all(len(mesh.triangles) for mesh in levels):
        raise HairloomError(
            "there are no cards to write", place=place, remedy="Choose hair that has strands"
        )


def check_exporter(file_format: CardFormat, place: str) -> None:
    """Refuse a format that this Blender cannot write, before any work is done.

    Raises:
        HairloomError: its exporter was left out of this Blender, or is switched off.
    """
    try:
        _OPERATORS[file_format.name]().get_rna_type()
    except (AttributeError, KeyError) as error:
        is_add_on = file_format in (GLB, FBX)
        raise HairloomError(
            f"Blender's exporter of {file_format.title} is "
            + ("switched off" if is_add_on else "not in this build of Blender"),
            place="Preferences > Add-ons" if is_add_on else place,
            remedy=f"Switch on '{_ADD_ONS[file_format.name]}'"
            if is_add_on
            else "Use an official build of Blender, or another format",
        ) from error


#: format -> its operator, which is looked up anew: add-ons come and go
_OPERATORS: dict[str, Callable[[], Any]] = {
    GLB.name: lambda: bpy.ops.export_scene.gltf,
    FBX.name: lambda: bpy.ops.export_scene.fbx,
    USD.name: lambda: bpy.ops.wm.usd_export,
    OBJ.name: lambda: bpy.ops.wm.obj_export,
}
_ADD_ONS = {GLB.name: "glTF 2.0 format", FBX.name: "FBX format"}


def _export_glb(path: Path, portable: bool) -> None:
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format="GLB",
        use_active_scene=True,
        export_yup=True,
        export_apply=False,
        export_animations=False,
        export_current_frame=True,
        export_tangents=True,
        export_attributes=not portable,
    )


def _export_fbx(path: Path, _portable: bool) -> None:
    """In centimetres and with Y up in the vertices themselves, so that no object is scaled or
    turned. It names textures by their folder too, so it is written where it will lie.
    """
    beside = path.parent.parent / f"{path.parent.name}.fbx"
    try:
        bpy.ops.export_scene.fbx(
            filepath=str(beside),
            axis_forward="-Z",
            axis_up="Y",
            bake_space_transform=True,
            apply_scale_options="FBX_SCALE_NONE",
            object_types={"MESH", "EMPTY"},
            use_mesh_modifiers=False,
            use_triangles=False,
            use_tspace=True,
            bake_anim=False,
            path_mode="STRIP",
        )
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def _export_usd(path: Path, _portable: bool) -> None:
    bpy.ops.wm.usd_export(
        filepath=str(path),
        root_prim_path="",
        export_animation=False,
        triangulate_meshes=False,
        rename_uvmaps=False,
        export_custom_properties=False,
        export_textures_mode="KEEP",
        relative_paths=True,
        convert_world_material=False,
    )


def _export_obj(path: Path, _portable: bool) -> None:
    bpy.ops.wm.obj_export(
        filepath=str(path),
        forward_axis="NEGATIVE_Z",
        up_axis="Y",
        export_triangulated_mesh=False,
        export_colors=True,
        path_mode="STRIP",
    )


_EXPORTERS: dict[str, Callable[[Path, bool], None]] = {
    GLB.name: _export_glb,
    FBX.name: _export_fbx,
    USD.name: _export_usd,
    OBJ.name: _export_obj,
}


def _reason(error: RuntimeError) -> str:
    """The last line of a report that may hold a whole traceback."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    return [line for line in lines if not line.startswith("Location:")][-1].strip()
