"""Hair cards to GLB, FBX, USD or OBJ by Blender's own exporters.

For each export, cards are put into a temporary scene. Exporters keep the order of the triangles
unless they triangulate, which is off, as cards are triangles already.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...cards.card_mesh import CardMesh
from ...errors import HairloomError
from ...exchange.cards.card_formats import FBX, GLB, OBJ, USD, CardFormat
from ...exchange.files.atomic import DISK_FULL, write_error, write_failure_reason
from ...exchange.files.file_names import identifier_name
from ...exchange.textures.srgb import srgb_decoded
from ...strands.vectors import unit
from ..base.parts import new_blocks_removed
from ..scene.surfaces import OCCLUSION_LAYER
from .material import fill_image, named_image, new_material
from .mesh import fill_mesh

_NAMED = ("objects", "meshes", "materials", "images", "scenes")
#: the attribute that holds occlusion and along in OBJ
_COLOR_ATTRIBUTE = "Occlusion color"


@dataclass(frozen=True)
class CardLook:
    """The textures of the plain material in the file.

    card: (height, width, 4) linear with straight alpha, row 0 the lowest, to be packed into the
        file; or None.
    base, alpha: names of files beside it, for formats that reference files. alpha is the channel
        "a" if both are one file, else the red channel of its own file.
    is_linear: whether the colours of base are linear instead of sRGB-encoded.
    """

    card: Floats | None = None
    base: str | None = None
    alpha: str | None = None
    is_linear: bool = False


def level_names(name: str, count: int) -> tuple[str, ...]:
    """The names of the objects of `count` levels of detail, finest first."""
    plain = identifier_name(name)
    return (plain,) if count == 1 else tuple(f"{plain}_LOD{level}" for level in range(count))


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
    """Write each level as one object, with its triangles in order.

    Args:
        path: in a folder of its own, as some exporters write more than one file; see
            `exchange.files.file_set.atomic_file_set`.
        name: the hair's name in the file.
        portable: without custom attributes, which some engines refuse.
        texels: for each level, (vertex_count, 2) for a third UV map, see `card_scene`.

    Raises:
        HairloomError: no cards, or Blender's exporter is missing or fails.
    """
    check_cards(levels, str(path))
    check_exporter(file_format, str(path))
    scene_of_cards = card_scene(levels, name, look, file_format, portable=portable, texels=texels)
    with scene_of_cards as scene, scene_in_window(scene):
        messages = StringIO()
        try:
            with redirect_stdout(StringIO()), redirect_stderr(messages):  # no running commentary
                _EXPORTERS[file_format.name](path, portable)
        except RuntimeError as error:
            if write_failure_reason(path, _reason(error)) == DISK_FULL:
                raise write_error(path, DISK_FULL) from error
            print(messages.getvalue(), end="", file=sys.stderr)
            raise HairloomError(
                f"Blender's exporter of {file_format.title} failed ({_reason(error)})",
                place=path.name,
                remedy="Try another file name or folder",
            ) from error
        print(messages.getvalue(), end="", file=sys.stderr)


def check_cards(levels: Sequence[CardMesh], place: str) -> None:
    """Refuse an export without cards.

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


