"""Copies made during a preview: the preview goes on, and copies are hair in their own right."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from grids import baked_grid, strand_grid
from swinging import tips_lag

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.base.objects import head_of
from hairloom.addon.blender.engine import engine_hair
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.viewport import overlay

LINKED = pytest.mark.parametrize("linked", [False, True], ids=["Shift-D", "Alt-D"])


@pytest.fixture
def playing(new_hair, sphere, get_depsgraph):
    """Hair that plays on a head: `hair`, `head` and `session`."""
    hair = new_hair(sphere)
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    session = previews.start(hair, get_depsgraph())
    assert previews.play(get_depsgraph()) == []
    return SimpleNamespace(hair=hair, head=sphere, session=session)


def duplicated(*objects, linked):
    """Duplicate objects as Blender's keys do: they act on the selection, and select the copies."""
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    before = set(bpy.data.objects)
    assert bpy.ops.object.duplicate(linked=linked) == {"FINISHED"}
    copies = {obj.type: obj for obj in set(bpy.data.objects) - before}
    return copies["CURVES"], copies.get("MESH")


def goes_on(playing):
    """Assert that only this hair is previewed, still swings, and that there is no notice."""
    assert previews.sessions() == (playing.session,) and previews.notice() == ""
    assert playing.session.is_playing and tips_lag(playing.session)


@LINKED
def test_a_duplicate_beside_hair_that_plays_is_shown_by_blender(linked, playing, get_depsgraph):
    twin, _ = duplicated(playing.hair, linked=linked)
    goes_on(playing)
    assert twin.evaluated_get(get_depsgraph()).display_type == "TEXTURED"
    assert playing.hair.evaluated_get(get_depsgraph()).display_type == "WIRE"
    assert twin.hairloom.dynamics.device == "numpy"
    twin.hairloom.dynamics.gusts, twin.data.hairloom.shading.ambient = 0.875, 0.25
    bpy.data.objects.remove(twin)
    bpy.context.view_layer.update()
    goes_on(playing)
    shading = overlay.drawing_of(playing.session.uid).snapshot.shading
    assert playing.hair.hairloom.dynamics.gusts != 0.875
    assert shading.ambient == (0.25 if linked else 1.0), "the curves have the look"


@LINKED
def test_a_duplicate_of_hair_and_head_goes_with_its_own_head(linked, playing, get_depsgraph):
    twin, head = duplicated(playing.hair, playing.head, linked=linked)
    assert head_of(twin) == head and head_of(playing.hair) == playing.head
    head.location = (1.0, 0.5, 0.0)
    bpy.context.view_layer.update()
    session = previews.start(twin, get_depsgraph())
    assert session.warnings == ()
    assert strand_grid(session).mean(axis=(0, 1))[0] == pytest.approx(1.0, abs=0.02)
    previews.play(get_depsgraph())
    other = strand_grid(playing.session)
    assert tips_lag(session) and tips_lag(playing.session)
    assert np.abs(other[..., 0]).max() < 0.5, "the first stays where it is"
    found = engine_hair.read_groom(twin, get_depsgraph())
    assert found.points.mean(axis=0)[0] > 1.0


def test_hair_that_shares_its_curves_is_combed_and_coloured_together(playing, get_depsgraph):
    twin, _ = duplicated(playing.hair, linked=True)
    sessions = playing.session, previews.start(twin, get_depsgraph())
    previews.rest(get_depsgraph(), keep_playing=False)
    twin.data.hairloom.shading.ambient = 0.5
    playing.hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    playing.hair.data.update_tag()
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    for session in sessions:
        assert strand_grid(session)[0, -1] == pytest.approx([0.0, 0.0, 0.5], abs=1e-5)
        assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 0.5


def test_undoing_a_duplicate_keeps_the_original(playing, get_depsgraph):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="begin")
    duplicated(playing.hair, playing.head, linked=False)
    bpy.ops.ed.undo_push(message="duplicate")
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == 2
    scene_events.catch_up(get_depsgraph())
    goes_on(playing)


