"""The grooms of the sight bench, prepared as by the extension with default settings."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bmesh
import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon import rig_flow
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.mesh_files import read_mesh_file
from hairloom.addon.exchange.join_grooms import join_grooms
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.face_hair import grow_with_face
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.groom.width_settings import WidthSettings
from hairloom.addon.rig_flow import Rig
from hairloom.addon.strands import StrandSet, Surface

_DATA = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data"))
type Pair = tuple[StrandSet, Surface | None]


def sintel() -> Pair:
    folder = _DATA / "sintel"
    return _file(folder / "SintelHairOriginal-sintel_hair.16points.tfx"), _mesh(
        folder / "sintel.obj"
    )


def ponytail() -> Pair:
    """Four files of one groom; it comes without a head, so its head is the hull of its roots."""
    names = ("front_top", "side", "back", "tail")
    parts = [read_tfx(_DATA / "tressfx_ponytail" / f"{name}.tfx").groom for name in names]
    strands = join_grooms(parts, "ponytail")[0].strands
    return strands, _hull(strands.roots)


def bear() -> Pair:
    return _file(_DATA / "creatures" / "bear.tfx"), _mesh(_DATA / "creatures" / "bear.obj")


def mohawk() -> Pair:
    folder = _DATA / "creatures"
    return _file(folder / "Ratboy_mohawk.tfx"), _mesh(folder / "ratboy_body.obj")


def scaled(pair: Pair, factor: float) -> Pair:
    strands, head = pair
    moved = strands.transformed(np.diag([factor, factor, factor, 1.0]))
    return moved, head and replace(head, positions=head.positions * np.float32(factor))


def rig_of(pair: Pair, name: str, children: str = ChildrenSettings().method) -> Rig:
    strands, head = pair
    widths, settings = WidthSettings().method, ChildrenSettings(method=children)
    return rig_flow.prepare(
        strands, head, GuideSettings(), place=name, children=settings, widths=widths
    )


def built_in() -> Pair:
    head = built_in_head()
    return grow_with_face(head.surface, GrowSettings(), head.weights), head.surface


GROOMS: dict[str, Callable[[], Pair]] = {
    "sintel": sintel,
    "ponytail": ponytail,
    "bear": bear,
    "mohawk": mohawk,
    "built_in": built_in,
}


def lost_curves() -> int:
    """How many of an artist's curves are not drawn, with and without children."""
    strands, head = sintel()
    lost_count = 0
    for method in ("none", "multi"):
        children = ChildrenSettings(method=method, strand_count=5000)
        rig = rig_flow.prepare(strands, head, GuideSettings(), place="hair", children=children)
        own = rig.strands.take(np.arange(rig.strands.strand_count - rig.child_count))
        tips = strands.points[strands.offsets[1:] - 1]
        kept_tips = {tip.tobytes() for tip in own.points[own.offsets[1:] - 1]}
        lost_count += sum(tip.tobytes() not in kept_tips for tip in tips)
    return lost_count


def _hull(points: np.ndarray) -> Surface:
    shape = bmesh.new()
    for point in points.tolist():
        shape.verts.new(point)
    hull = bmesh.ops.convex_hull(shape, input=shape.verts)
    faces = [each for each in hull["geom"] if isinstance(each, bmesh.types.BMFace)]
    shape.verts.index_update()
    corners = [[vertex.index for vertex in face.verts] for face in faces]
    places = np.array([vertex.co for vertex in shape.verts], np.float32)
    shape.free()
    return Surface(places, np.array(corners, np.int32))


def _file(path: Path) -> StrandSet:
    return read_tfx(path).strands


def _mesh(path: Path) -> Surface:
    return read_mesh_file(path, need_uv=False)[0]
