"""Trim, Flow, Mirror and similar tools report progress and leave no trace when cancelled.

Each is cancelled while its first part is running, as Esc does in the window.
"""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from overriding import library_overrides

from hairloom.addon.blender.base.parts import Part, batched, run_parts
from hairloom.addon.blender.colliders import ties
from hairloom.addon.blender.scene.curves import curve_points, set_points
from hairloom.addon.blender.scene.shape_backup import BEFORE_SETTLE
from hairloom.addon.ui import (
    operators_colliders,
    operators_export_check,
    operators_flow,
    operators_hairstyles,
    operators_mirror,
    operators_partings,
    operators_start,
    operators_trim,
)
from hairloom.addon.ui.long_work import LongWork

pytestmark = pytest.mark.usefixtures("extension")


@pytest.fixture
def hair(sphere):
    bpy.ops.hairloom.grow(strand_count=40, length=0.1, cv_count=8)
    return bpy.context.object


def chosen(hair, *others):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in (*others, hair):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = hair


def with_plane(hair):
    bpy.ops.object.empty_add()
    chosen(hair, bpy.context.object)


def with_stroke(hair):
    bpy.ops.hairloom.add_stroke()
    chosen(hair)


def with_parting(hair):
    bpy.ops.hairloom.add_parting()
    chosen(hair)


JOBS = {
    "trim": (operators_trim.HAIRLOOM_OT_trim_to_shape, with_plane, "Trimming"),
    "flow": (operators_flow.HAIRLOOM_OT_comb_flow, with_stroke, "Combing 40 curves"),
    "parting": (operators_partings.HAIRLOOM_OT_comb_parting, with_parting, "Combing 40 curves"),
    "mirror": (operators_mirror.HAIRLOOM_OT_mirror_hair, chosen, "Mirroring"),
    "spheres": (operators_colliders.HAIRLOOM_OT_fit_spheres, chosen, "Fitting spheres"),
    "landmarks": (
        operators_hairstyles.HAIRLOOM_OT_place_landmarks,
        chosen,
        "Looking for landmarks",
    ),
    "check": (operators_export_check.HAIRLOOM_OT_check_export, chosen, "Making strands"),
    "take_over": (operators_start.HAIRLOOM_OT_use_groom, chosen, "Reading the hair"),
}


def stand_in(kind):
    """A placeholder for an operator with default properties, to call `steps` without Blender."""
    values = {
        name: own.keywords.get("default")
        for name, own in getattr(kind, "__annotations__", {}).items()
        if hasattr(own, "keywords")
    }
    said = []
    return SimpleNamespace(
        **values,
        said=said,
        bl_idname=kind.bl_idname,
        bl_label=kind.bl_label,
        report=lambda levels, text: said.append(text),
    )


@pytest.mark.parametrize("job", JOBS)
def test_it_says_what_it_makes_and_leaves_nothing_when_it_is_cancelled(job, hair):
    kind, prepare, text = JOBS[job]
    assert issubclass(kind, LongWork) and kind.poll(bpy.context) is not None
    prepare(hair)
    before, objects = curve_points(hair.data).copy(), len(bpy.data.objects)
    steps = kind.steps(stand_in(kind), bpy.context)
    assert next(steps).text.startswith(text)
    steps.close()
    assert np.array_equal(curve_points(hair.data), before)
    assert len(bpy.data.objects) == objects
    assert not hair.data.attributes.get("hairloom_before_flow")
    assert not hair.data.attributes.get("hairloom_before_trim")


@pytest.fixture
def trimmed(hair, tmp_path):
    """Hair that was trimmed and settled in another file, overridden with all its data."""
    with_plane(hair)
    bpy.ops.hairloom.trim_to_shape()
    BEFORE_SETTLE.save(hair)
    set_points(hair.data, curve_points(hair.data) * np.float32(1.01))
    BEFORE_SETTLE.mark_result(hair)
    return overridden_hair(tmp_path)


def overridden_hair(folder):
    hair = next(obj for obj in library_overrides(folder) if obj.type == "CURVES")
    chosen(hair)
    return hair