@pytest.mark.parametrize("link", [False, True], ids=["appended", "linked"])
def test_hair_of_the_same_name_from_a_file(link, playing, get_depsgraph, tmp_path):
    file = str(tmp_path / "groom.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file, copy=True)
    with bpy.data.libraries.load(file, link=link) as (_, data_to):
        data_to.objects = ["Hair", "Head"]
    for obj in data_to.objects:
        bpy.context.scene.collection.objects.link(obj)
    theirs = data_to.objects[0]
    bpy.context.view_layer.update()
    goes_on(playing)
    playing.hair.name = "Wig"  # "Hair" may now be another object
    assert (bpy.data.objects.get("Hair") == theirs) == link
    goes_on(playing)
    second = previews.start(theirs, get_depsgraph())
    assert set(previews.sessions()) == {playing.session, second} and previews.notice() == ""


def test_grooms_keep_their_bakes_when_names_are_exchanged(playing, get_depsgraph):
    twin, head = duplicated(playing.hair, playing.head, linked=False)
    for one, other in ((playing.hair, twin), (playing.head, head)):
        name, one.name = one.name, "Between"
        other.name, one.name = name, other.name
    assert twin.name == "Hair" and playing.hair.name == "Hair.001"
    goes_on(playing)
    assert previews.session_of(twin) is None and playing.session.name == "Hair.001"


@pytest.mark.parametrize("kind", ["NEW", "LINK_COPY", "FULL_COPY"])
def test_a_copy_in_another_scene(kind, playing, get_depsgraph):
    window, first = bpy.context.window, bpy.context.scene
    if kind == "NEW":
        second = bpy.data.scenes.new("Second")
        playing.hair.select_set(True)
        playing.head.select_set(True)
        assert bpy.ops.object.make_links_scene(scene=second.name) == {"FINISHED"}
    else:
        bpy.ops.scene.new(type=kind)
        second = window.scene
    window.scene = second
    bpy.context.view_layer.update()
    (hair,) = (obj for obj in second.objects if obj.type == "CURVES")
    assert (hair == playing.hair) == (kind != "FULL_COPY")
    assert previews.sessions() == (playing.session,) and previews.notice() == ""
    drawn = overlay.drawing_of(playing.session.uid)
    if kind == "FULL_COPY":
        assert not drawn.is_visible
        assert head_of(hair) in tuple(second.objects), "it grows from the copied head"
        previews.start(hair, get_depsgraph())
        previews.stop(previews.session_of(hair))
    else:
        goes_on(playing)
    window.scene = first
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    assert overlay.drawing_of(playing.session.uid).is_visible
    goes_on(playing)


@pytest.fixture
def baked(playing, tmp_path):
    """The hair of `playing`, baked over three frames."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    bake(playing.hair)
    return playing.hair


def bake(hair):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.hairloom.bake() == {"FINISHED"}


@LINKED
def test_renders_show_a_duplicate_by_its_own_bake(linked, baked, playing):
    copy = baked.hairloom.bake.copy
    twin, head = duplicated(baked, playing.head, linked=linked)
    head.location.x = 1.0
    bake(twin)
    other = twin.hairloom.bake.copy
    assert other not in (None, copy) and baked.hairloom.bake.copy == copy
    bpy.context.scene.frame_set(2)
    for hair, shown, x in ((baked, copy, 0.0), (twin, other, 1.0)):
        assert engine_hair.owner_of(shown) == hair and hair.hide_render and not shown.hide_render
        points = np.empty((len(shown.data.position_data), 3), np.float32)
        shown.data.position_data.foreach_get("vector", points.ravel())
        strands = baked_grid(playback.cache_of(hair), 2)
        assert np.array_equal(points, strands.reshape(-1, 3))
        assert points[:, 0].mean() == pytest.approx(x, abs=0.02)
    bake(baked)
    assert baked.hairloom.bake.copy == copy, "and again"


def test_a_copied_scene_has_a_copy_of_its_own_for_renders(baked):
    copy = baked.hairloom.bake.copy
    bpy.ops.scene.new(type="FULL_COPY")
    (twin,) = (o for o in bpy.context.scene.objects if o.type == "CURVES" and o.parent is not None)
    other = twin.hairloom.bake.copy
    assert other not in (None, copy) and other.name in bpy.context.scene.objects
    assert engine_hair.owner_of(other) == twin and engine_hair.owner_of(copy) == baked
    bake(twin)
    assert twin.hairloom.bake.copy == other and baked.hairloom.bake.copy == copy


def test_the_copy_of_a_bake_is_there_as_long_as_any_hair_names_it(baked, playing):
    copy = baked.hairloom.bake.copy
    name = copy.name
    twin, _ = duplicated(baked, linked=False)
    bpy.ops.object.select_all(action="DESELECT")
    baked.select_set(True)
    bpy.context.view_layer.objects.active = baked
    assert bpy.ops.hairloom.bake_free("EXEC_DEFAULT") == {"FINISHED"}
    assert not baked.hide_render and baked.hairloom.bake.copy is None
    assert twin.hairloom.bake.copy == copy and engine_hair.owner_of(copy) == twin
    bpy.ops.object.select_all(action="DESELECT")
    twin.select_set(True)
    bpy.context.view_layer.objects.active = twin
    assert bpy.ops.hairloom.bake_free("EXEC_DEFAULT") == {"FINISHED"}
    assert name not in bpy.data.objects and not twin.hide_render
