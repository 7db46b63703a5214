"""Hair in several view layers: Blender's own strands are hidden in each, and shown again."""

import bpy
import pytest

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.viewport import overlay


@pytest.fixture
def layers(new_hair, sphere):
    """Two evaluated view layers that both contain the hair."""
    new_hair(sphere)
    found = [bpy.context.view_layer, bpy.context.scene.view_layers.new("Too")]
    update(found)
    yield found
    scene_events.clear()


def update(layers):
    for layer in layers:
        layer.update()


def displays(layers):
    hair = bpy.data.objects["Hair"]
    return [hair.evaluated_get(layer.depsgraph).display_type for layer in layers]


def test_blenders_strands_go_and_come_in_every_view_layer(layers):
    previews.start(bpy.data.objects["Hair"], layers[0].depsgraph)
    update(layers)
    assert displays(layers) == ["WIRE", "WIRE"]
    previews.stop_all()
    assert displays(layers) == ["TEXTURED", "TEXTURED"]


def test_a_layer_that_a_window_changes_to_is_evaluated(layers):
    timer, window = overlay._evaluate_scenes, bpy.context.window_manager.windows[0]
    overlay.stop_watching_view_layers()
    overlay.watch_view_layers()
    assert bpy.app.timers.is_registered(timer)
    bpy.app.timers.unregister(timer)
    overlay.watch_view_layers()
    assert not bpy.app.timers.is_registered(timer), "nothing is new"
    for layer in (layers[1], layers[0]):
        window.view_layer = layer
        overlay.watch_view_layers()
        assert bpy.app.timers.is_registered(timer)
        bpy.app.timers.unregister(timer)
    previews.start(bpy.data.objects["Hair"], layers[0].depsgraph)
    update(layers)
    layers[1].depsgraph.update()
    bpy.data.objects["Hair"].evaluated_get(layers[1].depsgraph).display_type = "TEXTURED"
    timer()
    update(layers)
    assert displays(layers) == ["WIRE", "WIRE"]
    window.view_layer = layers[1]
    overlay.watch_view_layers()
    overlay.stop_watching_view_layers()
    assert not bpy.app.timers.is_registered(timer), "a timer is left"


def test_a_local_view_in_a_workspace_that_no_window_shows_has_no_hair(
    new_hair, sphere, get_depsgraph
):
    hair, window = new_hair(sphere), bpy.context.window
    hair.select_set(False)
    sphere.select_set(True)
    area, screen = next(
        (area, screen)
        for workspace in bpy.data.workspaces
        for screen in workspace.screens
        for area in screen.areas
        if area.type == "VIEW_3D" and workspace != window.workspace
    )
    region = next(each for each in area.regions if each.type == "WINDOW")
    with bpy.context.temp_override(window=window, screen=screen, area=area, region=region):
        assert bpy.ops.view3d.localview(frame_selected=False) == {"FINISHED"}
    session = previews.start(hair, get_depsgraph())
    assert area.spaces.active.as_pointer() in overlay.drawing_of(session.uid).hiding_views
