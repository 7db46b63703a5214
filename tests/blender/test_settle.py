"""Settle: combed hair falls onto head and shoulders, keeps that shape, and can be restored."""

import bpy
import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.blender.base.attributes import set_attribute
from hairloom.addon.blender.base.outcome import past_reports
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.curves import curve_offsets, curve_points
from hairloom.addon.blender.scene.hair_nodes import add_hair_nodes
from hairloom.addon.blender.scene.shape_backup import BEFORE_SETTLE, BEFORE_TRIM
from hairloom.addon.blender.sessions.settling import settle_hair
from hairloom.addon.dynamics.settle_settings import SettleSettings
from hairloom.addon.strands import StrandSet

RADIUS = 0.1
#: how far settled hair may move in two seconds of simulation on a still head [m]: as far as gravity
#: moves combed hair in a substep
AT_REST = 5e-4


def lying(count=5, points=12, length=0.3):
    """Straight curves that stand out sideways from the sphere's side."""
    begin = np.zeros((count, 1, 3))
    begin[:, 0] = [RADIUS, 0.0, 0.0] + np.arange(count)[:, None] * [0.0, 0.001, 0.0]
    along = np.linspace(0.0, length, points)[:, None] * [1.0, 0.0, 0.0]
    return strand_set(list(begin + along))


def strand_set(curves):
    counts = [len(each) for each in curves]
    return StrandSet(
        np.concatenate(curves),
        np.concatenate([[0], np.cumsum(counts)]),
        np.full(sum(counts), 4e-5),
        np.zeros(len(curves), np.int32),
    )


def steps(hair):
    """The length of each segment, 0 at roots [m]."""
    length = np.linalg.norm(np.diff(curve_points(hair.data), axis=0), axis=1)
    length = np.concatenate([[0.0], length])
    length[curve_offsets(hair.data)[:-1]] = 0.0
    return length


def settle(**values):
    assert bpy.ops.hairloom.settle(**values) == {"FINISHED"}


def test_hair_without_stiffness_hangs_straight_down_from_its_roots(new_hair, sphere):
    """The first segment has the root's direction; the rest hangs vertically as a chain at rest."""
    hair = new_hair(sphere, lying())
    settle(stiffness=0.0, seconds=6.0)
    grid = curve_points(hair.data).reshape(5, 12, 3)
    segment = 0.3 / 11
    hanging = grid[:, -1] - grid[:, 1]
    assert hanging[:, 2] == pytest.approx(-(0.3 - segment), rel=0.01)
    assert np.abs(hanging[:, :2]).max() < 0.03


def test_hair_falls_by_its_whole_weight_whatever_is_seen_of_its_motion_and_under_water(
    new_hair, sphere
):
    """The simulated fraction and water change nothing; strands with a gravity mask of 0 stay."""
    found = []
    for values in ({}, {"influence": 0.0, "buoyancy": 1.0, "drag": 5.0, "influence_mask": "Few"}):
        hair = new_hair(sphere, lying())
        few = hair.data.attributes.new("Few", "FLOAT", "CURVE")
        few.data.foreach_set("value", [0.0, 0.0, 1.0, 1.0, 1.0])
        hair.hairloom.dynamics.gravity_mask = "Few"
        for name, value in values.items():
            setattr(hair.hairloom.dynamics, name, value)
        settle(stiffness=0.0, seconds=1.0)
        found.append(curve_points(hair.data).reshape(5, 12, 3))
        bpy.data.objects.remove(hair)
    np.testing.assert_array_equal(*found)
    tips = found[0][:, -1, 2]
    assert np.abs(tips[:2]).max() < 1e-4 and tips[2:].max() < -0.2


@pytest.mark.slow
def test_stiffness_holds_hair_up(new_hair, sphere):
    tips = []
    for stiffness in (0.0, 1.0, 6.0):
        hair = new_hair(sphere, lying())
        settle(stiffness=stiffness, seconds=4.0)
        tips.append(curve_points(hair.data)[-1, 2])
        bpy.data.objects.remove(hair)
    assert tips[0] < tips[1] - 0.01 < tips[2] - 0.02 < -0.02


