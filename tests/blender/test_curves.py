"""Hair curves in and out of Blender."""

import math
from itertools import pairwise

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from node_modifiers import add_nodes_modifier

from hairloom.addon.blender.base.attributes import set_attribute
from hairloom.addon.blender.scene.curves import (
    read_curves,
    read_original_curves,
    unusable_curves,
    write_curves,
    write_original_curves,
)
from hairloom.addon.blender.scene.curves_motion import store_motion
from hairloom.addon.errors import HairloomError
from hairloom.addon.refine.smooth import points_at
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.clean import clean

pytestmark = pytest.mark.portable


def ragged(seed=0, counts=(2, 5, 16, 3)):
    rng = np.random.default_rng(seed)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return StrandSet(
        points=rng.normal(size=(offsets[-1], 3)),
        offsets=offsets,
        radius=rng.uniform(1e-5, 1e-3, offsets[-1]),
        group=np.arange(len(counts)) % 3,
        root_uv=rng.random((len(counts), 2)),
    )


def written(strands, surface=None):
    return write_curves("Hair", strands, surface, bpy.context.collection)


def raw_curves(points, counts):
    """A Curves object from any numbers, even those that StrandSet refuses."""
    curves = bpy.data.hair_curves.new("Raw")
    curves.add_curves(list(counts))
    curves.position_data.foreach_set("vector", np.asarray(points, np.float32).ravel())
    obj = bpy.data.objects.new("Raw", curves)
    bpy.context.collection.objects.link(obj)
    return obj


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("points", "offsets", "radius", "group", "root_uv")
    )


def test_what_is_written_is_read_back_bit_for_bit(get_depsgraph):
    strands = ragged()
    read = read_curves(written(strands), get_depsgraph())
    assert same(read.strands, strands)
    assert read.dropped == {}


def test_world_space_follows_a_turned_scaled_and_mirrored_object(get_depsgraph):
    strands = ragged()
    obj = written(strands)
    matrix = Matrix.LocRotScale((1, 2, 3), Euler((0.3, 0.7, -1.1)), (2.0, 3.0, -0.5))
    obj.matrix_world = matrix
    read = read_curves(obj, get_depsgraph()).strands
    expected = [matrix @ obj.data.points[i].position for i in range(strands.point_count)]
    assert read.points == pytest.approx(np.array(expected), abs=1e-5)
    assert read.radius == pytest.approx(strands.radius * math.cbrt(3.0), rel=1e-5)


def test_more_points_than_one_block_are_transformed(get_depsgraph):
    strands = ragged(counts=(4,) * 5000)
    obj = written(strands)
    obj.matrix_world = Matrix.Translation((10.0, 0.0, 0.0))
    read = read_curves(obj, get_depsgraph()).strands
    assert read.points == pytest.approx(strands.points + np.array([10.0, 0.0, 0.0]), abs=2e-6)


def test_modifiers_are_applied(get_depsgraph):
    strands = ragged(counts=(16, 16))
    obj = written(strands)
    add_nodes_modifier(
        obj,
        ("GeometryNodeSetPosition", {"Offset": (0.0, 0.0, 1.0)}),
        ("GeometryNodeResampleCurve", {"Count": 5}),
    )
    assert len(obj.evaluated_get(get_depsgraph()).data.points) == 10
    read = read_curves(obj, get_depsgraph()).strands
    assert read.roots == pytest.approx(strands.roots + np.array([0.0, 0.0, 1.0]), abs=1e-6)


@pytest.mark.parametrize("name", ["groom_group_id", "group"])
def test_groups_are_known_by_two_names(name, get_depsgraph):
    obj = written(ragged())
    if "groom_group_id" in obj.data.attributes:
        obj.data.attributes.remove(obj.data.attributes["groom_group_id"])
    obj.data.attributes.new(name, "INT", "CURVE").data.foreach_set("value", [7, 7, 8, 9])
    assert read_curves(obj, get_depsgraph()).strands.group.tolist() == [7, 7, 8, 9]


