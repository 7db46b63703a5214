"""Lights read from a scene; tests/gpu/test_radiometry.py compares their light with Cycles."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from engine_stage import view_shadings

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.lights import light_warnings, read_lights
from hairloom.addon.blender.scene.world import studio_environment
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.blender.viewport.overlay import with_view_lights
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.environment import radiance_from
from hairloom.addon.shading.lights import (
    LIGHT_CAPACITY,
    Light,
    light_irradiance,
    three_point_lights,
)


def add(kind: str, location: tuple[float, float, float] = (0, 0, 1), **settings: Any) -> Any:
    lamp = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
    lamp.location = location
    for name, value in settings.items():
        setattr(lamp.data, name, value)
    bpy.context.collection.objects.link(lamp)
    return lamp


def lights() -> tuple[Light, ...]:
    return read_lights(bpy.context.evaluated_depsgraph_get(), np.zeros(3))


def warnings(*suns: Light) -> tuple[str, ...]:
    return light_warnings(bpy.context.evaluated_depsgraph_get(), suns)


def test_the_eight_lights_brightest_at_the_hair_are_kept_and_others_are_reported():
    """Irradiance at the hair counts: a weak lamp nearby precedes a powerful one far away."""
    for place in range(LIGHT_CAPACITY):
        add("POINT", (0.0, 0.0, 1.0 + place), energy=10.0)
    assert len(lights()) == LIGHT_CAPACITY
    assert warnings() == ()
    sun = Light("sun", (1.0, 0.0, 0.0), (2.0, 2.0, 2.0), is_from_world=True)
    (warning,) = warnings(sun)
    assert warning.startswith("Lights: 9 shine here (1 from the world), but")
    far = add("POINT", (0.0, 0.0, 100.0), energy=1000.0)
    near = add("POINT", (0.0, 0.0, 0.1), energy=1.0)
    away = add("AREA", (0.0, 0.0, 0.2), energy=1000.0)
    away.rotation_euler.x = np.pi
    found = lights()
    assert len(found) == LIGHT_CAPACITY
    assert found[0].vector == pytest.approx((0.0, 0.0, 0.1))
    assert all(light.vector[2] < 8.0 and light.kind == "point" for light in found)
    (warning,) = warnings()
    assert warning.startswith("Lights: 11 shine") and "8" in warning and warning.endswith(".")
    for lamp in (far, near, away):
        lamp.hide_viewport = True
    assert warnings() == ()


def test_lights_that_are_hidden_or_dark_are_left_out():
    hidden, switched_off = add("POINT"), add("POINT")
    hidden.hide_set(True)
    switched_off.hide_viewport = True
    add("SPOT", energy=0.0)
    add("AREA", color=(0.0, 0.0, 0.0))
    portal = add("AREA")
    if hasattr(portal.data, "cycles"):
        portal.data.cycles.is_portal = True
        assert lights() == ()
    elsewhere = bpy.data.collections.new("Elsewhere")
    bpy.context.scene.collection.children.link(elsewhere)
    elsewhere.objects.link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    before = len(lights())
    bpy.context.view_layer.layer_collection.children["Elsewhere"].exclude = True
    assert len(lights()) == before - 1


def test_an_emission_node_colours_a_light():
    lamp = add("POINT", energy=10.0)
    node = next(node for node in lamp.data.node_tree.nodes if node.type == "EMISSION")
    node.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    node.inputs["Strength"].default_value = 2.0
    assert lights()[0].power == pytest.approx((20.0, 10.0, 5.0))


def test_parents_carry_and_scale_a_panel():
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.rotation_euler.x, parent.scale = np.pi / 2.0, (3.0, 2.0, 1.0)
    lamp = add("AREA", shape="RECTANGLE", size=1.0, size_y=0.5)
    lamp.parent = parent
    (light,) = lights()
    assert light.panel is not None
    assert (light.panel.half_width, light.panel.half_height) == pytest.approx((1.5, 0.5))
    assert light.panel.shines_along == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert light.vector == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("scale", [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0), (-1, 1, 1)])
@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_lights_with_zero_and_mirrored_scales_are_read(kind, scale):
    add(kind, energy=10.0).scale = scale
    found = lights()
    # an area light without width and a lamp without direction give no light
    assert len(found) == 1 or kind != "POINT"
    for light in found:
        irradiance = light_irradiance(light, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
        assert np.isfinite(irradiance).all()
    if min(np.abs(scale)) > 0.0:
        assert light_irradiance(lights()[0], np.zeros(3)).min() > 0.0


def test_a_preview_reports_lights_that_it_leaves_out(new_hair: Any, sphere: Any) -> None:
    hair = new_hair(sphere)
    for place in range(LIGHT_CAPACITY):
        add("POINT", (0.0, 0.0, 1.0 + place), energy=10.0)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    session = Session(hair, depsgraph)
    assert not any("Lights" in warning for warning in session.warnings)
    add("POINT", energy=10.0)
    session.take_lights(bpy.context.evaluated_depsgraph_get())
    assert any("Lights: 9 shine" in warning for warning in session.warnings)
    assert len(session.snapshot.lights) == LIGHT_CAPACITY


@pytest.mark.parametrize("world", [None, (0.0, 0.0, 0.0), (0.2, 0.1, 0.3)])
def test_a_scene_without_light_is_reported_if_a_view_uses_scene_lights(
    new_hair: Any, sphere: Any, world: Any
) -> None:
    hair = new_hair(sphere)
    if world is not None:
        bpy.context.scene.world = bpy.data.worlds.new("World")
        node = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
        node.inputs["Color"].default_value = (*world, 1.0)
    session = Session(hair, bpy.context.evaluated_depsgraph_get())
    assert view_shadings()
    for shading in view_shadings():
        shading.type = "SOLID"
    assert not any("no light" in warning for warning in session.warnings)
    view_shadings()[0].type = "RENDERED"
    (warning,) = (warning for warning in session.warnings if "no light" in warning)
    assert ("studio" in warning) is (world is None or not any(world))
    assert "Add a light" in warning and warning.endswith(".")
    add("POINT", energy=10.0)
    session.take_lights(bpy.context.evaluated_depsgraph_get())
    assert not any("no light" in warning for warning in session.warnings)


STUDIO_WORLDS = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"


def view(kind: str, lights: bool, has_world: bool, picture: str = "forest.exr") -> Any:
    """A 3D view's shading; picture: its studio HDRI, "" for none, as in Solid mode."""
    names = ("type", "use_scene_lights", "use_scene_world")
    names += ("use_scene_lights_render", "use_scene_world_render")
    values = (kind, lights, has_world, lights, has_world)
    light = SimpleNamespace(type="WORLD", path=str(STUDIO_WORLDS / picture)) if picture else None
    return SimpleNamespace(
        **dict(zip(names, values, strict=True)),
        selected_studio_light=light,
        studiolight_rotate_z=0.0,
        studiolight_intensity=1.0,
    )


