"""Cloth with many faces is built in a thread, and nothing blocks until it is ready."""

from __future__ import annotations

import threading

import bpy
import numpy as np
import pytest
from waiting import wait_until

from hairloom.addon.blender.colliders.fields import NotReadyError
from hairloom.addon.blender.preview import fins, previews
from hairloom.addon.blender.preview import preview as preview_module
from hairloom.addon.blender.preview.phases import Phase
from hairloom.addon.blender.sessions import fabrics

FRAME = 1.0 / 24.0


@pytest.fixture
def sheet(flag_object):
    """The flag; its cloth is built in a thread, whatever its size."""
    before, fabrics.MAX_BLOCKING_TRIANGLES = fabrics.MAX_BLOCKING_TRIANGLES, 0
    bpy.context.view_layer.update()
    yield flag_object
    fabrics.MAX_BLOCKING_TRIANGLES = before


def test_play_begins_once_its_cloth_is_made_as_if_it_had_waited(sheet, get_depsgraph):
    session = fins.start(sheet, get_depsgraph())
    preview = previews.previews[session.uid]
    previews.begin(session, get_depsgraph(), blocking=False)
    assert preview.phase is Phase.WAITING and session.state is None
    assert previews.is_playing() and previews.waiting_names() == ("Flag",)
    wait_until(lambda: session.is_made)
    previews.advance(get_depsgraph(), FRAME)
    assert preview.phase is Phase.FREE and previews.waiting_names() == ()
    begun = session.state
    session.play(get_depsgraph())
    for one, other in ((begun.fabric, session.state.fabric), (begun, session.state)):
        assert np.array_equal(one.position, other.position)
    assert np.array_equal(begun.fabric.length, session.state.fabric.length)
    previews.advance(get_depsgraph(), FRAME)
    assert session.state.position[2].min() < -1e-3, "it does not fall"


def test_what_is_stopped_meanwhile_does_not_play(sheet, get_depsgraph, monkeypatch):
    may_end, fabric = threading.Event(), fabrics.ClothMesh.fabric
    monkeypatch.setattr(fabrics.ClothMesh, "fabric", lambda mesh: may_end.wait(60) and fabric(mesh))
    session = fins.start(sheet, get_depsgraph())
    previews.begin(session, get_depsgraph(), blocking=False)
    assert not session.is_made
    previews.rest(get_depsgraph(), keep_playing=False)
    assert session.is_made and not previews.is_playing(), "somebody waits for it"
    may_end.set()
    previews.advance(get_depsgraph(), FRAME)
    assert session.state is None and not session.is_playing


def test_a_mesh_that_moves_is_waited_for_once(sheet, get_depsgraph):
    session = fins.start(sheet, get_depsgraph())
    with pytest.raises(NotReadyError):
        session.play(get_depsgraph(), blocking=False)
    sheet.location.x = 0.3
    bpy.context.view_layer.update()
    wait_until(lambda: session.is_made)
    session.play(get_depsgraph(), blocking=False)
    assert session.state.position[0].mean() == pytest.approx(0.3, abs=1e-6)
    size = float(np.linalg.norm(np.ptp(session.state.position, axis=1)))
    assert session.state.fabric.size == pytest.approx(0.25 * size, rel=1e-6)


def test_a_changed_mesh_is_rebuilt_and_an_unchanged_one_is_kept(sheet, get_depsgraph):
    session = fins.start(sheet, get_depsgraph())
    with pytest.raises(NotReadyError):
        session.play(get_depsgraph(), blocking=False)
    wait_until(lambda: session.is_made)
    session.play(get_depsgraph(), blocking=False)
    first = session.state.fabric
    session.play(get_depsgraph(), blocking=False)
    assert session.state.fabric is first
    sheet.vertex_groups["Pins"].add([60], 1.0, "REPLACE")
    bpy.context.view_layer.update()
    with pytest.raises(NotReadyError):
        session.play(get_depsgraph(), blocking=False)
    wait_until(lambda: session.is_made)
    session.play(get_depsgraph(), blocking=False)
    assert session.state.fabric.pin[60] == 1.0


def test_a_small_cloth_is_not_waited_for(flag_object, get_depsgraph):
    bpy.context.view_layer.update()
    session = fins.start(flag_object, get_depsgraph())
    session.play(get_depsgraph(), blocking=False)
    assert session.state is not None


def test_playback_goes_on_and_its_next_round_begins_at_the_first_frame(
    sheet, get_depsgraph, monkeypatch
):
    session = fins.start(sheet, get_depsgraph())
    preview = previews.previews[session.uid]
    monkeypatch.setattr(preview_module, "_is_exact", lambda: False)
    bpy.context.scene.frame_set(1)
    assert preview.phase is Phase.DEFERRED and session.state is None
    wait_until(lambda: session.is_made)
    for frame in (2, 3, 1, 2):
        bpy.context.scene.frame_set(frame)
        assert preview.phase is Phase.TIMELINE, f"frame {frame}"