def test_a_group_attribute_of_another_kind_is_no_group(get_depsgraph):
    obj = written(ragged(counts=(3,)))
    obj.data.attributes.new("group", "FLOAT_COLOR", "CURVE")
    assert read_curves(obj, get_depsgraph()).strands.group.tolist() == [0]


def test_unusable_curves_are_dropped_and_counted(get_depsgraph):
    nan, inf = float("nan"), float("inf")
    curves = [
        [(0, 0, 0), (0, 0, 1)],
        [(0, 0, 0)],
        [(0, 0, 0), (nan, 0, 1)],
        [(0, 0, 0), (0, inf, 1), (0, 0, 2)],
        [(1, 1, 1), (1, 1, 1), (1, 1, 1)],
        [(5, 0, 0), (5, 0, 1), (5, 0, 2)],
    ]
    obj = raw_curves([p for curve in curves for p in curve], [len(curve) for curve in curves])
    obj.location.x = 100.0
    read = read_curves(obj, get_depsgraph())
    assert read.dropped == {
        "fewer than two points": 1,
        "a point that is not finite": 2,
        "no length": 1,
    }
    assert read.curve_indices.tolist() == [0, 5]
    assert read.strands.roots.tolist() == [[100, 0, 0], [105, 0, 0]]


def test_the_fast_path_for_valid_curves_equals_cleaning(get_depsgraph):
    strands = ragged(counts=(2, 3, 16))
    read = read_curves(written(strands), get_depsgraph())
    cleaned = clean(
        strands.points,
        strands.offsets,
        radius=strands.radius,
        group=strands.group,
        root_uv=strands.root_uv,
    )
    assert same(read.strands, cleaned.strands)
    assert read.curve_indices.tolist() == cleaned.curve_indices.tolist()


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_a_bad_radius_is_replaced(bad, get_depsgraph):
    strands = ragged(counts=(3, 3))
    obj = written(strands)
    obj.data.attributes["radius"].data[4].value = bad
    radius = read_curves(obj, get_depsgraph()).strands.radius
    assert np.isfinite(radius).all() and (radius > 0.0).all()
    assert radius[:4] == pytest.approx(strands.radius[:4])


def test_no_curves_give_an_empty_set(get_depsgraph):
    empty = bpy.data.objects.new("Empty", bpy.data.hair_curves.new("Empty"))
    bpy.context.collection.objects.link(empty)
    assert read_curves(empty, get_depsgraph()).strands.strand_count == 0


def test_an_empty_set_can_be_written(get_depsgraph):
    obj = written(ragged().take(np.array([], int)))
    assert read_curves(obj, get_depsgraph()).strands.strand_count == 0


def test_other_objects_are_refused_with_a_remedy(get_depsgraph, sphere):
    legacy = bpy.data.objects.new("Legacy", bpy.data.curves.new("Legacy", "CURVE"))
    bpy.context.collection.objects.link(legacy)
    for obj, words in ((legacy, "Convert"), (sphere, "particle hair")):
        with pytest.raises(HairloomError, match=words) as raised:
            read_curves(obj, get_depsgraph())
        assert raised.value.place == obj.name


def test_written_on_a_moved_head_strands_stay_where_they_are(get_depsgraph, sphere):
    sphere.matrix_world = Matrix.LocRotScale((1, 2, 3), Euler((0.3, 0.7, -1.1)), (2, 2, 2))
    bpy.context.view_layer.update()
    strands = ragged()
    obj = written(strands, sphere)
    assert read_curves(obj, get_depsgraph()).strands.points == pytest.approx(
        strands.points, abs=2e-6
    )
    assert (obj.data.surface, obj.parent) == (sphere, sphere)
    assert obj.data.surface_uv_map == sphere.data.uv_layers.active.name
    sphere.location.x += 1.0
    moved = read_curves(obj, get_depsgraph()).strands.points
    assert moved == pytest.approx(strands.points + np.array([1.0, 0.0, 0.0]), abs=2e-6)


