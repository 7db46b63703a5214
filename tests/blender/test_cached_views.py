"""When a 3D view that shows a kept picture is drawn again, and which changes count."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.preview import handlers
from hairloom.addon.blender.viewport import views
from hairloom.addon.render.camera import Camera

SOLID, MATERIAL = SimpleNamespace(type="SOLID"), SimpleNamespace(type="MATERIAL")


@pytest.fixture
def view() -> Iterator[views.View]:
    known = views.view_of(SimpleNamespace(as_pointer=lambda: 7))
    known.picture.key = ("kept",)
    yield known
    views.forget_views()


def is_waiting(timer: object) -> bool:
    return bool(bpy.app.timers.is_registered(timer))


def test_a_row_of_samples_is_followed_by_a_fresh_draw(view: views.View) -> None:
    views.record_drawn(view)
    for _ in range(9):
        views.record_reshown(view, SOLID)
    assert not is_waiting(views._redraw_strands), "in Solid what is in the way is known"
    views.record_drawn(view)
    for count in range(1, 5):
        views.record_reshown(view, MATERIAL)
        assert is_waiting(views._redraw_strands) == (count >= 3)
    views._redraw_strands()
    assert view.picture.key == ()


def test_a_redraw_long_after_is_a_row_by_itself(view: views.View) -> None:
    views.record_drawn(view)
    view.drawn_at -= 6.0
    views.record_reshown(view, MATERIAL)
    assert is_waiting(views._redraw_strands)
    views.forget_views()
    assert not is_waiting(views._redraw_strands)


def test_shadows_that_lag_are_caught_up_with(view: views.View) -> None:
    views.record_drawn(view)
    assert not is_waiting(views._catch_up)
    view.is_outdated = True
    views.record_drawn(view)
    assert is_waiting(views._catch_up)


def test_a_view_turns_from_its_second_draw_on(view: views.View) -> None:
    one, other = Camera(np.eye(4), np.eye(4)), Camera(2.0 * np.eye(4), np.eye(4))
    assert [view.has_new_camera(each) for each in (one, one, other, other, one)] == [
        *(False, False, True, False, True)
    ]


def test_each_switch_and_each_evaluation_changes_the_key() -> None:
    space = next(
        area.spaces.active
        for screen in bpy.data.screens
        for area in screen.areas
        if area.type == "VIEW_3D"
    )
    shading, before = space.shading, views._switches(space.shading)
    assert views._switches(shading) == before
    for name, value in (
        ("show_xray", True),
        ("show_backface_culling", True),
        ("type", "WIREFRAME"),
    ):
        kept = getattr(shading, name)
        setattr(shading, name, value)
        assert views._switches(shading) != before, name
        setattr(shading, name, kept)
    assert views._switches(shading) == before
    changes, depsgraph = views._known.changes, bpy.context.evaluated_depsgraph_get()
    handlers.on_depsgraph_update(bpy.context.scene, depsgraph)
    handlers.on_frame_change(bpy.context.scene, depsgraph)
    assert views._known.changes == changes + 2


def test_a_view_moves_until_it_is_drawn_of_the_same_again(view: views.View) -> None:
    one, other = (object(), 1, b"a"), (object(), 1, b"a")
    assert [view.has_new_key(key) for key in (one, one, other, other, one)] == [
        *(True, False, True, False, True)
    ]