#: format -> its operator, looked up each time, as add-ons can be switched on and off
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
    """Write FBX with vertices in centimetres and Y up, so that objects have no scale or rotation.

    The exporter stores the folder of textures too, so the file is first written to its final
    folder.
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


@contextmanager
def card_scene(
    levels: Sequence[CardMesh],
    name: str,
    look: CardLook,
    file_format: CardFormat,
    *,
    portable: bool,
    texels: Sequence[Floats] = (),
) -> Iterator[bpy.types.Scene]:
    """A temporary scene with an object for each level, below an Empty if there are several.

    It is removed afterwards with every data-block that was added inside. The user's data-blocks of
    the same names are renamed meanwhile.

    Args:
        texels: for each level, (vertex_count, 2): a third UV map, with v from the top.
    """
    names = level_names(name, len(levels))
    with _names_freed({identifier_name(name), *names}), new_blocks_removed():
        scene = bpy.data.scenes.new(identifier_name(name))
        material = _new_material(look, identifier_name(name), file_format)
        parent = _new_parent(scene, identifier_name(name)) if len(levels) > 1 else None
        for number, (level, level_name) in enumerate(zip(levels, names, strict=True)):
            mesh = bpy.data.meshes.new(level_name)
            uv_maps = _uv_maps(level, texels[number] if len(texels) else None, file_format)
            points = _attributes(level, file_format, portable=portable)
            fill_mesh(mesh, level, uv_maps=uv_maps, points=points)
            if file_format == OBJ:
                mesh.color_attributes.active_color = mesh.color_attributes[_COLOR_ATTRIBUTE]
            mesh.materials.append(material)
            obj = bpy.data.objects.new(level_name, mesh)
            obj.parent = parent
            scene.collection.objects.link(obj)
        yield scene


@contextmanager
def scene_in_window(scene: bpy.types.Scene) -> Iterator[None]:
    """Show a scene in the window inside the block, as exporters need it.

    Blender runs the frame change handlers at both changes of the scene.
    """
    window = bpy.context.window or bpy.context.window_manager.windows[0]
    user_scene, user_layer = window.scene, window.view_layer
    with bpy.context.temp_override(window=window):
        try:
            window.scene = scene
            yield
        finally:
            window.scene = user_scene
            window.view_layer = user_layer


@contextmanager
def _names_freed(names: Iterable[str]) -> Iterator[None]:
    """Rename data-blocks with these names inside the block, else Blender would number ours."""
    taken = [
        (block, block.name)
        for kind in _NAMED
        for name in names
        if (block := getattr(bpy.data, kind).get(name)) is not None and block.library is None
    ]
    try:
        for block, name in taken:
            block.name = f"{name} (while exporting)"
        yield
    finally:
        for block, name in taken:
            block.name = name


def _new_parent(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    parent = bpy.data.objects.new(name, None)
    parent["fbx_type"] = "LodGroup"  # read by Blender's FBX exporter
    scene.collection.objects.link(parent)
    return parent


def _uv_maps(cards: CardMesh, texels: Floats | None, file_format: CardFormat) -> dict[str, Floats]:
    """The UV maps by name; importers of USD rely on the names st, st1 and st2."""
    is_usd = file_format == USD
    # The exporter of glTF flips v.
    along = 1.0 - cards.along if file_format == GLB else cards.along
    maps = {
        "st" if is_usd else "UVMap": cards.uv,
        "st1" if is_usd else OCCLUSION_LAYER: np.stack([cards.occlusion, along], axis=1),
    }
    if texels is not None:  # v counts from the bottom in Blender, and in all formats but glTF
        maps["st2" if is_usd else "Motion"] = texels * [1.0, -1.0] + [0.0, 1.0]
    return maps


def _attributes(cards: CardMesh, file_format: CardFormat, *, portable: bool) -> dict[str, Floats]:
    """The attributes of a format beside UV maps and normals."""
    values: dict[str, Floats] = {}
    if not portable and file_format.extra:
        values["_AO"] = cards.occlusion
    if file_format == OBJ:
        # OBJ has a single UV map, so colours hold the rest; its exporter encodes them as sRGB.
        rest = np.stack([cards.occlusion, cards.along, np.zeros_like(cards.along)], axis=1)
        opaque = np.ones((len(rest), 1))
        values[_COLOR_ATTRIBUTE] = np.concatenate([srgb_decoded(rest), opaque], axis=1)
    if file_format == USD:
        values["tangents"] = unit(np.cross(cards.tangent, cards.normal))
    return values


def _new_material(look: CardLook, name: str, file_format: CardFormat) -> bpy.types.Material:
    """The material: GLB packs its picture; the other exporters write the names of linked images."""
    if file_format == GLB:
        packed = None if look.card is None else _packed_image(look.card, name)
        return new_material(name, packed, packed, blending="BLENDED")
    space = "Linear Rec.709" if look.is_linear else "sRGB"
    base = None if look.base is None else named_image(look.base, space)
    alpha = base
    if look.alpha != look.base:
        alpha = None if look.alpha is None else named_image(look.alpha, "Non-Color")
    return new_material(name, base, alpha, blending="BLENDED")


def _packed_image(texture: Floats, name: str) -> bpy.types.Image:
    height, width = texture.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True)
    fill_image(image, texture)
    return image