def test_blenders_own_surface_node_accepts_the_attachment(get_depsgraph, sphere):
    """Blender's Deform Curves on Surface moves strands with the mesh and finds no invalid UV."""
    from hairloom.addon.blender.scene.surfaces import read_surface
    from hairloom.addon.groom.roots import bind_roots

    surface = read_surface(sphere, get_depsgraph(), need_uv=True, place="head")
    corners = surface.corners.mean(axis=1)[30:60]
    points = np.stack([corners, corners * 1.5], axis=1).reshape(-1, 3)
    loose = StrandSet(points, np.arange(31) * 2, np.full(60, 1e-4), np.zeros(30))
    obj = written(bind_roots(loose, surface, place="hair").strands, sphere)
    add_nodes_modifier(obj, ("GeometryNodeDeformCurvesOnSurface", {}))
    sphere.shape_key_add(name="Basis")
    raised = sphere.shape_key_add(name="Raised")
    for point in raised.points:
        point.co.z += 0.25
    raised.value = 1.0
    moved = read_curves(obj, get_depsgraph()).strands.points
    assert obj.modifiers[0].node_warnings[:] == []
    assert moved == pytest.approx(points + np.array([0.0, 0.0, 0.25]), abs=1e-4)


def test_imported_motion_goes_straight_from_frame_to_frame_on_both_sides_of_0(
    new_hair, get_depsgraph
):
    hair = new_hair()
    rest = read_curves(hair, get_depsgraph()).strands.points
    positions = [rest + np.float32([10.0 + frame, 0.0, 0.0]) for frame in range(-2, 3)]
    store_motion(hair, -2, np.array(positions, np.float32))
    for time in (-3.0, -1.5, -0.75, -0.25, 0.25, 1.5, 2.5):
        frame = int(np.floor(time))
        bpy.context.scene.frame_set(frame, subframe=time - frame)
        read = read_curves(hair, get_depsgraph()).strands
        expected = rest + [10.0 + np.clip(time, -2.0, 2.0), 0.0, 0.0]
        np.testing.assert_allclose(read.points, expected, atol=2e-6, err_msg=f"{time}")


ZIGZAG = 0.05 * np.array([[0, 0, 0], [1, 0, 1], [0, 0.2, 2], [1, 0, 3], [0, 0, 4], [1, 0.5, 5]])


def typed(kind, points=ZIGZAG, **attributes):
    """Two curves of this type; the second is straight up. Radii grow to the tip."""
    straight = np.linspace(0.0, 0.4, len(points))[:, None] * [0, 0, 1] + [1.0, 0, 0]
    obj = raw_curves(np.concatenate([points, straight]), (len(points),) * 2)
    curves = obj.data
    curves.set_types(type=kind)
    set_attribute(curves, "radius", "POINT", np.tile(np.linspace(1e-3, 2e-3, len(points)), 2))
    for name, values in attributes.items():
        domain = "CURVE" if len(values) == 2 else "POINT"
        if name in ("nurbs_order", "knots_mode"):
            attribute = curves.attributes.new(name, "INT8", domain)
            attribute.data.foreach_set("value", np.asarray(values, np.int32))
        else:
            set_attribute(curves, name, domain, np.asarray(values))
    return obj


HANDLES = {
    name: np.concatenate([ZIGZAG, ZIGZAG + [1.0, 0, 0]]) + side * np.array([0.015, 0.01, 0.01])
    for name, side in (("handle_left", -1.0), ("handle_right", 1.0))
}
WEIGHTS = np.tile(np.float32([1.0, 3.0, 1.0, 0.5, 1.0, 1.0]), 2)


