"""Distance fields that are built in a thread: hair stays at rest until they are ready."""

import threading
import weakref

import bpy
import numpy as np
import pytest
from grids import strand_grid
from waiting import wait_until, wait_until_playing

from hairloom.addon.blender.colliders import fields
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.phases import Phase
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface

COARSE = DynamicsSettings(collider_resolution=16)
FRAME = 1.0 / 60.0


@pytest.fixture(autouse=True)
def no_fields(cached_distance_fields, monkeypatch):
    monkeypatch.setattr(DistanceField, "from_surface", cached_distance_fields)
    fields.forget()
    yield
    fields.forget()


@pytest.fixture
def gate(monkeypatch):
    """Fields are held back until this event is set."""
    opened, make = threading.Event(), DistanceField.from_surface

    def wait_and_make(*arguments, **named):
        assert opened.wait(60.0)
        return make(*arguments, **named)

    monkeypatch.setattr(DistanceField, "from_surface", wait_and_make)
    yield opened
    opened.set()


def until_made():
    wait_until(fields.are_ready)


def surface_of(obj, get_depsgraph):
    return read_surface(obj, get_depsgraph(), need_uv=False, place=obj.name)


def test_a_field_is_the_same_whoever_makes_it_and_is_made_once(sphere, get_depsgraph, extension):
    surface = surface_of(sphere, get_depsgraph)
    with pytest.raises(fields.NotReadyError):
        fields.field_of(surface, COARSE, place="Head", blocking=False)
    beside = fields.field_of(surface, COARSE, place="Head")
    alone = DistanceField.from_surface(surface, COARSE)
    assert np.array_equal(beside.values, alone.values) and beside.cell == alone.cell
    again = surface_of(sphere, get_depsgraph)
    assert fields.field_of(again, COARSE, place="Another head", blocking=False) is beside
    finer = DynamicsSettings(collider_resolution=17)
    assert fields.field_of(again, finer, place="Head") is not beside


def test_a_failed_field_is_reported_at_each_request():
    flat = Surface(np.eye(3, dtype=np.float32), np.zeros((0, 3), np.int32))
    for name in ("Sheet", "Same sheet", "Sheet"):
        with pytest.raises(HairloomError, match="no faces") as caught:
            fields.field_of(flat, COARSE, place=name)
        assert caught.value.place == name


@pytest.mark.slow(instead="test_a_field_is_the_same_whoever_makes_it_and_is_made_once")
def test_only_the_latest_fields_are_cached(sphere, get_depsgraph, extension):
    surface = surface_of(sphere, get_depsgraph)
    first, *others = fields_wanted()
    oldest = fields.field_of(surface, first, place="Head")
    for settings in others:
        fields.field_of(surface, settings, place="Head")
    assert fields.field_of(surface, first, place="Head") is not oldest


def fields_wanted():
    """Settings for one more field than the cache keeps."""
    return [
        DynamicsSettings(collider_resolution=16 + number) for number in range(fields.MAX_CACHED + 1)
    ]


def made_beside(surface):
    """Build more fields than are kept, as previews do; returns a weak reference to the oldest."""
    for settings in fields_wanted():
        with pytest.raises(fields.NotReadyError):
            fields.field_of(surface, settings, place="Head", blocking=False)
    until_made()
    made = [
        fields.field_of(surface, settings, place="Head", blocking=False)
        for settings in fields_wanted()
    ]
    return weakref.ref(made[0])


@pytest.mark.slow
def test_previews_cache_only_the_latest_fields(new_hair, sphere, get_depsgraph, extension):
    oldest = made_beside(surface_of(sphere, get_depsgraph))
    previews.start(new_hair(sphere), get_depsgraph())
    assert oldest() is None


