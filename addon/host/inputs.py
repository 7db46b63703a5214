"""A groom, its head and its collider, whatever names them: a file, an object or nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

from ..errors import HairloomError
from ..exchange.tressfx import read_tfx
from ..groom.grow import grow, scalp_density
from ..groom.settings import GrowSettings
from ..strands import StrandSet, Surface
from .built_in_head import built_in_head
from .curves import read_curves
from .mesh_files import read_mesh_file
from .surfaces import read_surface

BUILT_IN = "built-in"


@dataclass(frozen=True)
class Sources:
    """What the caller asks for; each is a file, an object of the open scene, or None.

    groom None: one is grown on the head. head None: the built-in one, or none when the groom
    brings no head. collider None: the head itself.
    """

    groom: str | None = None
    head: str | None = None
    collider: str | None = None
    groom_scale: float = 1.0
    groom_up: str = "Y"
    need_uv: bool = True


@dataclass(frozen=True)
class Inputs:
    """What was found, in world space at rest."""

    strands: StrandSet
    dropped: dict[str, int]
    groom_name: str
    head: Surface
    head_object: str | None
    collider: Surface


def read_inputs(sources: Sources, grow_settings: GrowSettings) -> Inputs:
    """Read all three.

    Raises:
        HairloomError: naming the file or object that cannot be used, and what to do.
    """
    if sources.groom is not None:
        strands, dropped = _read_groom(sources.groom, sources)
        head = _read_head(sources)
    else:
        head, dropped = _read_head(sources), {}
        strands = grow(head, grow_settings, scalp_density(head))
    head_object = bpy.data.objects.get(sources.head or "")
    collider = head if sources.collider is None else _read_mesh(sources.collider, need_uv=False)
    return Inputs(
        strands,
        dropped,
        sources.groom or BUILT_IN,
        head,
        head_object and head_object.name,
        collider,
    )


def _read_head(sources: Sources) -> Surface:
    if sources.head is not None:
        return _read_mesh(sources.head, need_uv=sources.need_uv)
    if sources.groom is None:
        return built_in_head()
    surface = getattr(_object_data(sources.groom), "surface", None)
    if surface is not None:
        return _read_mesh(surface.name, need_uv=sources.need_uv)
    raise HairloomError(
        "it has no head to grow on",
        place=sources.groom,
        remedy="Name the head with --head FILE_OR_OBJECT",
    )


def _read_groom(source: str, sources: Sources) -> tuple[StrandSet, dict[str, int]]:
    groom_object = bpy.data.objects.get(source)
    if groom_object is not None:
        read = read_curves(groom_object, bpy.context.evaluated_depsgraph_get())
        return read.strands, read.dropped
    if source.lower().endswith(".tfx"):
        file = read_tfx(Path(source), up=sources.groom_up, scale=sources.groom_scale)
        return file.strands, file.dropped
    raise _unknown(source, "hair curves", "a .tfx file")


def _read_mesh(source: str, *, need_uv: bool) -> Surface:
    mesh_object = bpy.data.objects.get(source)
    if mesh_object is not None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return read_surface(mesh_object, depsgraph, need_uv=need_uv, place=source)
    if Path(source).suffix:
        return read_mesh_file(Path(source), need_uv=need_uv)
    raise _unknown(source, "mesh", "a mesh file such as head.obj")


def _object_data(name: str) -> object:
    found = bpy.data.objects.get(name)
    return None if found is None else found.data


def _unknown(source: str, kind: str, example: str) -> HairloomError:
    return HairloomError(
        f"this names neither a {kind} object of the open scene nor {example}",
        place=source,
        remedy="Check the name",
    )
