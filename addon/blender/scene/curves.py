"""Reading hair curves from Blender into a `StrandSet`, and writing them back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...arrays import Bools, Floats, Ints, rows_of_pieces
from ...errors import HairloomError
from ...groom.widths import with_widths
from ...strands import StrandSet
from ...strands.affine import mean_scale, transform_points
from ...strands.clean import Cleaned, clean
from ...strands.curve_types import (
    CurveShapes,
    CurveType,
    EvaluatedCurves,
    KnotMode,
    evaluate_curves,
)
from ..base.attributes import read_attribute, set_attribute
from ..base.objects import link_into

#: Curve attributes that may hold a strand's group. The first one found wins; the first name is
#: that of Unreal and USD, and is written.
GROUP_ATTRIBUTES = ("groom_group_id", "group")
#: The attribute of Blender's own importers, per point or per curve.
COLOR_ATTRIBUTE = "color"
#: The attribute of curves with the seed of each strand's noise, see `StrandSet.seed`.
SEED_ATTRIBUTE = "strand_seed"
#: Attributes that `read_curves` reads beside positions and groups, and the size of their values.
VALUE_ATTRIBUTES = (
    ("radius", 1),
    ("surface_uv_coordinate", 2),
    (SEED_ATTRIBUTE, 1),
    (COLOR_ATTRIBUTE, 4),
)
#: Attributes that Blender stores unless all curves are open Catmull-Rom curves: name, domain, size.
SHAPE_ATTRIBUTES = (
    ("curve_type", "CURVE", 1),
    ("cyclic", "CURVE", 1),
    ("resolution", "CURVE", 1),
    ("nurbs_order", "CURVE", 1),
    ("knots_mode", "CURVE", 1),
    ("nurbs_weight", "POINT", 1),
    ("handle_left", "POINT", 3),
    ("handle_right", "POINT", 3),
)
_REMEDIES = {
    "CURVE": "Convert them: Object > Convert > Curves (hair)",
    "MESH": "Select hair curves; particle hair converts by Object > Convert > Curves (hair)",
}


def read_curves(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Cleaned:
    """The hair as Blender shows it after all modifiers, in world space, without unusable curves.
    The points lie on the curves, whatever their type, see `curve_types`.

    Raises:
        HairloomError: the object holds no hair curves.
    """
    _check_curves(obj)
    evaluated = obj.evaluated_get(depsgraph)
    curves = evaluated.data
    return _read(curves, np.array(evaluated.matrix_world), drawn=curves_as_drawn(curves))


def read_original_curves(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, points: Floats | None = None
) -> Cleaned:
    """The hair before all modifiers, as brushes comb it: the control points of curves of any type.

    Args:
        points: (point_count, 3) object space, instead of the curves' own.

    Raises:
        HairloomError: the object holds no hair curves.
    """
    _check_curves(obj)
    return _read(obj.data, np.array(obj.evaluated_get(depsgraph).matrix_world), points)


def _check_curves(obj: bpy.types.Object) -> None:
    """Raises:
    HairloomError: the object holds no hair curves.
    """
    if obj.type != "CURVES":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, not hair curves",
            place=obj.name,
            remedy=_REMEDIES.get(obj.type, "Select hair curves (Add > Curve > Empty Hair)"),
        )


def _read(
    curves: bpy.types.Curves,
    matrix: Floats,
    points: Floats | None = None,
    drawn: EvaluatedCurves | None = None,
) -> Cleaned:
    """The curves in world space. Args: drawn: points on the curves, instead of control points."""
    radius = read_attribute(curves, "radius", "POINT")
    color, offsets = _colors(curves), curve_offsets(curves)
    group = next(
        filter(_is_not_none, (read_attribute(curves, n, "CURVE") for n in GROUP_ATTRIBUTES)), None
    )
    if points is None:
        points = curve_points(curves) if drawn is None else drawn.points
    if drawn is not None:
        offsets = drawn.offsets
        radius = None if radius is None else drawn.of(radius)
        color = None if color is None else drawn.of(color)
    return clean(
        transform_points(points, matrix),
        offsets,
        radius=None if radius is None else radius * np.float32(mean_scale(matrix)),
        group=group,
        root_uv=read_attribute(curves, "surface_uv_coordinate", "CURVE", 2),
        color=color,
        seed=_seeds(curves),
        unusable=unusable_curves(curves),
    )


def curves_as_drawn(curves: bpy.types.Curves) -> EvaluatedCurves | None:
    """Points on the curves, object space; None if all are Catmull-Rom curves, which pass through
    their own points."""
    kind = read_attribute(curves, "curve_type", "CURVE")
    if kind is None or not (kind != CurveType.CATMULL_ROM).any():
        return None
    points, offsets = curve_points(curves), curve_offsets(curves)
    found = {
        name: read_attribute(curves, name, domain, width)
        for name, domain, width in SHAPE_ATTRIBUTES
    }

    def of_curves(name: str, default: int) -> Ints:
        values = found[name]
        return np.full(len(kind), default, np.int32) if values is None else values

    left, right, weight = (found[n] for n in ("handle_left", "handle_right", "nurbs_weight"))
    shapes = CurveShapes(
        kind,
        # Blender's defaults where there is no attribute
        of_curves("resolution", 12),
        of_curves("nurbs_order", 4),
        of_curves("knots_mode", KnotMode.NORMAL),
        np.ones(len(points), np.float32) if weight is None else weight,
        points if left is None else left,
        points if right is None else right,
    )
    return evaluate_curves(points, offsets, shapes)


def unusable_curves(curves: bpy.types.Curves) -> dict[str, Bools]:
    """Curves that are not hair, or cannot be read: reason -> mask (curve_count,)."""
    masks = {}
    cyclic = read_attribute(curves, "cyclic", "CURVE")
    if cyclic is not None and cyclic.any():
        masks["no end (Toggle Cyclic opens them)"] = cyclic
    kind, knots = (read_attribute(curves, name, "CURVE") for name in ("curve_type", "knots_mode"))
    if kind is not None and knots is not None:
        is_custom = (kind == CurveType.NURBS) & (knots == KnotMode.CUSTOM)
        if is_custom.any():
            masks["knots of their own (set another Knot Mode)"] = is_custom
    return masks


def write_original_curves(
    obj: bpy.types.Object, cleaned: Cleaned, points: Floats, depsgraph: bpy.types.Depsgraph
) -> None:
    """Move the curves that `read_original_curves` returned; those that it dropped stay.

    Args:
        points: (point_count, 3) [m] world space, of the strands of `cleaned`.
    """
    curves = obj.data
    offsets, moved_points = curve_offsets(curves), curve_points(curves)
    to_object = np.linalg.inv(np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64))
    kept_points = rows_of_pieces(cleaned.curve_indices, offsets)
    moved_points[kept_points] = transform_points(points, to_object)
    move_curves(curves, moved_points)


def move_curves(curves: bpy.types.Curves, points: Floats) -> None:
    """`set_points` that moves the handles of Bezier curves too; each is scaled as the piece of the
    curve on its side is."""
    before = curve_points(curves)
    for name, side in (("handle_left", 1), ("handle_right", -1)):
        handles = read_attribute(curves, name, "POINT", 3)
        if handles is None:
            continue
        # the outer handles of a curve have no effect, so rolling past its ends does no harm
        was, now = (np.linalg.norm(p - np.roll(p, side, axis=0), axis=1) for p in (before, points))
        scale = np.divide(now, was, out=np.ones_like(was), where=was > 0.0)
        set_attribute(curves, name, "POINT", points + scale[:, None] * (handles - before))
    set_points(curves, points)


def set_points(curves: bpy.types.Curves, points: Floats) -> None:
    """Move all points, (point_count, 3) [m] object space, and nothing else of the curves.

    Written as an attribute: after writing to `position_data`, Blender keeps its cached curves, and
    nodes that evaluate curves would find the old shape.
    """
    places = curves.attributes["position"].data
    places.foreach_set("vector", np.ascontiguousarray(points, np.float32).ravel())
    curves.update_tag()


def write_curves(
    name: str,
    strands: StrandSet,
    surface: bpy.types.Object | None,
    collection: bpy.types.Collection,
    *,
    are_widths_estimated: bool = False,
) -> bpy.types.Object:
    """A new hair curves object that holds these strands, attached to a surface if there is one.

    Args:
        strands: world space, which is also object space: the object is at the origin. Strands
            without widths get estimated ones.
        collection: where it goes; the scene's is used if this is linked or overridden.
        are_widths_estimated: whether they are estimates already; see `groom.widths.with_widths`.
    """
    curves = bpy.data.hair_curves.new(name)
    fill_curves(curves, strands)
    if are_widths_estimated:
        curves.hairloom.widths.method = "found"
    obj = bpy.data.objects.new(name, curves)
    link_into(obj, [collection], bpy.context.scene)
    if surface is not None:
        attach_to_surface(obj, surface)
    return obj


def fill_curves(curves: bpy.types.Curves, strands: StrandSet) -> None:
    """Write strands into empty hair curves; see `write_curves`."""
    if strands.strand_count:
        curves.add_curves(strands.point_counts.tolist())
        curves.position_data.foreach_set("vector", strands.points.ravel())
    if not strands.has_widths:
        strands, _ = with_widths(strands, "found")
        curves.hairloom.widths.method = "found"
    set_attribute(curves, "radius", "POINT", strands.radius)
    if strands.group.any():
        set_attribute(curves, GROUP_ATTRIBUTES[0], "CURVE", strands.group)
    if strands.root_uv is not None:
        set_attribute(curves, "surface_uv_coordinate", "CURVE", strands.root_uv)
    if strands.seed is not None:
        set_attribute(curves, SEED_ATTRIBUTE, "CURVE", strands.seed)
    set_colors(curves, strands)


def set_colors(curves: bpy.types.Curves, strands: StrandSet) -> None:
    """Write the strands' own colours, if they have any; -1 where a strand has none, since Blender
    cannot draw NaN."""
    if strands.color is not None:
        opaque = np.ones((strands.point_count, 4), np.float32)
        opaque[:, :3] = np.nan_to_num(strands.color, nan=-1.0)
        set_attribute(curves, COLOR_ATTRIBUTE, "POINT", opaque)


def attach_to_surface(obj: bpy.types.Object, surface: bpy.types.Object) -> None:
    """Set what Blender's own hair tools and nodes expect of hair on a surface."""
    obj.data.surface = surface
    if surface.data.uv_layers.active is not None:
        obj.data.surface_uv_map = surface.data.uv_layers.active.name
    surface.add_rest_position_attribute = True
    obj.parent = surface
    obj.matrix_parent_inverse = surface.matrix_world.inverted_safe()