@pytest.mark.slow
def test_a_preview_takes_no_field_from_hair_that_waits_for_it(
    new_hair, sphere, get_depsgraph, gate
):
    waiting = previews.start(new_hair(sphere), get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    gate.set()
    oldest = made_beside(surface_of(sphere, get_depsgraph))
    assert previews.previews[waiting.uid].phase is Phase.WAITING
    previews.start(new_hair(sphere), get_depsgraph())
    assert oldest() is not None


def test_hair_that_waits_for_its_collider_is_at_rest_and_then_plays(
    new_hair, sphere, get_depsgraph, gate
):
    hair = new_hair(sphere)
    session = previews.start(hair, get_depsgraph())
    at_rest = strand_grid(session)
    assert previews.play(get_depsgraph(), blocking=False) == []
    assert (
        previews.is_playing()
        and previews.previews[session.uid].phase is Phase.WAITING
        and not session.is_playing
    )
    sphere.location.x = 0.05
    get_depsgraph()
    previews.advance(get_depsgraph(), FRAME)
    previews.rest(get_depsgraph(), keep_playing=True)
    assert previews.previews[session.uid].phase is Phase.WAITING
    assert strand_grid(session) == pytest.approx(at_rest + [0.05, 0.0, 0.0], abs=2e-6)
    gate.set()
    wait_until_playing(session, get_depsgraph, FRAME)
    assert previews.previews[session.uid].phase is not Phase.WAITING
    sphere.location.x = 0.08
    get_depsgraph()
    previews.advance(get_depsgraph(), FRAME)
    carried = at_rest + [0.08, 0.0, 0.0]
    assert np.abs(strand_grid(session) - carried)[:, -1].max() > 1e-3, "tips stay behind"


def test_stop_while_hair_waits_ends_the_waiting(new_hair, sphere, get_depsgraph, gate):
    session = previews.start(new_hair(sphere), get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    previews.rest(get_depsgraph(), keep_playing=False)
    assert not previews.is_playing()
    gate.set()
    until_made()
    previews.advance(get_depsgraph(), FRAME)
    assert not previews.is_playing() and not session.is_playing


def test_a_collider_that_cannot_be_built_is_left_out_with_a_warning(
    new_hair, sphere, get_depsgraph, extension
):
    hair = new_hair(sphere)
    bpy.ops.mesh.primitive_plane_add(size=0.1)
    hair.hairloom.collider = bpy.context.object
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    wait_until_playing(session, get_depsgraph, FRAME)
    assert any("encloses no volume" in warning for warning in session.warnings)


def test_more_meshes_than_are_kept_are_all_waited_for(new_hair, sphere, get_depsgraph, extension):
    hair = new_hair(sphere)
    hair.hairloom.dynamics.collider_resolution = 16
    colliders = bpy.data.collections.new("Colliders")
    bpy.context.scene.collection.children.link(colliders)
    for number in range(fields.MAX_CACHED + 2):
        bpy.ops.mesh.primitive_cube_add(size=0.02, location=(1.0 + number, 0.0, 0.0))
        colliders.objects.link(bpy.context.object)
    hair.hairloom.collider_collection = colliders
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    wait_until_playing(session, get_depsgraph, FRAME)
    assert len(session.scene_colliders.parts) == fields.MAX_CACHED + 3


def test_blenders_playback_waits_and_takes_over(new_hair, sphere, get_depsgraph, extension):
    hair = new_hair(sphere)
    hair.hairloom.bake.follows = True
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    bpy.context.scene.frame_set(bpy.context.scene.frame_start)
    previews.previews[session.uid].follow_frame(get_depsgraph())
    assert session.is_playing and previews.previews[session.uid].phase is not Phase.WAITING
    previews.advance(get_depsgraph(), FRAME)
    scene_events.clear()


def test_the_field_of_the_built_in_head_ships(monkeypatch):
    def made(*_, **__):
        raise AssertionError("it is made again")

    monkeypatch.setattr(DistanceField, "from_surface", made)
    surface, settings = built_in_head().surface, DynamicsSettings()
    found = fields.field_of(surface, settings, place="Head")
    assert found.surface is surface
    for other, finer in ((moved(surface), settings), (surface, COARSE)):
        with pytest.raises(AssertionError, match="made again"):
            fields.field_of(other, finer, place="Head")


@pytest.mark.slow(instead="test_the_field_of_the_built_in_head_ships")
def test_the_field_that_ships_is_the_one_that_would_be_made(cached_distance_fields):
    surface, settings = built_in_head().surface, DynamicsSettings()
    ships = fields.field_of(surface, settings, place="Head")
    made = cached_distance_fields(surface, settings)
    assert ships.cell == made.cell
    np.testing.assert_array_equal(ships.low, made.low)
    # other processors round differently
    np.testing.assert_allclose(ships.values, made.values, rtol=0.0, atol=1e-7)


def moved(surface):
    return Surface(surface.positions + np.float32(0.001), surface.triangles)
