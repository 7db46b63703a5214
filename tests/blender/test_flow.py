"""Strokes in a scene: drawn, combed along, edited and combed along again, and removed."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.scene.curves import curve_points
from hairloom.addon.blender.scene.strokes import strokes_of

RADIUS = 0.1


@pytest.fixture
def hair(new_hair, sphere):
    return new_hair(sphere)


def ring(name="Stroke", radius=RADIUS, backwards=False):
    """A curve around the sphere's equator, counterclockwise seen from above."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    angle = np.linspace(0.0, 1.98 * np.pi, 120)[:: -1 if backwards else 1]
    spline.points.add(len(angle) - 1)
    for point, a in zip(spline.points, angle, strict=True):
        point.co = (radius * np.cos(a), radius * np.sin(a), 0.0, 1.0)
    stroke = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(stroke)
    bpy.context.view_layer.update()
    return stroke


def add(*strokes):
    for stroke in strokes:
        stroke.select_set(True)
    assert bpy.ops.hairloom.add_stroke() == {"FINISHED"}
    for stroke in strokes:
        stroke.select_set(False)


def comb(**values):
    assert bpy.ops.hairloom.comb_flow(**values) == {"FINISHED"}


def around(hair):
    """The distance that each tip near the equator has moved around the sphere [m], and the
    distances of all points from its centre."""
    grid = curve_points(hair.data).reshape(-1, 8, 3)
    root, tip = grid[:, 0], grid[:, -1]
    near = np.abs(root[:, 2]) < 0.03
    side = np.cross([0.0, 0.0, 1.0], root)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return np.einsum("ij,ij->i", tip - root, side)[near], np.linalg.norm(grid, axis=2)


def test_hair_follows_a_stroke_and_stays_out_of_the_head(hair):
    add(ring())
    before = curve_points(hair.data).reshape(-1, 8, 3)
    comb(reach=0.6, falloff=0.2)
    gone, height = around(hair)
    after = curve_points(hair.data).reshape(-1, 8, 3)
    assert gone.min() > 0.05  # of 8 cm, around a ball of 10 cm
    assert height.min() > RADIUS * np.cos(np.pi / 24) ** 2
    assert (after[:, 0] == before[:, 0]).all()
    lengths = [
        np.linalg.norm(np.diff(each, axis=1), axis=2).sum(axis=1) for each in (before, after)
    ]
    assert np.abs(lengths[1] - lengths[0]).max() < 1e-5
    far = np.abs(before[:, 0, 2]) > 0.09
    assert far.any()
    assert (after[far] == before[far]).all()


def test_combed_again_it_begins_from_the_shape_before(hair):
    stroke = ring()
    add(stroke)
    before = curve_points(hair.data)
    comb(amount=0.5)
    half = curve_points(hair.data)
    comb(amount=0.5)
    assert np.array_equal(curve_points(hair.data), half)
    stroke.data.splines[0].points.foreach_set(
        "co", np.array([p.co[:] for p in stroke.data.splines[0].points])[::-1].ravel()
    )
    bpy.context.view_layer.update()
    comb(reach=0.6, falloff=0.2)
    assert around(hair)[0].max() < -0.05  # the other direction, not a mixture of both
    again = curve_points(hair.data)
    assert bpy.ops.hairloom.revert_flow() == {"FINISHED"}
    assert np.array_equal(curve_points(hair.data), before)
    assert not bpy.ops.hairloom.revert_flow.poll()
    comb(reach=0.6, falloff=0.2)
    assert np.array_equal(curve_points(hair.data), again)


def test_later_brush_strokes_are_not_lost(hair):
    add(ring())
    comb()
    brushed = curve_points(hair.data) * np.float32(1.01)
    hair.data.position_data.foreach_set("vector", brushed.ravel())
    comb(amount=0.0)
    assert np.abs(curve_points(hair.data) - brushed).max() < 1e-6
    bpy.ops.hairloom.revert_flow()
    assert np.array_equal(curve_points(hair.data), brushed)


def test_undo_takes_strokes_and_combing_back(hair):
    name, before = hair.name, curve_points(hair.data)
    stroke = ring()
    bpy.ops.ed.undo_push(message="drawn")
    add(stroke)
    comb()
    bpy.ops.ed.undo_push(message="combed")
    bpy.ops.ed.undo()
    hair = bpy.data.objects[name]
    assert np.array_equal(curve_points(hair.data), before)
    assert not strokes_of(hair)


@pytest.mark.parametrize("wrong", ["faces", "away", "empty"])
def test_objects_that_are_no_strokes_on_the_head_are_refused(hair, wrong):
    stroke = ring(radius=0.3 if wrong == "away" else RADIUS)
    if wrong == "faces":
        stroke.data.bevel_depth = 0.01
    elif wrong == "empty":
        stroke.data.splines.clear()
    stroke.select_set(True)
    message = {"faces": "has faces", "away": "away from Head", "empty": "no length"}[wrong]
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.hairloom.add_stroke()
    assert not strokes_of(hair)


def test_without_strokes_or_surface_it_says_what_to_do(hair):
    assert not bpy.ops.hairloom.comb_flow.poll()
    stroke = ring()
    add(stroke)
    stroke.data.splines.clear()
    before = curve_points(hair.data)
    bpy.context.view_layer.update()
    with pytest.raises(
        RuntimeError,
        match=r"it has no strokes: .*no length.*[^.]\. Draw a curve on the surface and",
    ):
        bpy.ops.hairloom.comb_flow()
    hair.data.surface = hair.parent = None
    with pytest.raises(RuntimeError, match="no surface"):
        bpy.ops.hairloom.comb_flow()
    assert np.array_equal(curve_points(hair.data), before)
    assert bpy.ops.hairloom.remove_stroke(stroke=stroke.name) == {"FINISHED"}
    assert stroke.name in bpy.context.scene.objects
    assert not strokes_of(hair)


def test_the_verbs_comb_a_file(hair, tmp_path):
    name, before = hair.name, curve_points(hair.data)
    stroke = ring()
    scene, added, combed = (str(tmp_path / f"{each}.blend") for each in ("a", "b", "c"))
    bpy.ops.wm.save_as_mainfile(filepath=scene)
    run = ["run", "add_stroke", "--scene", scene, "--object", stroke.name, "--object", name]
    assert command_line.run([*run, "--output", added]) == 0
    run = ["run", "comb_flow", "--scene", added, "--object", name, "--set", "reach=0.5"]
    assert command_line.run([*run, "--output", combed]) == 0
    bpy.ops.wm.open_mainfile(filepath=combed)
    hair = bpy.data.objects[name]
    assert [each.name for each in strokes_of(hair)] == ["Stroke"]
    assert not np.array_equal(curve_points(hair.data), before)