@pytest.mark.parametrize(
    "tool",
    ["grow_again", "fit_again", "settle", "revert_settle", "trim_to_shape", "revert_trim"]
    + ["mirror_hair", "comb_flow", "comb_parting"],
)
def test_curves_of_a_library_override_are_left_alone(tool, trimmed):
    """Blender ignores new points of such curves, but would delete curves."""
    hair = trimmed
    hair.hairloom.hairstyle = "bob"
    hair.hairloom.dynamics.sag_compensation = 0.5
    for add in ("add_stroke", "add_parting"):
        getattr(bpy.ops.hairloom, add)()
    chosen(hair)
    before = curve_points(hair.data)
    with pytest.raises(RuntimeError, match="cannot change the curves"):
        getattr(bpy.ops.hairloom, tool)()
    assert len(before) and np.array_equal(curve_points(hair.data), before)
    assert hair.hairloom.dynamics.sag_compensation == 0.5


def test_a_setting_of_growth_says_why_overridden_curves_do_not_follow(hair, tmp_path):
    hair = overridden_hair(tmp_path)
    before, own = curve_points(hair.data), hair.data.hairloom.grow
    own.length = 0.05
    assert "cannot change the curves" in own.problem
    assert len(before) and np.array_equal(curve_points(hair.data), before)


@pytest.mark.parametrize(
    "tool", ["add_stroke", "add_parting", "add_hair_tie", "make_real", "make_cards"]
)
def test_what_is_made_for_overridden_hair_goes_into_a_collection_of_this_file(tool, hair, tmp_path):
    overridden_hair(tmp_path)
    before = set(bpy.data.objects)
    assert getattr(bpy.ops.hairloom, tool)() == {"FINISHED"}
    made = set(bpy.data.objects) - before
    assert made and all(obj.users_scene == (bpy.context.scene,) for obj in made)
    homes = {each for obj in made for each in obj.users_collection}
    assert bpy.context.scene.collection in homes
    assert not any(each.override_library for each in homes)


def test_ties_of_a_library_stay_where_one_is_added_to_its_override(hair, tmp_path):
    bpy.ops.hairloom.add_hair_tie()
    first = bpy.context.scene.objects["Hair Tie"]
    first.name = "First"
    library = hair.hairloom.tie_collection
    bpy.context.scene.collection.children.unlink(library)
    first.parent.users_collection[0].children.link(library)
    hair = overridden_hair(tmp_path)
    bpy.ops.hairloom.add_hair_tie()
    assert {obj.name for obj in ties.ties_of(hair)} == {"First", "Hair Tie"}
    with pytest.raises(RuntimeError, match="First: it is not"):
        bpy.ops.hairloom.remove_hair_tie(tie="First")
    assert bpy.ops.hairloom.remove_hair_tie(tie="Hair Tie") == {"FINISHED"}
    assert [obj.name for obj in ties.ties_of(hair)] == ["First"]


@pytest.mark.parametrize("tool", ["mirror_hair", "trim_to_shape", "comb_flow", "comb_parting"])
def test_linked_duplicates_share_curves_which_are_changed_once(tool, hair):
    for prepare in (with_stroke, with_parting, with_plane):
        prepare(hair)
    beside = bpy.context.selected_objects
    copy = hair.copy()
    bpy.context.collection.objects.link(copy)
    other = hair.copy()
    other.data = hair.data.copy()
    bpy.context.collection.objects.link(other)
    chosen(other, *(obj for obj in beside if obj != hair))
    getattr(bpy.ops.hairloom, tool)()
    chosen(hair, copy, *(obj for obj in beside if obj != hair))
    before = curve_points(hair.data)
    getattr(bpy.ops.hairloom, tool)()
    assert np.array_equal(curve_points(hair.data), curve_points(other.data))
    assert not np.array_equal(curve_points(hair.data), before)


def test_of_many_hairs_all_is_made_before_any_is_written():
    log = []

    def work(name):
        made = yield Part(name, lambda: log.append(f"made {name}") or name)
        log.append(f"wrote {made}")
        return made.upper()

    assert run_parts(batched([work("a"), work("b")])) == ["A", "B"]
    assert log == ["made a", "made b", "wrote a", "wrote b"]


def test_where_one_of_many_fails_none_is_written():
    log = []

    def work(name):
        made = yield Part(name, lambda: 1 // (name != "b"))
        log.append(made)

    with pytest.raises(ZeroDivisionError):
        run_parts(batched([work("a"), work("b")]))
    assert log == []


def test_a_work_of_two_parts_is_none_of_these():
    def work():
        yield Part("one", int)
        yield Part("two", int)

    with pytest.raises(AssertionError, match="more than one part"):
        run_parts(batched([work()]))
