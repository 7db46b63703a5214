"""Partings in a scene: drawn, read, followed by the preview, combed from, removed."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hairloom.addon.arrays import all_equal
from hairloom.addon.blender.bakes.groom_hashes import groom_rig_hash
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.engine import engine_hair
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.scene.curves import curve_points
from hairloom.addon.blender.scene.drawn_lines import new_line, pieces_of
from hairloom.addon.blender.scene.partings import parting_state, partings_of
from hairloom.addon.strands import StrandSet

RADIUS = 0.1


def cap(count=400, points=8, length=0.06):
    """Strands on the upper half of the sphere."""
    outward = np.random.default_rng(3).normal(size=(count, 3))
    outward[:, 2] = np.abs(outward[:, 2])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = RADIUS + np.linspace(0.0, length, points)
    return StrandSet(
        (outward[:, None] * along[:, None]).reshape(-1, 3),
        np.arange(count + 1) * points,
        np.full(count * points, 5e-5),
        np.zeros(count, np.int32),
    )


@pytest.fixture
def hair(new_hair, sphere):
    made = new_hair(sphere, cap())
    made.data.hairloom.children.method = "multi"
    made.data.hairloom.children.strand_count = 2000
    return made


def arch(x=0.0, kind="POLY", radius=RADIUS, collection=True):
    """A curve over the sphere from front to back at this x."""
    data = bpy.data.curves.new("Line", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    around = np.sqrt(radius**2 - x**2)
    angle = np.linspace(0.0, np.pi, 60)
    spline.points.add(len(angle) - 1)
    for point, a in zip(spline.points, angle, strict=True):
        point.co = (x, around * np.cos(a), around * np.sin(a), 1.0)
    line = bpy.data.objects.new("Line", data)
    bpy.context.collection.objects.link(line)
    bpy.context.view_layer.update()
    return line


def mixes_both_sides(session, x=0.0):
    """The number of children that blend guides from both sides of the plane at this x."""
    rig = session.rig
    root = rig.strands.roots[rig.guides]
    weights = rig.weights.weight[rig.own_count :] > 0.0
    right = root[rig.weights.guide[rig.own_count :], 0] > x
    return int(((right & weights).any(axis=1) & (~right & weights).any(axis=1)).sum())


def add(hair, *lines):
    for line in lines:
        line.select_set(True)
    assert bpy.ops.hairloom.add_parting() == {"FINISHED"}
    for line in lines:
        line.select_set(False)


def test_no_child_blends_both_sides_and_the_preview_follows(hair, get_depsgraph):
    session = previews.start(hair, get_depsgraph())
    assert mixes_both_sides(session) > 50
    line = arch()
    add(hair, line)
    assert session.has_changed_partings()
    session.read_again(get_depsgraph())
    assert mixes_both_sides(session) == 0
    before = session.rig
    line.location.x = 0.03  # now over x = 0.03, a little away from the sphere
    bpy.context.view_layer.update()
    assert session.has_changed_partings()
    session.read_again(get_depsgraph())
    assert session.rig is not before
    assert mixes_both_sides(session) > 20
    for point in line.data.splines[0].points:
        point.co.x = -0.03
    bpy.context.view_layer.update()
    session.read_again(get_depsgraph())
    assert mixes_both_sides(session) == 0
    assert bpy.ops.hairloom.remove_parting(line=line.name) == {"FINISHED"}
    assert line.name in bpy.context.scene.objects
    session.read_again(get_depsgraph())
    assert mixes_both_sides(session) > 50


def wire():
    """A mesh of three edges over the sphere."""
    mesh = bpy.data.meshes.new("Wire")
    corners = [(0.0, -0.1, 0.0), (0.0, -0.07, 0.07), (0.0, 0.0, 0.1), (0.0, 0.07, 0.07)]
    mesh.from_pydata(corners, [(0, 1), (1, 2), (2, 3)], [])
    line = bpy.data.objects.new("Wire", mesh)
    bpy.context.collection.objects.link(line)
    return line


@pytest.mark.parametrize("edit", ["cyclic", "edge", "parent"])
def test_changes_of_a_parting_are_noticed_and_motion_with_its_head_is_not(edit, hair, sphere):
    line = wire() if edit == "edge" else arch()
    handle, body = bpy.data.objects.new("Handle", None), bpy.data.objects.new("Body", None)
    for each in (handle, body):
        bpy.context.collection.objects.link(each)
    line.parent, handle.parent, sphere.parent = handle, body, body
    bpy.context.view_layer.update()
    add(hair, line)
    before = parting_state(hair)
    body.location.x += 0.5
    sphere.rotation_euler.z = 0.5
    assert all_equal(parting_state(hair), before)
    if edit == "cyclic":
        line.data.splines[0].use_cyclic_u = True
    elif edit == "edge":
        mesh = bmesh.new()
        mesh.from_mesh(line.data)
        mesh.edges.ensure_lookup_table()
        mesh.edges.remove(mesh.edges[2])
        mesh.to_mesh(line.data)
    else:
        handle.location.x = 0.01
    assert not all_equal(parting_state(hair), before)


@pytest.mark.slow
def test_a_head_that_turns_with_its_parting_builds_nothing_again(hair, sphere, get_depsgraph):
    line = arch()
    line.parent = sphere
    add(hair, line)
    session = previews.start(hair, get_depsgraph())
    rig = session.rig
    sphere.rotation_euler.z = 1.0
    bpy.context.view_layer.update()
    assert not session.has_changed_partings()
    session.read_again(get_depsgraph())
    assert session.rig is rig
    other = arch(0.02)
    other.parent = sphere
    add(hair, other)
    session.read_again(get_depsgraph())
    turned = np.array(sphere.matrix_world)[:3, :3]
    assert np.allclose(turned @ turned.T, np.eye(3), atol=1e-5)
    # added after the head has turned, it applies to the hair in that pose
    partings = session.source.partings
    assert np.abs(partings[-59:, :, 0] - 0.02).max() < 1e-5


@pytest.mark.slow
def test_without_a_selected_curve_a_line_is_drawn_on_the_head(extension, get_depsgraph):
    bpy.ops.hairloom.add_hairstyle(style="bob", plays=False)
    hair = bpy.context.object
    add(hair)
    (line,) = partings_of(hair)
    pieces = pieces_of(line, get_depsgraph())
    assert line.parent == hair.parent
    assert np.abs(pieces[..., 0]).max() < 0.005
    assert pieces[..., 1].min() < -0.03
    assert pieces[..., 1].max() > 0.03
    assert pieces[..., 2].min() > 0.03  # [m], above the middle of the skull
    assert bpy.ops.hairloom.comb_parting() == {"FINISHED"}


def test_comb_from_partings_turns_roots_and_keeps_lengths(hair):
    add(hair, arch())
    before = curve_points(hair.data).reshape(-1, 8, 3)
    assert bpy.ops.hairloom.comb_parting(amount=1.0, width=0.5, lift=0.2) == {"FINISHED"}
    after = curve_points(hair.data).reshape(-1, 8, 3)
    lengths = [np.linalg.norm(np.diff(each, axis=1), axis=2) for each in (before, after)]
    assert np.abs(lengths[1] - lengths[0]).max() < 1e-6
    assert (after[:, 0] == before[:, 0]).all()
    x = before[:, 0, 0]
    beside = (np.abs(x) < 0.012) & (np.abs(x) > 1e-3)
    moved = (after - before)[:, -1, 0] * np.sign(x)
    assert moved[beside].min() > 0.01
    assert np.abs(moved[np.abs(x) > 0.06]).max() == 0.0
    inscribed = RADIUS * np.cos(np.pi / 24) ** 2
    assert np.linalg.norm(after, axis=2).min() > inscribed


def test_undo_takes_parting_and_combing_back(hair):
    name = hair.name
    before = curve_points(hair.data)
    line = arch()
    bpy.ops.ed.undo_push(message="drawn")
    add(hair, line)
    bpy.ops.hairloom.comb_parting()
    bpy.ops.ed.undo_push(message="combed")
    bpy.ops.ed.undo()
    hair = bpy.data.objects[name]
    assert (curve_points(hair.data) == before).all()
    assert not partings_of(hair)


def test_a_bake_is_stale_once_a_parting_is_moved(hair, sphere):
    def hashed():
        bpy.context.view_layer.update()
        return groom_rig_hash(hair, sphere, GroomSettings.of(hair), bpy.context.scene)

    without, line = hashed(), arch()
    add(hair, line)
    drawn = hashed()
    sphere.rotation_euler.z = 0.3
    assert drawn == hashed() != without
    line.location.x = 0.01
    assert hashed() != drawn


@pytest.mark.parametrize("wrong", ["faces", "away", "empty"])
def test_objects_that_are_no_lines_on_the_head_are_refused(hair, wrong):
    line = arch(radius=0.3 if wrong == "away" else RADIUS)
    if wrong == "faces":
        line.data.bevel_depth = 0.01
    elif wrong == "empty":
        line.data.splines.clear()
    line.select_set(True)
    message = {"faces": "has faces", "away": "away from Head", "empty": "no length"}[wrong]
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.hairloom.add_parting()
    assert not partings_of(hair)


def test_a_parting_that_becomes_unusable_is_a_warning(hair, get_depsgraph):
    line = arch()
    add(hair, line)
    line.data.splines.clear()
    bpy.context.view_layer.update()
    session = previews.start(hair, get_depsgraph())
    assert any("no length" in warning for warning in session.warnings)
    with pytest.raises(RuntimeError, match="no partings"):
        bpy.ops.hairloom.comb_parting()


def test_the_verbs_part_a_file(hair, tmp_path):
    name = hair.name
    line = arch()
    scene, parted, combed = (str(tmp_path / f"{each}.blend") for each in ("a", "b", "c"))
    bpy.ops.wm.save_as_mainfile(filepath=scene)
    run = ["run", "add_parting", "--scene", scene, "--object", line.name, "--object", name]
    assert command_line.run([*run, "--output", parted]) == 0
    run = ["run", "comb_parting", "--scene", parted, "--object", name, "--set", "amount=1"]
    assert command_line.run([*run, "--output", combed]) == 0
    bpy.ops.wm.open_mainfile(filepath=combed)
    hair = bpy.data.objects[name]
    assert [each.name for each in partings_of(hair)] == ["Line"]
    assert not np.array_equal(curve_points(hair.data), cap().points)


def test_a_render_after_a_parting_has_moved_has_other_children(hair, get_depsgraph):
    line = arch()
    add(hair, line)
    assert line.session_uid in engine_hair.uids_of(hair), "Rendered mode does not read it again"
    before = engine_hair.read_groom(hair, get_depsgraph())
    again = engine_hair.read_groom(hair, get_depsgraph())
    assert again.radius is before.radius, "it is kept"
    line.location.x = 0.03
    bpy.context.view_layer.update()
    after = engine_hair.read_groom(hair, get_depsgraph())
    assert not np.array_equal(after.points, before.points)
    engine_hair.forget()


@pytest.mark.parametrize("data", ["Y up", "Z up"])
def test_a_new_line_moves_with_its_head(data, new_hair):
    """The line is the same with Y up and centimetres in the head's data, and turns with a head."""
    turn = Matrix.Rotation(0.5 * np.pi, 4, "X") @ Matrix.Scale(0.01, 4)
    if data == "Z up":
        turn = Matrix.Rotation(0.5 * np.pi, 4, "Z")
    lines = []
    for matrix in (Matrix.Identity(4), turn):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
        head = bpy.context.object
        head.data.transform(Matrix.Diagonal((0.8, 1.0, 1.3, 1.0)))
        if data == "Y up":
            head.data.transform(matrix.inverted())
        head.matrix_world = matrix
        bpy.context.view_layer.update()
        line = new_line(new_hair(head), "Line", bpy.context)
        lines.append(pieces_of(line, bpy.context.evaluated_depsgraph_get()))
    upright, other = lines
    assert upright[..., 2].min() > 0.05 and upright[0, 0, 1] < upright[-1, 1, 1]
    if data == "Z up":
        upright = upright @ np.array(turn.to_3x3()).T
    assert other == pytest.approx(upright, abs=1e-5)
