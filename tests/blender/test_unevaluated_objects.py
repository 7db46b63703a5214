"""Previews of objects that Blender does not evaluate: in other scenes, or hidden."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from fin_motion import start_fin, update_view_layer
from grids import strand_grid
from swinging import play_frames

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.phases import Phase
from hairloom.addon.blender.scene.fin_modifier import is_shown
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.ui import operators_preview

FRAME = 1.0 / 24.0


def show(name):
    """Show the scene of this name in the window; it is made if it does not exist."""
    scene = bpy.data.scenes.get(name) or bpy.data.scenes.new(name)
    bpy.context.window.scene = scene
    update_view_layer()
    return scene


def phase_of(session):
    return previews.previews[session.uid].phase


def hide_objects(is_hidden):
    for name in ("Hair", "Head"):
        bpy.data.objects[name].hide_viewport = is_hidden


def hide_collection(is_hidden):
    bpy.data.collections["Groom"].hide_viewport = is_hidden


def exclude(is_hidden):
    bpy.context.view_layer.layer_collection.children["Groom"].exclude = is_hidden


@pytest.fixture
def groom(preview, get_depsgraph):
    """Previewed hair on a head with a modifier, in their own collection: (head, session)."""
    hair, head, session = preview
    previews.stop(session)
    collection = bpy.data.collections.new("Groom")
    bpy.context.scene.collection.children.link(collection)
    for obj in (hair, head):
        for each in obj.users_collection:
            each.objects.unlink(obj)
        collection.objects.link(obj)
    head.modifiers.new("Subdivision", "SUBSURF").levels = 1
    return head, previews.start(hair, get_depsgraph())


@pytest.mark.parametrize("hide", [hide_objects, hide_collection, exclude])
def test_hidden_hair_is_read_again_when_it_is_shown(hide, groom, get_depsgraph):
    head, session = groom
    at_rest = strand_grid(session)
    hide(True)
    update_view_layer()
    bpy.context.scene.frame_set(2)
    head.location.x = 1.0
    scene_events.undone()
    scene_events.catch_up(get_depsgraph())
    assert previews.sessions() == (session,) and previews.notice() == ""
    assert not overlay.drawing_of(session.uid).is_visible
    hide(False)
    update_view_layer()
    scene_events.catch_up(get_depsgraph())
    assert overlay.drawing_of(session.uid).is_visible and not session.is_stale
    assert strand_grid(session) == pytest.approx(at_rest + np.array([1.0, 0.0, 0.0]), abs=1e-6)


def test_hidden_hair_that_plays_goes_on_when_it_is_shown(groom, get_depsgraph):
    _, session = groom
    previews.play(get_depsgraph())
    play_frames(get_depsgraph, 3)
    hide_collection(True)
    play_frames(get_depsgraph, 3)
    assert previews.is_playing() and previews.notice() == ""
    hide_collection(False)
    play_frames(get_depsgraph, 3)
    assert phase_of(session) is Phase.FREE and session.is_playing


def test_play_begins_hair_of_its_own_scene_alone(groom, get_depsgraph, new_hair):
    _, session = groom
    show("Other")
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    other = previews.start(new_hair(bpy.context.object), get_depsgraph())
    assert previews.play(get_depsgraph()) == []
    assert (phase_of(session), phase_of(other)) == (Phase.REST, Phase.FREE)


def test_stop_stops_hair_and_cloth_of_another_scene(groom, flag_object, get_depsgraph):
    head, session = groom
    scene, at_rest = bpy.context.scene, strand_grid(session)
    start_fin(flag_object, get_depsgraph)
    previews.play(get_depsgraph())
    for step in range(4):
        head.location.x = 0.02 * (step + 1)
        play_frames(get_depsgraph, 1)
    assert is_shown(flag_object)
    show("Other")
    assert previews.is_playing()
    previews.rest(get_depsgraph(), keep_playing=False)
    assert not previews.is_playing() and not bpy.ops.hairloom.stop.poll()
    assert not is_shown(flag_object)
    show(scene.name)
    scene_events.catch_up(get_depsgraph())
    carried = at_rest + np.array([head.location.x, 0.0, 0.0])
    assert strand_grid(session) == pytest.approx(carried, abs=2e-6)


def test_each_scene_that_plays_goes_on_in_a_window_of_its_own(
    groom, get_depsgraph, new_hair, monkeypatch
):
    here, _ = bpy.context.scene, groom
    other_scene = show("Other")
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    other = previews.start(new_hair(bpy.context.object), get_depsgraph())
    previews.play(get_depsgraph())
    windows = [
        SimpleNamespace(scene=each, view_layer=each.view_layers[0])
        for each in (here, here, other_scene)
    ]
    context = SimpleNamespace(window_manager=SimpleNamespace(windows=windows))
    with monkeypatch.context() as patch:
        patch.setattr(previews, "bpy", SimpleNamespace(context=context))
        assert list(previews.playing_windows().values()) == [windows[2]]
    show(here.name)
    previews.play(get_depsgraph())
    with monkeypatch.context() as patch:
        patch.setattr(previews, "bpy", SimpleNamespace(context=context))
        assert list(previews.playing_windows().values()) == [windows[0], windows[2]]
    assert phase_of(other) is Phase.FREE


def test_each_scene_that_plays_goes_by_a_clock_of_its_own(preview, get_depsgraph, monkeypatch):
    now, window, advanced = [100.0], bpy.context.window, []
    monkeypatch.setattr(operators_preview, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr(previews, "playing_windows", lambda: {1: window, 2: window})
    monkeypatch.setattr(previews, "advance", lambda _, duration: advanced.append(duration))
    previews.play(get_depsgraph())
    ticks = operators_preview._Ticks()
    for _ in range(3):
        ticks.tick()
        now[0] += 1.01 * FRAME
    assert advanced == 4 * [pytest.approx(FRAME)]