def curve_points(curves: bpy.types.Curves) -> Floats:
    """(point_count, 3) float32, object space."""
    points = np.empty((len(curves.position_data), 3), np.float32)
    curves.position_data.foreach_get("vector", points.ravel())
    return points


def _colors(curves: bpy.types.Curves) -> Floats | None:
    """Scene-linear colours (point_count, 3), painted per point or per curve; None without any."""
    colors = read_attribute(curves, COLOR_ATTRIBUTE, "POINT", 4)
    if colors is None:
        of_curves = read_attribute(curves, COLOR_ATTRIBUTE, "CURVE", 4)
        if of_curves is None:
            return None
        colors = np.repeat(of_curves, np.diff(curve_offsets(curves)), axis=0)
    return np.ascontiguousarray(colors[:, :3])


def _seeds(curves: bpy.types.Curves) -> Ints | None:
    """Seeds (curve_count,), 0 for curves that Blender has added since; None without any."""
    seeds = read_attribute(curves, SEED_ATTRIBUTE, "CURVE")
    return seeds if seeds is not None and seeds.dtype.kind == "i" else None


def curve_offsets(curves: bpy.types.Curves) -> Ints:
    """(curve_count + 1,) int32; [0] where there are no curves."""
    offsets = np.zeros(len(curves.curves) + 1, np.int32)
    if len(curves.curves):  # without curves the array has length 1 but holds nothing
        curves.curve_offset_data.foreach_get("value", offsets)
    return offsets


def _is_not_none(values: Any) -> bool:
    return values is not None
