"""Lists of ties, partings, strokes and trim shapes are as high with thirty entries as with one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from panel_layout import Layout

from hairloom.addon.ui import (
    object_lists,
    operators_flow,
    operators_partings,
    operators_ties,
    operators_trim,
)

pytestmark = pytest.mark.usefixtures("extension")
PANELS = {
    "tie_collection": operators_ties.draw_ties,
    "parting_collection": operators_partings.draw_partings,
    "stroke_collection": operators_flow.draw_flow,
    "trim_collection": operators_trim.draw_trim,
}


@pytest.fixture
def hair(sphere):
    bpy.ops.hairloom.grow(strand_count=10, length=0.1, cv_count=8)
    return bpy.context.object


def filled(hair: Any, setting: str, count: int) -> bpy.types.Collection:
    collection = bpy.data.collections.new("Things")
    bpy.context.scene.collection.children.link(collection)
    for number in range(count):
        collection.objects.link(bpy.data.objects.new(f"Thing {number}", None))
    setattr(hair.hairloom, setting, collection)
    return collection


@pytest.mark.parametrize("setting", PANELS)
def test_a_panel_is_as_high_for_thirty_as_for_one(setting, hair):
    heights = []
    for count in (1, 30):
        filled(hair, setting, count)
        layout = Layout([])
        PANELS[setting](layout, hair)
        heights.append(layout.height)
    assert heights[0] == heights[1] > object_lists.ROWS


@pytest.mark.parametrize("setting", PANELS)
def test_the_cross_of_a_row_removes_its_object(setting, hair):
    collection = filled(hair, setting, 2)
    first = collection.all_objects[0]
    pressed: list[tuple[str, Any]] = []

    class Row:
        def prop(self, data: Any, name: str, **_: Any) -> None:
            assert (data, name) == (first, "name"), "names can be changed in the list"

        def operator(self, name: str, **_: Any) -> Any:
            pressed.append((name, SimpleNamespace()))
            return pressed[-1][1]

    row = SimpleNamespace(list_id=setting)
    draw = object_lists.HAIRLOOM_UL_objects.draw_item
    draw(row, bpy.context, Row(), collection, first, 0, None, "")
    ((name, values),) = pressed
    assert getattr(bpy.ops.hairloom, name.partition(".")[2])(**vars(values)) == {"FINISHED"}
    assert first.name not in collection.objects and first.name in bpy.data.objects


@pytest.mark.parametrize("setting", PANELS)
def test_without_a_name_the_selected_object_or_the_only_one_is_removed(setting, hair):
    remove = getattr(bpy.ops.hairloom, object_lists.KINDS[setting].remove.partition(".")[2])
    with pytest.raises(RuntimeError, match=f"{hair.name}: it has no .* of its own. Add one first"):
        remove()
    collection = filled(hair, setting, 4)
    with pytest.raises(RuntimeError, match=r"several .*Thing 0, Thing 1, Thing 2, Thing 3"):
        remove()
    for number in (1, 2):
        bpy.data.objects[f"Thing {number}"].select_set(True)
    with pytest.raises(RuntimeError, match="one of Thing 1, Thing 2"):
        remove()
    bpy.context.view_layer.objects.active = bpy.data.objects["Thing 2"]
    assert remove() == {"FINISHED"} and "Thing 2" not in collection.objects
    assert remove() == {"FINISHED"} and "Thing 1" not in collection.objects
    collection.objects.unlink(bpy.data.objects["Thing 0"])
    assert remove() == {"FINISHED"} and not collection.objects


@pytest.mark.parametrize("setting", PANELS)
def test_hair_without_a_collection_has_no_list(setting, hair):
    layout = Layout([])
    object_lists.draw_objects(layout, hair, setting)
    assert layout.height == 1.0
