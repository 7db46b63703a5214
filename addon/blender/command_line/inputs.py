"""A groom, its head and its collider, each from a file, an object or a default."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError, did_you_mean
from ...exchange.groom import Groom
from ...exchange.strand_formats import SUFFIXES
from ...exchange.strand_reading import read_strands
from ...groom.face_hair import grow_with_face
from ...groom.grow import grow
from ...groom.scalp import scalp_density
from ...groom.settings import GrowSettings
from ...groom.size_notes import size_note
from ...strands import StrandSet, Surface
from ...strands.colors import color_notes
from ...strands.join import join_strands
from ..base.objects import head_of, objects_in
from ..base.parts import run_parts
from ..base.vertex_weights import read_weights
from ..scene.built_in_head import HeadLook, built_in_head
from ..scene.curves import read_curves
from ..scene.head_look import head_look, is_bust_surface
from ..scene.masks import read_map
from ..scene.mesh_files import read_mesh_file
from ..scene.partings import read_partings
from ..scene.surfaces import read_surface, uv_map_note
from ..setup.hairstyles import face_hair, is_bust
from ..strands.child_python import python_for
from .object_settings import find_hair

BUILT_IN = "built-in"
_SKIN = "light"


@dataclass(frozen=True)
class Sources:
    """The requested inputs; each is a file, an object of the open scene, or None.

    groom None: one is grown on the head. head None: the surface of the hair curves; the built-in
    head where a groom is grown. collider None: the head itself.
    groom_scale, groom_up: of a groom's file, see `strand_reading.read_strands`.
    head_scale: of the files of head and collider.
    need_head: whether a groom without a head is refused.
    need_uv: whether a head without UVs is refused.
    density_group, length_group: vertex groups, attributes or images of a head in the open scene, by
        name, for hair that is grown here.
    children_density: the same for the children between guides.
    skin: of the built-in head if it has no materials, one of bust_skin.TONES.
    with_face: whether to add brows and lashes to a groom of the scene on the built-in head.
    """

    groom: str | None = None
    head: str | None = None
    collider: str | None = None
    groom_scale: float = 1.0
    groom_up: str | None = None
    head_scale: float = 1.0
    need_head: bool = True
    need_uv: bool = False
    density_group: str = ""
    length_group: str = ""
    children_density: str = ""
    skin: str = _SKIN
    with_face: bool = False


@dataclass(frozen=True)
class Inputs:
    """The inputs that were read, in world space at rest.

    groom: the content of a groom's file, or None.
    notes: for the artist, such as what of that file was left out or changed.
    density: (vertex_count,) how densely children grow on the head, or None.
    partings: see `Source.partings`.
    """

    strands: StrandSet
    dropped: dict[str, int]
    groom: Groom | None
    notes: tuple[str, ...]
    groom_name: str
    head: Surface | None
    head_object_name: str | None
    collider: Surface | None
    density: Floats | None
    partings: Floats | None = None


def read_inputs(sources: Sources, grow_settings: GrowSettings) -> Inputs:
    """Read groom, head and collider.

    Raises:
        HairloomError: naming the file or object that cannot be used, and what to do.
    """
    head_name = find_head_name(sources)
    head, head_notes = _read_head(head_name, sources)
    if sources.groom is not None:
        strands, dropped, groom, notes = _read_groom(sources.groom, sources)
        notes = (*notes, *_size_notes(sources, strands, head))
        mesh = bpy.data.objects.get(head_name or "")
        if sources.with_face and head is not None and mesh is not None and is_bust(mesh):
            face = run_parts(face_hair(mesh, head, bpy.context.evaluated_depsgraph_get()))
            strands = join_strands(strands, face)
    else:
        assert head is not None, "the built-in one is always there"
        dropped, groom, notes = {}, None, _size_notes(sources, None, head)
        strands = _grow_hair(head, head_name, sources, grow_settings)
    notes, collider = (*notes, *head_notes), head
    if sources.collider is not None:
        collider, _ = _read_mesh(sources.collider, replace(sources, need_uv=False))
    head_object = bpy.data.objects.get(head_name or "")
    name = sources.groom or BUILT_IN
    if head is not None and head.corner_uv is None:
        notes = (
            *notes,
            f"{head_name}: it has no UVs, so strands have no root UVs. Unwrap it (Edit Mode, UV >"
            " Unwrap).",
        )
    children = _weights(sources.children_density, head_name)
    head_object_name = head_object and head_object.name
    partings, parting_notes = _partings(sources.groom)
    notes = (*notes, *parting_notes)
    return Inputs(
        strands, dropped, groom, notes, name, head, head_object_name, collider, children, partings
    )


def _grow_hair(
    head: Surface, head_name: str | None, sources: Sources, settings: GrowSettings
) -> StrandSet:
    """Hair grown on this head. Combed hair comes with brows and lashes if the head is the built-in
    one or has the same vertex groups."""
    density = _weights(sources.density_group, head_name)
    length = _weights(sources.length_group, head_name)
    if settings.method != "combed":
        return grow(head, settings, density, length)
    if head_name is None:
        return grow_with_face(head, settings, built_in_head().weights, length)
    if density is not None:
        return grow(head, settings, density, length)
    mesh = bpy.data.objects.get(head_name)
    if mesh is None or not {"scalp", "brows", "lashes"} <= set(mesh.vertex_groups.keys()):
        return grow(head, settings, scalp_density(head), length)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    weights = {name: read_weights(mesh, depsgraph, name) for name in ("scalp", "brows", "lashes")}
    return grow_with_face(head, settings, weights, length)


def read_head_look(sources: Sources, head: Surface | None) -> HeadLook | None:
    """The look of this head, or of a bake's head; see `head_look`."""
    return head_look(find_head_name(sources), head, sources.skin)


