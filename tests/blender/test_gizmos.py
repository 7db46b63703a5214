"""Handles in the 3D view: their places, their properties, and when they are shown."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.ui import gizmos

pytestmark = pytest.mark.draws(light=False)


class Recorded:
    """A gizmo that only records its settings."""

    def __init__(self, kind: str) -> None:
        self.kind, self.target = kind, None

    def target_set_prop(self, target: str, owner: Any, name: str) -> None:
        assert target == "offset" and name in owner.bl_rna.properties
        self.target = owner, name

    def target_set_handler(self, target: str, *, get: Any, set: Any) -> None:
        assert target == "offset"
        self.get, self.set = get, set

    def tip(self) -> np.ndarray:
        """The position of an arrow's tip (3,)."""
        return np.array(self.matrix_basis @ Vector((0.0, 0.0, self.get())))


def handles(kind: Any) -> Any:
    """A gizmo group, with its gizmos made and placed as Blender does it."""
    made: list[Recorded] = []

    def new(name: str) -> Recorded:
        made.append(Recorded(name))
        return made[-1]

    group = SimpleNamespace(gizmos=SimpleNamespace(new=new))
    for step in (kind.setup, kind.refresh, kind.draw_prepare):
        step(group, bpy.context)
    return group


def is_there(kind: Any, *, is_on: bool = True) -> bool:
    context = bpy.context
    return kind.poll(
        SimpleNamespace(
            active_object=context.active_object,
            mode=context.mode,
            view_layer=context.view_layer,
            space_data=SimpleNamespace(show_gizmo_context=is_on),
        )
    )


def make_active(obj: Any) -> None:
    bpy.context.view_layer.objects.active = obj


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any, get_depsgraph: Any) -> Any:
    """Previewed hair in the wind, with its overlay."""
    made = new_hair(sphere)
    wind = made.hairloom.dynamics
    wind.wind_speed, wind.wind_direction, wind.wind_elevation = 4.0, 0.7, -0.4
    previews.start(made, get_depsgraph())
    made.hairloom.shown_overlays = {"wind"}
    make_active(made)
    return made


def test_the_winds_arrow_ends_where_the_overlays_does(hair: Any) -> None:
    session = previews.session_of(hair)
    (lines,) = overlay.drawing_of(session.uid).lines
    speed = handles(gizmos.HAIRLOOM_GGT_wind).speed
    np.testing.assert_allclose(speed.tip(), lines.points[1], atol=1e-6)
    for factor, expected in ((1.5, 6.0), (0.0, 0.0), (-1.0, 0.0)):
        hair.hairloom.dynamics.wind_speed = 4.0
        speed.set(speed.get() * factor)
        assert hair.hairloom.dynamics.wind_speed == pytest.approx(expected)


def test_rings_turn_the_wind_as_the_mouse_turns_them(hair: Any) -> None:
    """Blender turns rings clockwise around z: turned back by its angle, x points along the wind."""
    dials, wind = handles(gizmos.HAIRLOOM_GGT_wind).dials, hair.hairloom.dynamics
    level = Vector((math.cos(wind.wind_direction), math.sin(wind.wind_direction), 0.0))
    along = math.cos(wind.wind_elevation) * level
    along.z = math.sin(wind.wind_elevation)
    for name, expected in (("wind_direction", level), ("wind_elevation", along)):
        assert dials[name].target == (wind, name)
        back = Matrix.Rotation(-getattr(wind, name), 3, "Z")
        found = dials[name].matrix_basis.to_3x3() @ back @ Vector((1.0, 0.0, 0.0))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_wind_has_handles_where_its_overlay_is_shown(hair: Any) -> None:
    kind = gizmos.HAIRLOOM_GGT_wind
    assert is_there(kind) and not is_there(kind, is_on=False)
    hair.hairloom.shown_overlays = {"lights"}
    assert not is_there(kind)
    hair.hairloom.shown_overlays = {"wind"}
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    assert not is_there(kind)
    bpy.ops.object.mode_set(mode="OBJECT")
    hair.hide_set(True)
    assert not is_there(kind)
    hair.hide_set(False)
    previews.stop(previews.session_of(hair))
    assert not is_there(kind)
    make_active(None)
    assert not is_there(kind)


@pytest.mark.parametrize("collection", ["tie_collection", "collider_collection"])
def test_only_ties_and_colliders_of_hair_have_a_size_to_drag(
    new_hair: Callable[..., Any], sphere: Any, collection: str
) -> None:
    kind, hair = gizmos.HAIRLOOM_GGT_empty_size, new_hair(sphere)
    empty = bpy.data.objects.new("Empty", None)
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.children.link(group)
    group.objects.link(empty)
    make_active(empty)
    assert not is_there(kind)
    setattr(hair.hairloom, collection, group)
    assert is_there(kind)
    make_active(sphere)
    assert not is_there(kind)


def test_colliders_of_cloth_have_a_size_to_drag(sphere: Any) -> None:
    empty, group = bpy.data.objects.new("Empty", None), bpy.data.collections.new("Group")
    bpy.context.scene.collection.children.link(group)
    group.objects.link(empty)
    make_active(sphere)
    sphere.select_set(True)
    bpy.ops.hairloom.fin_add()
    sphere.hairloom.collider_collection = group
    make_active(empty)
    assert is_there(gizmos.HAIRLOOM_GGT_empty_size)
    bpy.data.objects.remove(sphere)
    assert not is_there(gizmos.HAIRLOOM_GGT_empty_size)


@pytest.mark.parametrize(
    ("shown_as", "shape", "axis"),
    [("CIRCLE", "automatic", 0), ("SPHERE", "automatic", 0), ("ARROWS", "capsule", 2)],
)
def test_an_empty_is_dragged_at_its_border(shown_as: str, shape: str, axis: int) -> None:
    """The handle is at the border also if the Empty is turned, scaled and moved."""
    empty = bpy.data.objects.new("Empty", None)
    empty.empty_display_type, empty.empty_display_size = shown_as, 0.3
    empty.hairloom.collider_shape = shape
    empty.location, empty.rotation_euler = (0.1, -0.2, 0.3), (0.5, 1.0, -2.0)
    empty.scale = (2.0, 1.0, 3.0)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    make_active(empty)
    size = handles(gizmos.HAIRLOOM_GGT_empty_size).size

    def border() -> Vector:
        place = Vector()
        place[axis] = empty.empty_display_size
        return empty.matrix_world @ place

    np.testing.assert_allclose(size.tip(), border(), atol=1e-6)
    size.set(1.7 * size.get())
    assert empty.empty_display_size == pytest.approx(0.51)
    np.testing.assert_allclose(size.tip(), border(), atol=1e-6)
    empty.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    size = handles(gizmos.HAIRLOOM_GGT_empty_size).size
    size.set(1.0)
    assert empty.empty_display_size == pytest.approx(0.51), "nothing can be dragged of a point"
