"""Partings of one groom: curves that are drawn on its surface, the objects of a collection."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...strands.affine import moved
from ...strands.closest_point import search_of
from ..base.objects import head_of, matrix_of
from .own_collections import put_into, take_out
from .surfaces import read_surface

#: types of objects that can be a parting
PARTING_TYPES = ("CURVE", "MESH")
_NONE = np.zeros((0, 2, 3), np.float32)
#: A line is on the surface within this part of the surface's diagonal.
_ON = 0.1
#: A new parting: points, and how far it goes over the head, as parts of its depth from the front.
_POINTS, _FRONT, _BACK = 9, 0.12, 0.62


def partings_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that part this hair, each once."""
    collection = hair.hairloom.parting_collection
    objects = () if collection is None else collection.all_objects
    return tuple(obj for obj in dict.fromkeys(objects) if obj is not None and obj != hair)


def parting_state(hair: bpy.types.Object) -> tuple[Floats | str, ...]:
    """Which lines part the hair, and where the artist has put them; what only carries them, such as
    a head that turns, is not in it."""
    state: list[Floats | str] = []
    for obj in partings_of(hair):
        state += [f"{obj.session_uid} {obj.type}", _line_points(obj)]
        state += [np.array(obj.matrix_parent_inverse), np.array(obj.matrix_basis)]
    return tuple(state)


def is_same_state(one: tuple[Floats | str, ...], other: tuple[Floats | str, ...]) -> bool:
    """Whether two `parting_state` are the same."""
    return len(one) == len(other) and all(map(np.array_equal, one, other))


def _line_points(obj: bpy.types.Object) -> Floats:
    """The control points of a curve, or the vertices of a mesh, before modifiers."""
    if obj.type == "MESH":
        places = np.empty(3 * len(obj.data.vertices), np.float32)
        obj.data.vertices.foreach_get("co", places)
        return places
    splines = obj.data.splines if obj.type == "CURVE" else ()
    found = [
        coordinate
        for spline in splines
        for point in spline.bezier_points
        for place in (point.handle_left, point.co, point.handle_right)
        for coordinate in place
    ]
    found += [each for spline in splines for point in spline.points for each in point.co[:3]]
    return np.array(found, np.float32)


def read_partings(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats, tuple[str, ...]]:
    """The straight pieces of all lines, (n, 2, 3) float32 [m] world space; and what cannot be used.

    Nothing else of the objects counts: neither their thickness nor whether they are shown.
    """
    found, unusable = [_NONE], []
    for obj in partings_of(hair):
        try:
            found.append(pieces_of(obj, depsgraph))
        except HairloomError as error:
            unusable.append(str(error))
    return np.concatenate(found), tuple(unusable)


def pieces_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """Those of one object, as it is drawn.

    Raises:
        HairloomError: it cannot be a parting.
    """
    if obj.type not in PARTING_TYPES:
        raise HairloomError(
            f"it is a {obj.type.lower()} object, which has no line to part hair along",
            place=obj.name,
            remedy="Draw a curve on the surface (Add > Curve > Bezier, then the Draw tool)",
        )
    matrix = matrix_of(obj, depsgraph)
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if mesh is not None and len(mesh.polygons):
            raise HairloomError(
                "it has faces, so it is no line to part hair along",
                place=obj.name,
                remedy="Set its bevel and extrusion to 0, or delete its faces and keep the line",
            )
        count = 0 if mesh is None else len(mesh.edges)
        points, ends = np.empty((0, 3), np.float32), np.empty(2 * count, np.int32)
        if count:
            points = np.empty((len(mesh.vertices), 3), np.float32)
            mesh.vertices.foreach_get("co", points.ravel())
            mesh.edges.foreach_get("vertices", ends)
    finally:
        evaluated.to_mesh_clear()
    pieces = moved(points, matrix)[ends].reshape(-1, 2, 3)
    if not np.isfinite(pieces).all():
        raise HairloomError(
            "its points are not finite numbers", place=obj.name, remedy="Correct its transforms"
        )
    pieces = pieces[(pieces[:, 0] != pieces[:, 1]).any(axis=1)]
    if not len(pieces):
        raise HairloomError(
            "it has no length, so it parts no hair",
            place=obj.name,
            remedy="Draw a line of two points or more",
        )
    return pieces


