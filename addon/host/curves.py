"""Hair curves in and out of Blender: evaluated curves to a `StrandSet`, and back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet
from ..strands.clean import FARTHEST_POINT, SHORTEST_STRAND, Cleaned, clean

#: Attributes of the curve domain that hold a strand's group, the first that is there wins; Unreal
#: and USD know the first by this name.
GROUP_ATTRIBUTES = ("groom_group_id", "group")
#: a strand whose ends are this far apart is long enough for `clean`, whose measure is per axis
_SHORTEST_SQUARED = 3.0 * SHORTEST_STRAND**2
_BLOCK = 8192  # points that are moved at once
_REMEDIES = {
    "CURVE": "Convert them: Object > Convert > Curves (hair)",
    "MESH": "Select hair curves; particle hair converts by Object > Convert > Curves (hair)",
}


def read_curves(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Cleaned:
    """The hair that Blender shows after all modifiers, in world space; unusable curves dropped.

    100,000 curves of 16 points take a few milliseconds: whole attributes are copied at once.

    Raises:
        HairloomError: the object holds no hair curves.
    """
    if obj.type != "CURVES":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, not hair curves",
            place=obj.name,
            remedy=_REMEDIES.get(obj.type, "Select hair curves (Add > Curve > Empty Hair)"),
        )
    evaluated = obj.evaluated_get(depsgraph)
    curves = evaluated.data
    matrix = np.array(evaluated.matrix_world)
    radius = _attribute(curves, "radius", "POINT")
    group = next(
        filter(_is_there, (_attribute(curves, n, "CURVE") for n in GROUP_ATTRIBUTES)), None
    )
    return _cleaned(
        _in_world(_positions(curves), matrix),
        _offsets(curves),
        radius=None if radius is None else radius * np.float32(_scale(matrix)),
        group=group,
        root_uv=_attribute(curves, "surface_uv_coordinate", "CURVE"),
    )


def write_curves(
    name: str,
    strands: StrandSet,
    surface: bpy.types.Object | None,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """A new hair curves object that holds these strands, attached to a surface if there is one.

    Args:
        strands: world space; the object stands at the origin, so it is object space as well.
    """
    curves = bpy.data.hair_curves.new(name)
    if strands.strand_count:
        curves.add_curves(strands.point_counts.tolist())
        curves.position_data.foreach_set("vector", strands.points.ravel())
    _set_attribute(curves, "radius", "FLOAT", "POINT", strands.radius)
    if strands.group.any():
        _set_attribute(curves, GROUP_ATTRIBUTES[0], "INT", "CURVE", strands.group)
    if strands.root_uv is not None:
        _set_attribute(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", strands.root_uv)
    obj = bpy.data.objects.new(name, curves)
    collection.objects.link(obj)
    if surface is not None:
        _attach(obj, surface)
    return obj


def _attach(obj: bpy.types.Object, surface: bpy.types.Object) -> None:
    """What Blender's own hair tools and nodes expect of hair on a surface."""
    obj.data.surface = surface
    if surface.data.uv_layers.active is not None:
        obj.data.surface_uv_map = surface.data.uv_layers.active.name
    surface.add_rest_position_attribute = True
    obj.parent = surface
    obj.matrix_parent_inverse = surface.matrix_world.inverted_safe()


def _positions(curves: bpy.types.Curves) -> Floats:
    """(point_count, 3) float32, object space."""
    points = np.empty((len(curves.position_data), 3), np.float32)
    curves.position_data.foreach_get("vector", points.ravel())
    return points


def _offsets(curves: bpy.types.Curves) -> Ints:
    """(curve_count + 1,) int32; [0] where there are no curves."""
    offsets = np.zeros(len(curves.curves) + 1, np.int32)
    if len(curves.curves):  # without curves the array has length 1 and yet holds nothing
        curves.curve_offset_data.foreach_get("value", offsets)
    return offsets


#: data type of an attribute -> (name of the value, width, dtype)
_LAYOUTS: dict[str, tuple[str, int, Any]] = {
    "FLOAT": ("value", 1, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
}


def _attribute(curves: bpy.types.Curves, name: str, domain: str) -> Any:
    """The values of an attribute, (count,) or (count, 2); None where it is absent or another's."""
    attribute = curves.attributes.get(name)
    if attribute is None or attribute.domain != domain or attribute.data_type not in _LAYOUTS:
        return None
    value, width, dtype = _LAYOUTS[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(value, values)
    return values if width == 1 else values.reshape(-1, width)


def _set_attribute(
    curves: bpy.types.Curves, name: str, data_type: str, domain: str, values: Floats | Ints
) -> None:
    attribute = curves.attributes.new(name, data_type, domain)
    if len(values):
        attribute.data.foreach_set(_LAYOUTS[data_type][0], values.ravel())


def _is_there(values: Any) -> bool:
    return values is not None


def _scale(matrix: Floats) -> float:
    """How much longer things get on average: cube root of the volume change."""
    return float(abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0))


def _in_world(points: Floats, matrix: Floats) -> Floats:
    """Moved by an affine (4, 4) matrix, in blocks that stay in the cache.

    Not by `@`: BLAS spreads so thin a product over threads that wait for each other, and takes
    anything from 2 to 300 ms for 1.6 million points on a busy machine; this takes 13.
    """
    if np.array_equal(matrix, np.eye(4)):
        return points
    rows = matrix.astype(np.float32)
    moved = np.empty_like(points)
    with np.errstate(invalid="ignore", over="ignore"):  # a point that is NaN is dropped later
        for begin in range(0, len(points), _BLOCK):
            x, y, z = np.ascontiguousarray(points[begin : begin + _BLOCK].T)
            for axis in range(3):
                along = x * rows[axis, 0]
                along += y * rows[axis, 1]
                along += z * rows[axis, 2]
                moved[begin : begin + _BLOCK, axis] = along + rows[axis, 3]
    return moved


def _cleaned(
    points: Floats,
    offsets: Ints,
    *,
    radius: Floats | None,
    group: Ints | None,
    root_uv: Floats | None,
) -> Cleaned:
    """`clean`, but sound curves with a radius, which are the rule, pass without a copy."""
    if radius is None or not _are_sound(points, offsets, radius, root_uv):
        return clean(points, offsets, radius=radius, group=group, root_uv=root_uv)
    count = len(offsets) - 1
    group = np.zeros(count, np.int32) if group is None else group
    return Cleaned(StrandSet(points, offsets, radius, group, root_uv), {}, np.arange(count))


def _are_sound(points: Floats, offsets: Ints, radius: Floats, root_uv: Floats | None) -> bool:
    """Whether `clean` would certainly drop and replace nothing; False may be a false alarm."""
    if len(offsets) < 2 or np.diff(offsets).min() < 2:
        return False
    # a sum of squares is finite, or below a limit, only if every one of them is
    if not np.vdot(points, points) < FARTHEST_POINT**2 or radius.min() <= 0.0:
        return False
    others = [radius] if root_uv is None else [radius, root_uv]
    if not all(np.isfinite(np.vdot(each, each)) for each in others):
        return False
    reach = points[offsets[1:] - 1] - points[offsets[:-1]]
    return bool((np.einsum("ij,ij->i", reach, reach) >= _SHORTEST_SQUARED).all())
