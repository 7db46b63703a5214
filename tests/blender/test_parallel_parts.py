"""Work whose parts run in threads: at once, in the window, cancelled, and failed."""

from __future__ import annotations

import threading
from typing import Any

import bpy
import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.blender.base.parts import Part, Parts, new_blocks_removed_on_error, run_parts
from hairloom.addon.blender.scene.curves import curve_points, set_points
from hairloom.addon.cards.steps import result_of
from hairloom.addon.errors import HairloomError
from hairloom.addon.ui.long_work import steps_of_parts
from hairloom.addon.ui.operators_grow import HAIRLOOM_OT_grow_again
from hairloom.addon.ui.operators_hairstyles import HAIRLOOM_OT_add_hairstyle
from hairloom.addon.ui.operators_make_real import HAIRLOOM_OT_make_real

threads: list[str] = []
may_go_on = threading.Event()


@pytest.fixture(autouse=True)
def at_start() -> None:
    threads.clear()
    may_go_on.set()


def doubled(value: int) -> int:
    threads.append(threading.current_thread().name)
    assert may_go_on.wait(30.0)
    if value > 10:
        raise HairloomError("too much", place="test", remedy="Take less")
    return 2 * value


def quadrupled(value: int) -> Parts[int]:
    twice = yield Part("Doubling", lambda: doubled(value))
    try:
        four: int = yield Part("Again", lambda: doubled(twice))
    except HairloomError:
        return -1
    return four


@pytest.mark.parametrize(("value", "expected"), [(3, 12), (9, -1)])
def test_blocking_and_threaded_parts_have_the_same_result(value: int, expected: int) -> None:
    """An error of a part is raised at its `yield`, where the work may catch it."""
    assert run_parts(quadrupled(value)) == expected
    assert result_of(steps_of_parts(quadrupled(value))) == expected


@pytest.mark.parametrize("run", [run_parts, lambda parts: result_of(steps_of_parts(parts))])
def test_an_unhandled_error_is_raised(run: Any) -> None:
    with pytest.raises(HairloomError, match="too much"):
        run(quadrupled(11))


def test_in_the_window_parts_run_in_threads_and_report_what_they_do() -> None:
    may_go_on.clear()
    steps = steps_of_parts(quadrupled(2))
    while next(steps).text != "Doubling":
        pass
    assert next(steps).is_idle and threads != [threading.main_thread().name]
    may_go_on.set()
    assert result_of(steps) == 8 and len(threads) == 2
    run_parts(quadrupled(2))
    assert threads[2:] == 2 * [threading.main_thread().name]


def everything() -> dict[str, list[str]]:
    """Names of all data-blocks of the file, and of the hidden objects."""
    kinds = [kind for kind in bpy.data.bl_rna.properties if kind.type == "COLLECTION"]
    found = {k.identifier: [each.name for each in getattr(bpy.data, k.identifier)] for k in kinds}
    return {**found, "hidden": [obj.name for obj in bpy.data.objects if obj.hide_viewport]}


def cancelled(operator: type[Any], stage: str, **values: Any) -> None:
    """Run an operator's own steps up to this stage, and cancel it there."""
    members = {"bl_label": operator.bl_label, "report": lambda *_: None, **values}
    if hasattr(operator, "_head"):
        members["_head"] = operator._head
    steps = operator.steps(type("Asked", (), members)(), bpy.context)
    next(progress for progress in steps if progress.text == stage)
    steps.close()


@pytest.mark.alike
@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize(
    "stage", few_in_commits(["Placing Buzz Cut", "Painting the skin", "Growing brows"])
)
def test_a_hairstyle_that_is_cancelled_leaves_nothing(stage: str) -> None:
    before = everything()
    values = {"style": "buzz_cut", "skin": "light", "hairline": "", "plays": False}
    cancelled(HAIRLOOM_OT_add_hairstyle, stage, **values)
    assert everything() == before


@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize("stage", ["Making strands", "Colouring strands"])
def test_hair_that_is_not_made_real_after_all_is_shown(stage: str, sphere: Any) -> None:
    bpy.ops.hairloom.grow(strand_count=60, length=0.1)
    before = everything()
    cancelled(HAIRLOOM_OT_make_real, stage)
    assert everything() == before


@pytest.mark.usefixtures("extension")
def test_hair_that_does_not_grow_again_after_all_is_as_it_was_combed(sphere: Any) -> None:
    """Two grooms grow; if the second is cancelled, neither has changed."""
    grooms, combed = [], []
    for count in (60, 70):
        bpy.ops.hairloom.grow(strand_count=count, length=0.1)
        grooms.append(bpy.context.object)
    grooms[0].select_set(True)  # the active one grows first
    for hair in grooms:
        set_points(hair.data, curve_points(hair.data) * np.float32(1.1))
        combed.append(curve_points(hair.data))
    cancelled(HAIRLOOM_OT_grow_again, "Growing 60 strands")
    for hair, points in zip(grooms, combed, strict=True):
        assert np.array_equal(curve_points(hair.data), points)


def test_added_objects_are_removed_if_work_fails_and_kept_if_it_succeeds() -> None:
    before = everything()
    with pytest.raises(HairloomError), new_blocks_removed_on_error() as note:
        bpy.data.meshes.new("Gone")
        note()
        doubled(11)
    assert everything() == before
    with new_blocks_removed_on_error() as note:
        bpy.data.meshes.new("Kept")
        note()
    assert "Kept" in bpy.data.meshes


def test_existing_data_stays_after_another_file_was_loaded() -> None:
    """Cancelling removes nothing from a file that was loaded meanwhile."""

    def work() -> Parts[None]:
        with new_blocks_removed_on_error() as note:
            bpy.data.meshes.new("Gone")
            note()
            yield Part("Waiting", lambda: None)

    parts = work()
    next(parts)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.data.meshes.new("Other")
    before = everything()
    parts.close()
    assert everything() == before