def bare(**values: Any) -> Snapshot:
    """A snapshot without hair in this light."""
    return Snapshot(np.zeros((0, 2, 3), np.float32), np.ones((0, 2), np.float32), **values)


def test_hair_is_lit_like_blenders_meshes_and_never_black() -> None:
    """The view's HDRI is used where Blender uses it, studio lights if there is no light at all."""
    studio, lamp, world = three_point_lights(np.eye(4)), Light.sun((0, 0, -1), (1, 1, 1), 1.0), 0.3
    sun = Light("sun", (1.0, 0.0, 0.0), (2.0, 2.0, 2.0), is_from_world=True)

    def shown(shading: Any, lamps: Any, grey: float) -> Any:
        snapshot = with_view_lights(bare(lights=lamps, ambient=(grey, grey, grey)), shading, studio)
        return snapshot.lights, snapshot.ambient[0]

    plain = Snapshot.ambient[0]
    assert shown(view("SOLID", True, True), (lamp,), world) == (studio, plain)
    for kind in ("MATERIAL", "RENDERED"):
        picture = studio_environment(view(kind, False, False))
        assert picture.ambient[0] > 0.0 and picture.harmonics is not None
        assert shown(view(kind, True, True), (sun, lamp), world) == ((sun, lamp), world)
        assert shown(view(kind, False, True), (lamp, sun), world) == ((sun,), world)
        assert shown(view(kind, True, True), (), world) == ((), world)
        of_picture = picture.ambient[0]
        assert shown(view(kind, True, False), (lamp, sun), world) == (
            (*picture.suns, lamp),
            of_picture,
        ), "no lamp takes their place"
        assert shown(view(kind, False, False), (lamp,), world) == (picture.suns, of_picture)
        assert shown(view(kind, True, False, ""), (), world) == (studio, plain)
        assert shown(view(kind, True, False, "none.exr"), (), world) == (studio, plain)
        assert shown(view(kind, True, True), (), 0.0) == (studio, plain)


def test_the_views_picture_turns_and_gets_brighter() -> None:
    shading = view("MATERIAL", False, False, "sunset.exr")
    still = studio_environment(shading)
    assert studio_environment(shading) is still, "each is made once"
    shading.studiolight_intensity = 2.0
    assert studio_environment(shading).ambient == pytest.approx(2.0 * np.array(still.ambient))
    shading.studiolight_intensity, shading.studiolight_rotate_z = 1.0, 0.5 * np.pi
    turned = studio_environment(shading)
    assert turned.ambient == pytest.approx(still.ambient)
    # the lookup is turned by a quarter, so the light turns the other way
    x, y, z = np.eye(3)
    assert radiance_from(turned, -y) == pytest.approx(radiance_from(still, x), rel=1e-3)
    assert radiance_from(turned, z) == pytest.approx(radiance_from(still, z), rel=1e-3)


def test_a_light_that_is_deleted_shines_no_longer(new_hair: Any, sphere: Any) -> None:
    hair, lamp = new_hair(sphere), add("POINT", energy=10.0)
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    assert len(session.snapshot.lights) == 1
    bpy.data.objects.remove(lamp)
    bpy.context.view_layer.update()
    assert session.snapshot.lights == ()
