"""Hair is trimmed to meshes and Empties, trimmed again, and restored."""

from itertools import pairwise

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.scene.curves import curve_points
from hairloom.addon.blender.scene.trim_shapes import trim_shapes_of

RADIUS, LENGTH = 0.1, 0.08


@pytest.fixture
def hair(new_hair, sphere):
    return new_hair(sphere)


def empty(z, name="Plane"):
    obj = bpy.data.objects.new(name, None)
    bpy.context.collection.objects.link(obj)
    obj.location.z = z
    bpy.context.view_layer.update()
    return obj


def ball(radius, **values):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=radius, subdivisions=5, **values)
    obj = bpy.context.object
    obj.select_set(False)
    bpy.context.view_layer.update()
    return obj


def trim(hair, *shapes):
    for obj in (*shapes, hair):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.hairloom.trim_to_shape() == {"FINISHED"}
    for obj in shapes:
        obj.select_set(False)


def tips(hair):
    return curve_points(hair.data).reshape(-1, 8, 3)[:, -1]


def test_hair_ends_on_a_ball_around_the_head(hair):
    before = curve_points(hair.data)
    radius = np.array(hair.data.attributes["radius"].data.values()[0].value)
    trim(hair, ball(0.15))
    after = curve_points(hair.data).reshape(-1, 8, 3)
    reach = np.linalg.norm(after[:, -1], axis=1)
    assert reach.max() < 0.15 + 1e-6
    assert reach.min() > 0.15 * 0.99  # the ball has facets
    assert (after[:, 0] == before.reshape(-1, 8, 3)[:, 0]).all()
    ways = np.cross(after[:, -1], before.reshape(-1, 8, 3)[:, -1])
    assert np.abs(ways).max() < 1e-7
    assert hair.data.attributes["radius"].data[0].value == pytest.approx(float(radius))


def test_hair_passes_no_plane_and_follows_it_again_when_it_moves(hair):
    before = curve_points(hair.data)
    plane = empty(-0.12)
    trim(hair, plane)
    assert [obj.name for obj in trim_shapes_of(hair)] == ["Plane"]
    crossed = before.reshape(-1, 8, 3)[:, -1, 2] < -0.12
    assert crossed.any()
    assert np.abs(tips(hair)[crossed, 2] + 0.12).max() < 1e-7
    assert (tips(hair)[~crossed] == before.reshape(-1, 8, 3)[~crossed, -1]).all()
    plane.location.z = -0.15
    bpy.context.view_layer.update()
    trim(hair)
    assert tips(hair)[:, 2].min() == pytest.approx(-0.15, abs=1e-7)
    assert bpy.ops.hairloom.revert_trim() == {"FINISHED"}
    assert np.array_equal(curve_points(hair.data), before)
    assert not bpy.ops.hairloom.revert_trim.poll()


def bezier_hair(sphere):
    """Legacy Bézier curves that rise from the sphere, the last one low, as hair curves."""
    data = bpy.data.curves.new("Bezier", "CURVE")
    data.dimensions = "3D"
    for height in (0.02, 0.02, 0.001):
        spline = data.splines.new("BEZIER")
        spline.bezier_points.add(2)
        for number, point in enumerate(spline.bezier_points):
            point.co = (0.1 + 0.03 * number, 0.01 * len(data.splines), height * number**2)
            point.handle_left_type = point.handle_right_type = "AUTO"
    obj = bpy.data.objects.new("Bezier", data)
    bpy.context.collection.objects.link(obj)
    for each in bpy.context.selected_objects:
        each.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.convert(target="CURVES")
    bpy.context.object.data.surface = sphere
    return bpy.context.object