def _read_head(name: str | None, sources: Sources) -> tuple[Surface | None, tuple[str, ...]]:
    """The head of this name, or the built-in head for hair that is grown here; and notes on it."""
    if sources.head_scale != 1.0 and (name is None or not _is_mesh_file(name)):
        raise HairloomError(
            "only a head that is read from a file can be scaled",
            place="--head-scale",
            remedy="Name the file with --head, or scale the object in the scene",
        )
    if name is not None:
        head, head_notes = _read_mesh(name, sources)
        if sources.skin != _SKIN and not is_bust_surface(head):
            raise HairloomError(
                "only the built-in head has skin tones",
                place="--skin",
                remedy=f"Omit it: {name} is drawn with its own materials",
            )
        return head, head_notes
    if sources.groom is None:
        return built_in_head().surface, ()
    if sources.need_head:
        raise HairloomError(
            "it has no head to move with",
            place=sources.groom,
            remedy="Name the head with --head FILE_OR_OBJECT",
        )
    return None, ()


def read_head(sources: Sources) -> Surface | None:
    """The mesh of the named head, or of the surface of hair curves; the built-in head if neither
    hair nor head is named; None if hair has no head."""
    name = find_head_name(sources)
    if name is None and sources.groom is None:
        return built_in_head().surface
    return None if name is None else _read_mesh(name, sources)[0]


def find_head_name(sources: Sources) -> str | None:
    """The name of --head, or of the surface of the scene's hair curves."""
    return sources.head or _surface_name(sources.groom)


def _partings(groom: str | None) -> tuple[Floats | None, tuple[str, ...]]:
    """The partings of hair curves of the scene, and notes on those that cannot be used."""
    hair = find_hair(groom)
    if hair is None:
        return None, ()
    lines, notes = read_partings(hair, bpy.context.evaluated_depsgraph_get())
    return (lines if len(lines) else None), notes


def _weights(group: str, head_name: str | None) -> Floats | None:
    """The weights of this name on the head, (vertex_count,); None without a name."""
    if not group:
        return None
    head = bpy.data.objects.get(head_name or "")
    if head is None:
        raise HairloomError(
            "only a mesh object of the open scene has vertex groups",
            place=group,
            remedy="Name one with --head OBJECT, or omit the group",
        )
    return read_map(head, bpy.context.evaluated_depsgraph_get(), group)


def _surface_name(groom: str | None) -> str | None:
    """The name of the mesh that a hair curves object of the scene grows on."""
    hair = find_hair(groom)
    surface = None if hair is None else head_of(hair)
    return None if surface is None else surface.name


def _read_groom(
    source: str, sources: Sources
) -> tuple[StrandSet, dict[str, int], Groom | None, tuple[str, ...]]:
    groom_object = bpy.data.objects.get(source)
    if groom_object is not None:
        read = read_curves(groom_object, bpy.context.evaluated_depsgraph_get())
        return read.strands, read.dropped, None, color_notes(source, read.strands)
    if source.lower().endswith(SUFFIXES):
        path = Path(source)
        file = read_strands(
            path, up=sources.groom_up, scale=sources.groom_scale, python=python_for(path)
        )
        notes = (*file.notes, *color_notes(path.name, file.strands))
        return file.strands, file.dropped, file.groom, notes
    raise _unknown_groom(source)


def check_groom(source: str) -> None:
    """Raises:
    HairloomError: the name is that of no hair of the scene and of no file.
    """
    if find_hair(source) is None and not os.path.isfile(source):
        raise _unknown_groom(source)


def _unknown_groom(source: str) -> HairloomError:
    return _unknown(source, "CURVES", "hair curves", "a groom's file such as hair.abc")


def _read_mesh(source: str, sources: Sources) -> tuple[Surface, tuple[str, ...]]:
    """The mesh of an object or a file, and notes on it."""
    mesh_object, need_uv = bpy.data.objects.get(source), sources.need_uv
    if mesh_object is not None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        surface = read_surface(mesh_object, depsgraph, need_uv=need_uv, place=source)
        return surface, tuple(filter(None, [uv_map_note(mesh_object)]))
    if not _is_mesh_file(source):
        raise _unknown(source, "MESH", "mesh", "a mesh file such as head.obj")
    surface, notes = read_mesh_file(Path(source), need_uv=need_uv)
    if sources.head_scale != 1.0:
        surface = replace(surface, positions=surface.positions * np.float32(sources.head_scale))
    return surface, notes


def _is_mesh_file(source: str) -> bool:
    """Whether a name is that of a file rather than of an object of the scene."""
    return bpy.data.objects.get(source) is None and bool(Path(source).suffix)


def _size_notes(
    sources: Sources, strands: StrandSet | None, head: Surface | None
) -> tuple[str, ...]:
    """Notes on files that seem to be in another unit than metres."""
    hair = head_file = None
    if sources.groom and strands is not None and bpy.data.objects.get(sources.groom) is None:
        hair = Path(sources.groom).name, strands.points
    if head is not None and sources.head and _is_mesh_file(sources.head):
        head_file = Path(sources.head).name, head.positions
    return tuple(filter(None, [size_note(hair, head_file)]))


def _unknown(source: str, object_type: str, kind: str, example: str) -> HairloomError:
    own = objects_in(bpy.context.view_layer)
    objects = [obj.name for obj in own if obj.type == object_type]
    return HairloomError(
        f"this is neither a {kind} object of the open scene nor {example}",
        place=source,
        remedy=f"{did_you_mean(source, objects)}Check the name",
    )
