"""Lines that are drawn on the surface of hair: curves, or meshes of edges alone."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...strands.affine import transform_points
from ...strands.closest_point import search_of
from ..base.mesh_arrays import edge_vertices, vertex_positions
from ..base.objects import as_mesh, head_of, link_into, matrix_of
from .surfaces import read_surface

#: types of objects that can be a line
LINE_TYPES = ("CURVE", "MESH")
#: Greatest median distance of a line on the surface, as a fraction of the surface's diagonal.
_MAX_DISTANCE = 0.1
#: A new line: its points, and where it starts and ends, as fractions of the head's depth from the
#: front.
_POINTS, _FRONT, _BACK = 9, 0.12, 0.62


def selected_lines(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The lines that are selected."""
    chosen = context.selected_objects
    return [obj for obj in chosen if obj.type == "CURVE" or is_wire(obj)]


def pieces_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """The straight pieces of a line as Blender draws it, (n, 2, 3) float32 [m] world space; those
    of a curve in order from its first point to its last.

    Raises:
        HairloomError: it has no line.
    """
    if obj.type not in LINE_TYPES:
        raise HairloomError(
            f"it is a {obj.type.lower()} object, not a line on a surface",
            place=obj.name,
            remedy="Draw a curve on the surface (Add > Curve > Bezier, then the Draw tool)",
        )
    matrix = matrix_of(obj, depsgraph)
    with as_mesh(obj, depsgraph) as mesh:
        if mesh is not None and len(mesh.polygons):
            raise HairloomError(
                "it has faces, so it is not a line",
                place=obj.name,
                remedy="Set its bevel and extrusion to 0, or delete its faces and keep the line",
            )
        points: Floats = np.empty((0, 3), np.float32)
        ends: Ints = np.empty(0, np.int32)
        if mesh is not None and len(mesh.edges):
            points, ends = vertex_positions(mesh), edge_vertices(mesh).ravel()
    pieces = transform_points(points, matrix)[ends].reshape(-1, 2, 3)
    if not np.isfinite(pieces).all():
        raise HairloomError(
            "its points are not finite numbers", place=obj.name, remedy="Correct its transforms"
        )
    pieces = pieces[(pieces[:, 0] != pieces[:, 1]).any(axis=1)]
    if not len(pieces):
        raise HairloomError(
            "it has no length, so it cannot guide hair",
            place=obj.name,
            remedy="Draw a line of two points or more",
        )
    return pieces


def joined_lines(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> list[Floats]:
    """The pieces joined to lines (m, 3), where one begins at the end of the one before.

    Raises:
        HairloomError: see `pieces_of`.
    """
    pieces = pieces_of(obj, depsgraph)
    breaks = np.flatnonzero((pieces[:-1, 1] != pieces[1:, 0]).any(axis=1)) + 1
    return [np.concatenate([each[:1, 0], each[:, 1]]) for each in np.split(pieces, breaks)]


def is_wire(obj: bpy.types.Object) -> bool:
    """Whether it is a mesh of edges without faces."""
    return bool(obj.type == "MESH" and len(obj.data.edges) and not len(obj.data.polygons))


def check_on_surface(
    line: bpy.types.Object, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> None:
    """Check that a line lies on the surface of this hair.

    Raises:
        HairloomError: it has no line, or is away from the surface.
    """
    pieces, head = pieces_of(line, depsgraph), head_of(hair)
    if head is None:
        raise _no_surface_error(hair)
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    away = search_of(surface).closest(pieces.reshape(-1, 3)).distance
    low, high = surface.bounds()
    if float(np.median(away)) > _MAX_DISTANCE * float(np.linalg.norm(high - low)):
        raise HairloomError(
            f"it is {100.0 * float(np.median(away)):.1f} cm away from {head.name}",
            place=line.name,
            remedy="Draw it on the surface: in the Draw tool, set Depth to Surface",
        )


def _no_surface_error(hair: bpy.types.Object) -> HairloomError:
    return HairloomError(
        "it has no surface to draw a line on",
        place=hair.name,
        remedy="Set Surface in its Data properties",
    )


def new_line(hair: bpy.types.Object, name: str, context: bpy.types.Context) -> bpy.types.Object:
    """A new line over the middle of the surface from the front to the crown, parented to it.

    Raises:
        HairloomError: the hair has no surface, or no part of it lies below that line.
    """
    head = head_of(hair)
    if head is None:
        raise _no_surface_error(hair)
    depsgraph = context.evaluated_depsgraph_get()
    evaluated = head.evaluated_get(depsgraph)
    low, high = np.array(evaluated.bound_box)[[0, 6]]
    # heads look along -Y, or along Z if the object's Y axis is up, as from other programs
    has_y_up = _world_z_of_axes(matrix_of(head, depsgraph)).argmax() == 1
    depth, up, front, back = (2, 1, high, low) if has_y_up else (1, 2, low, high)
    points, above, down = [], 0.5 * (low + high), np.zeros(3)
    above[up], down[up] = 2.0 * high[up] - low[up], -1.0
    for part in np.linspace(_FRONT, _BACK, _POINTS):
        above[depth] = front[depth] + part * (back[depth] - front[depth])
        is_hit, place, _, _ = evaluated.ray_cast(above, down)
        if is_hit:
            points.append(place)
    if len(points) < 2:
        raise HairloomError(
            "its surface has no faces below the middle line, so no line can be placed there",
            place=head.name,
            remedy="Draw a curve on the surface, and select it together with the hair",
        )
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(len(points) - 1)
    for point, place in zip(spline.bezier_points, points, strict=True):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    line = bpy.data.objects.new(name, data)
    line.show_in_front = True
    link_into(line, hair.users_collection, context.scene)
    line.parent = head
    context.view_layer.update()
    return line


def _world_z_of_axes(matrix: Floats) -> Floats:
    """World Z of each unit axis of an object, (3,), -1 to 1."""
    up: Floats = matrix[2, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-30)
    return up


def selected_or_new_lines(
    hair: bpy.types.Object, name: str, context: bpy.types.Context
) -> list[bpy.types.Object]:
    """The selected lines on the hair's surface; without any, a new line of this name.

    Raises:
        HairloomError: the hair has no surface, or a curve is not on it.
    """
    depsgraph = context.evaluated_depsgraph_get()
    lines = selected_lines(context)
    for line in lines:
        check_on_surface(line, hair, depsgraph)
    return lines or [new_line(hair, name, context)]