def drawn(hair):
    """The points of the curves as Blender draws them."""
    tree = bpy.data.node_groups.new("Drawn", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    kinds = "NodeGroupInput", "GeometryNodeCurveToPoints", "GeometryNodePointsToVertices"
    nodes = [tree.nodes.new(kind) for kind in (*kinds, "NodeGroupOutput")]
    nodes[1].mode = "EVALUATED"
    for one, following in pairwise(nodes):
        tree.links.new(one.outputs[0], following.inputs[0])
    modifier = hair.modifiers.new("Drawn", "NODES")
    modifier.node_group = tree
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    geometry = evaluated.evaluated_geometry()
    places = np.array([vertex.co[:] for vertex in geometry.mesh.vertices])
    hair.modifiers.remove(modifier)
    return places


def test_nodes_find_curves_where_they_have_been_trimmed_to(hair):
    """Even if nodes have evaluated them before, and Blender has cached the result."""
    before = drawn(hair)[:, 2].max()
    shape = empty(0.12)
    trim(hair, shape)
    assert before > 0.15 and drawn(hair)[:, 2].max() < 0.12 + 1e-6
    assert bpy.ops.hairloom.revert_trim() == {"FINISHED"}
    assert drawn(hair)[:, 2].max() == pytest.approx(before, abs=1e-7)


def test_bezier_curves_are_drawn_where_they_have_been_trimmed_to(extension, sphere):
    """Handles must not keep their old places or lengths."""
    hair = bezier_hair(sphere)
    before = drawn(hair)
    assert before[:, 2].max() > 0.07
    trim(hair, empty(0.01))
    after = drawn(hair)
    assert after[:, 2].max() < 0.0101
    assert np.array_equal(after[after[:, 1] > 0.025], before[before[:, 1] > 0.025]), "it was low"
    assert bpy.ops.hairloom.revert_trim() == {"FINISHED"}
    assert drawn(hair) == pytest.approx(before, abs=1e-6)


def test_the_report_counts_what_is_trimmed_left_and_outside(hair, tmp_path, capsys):
    name = hair.name
    shape = ball(0.15, location=(0.0, 0.0, 0.1))
    ends = curve_points(hair.data).reshape(-1, 8, 3)[:, [0, -1]]
    inside = np.linalg.norm(ends - [0.0, 0.0, 0.1], axis=2) < 0.15
    scene, output = (str(tmp_path / f"{each}.blend") for each in "ab")
    bpy.ops.wm.save_as_mainfile(filepath=scene)
    run = ["run", "trim_to_shape", "--scene", scene, "--object", shape.name, "--object", name]
    assert command_line.run([*run, "--output", output]) == 0
    count, out = int((inside[:, 0] & ~inside[:, 1]).sum()), int((~inside[:, 0]).sum())
    message = f"{name}: {count} curves trimmed, {60 - count} left unchanged, "
    message += f"{out} of them with roots"
    assert message in capsys.readouterr().out
    assert 0 < count < 60 - out


def test_undo_and_a_shape_that_is_removed(hair):
    name, before = hair.name, curve_points(hair.data)
    bpy.ops.ed.undo_push(message="before")
    trim(hair, empty(-0.12))
    bpy.ops.ed.undo_push(message="trimmed")
    bpy.ops.ed.undo()
    hair = bpy.data.objects[name]
    assert np.array_equal(curve_points(hair.data), before)
    assert not trim_shapes_of(hair)
    trim(hair, empty(-0.12, "Again"))
    assert bpy.ops.hairloom.remove_trim_shape(shape="Again") == {"FINISHED"}
    assert "Again" in bpy.context.scene.objects
    assert not bpy.ops.hairloom.trim_to_shape.poll()


@pytest.mark.parametrize("wrong", ["open", "no size", "no faces"])
def test_objects_that_cannot_cut_are_refused(hair, wrong):
    before = curve_points(hair.data)
    if wrong == "no size":
        shape = empty(0.0)
        shape.scale = (0.0, 0.0, 0.0)
    elif wrong == "open":
        bpy.ops.mesh.primitive_cylinder_add(radius=0.15, end_fill_type="NOTHING")
        shape = bpy.context.object
    else:
        shape = bpy.data.objects.new("Nothing", bpy.data.meshes.new("Nothing"))
        bpy.context.collection.objects.link(shape)
    bpy.context.view_layer.update()
    message = {"open": "neither closed nor flat", "no size": "no size", "no faces": "no faces"}
    shape.select_set(True)
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    with pytest.raises(RuntimeError, match=message[wrong]):
        bpy.ops.hairloom.trim_to_shape()
    assert np.array_equal(curve_points(hair.data), before)
    assert not trim_shapes_of(hair)


def test_the_head_beside_its_hair_is_no_shape(hair, sphere):
    sphere.select_set(True)
    assert not bpy.ops.hairloom.trim_to_shape.poll()