def test_lengths_are_kept_and_nothing_is_in_the_head(new_hair, sphere):
    """Curves with different point counts fall from all sides onto a faceted sphere."""
    random = np.random.default_rng(2)
    outward = random.normal(size=(80, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    curves = [
        out * np.linspace(RADIUS, RADIUS + 0.15, number)[:, None]
        for out, number in zip(outward, random.integers(5, 30, 80), strict=True)
    ]
    hair = new_hair(sphere, strand_set(curves))
    before = steps(hair)
    settle()
    assert np.abs(steps(hair) - before).max() < 1e-6
    inscribed = RADIUS * np.cos(np.pi / 24) * np.cos(np.pi / 24)  # 24 segments, 12 rings
    away = np.linalg.norm(curve_points(hair.data), axis=1)
    roots = curve_offsets(hair.data)[:-1]
    assert np.delete(away, roots).min() > inscribed
    assert np.linalg.norm(curve_points(hair.data)[roots] - RADIUS * outward, axis=1).max() < 1e-6
    is_low = outward[:, 2] < -0.5
    tips = curve_points(hair.data)[curve_offsets(hair.data)[1:] - 1]
    assert (tips[~is_low, 2] < RADIUS * outward[~is_low, 2]).mean() > 0.9


@pytest.mark.parametrize("preset", few_in_commits(["dynamics/soft", "dynamics/natural"]))
def test_settled_hair_is_at_rest_in_motion(new_hair, sphere, get_depsgraph, preset):
    hair = new_hair(sphere)
    bpy.ops.hairloom.apply_preset(name=preset)
    hair.hairloom.dynamics.device = "numpy"

    def moved():
        session = previews.start(hair, get_depsgraph())
        session.play(get_depsgraph())
        before = session.strands.copy()
        for _ in range(48):
            session.advance(get_depsgraph(), 1.0 / 24.0)
        away = np.linalg.norm(session.strands - before, axis=1).max()
        previews.stop(session)
        return away

    settle(seconds=3.0)
    assert moved() < AT_REST
    hair.hairloom.dynamics.sag_compensation = 0.0
    assert moved() > 10 * AT_REST  # shows that the assertion above can fail


def test_revert_settle_is_exact_and_settling_again_begins_there(new_hair, sphere):
    hair = new_hair(sphere)
    hair.hairloom.dynamics.sag_compensation = 0.5
    combed = curve_points(hair.data)
    settle(seconds=0.3)
    once = curve_points(hair.data)
    settle(seconds=0.3)
    assert np.abs(once - combed).max() > 0.005
    assert (curve_points(hair.data) == once).all()
    settle(seconds=0.3, stiffness=4.0)
    held = curve_points(hair.data)
    assert np.abs(held - combed).max() < 0.5 * np.abs(once - combed).max()
    assert hair.hairloom.dynamics.sag_compensation == 1.0
    assert bpy.ops.hairloom.revert_settle() == {"FINISHED"}
    assert (curve_points(hair.data) == combed).all()
    assert hair.hairloom.dynamics.sag_compensation == 0.5
    assert not BEFORE_SETTLE.exists(hair)
    assert not bpy.ops.hairloom.revert_settle.poll()


@pytest.mark.slow
def test_hair_that_was_combed_since_goes_back_to_that(new_hair, sphere):
    hair = new_hair(sphere)
    settle(seconds=0.3)
    points = curve_points(hair.data)
    points[7] += 0.002
    hair.data.position_data.foreach_set("vector", points.ravel())
    settle(seconds=0.3)
    bpy.ops.hairloom.revert_settle()
    assert (curve_points(hair.data) == points).all()


def test_curves_drawn_since_and_curves_that_cannot_be_used_stay_as_they_are(new_hair, sphere):
    hair = new_hair(sphere)
    hair.data.add_curves([1, 5])
    points = curve_points(hair.data)
    combed = points.copy()
    settle(seconds=0.2)
    now = curve_points(hair.data)
    assert (now[-6:] == points[-6:]).all()
    hair.data.add_curves([3])
    now = curve_points(hair.data)
    now[-3:] = [[0.2, 0.0, 0.0], [0.3, 0.0, 0.0], [0.4, 0.0, 0.0]]
    hair.data.position_data.foreach_set("vector", now.ravel())
    bpy.ops.hairloom.revert_settle()
    back = curve_points(hair.data)
    assert (back[-3:] == now[-3:]).all()
    assert (back[:-3] == combed).all()


def trim(hair):
    plane = bpy.data.objects.new("Plane", None)
    bpy.context.collection.objects.link(plane)
    plane.location.z = -0.12
    plane.select_set(True)
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    bpy.context.view_layer.update()
    assert bpy.ops.hairloom.trim_to_shape() == {"FINISHED"}
    plane.select_set(False)


@pytest.mark.parametrize("order", ["settle, trim", "trim, settle"])
def test_reverting_settle_also_reverts_later_tools(order, new_hair, sphere):
    """Undoing a tool undoes later ones too, but no earlier ones, such as a settle before a trim."""
    past_reports.clear()
    hair = new_hair(sphere)
    hair.hairloom.dynamics.sag_compensation = 0.5
    shapes = [curve_points(hair.data)]
    for tool in order.split(", "):
        trim(hair) if tool == "trim" else settle(seconds=0.2)
        shapes.append(curve_points(hair.data))
    first, second = (
        {"settle": "revert_settle", "trim": "revert_trim"}[tool] for tool in order.split(", ")
    )
    twin = hair.copy()
    twin.data = hair.data.copy()
    bpy.context.collection.objects.link(twin)
    twin.select_set(False)
    getattr(bpy.ops.hairloom, first)()
    assert (curve_points(hair.data) == shapes[0]).all()
    assert not BEFORE_SETTLE.exists(hair) and not BEFORE_TRIM.exists(hair)
    assert hair.hairloom.dynamics.sag_compensation == 0.5
    assert len([each for each in past_reports if "are lost, too" in each.text]) == 1
    hair.select_set(False)
    twin.select_set(True)
    bpy.context.view_layer.objects.active = twin
    getattr(bpy.ops.hairloom, second)()
    assert (curve_points(twin.data) == shapes[1]).all()
    assert BEFORE_SETTLE.exists(twin) is (second == "revert_trim")
    assert twin.hairloom.dynamics.sag_compensation == (0.5 if second == "revert_settle" else 1.0)
    assert len([each for each in past_reports if "are lost, too" in each.text]) == 1


def test_linked_duplicates_share_settled_curves_and_carry_their_weight_alike(new_hair, sphere):
    hair = new_hair(sphere)
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    twin.select_set(False)
    sags = {hair: 0.5, twin: 0.25}
    for each, sag in sags.items():
        each.hairloom.dynamics.sag_compensation = sag
    settle(seconds=0.2)
    assert {each.hairloom.dynamics.sag_compensation for each in sags} == {1.0}
    hair.select_set(False)
    twin.select_set(True)
    bpy.context.view_layer.objects.active = twin
    bpy.ops.hairloom.revert_settle()
    assert {each: each.hairloom.dynamics.sag_compensation for each in sags} == sags


@pytest.mark.parametrize("domain", ["surface", "curves", "control points"])
def test_hair_falls_as_painted_where_a_modifier_adds_curves(domain, new_hair, sphere):
    """The curves from before the modifier fall. Without Only Selected, a selection is ignored."""
    hair = new_hair(sphere, lying())
    if domain == "surface":
        sphere.vertex_groups.new(name="Few").add(range(len(sphere.data.vertices)), 0.0, "REPLACE")
        moving = []
    else:
        few = hair.data.attributes.new("Few", "FLOAT", "CURVE")
        few.data.foreach_set("value", [0.0, 0.0, 1.0, 1.0, 1.0])
        moving = [2, 3, 4]
    if domain == "control points":
        hair.data.set_types(type="NURBS")
    set_attribute(hair.data, ".selection", "CURVE", np.ones(5, bool))
    hair.hairloom.dynamics.gravity_mask = "Few"
    add_hair_nodes(hair, "Duplicate Hair Curves", {"Amount": 3}, 1.0)
    settle(stiffness=0.0, seconds=1.0)
    tips = curve_points(hair.data).reshape(5, 12, 3)[:, -1, 2]
    assert np.flatnonzero(tips < -0.2).tolist() == moving
    assert np.abs(np.delete(tips, moving)).max() < 1e-4


def test_settling_changes_nothing_until_it_ends(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    combed = curve_points(hair.data)
    work = settle_hair(hair, get_depsgraph(), SettleSettings())
    parts = [next(work) for _ in range(5)]
    assert parts == sorted(parts)
    work.close()
    assert (curve_points(hair.data) == combed).all()
    assert not BEFORE_SETTLE.exists(hair)


def test_several_grooms_settle_together_or_not_at_all(new_hair, sphere):
    first, second = new_hair(sphere), new_hair(sphere)
    combed = curve_points(first.data)
    second.data.position_data.foreach_set("vector", (combed + np.float32(1.0)).ravel())
    second.data.update_tag()
    for hair in (second, first):
        hair.select_set(True)
        bpy.context.view_layer.objects.active = hair
    with pytest.raises(RuntimeError, match=r"roots lie .* m from the head"):
        bpy.ops.hairloom.settle(seconds=0.2)
    assert (curve_points(first.data) == combed).all() and not BEFORE_SETTLE.exists(first)


@pytest.mark.slow
def test_modifiers_act_on_what_has_settled(extension):
    """The curves keep their number of points and lengths, so the modifier curls them once."""
    bpy.ops.hairloom.add_hairstyle(style="curls", plays=False)
    hair = bpy.context.object
    before, number = steps(hair), len(curve_points(hair.data))
    settle(seconds=0.2)
    assert len(curve_points(hair.data)) == number
    assert np.abs(steps(hair) - before).max() < 1e-6
    assert hair.modifiers


@pytest.mark.slow
def test_moved_and_scaled_hair_settles_where_it_is(new_hair, sphere):
    """Down is the world's, and the result is stored in object space."""
    sphere.location, sphere.rotation_euler = (1.0, 2.0, 3.0), (0.0, 1.2, 0.4)
    sphere.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    hair = new_hair(sphere)
    hair.matrix_parent_inverse.identity()
    bpy.context.view_layer.update()
    before = curve_points(hair.data)
    settle(seconds=4.0)
    way = (curve_points(hair.data) - before)[7::8] @ np.array(hair.matrix_world)[:3, :3].T
    assert way[:, 2].mean() < -0.02
    assert np.abs(way.mean(axis=0)[:2]).max() < 0.3 * abs(way[:, 2].mean())


def test_hair_away_from_its_surface_is_refused(new_hair, sphere):
    hair = new_hair(sphere)
    hair.location.x += 0.1
    bpy.context.view_layer.update()
    combed = curve_points(hair.data)
    with pytest.raises(RuntimeError, match="roots are away from the surface"):
        bpy.ops.hairloom.settle()
    assert (curve_points(hair.data) == combed).all()


def test_the_verb_settles_a_file(new_hair, sphere, tmp_path):
    hair = new_hair(sphere)
    combed, name = curve_points(hair.data), hair.name
    scene, output = tmp_path / "combed.blend", tmp_path / "settled.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    arguments = ["run", "settle", "--scene", str(scene), "--object", name]
    arguments += ["--set", "seconds=0.5", "--output", str(output)]
    assert command_line.run(arguments) == 0
    bpy.ops.wm.open_mainfile(filepath=str(output))
    settled = curve_points(bpy.data.objects[name].data)
    assert np.abs(settled - combed).max() > 0.005


def test_one_undo_takes_it_back(new_hair, sphere):
    hair = new_hair(sphere)
    combed, name = curve_points(hair.data), hair.name
    bpy.ops.ed.undo_push(message="combed")
    settle(seconds=0.2)
    bpy.ops.ed.undo_push(message="settled")  # as Blender does after a click
    assert (curve_points(bpy.data.objects[name].data) != combed).any()
    bpy.ops.ed.undo()
    hair = bpy.data.objects[name]
    assert (curve_points(hair.data) == combed).all()
    assert not BEFORE_SETTLE.exists(hair)