def is_wire(obj: bpy.types.Object) -> bool:
    """Whether it is a mesh of edges without faces."""
    return bool(obj.type == "MESH" and len(obj.data.edges) and not len(obj.data.polygons))


def check_on_surface(
    line: bpy.types.Object, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> None:
    """Raises:
    HairloomError: it cannot be a parting of this hair: it has no line, or is away from the surface.
    """
    pieces, head = pieces_of(line, depsgraph), head_of(hair)
    if head is None:
        raise _no_surface(hair)
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    away = search_of(surface).closest(pieces.reshape(-1, 3)).distance
    low, high = surface.bounds()
    if float(np.median(away)) > _ON * float(np.linalg.norm(high - low)):
        raise HairloomError(
            f"it is {100.0 * float(np.median(away)):.1f} cm away from {head.name}",
            place=line.name,
            remedy="Draw it on the surface: in the Draw tool, set Depth to Surface",
        )


def _no_surface(hair: bpy.types.Object) -> HairloomError:
    return HairloomError(
        "it has no surface to draw a parting on",
        place=hair.name,
        remedy="Set Surface in its Data properties",
    )


def add_partings(
    hair: bpy.types.Object, lines: list[bpy.types.Object], scene: bpy.types.Scene
) -> None:
    """Put lines into the hair's collection of partings, which is made where there is none."""
    put_into(hair, "parting_collection", "Partings", lines, scene)


def remove_parting(hair: bpy.types.Object, name: str, scene: bpy.types.Scene) -> None:
    """Take an object out of the hair's collection of partings, but not out of the scene.

    Raises:
        HairloomError: it is not in that collection itself.
    """
    take_out(hair, "parting_collection", "Partings", name, scene)


def copy_partings(
    source: bpy.types.Object,
    hair: bpy.types.Object,
    head: bpy.types.Object,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    """Part hair along the partings of another groom where they are now, as a mesh that is a child
    of a head that stands at the origin."""
    lines, _ = read_partings(source, depsgraph)
    if not len(lines):
        return
    mesh = bpy.data.meshes.new("Partings")
    ends = np.arange(2 * len(lines)).reshape(-1, 2)
    mesh.from_pydata(lines.reshape(-1, 3).tolist(), ends.tolist(), [])
    line = bpy.data.objects.new("Partings", mesh)
    scene.collection.objects.link(line)
    line.parent = head
    hair.hairloom.parting_collection = bpy.data.collections.new("Partings")
    hair.hairloom.parting_collection.objects.link(line)


def new_parting(hair: bpy.types.Object, context: bpy.types.Context) -> bpy.types.Object:
    """A line over the middle of the surface from the front to the crown, that goes with it.

    Raises:
        HairloomError: the hair has no surface, or nothing of it is up there.
    """
    head = head_of(hair)
    if head is None:
        raise _no_surface(hair)
    evaluated = head.evaluated_get(context.evaluated_depsgraph_get())
    low, high = np.array(evaluated.bound_box)[[0, 6]]
    points = []
    for part in np.linspace(_FRONT, _BACK, _POINTS):
        above = (0.5 * (low[0] + high[0]), low[1] + part * (high[1] - low[1]), high[2] + 1.0)
        is_hit, place, _, _ = evaluated.ray_cast(above, (0.0, 0.0, -1.0))
        if is_hit:
            points.append(place)
    if len(points) < 2:
        raise HairloomError(
            "nothing of its surface is below its middle line, so no parting can be drawn there",
            place=head.name,
            remedy="Draw a curve on the surface, select it and the hair, and press Add Parting",
        )
    data = bpy.data.curves.new("Parting", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(len(points) - 1)
    for point, place in zip(spline.bezier_points, points, strict=True):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    line = bpy.data.objects.new("Parting", data)
    line.show_in_front = True
    hair.users_collection[0].objects.link(line)
    line.parent = head
    context.view_layer.update()
    return line