@pytest.mark.parametrize(
    ("kind", "attributes"),
    [
        ("POLY", {}),
        ("BEZIER", HANDLES),
        ("BEZIER", {**HANDLES, "resolution": np.int32([24, 24])}),
        ("NURBS", {}),
        ("NURBS", {"nurbs_order": [3, 3], "nurbs_weight": WEIGHTS}),
        ("NURBS", {"nurbs_order": [6, 6], "knots_mode": [1, 1]}),
        ("NURBS", {"nurbs_order": [4, 2], "knots_mode": [1, 1], "nurbs_weight": WEIGHTS}),
        ("NURBS", {"nurbs_order": [4, 4], "knots_mode": [2, 2]}),
        ("NURBS", {"nurbs_order": [3, 3], "knots_mode": [3, 2]}),
        ("NURBS", {"nurbs_order": [7, 7]}),
    ],
)
def test_curves_of_every_type_are_where_blender_draws_them(kind, attributes, get_depsgraph):
    """Within 1 to 2 mm, curves of 35 cm agree with Blender's own conversion to a mesh."""
    obj = typed(kind, **attributes)
    read = read_curves(obj, get_depsgraph())
    assert read.dropped == {}
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.convert(target="MESH")
    mesh = bpy.context.object.data
    vertex = np.array([each.co for each in mesh.vertices])
    for number, strand in enumerate(read.strands.iter_strands()):
        drawn = smoothed(strand)
        own = vertex[vertex[:, 0] > 0.7] if number else vertex[vertex[:, 0] <= 0.7]
        count = max(1600 // len(own), 8)
        line = np.concatenate([np.linspace(a, b, count) for a, b in pairwise(own)])
        away = np.linalg.norm(drawn[:, None] - line[None], axis=2)
        assert away.min(axis=1).max() < 1e-3, "nothing is drawn beside the curve"
        assert away.min(axis=0).max() < 2e-3, "and all of it is drawn"
        np.testing.assert_allclose(strand[[0, -1]], own[[0, -1]], atol=1e-5)
    radius = read.strands.radius.reshape(2, -1)[0] if read.strands.is_uniform else None
    if radius is not None:
        assert (np.diff(radius) >= 0.0).all() and 1e-3 <= radius[0] < radius[-1] <= 2e-3


def smoothed(strand):
    """Points along the curve that is drawn for a strand (count, 3)."""
    count = max(1600 // (len(strand) - 1), 8)
    u = np.tile(np.linspace(0.0, 1.0, count), len(strand) - 1)
    segment = np.repeat(np.arange(len(strand) - 1), count)
    return points_at(strand[None], np.zeros(len(u), int), segment, u)


def test_curves_that_are_no_hair_are_named(get_depsgraph):
    closed = typed("BEZIER", cyclic=np.array([True, False]), **HANDLES)
    assert read_curves(closed, get_depsgraph()).dropped == {"no end (Toggle Cyclic opens them)": 1}
    own = read_original_curves(closed, get_depsgraph())
    assert own.curve_indices.tolist() == [1] and own.strands.point_count == 6


def test_custom_knots_are_named(extension):
    """The curves are not evaluated: Blender crashes if custom knots are missing."""
    curves = bpy.data.hair_curves.new("NURBS")
    curves.add_curves([6, 6])
    curves.set_types(type="NURBS")
    knots = curves.attributes.new("knots_mode", "INT8", "CURVE")
    knots.data.foreach_set("value", [4, 0])
    ((reason, which),) = unusable_curves(curves).items()
    assert reason.startswith("knots of their own") and which.tolist() == [True, False]
    curves.set_types(type="POLY")
    assert unusable_curves(curves) == {}


def test_curves_of_several_types_keep_their_order_and_points(get_depsgraph):
    """Catmull-Rom curves among other types are unchanged bit for bit."""
    obj = typed("CATMULL_ROM")
    obj.data.set_types(type="NURBS", indices=[1])
    read = read_curves(obj, get_depsgraph()).strands
    counts = read.point_counts.tolist()
    assert counts[0] == 6 and counts[1] > 6
    np.testing.assert_array_equal(read.points[:6], ZIGZAG.astype(np.float32))


def test_handles_follow_combed_points(get_depsgraph):
    """Combing, settling and trimming move points; handles follow, so curves keep their shape."""
    obj = typed("BEZIER", **HANDLES)
    before = read_curves(obj, get_depsgraph()).strands.points.copy()
    own = read_original_curves(obj, get_depsgraph())
    write_original_curves(obj, own, own.strands.points + np.float32([0, 0.2, 0]), get_depsgraph())
    after = read_curves(obj, get_depsgraph()).strands.points
    np.testing.assert_allclose(after, before + [0, 0.2, 0], atol=1e-6)
