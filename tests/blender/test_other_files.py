"""Grooms from other files and older versions, and animated or driven settings."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from grids import baked_grid, strand_grid
from selecting import select
from swinging import FRAME_S, key_x, tips_lag
from tiers import few_in_commits

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.engine import engine_hair
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake, free, show_in_renders
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

#: saved before there were shadows, displayed cards, densities and debug views
OLD = Path(__file__).parents[1] / "data" / "first_settings.blend"


@pytest.fixture
def library(new_hair, sphere, tmp_path):
    """A file with a groom on its head, in the collection Groom."""
    hair = new_hair(sphere)
    collection = bpy.data.collections.new("Groom")
    bpy.context.scene.collection.children.link(collection)
    for obj in (hair, sphere):
        collection.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
    hair.hairloom.dynamics.damping = 2.0
    hair.data.hairloom.shading.ambient = 0.5
    file = str(tmp_path / "groom.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return file


def brought(file, *, link):
    with bpy.data.libraries.load(file, link=link) as (_, data_to):
        data_to.collections = ["Groom"]
    return bpy.data.collections["Groom"]


def settings(hair):
    found = GroomSettings.of(hair)
    return found[DynamicsSettings].damping, found[ShadingSettings].ambient


def plays(hair):
    """Whether previewed hair lags behind a head that moves."""
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    assert previews.play(bpy.context.evaluated_depsgraph_get()) == []
    return tips_lag(session)


@pytest.mark.slow
def test_an_appended_groom_keeps_its_settings_and_moves(library):
    bpy.context.scene.collection.children.link(brought(library, link=False))
    hair = bpy.data.objects["Hair"]
    assert settings(hair) == (2.0, 0.5) and hair.library is None
    assert plays(hair)


def test_a_linked_groom_is_shown_as_it_is_there(library):
    bpy.context.scene.collection.children.link(brought(library, link=True))
    hair = bpy.data.objects["Hair"]
    assert settings(hair) == (2.0, 0.5) and hair.library is not None
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    assert previews.play(bpy.context.evaluated_depsgraph_get()) == []
    previews.advance(bpy.context.evaluated_depsgraph_get(), FRAME_S)
    assert np.isfinite(strand_grid(session)).all() and previews.notice() == ""


@pytest.fixture
def linked(library):
    """Hair of the library, linked and selected, beside a selected local Empty."""
    bpy.context.scene.collection.children.link(brought(library, link=True))
    hair, empty = bpy.data.objects["Hair"], bpy.data.objects.new("Cut", None)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    select(hair)
    return hair


@pytest.mark.parametrize(
    ("operator", "options"),
    [
        ("add_hair_tie", {}),
        ("add_parting", {}),
        ("add_stroke", {}),
        ("trim_to_shape", {}),
        ("apply_preset", {"name": "looks/blond"}),
        ("look_to_material", {}),
    ],
)
def test_tools_refuse_linked_hair_which_would_forget_what_they_do(operator, options, linked):
    """Undo crashes Blender where linked data refers to what the undo removes."""
    if operator == "trim_to_shape":
        bpy.data.objects["Cut"].select_set(True)
    blocks, before = len(bpy.data.user_map()), GroomSettings.of(linked)
    with pytest.raises(RuntimeError, match="Hair: it is linked from another file"):
        getattr(bpy.ops.hairloom, operator)(**options)
    assert len(bpy.data.user_map()) == blocks, "something was added"
    assert GroomSettings.of(linked) == before and not linked.data.materials


def test_linked_hair_stays_as_its_file_has_it_where_other_objects_are_made(linked, capfd):
    """Undo does not bring changes of linked data back."""
    before = GroomSettings.of(linked)
    assert bpy.ops.hairloom.use_groom() == {"FINISHED"}
    assert GroomSettings.of(linked) == before
    select(linked)
    assert bpy.ops.hairloom.make_real() == {"FINISHED"}
    assert not linked.hide_render and not linked.hide_viewport
    select(linked)
    assert bpy.ops.hairloom.fit_spheres(sphere_count=4) == {"FINISHED"}
    assert linked.hairloom.collider_collection is None
    assert linked.parent.hairloom.collider_shape == "automatic"
    said = capfd.readouterr().out
    assert "still shown" in said and "does not use them" in said and "still collides" in said
    assert bpy.data.objects["Hair Real"].hairloom.collider_collection is not None


def test_an_override_has_settings_of_its_own_which_last(override, tmp_path):
    hair = override
    hair.hairloom.dynamics.damping = 5.0
    hair.hairloom.bake.is_shown = False
    hair.hairloom.debug_view = "guide"
    hair.data.hairloom.shading.ambient = 0.25
    assert plays(hair)
    previews.stop_all()
    hair = saved_and_loaded(tmp_path)
    assert hair.override_library is not None and settings(hair) == (5.0, 0.25)
    assert hair.hairloom.debug_view == "guide" and not hair.hairloom.bake.is_shown
    assert hair.data.hairloom.strands.fullness == 1.0, "what was not set is the library's"


@pytest.fixture
def override(library):
    """Hair of the library, overridden together with its curves and its head."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    brought(library, link=True).override_hierarchy_create(scene, layer)
    hair = next(obj for obj in scene.objects if obj.type == "CURVES")
    hair.data.override_create(remap_local_usages=True)
    return hair


def saved_and_loaded(tmp_path):
    file = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=file)
    return next(obj for obj in bpy.context.scene.objects if obj.type == "CURVES")


def test_groups_that_the_library_has_not_got_are_kept_on_overrides(override, tmp_path):
    # these settings were never touched in the library
    override.data.hairloom.shafts.strength = 0.75
    override.data.hairloom.children.method = "multi"
    override.hairloom.bake.in_renders = not (before := override.hairloom.bake.in_renders)
    bpy.ops.ed.undo_push(message="Set")  # Blender also compares with the library at an undo step
    hair = saved_and_loaded(tmp_path)
    assert hair.data.override_library is not None
    assert hair.data.hairloom.shafts.strength == 0.75
    assert hair.data.hairloom.children.method == "multi"
    assert hair.hairloom.bake.in_renders is not before
    assert settings(hair) == (2.0, 0.5), "the library's"


def test_pictures_and_owner_of_cards_can_be_overridden(override, tmp_path):
    image = bpy.data.images.new("Strands", 4, 4)
    image.pack()
    head = override.parent
    override.data.hairloom.card_images.alpha = image
    head.hairloom.card_object.groom = override
    head.hairloom.card_object.level = 2
    head.hairloom.card_object.image = image
    head.hairloom.collider_shape = "sphere"
    hair = saved_and_loaded(tmp_path)
    head = hair.parent
    assert hair.data.hairloom.card_images.alpha == bpy.data.images["Strands"]
    assert head.hairloom.card_object.groom == hair and head.hairloom.card_object.level == 2
    assert head.hairloom.card_object.image == bpy.data.images["Strands"]
    assert head.hairloom.collider_shape == "sphere"


def test_an_override_plays_the_bake_of_the_library_until_it_is_baked_itself(library, tmp_path):
    """Also in a file in another folder, where the relative path of the bake points elsewhere."""
    bpy.ops.wm.open_mainfile(filepath=library)
    hair, scene = bpy.data.objects["Hair"], bpy.context.scene
    scene.frame_end = 2
    list(Bake.of([hair], scene).steps())
    assert hair.hairloom.bake.folder.startswith("//")
    baked = playback.cache_of(hair).folder
    bpy.ops.wm.save_mainfile()
    (tmp_path / "shot").mkdir()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot" / "groom.blend"))
    scene = bpy.context.scene
    brought(library, link=True).override_hierarchy_create(scene, bpy.context.view_layer)
    hair = next(obj for obj in scene.objects if obj.type == "CURVES")
    assert playback.cache_of(hair).folder == baked
    hair = saved_and_loaded(tmp_path / "shot")
    assert playback.cache_of(hair).folder == baked
    bpy.context.scene.frame_end = 3
    list(Bake.of([hair], bpy.context.scene).steps())
    own = playback.cache_of(hair)
    assert own.folder.is_relative_to(tmp_path / "shot") and own.facts.frame_count == 3
    assert Cache(baked).facts.frame_count == 2
    free(hair, bpy.context.evaluated_depsgraph_get())
    assert not own.folder.exists() and baked.exists()


@pytest.fixture
def shot(library, tmp_path):
    """A file in its own folder, which links hair that is baked in its library; and that bake."""
    bpy.ops.wm.open_mainfile(filepath=library)
    hair, scene = bpy.data.objects["Hair"], bpy.context.scene
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    scene.frame_start, scene.frame_end = 1, 3
    list(Bake.of([hair], scene).steps())
    baked = playback.cache_of(hair).folder
    bpy.ops.wm.save_mainfile()
    (tmp_path / "shot").mkdir()
    file = str(tmp_path / "shot" / "shot.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 2
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.context.scene.collection.children.link(brought(library, link=True))
    bpy.ops.wm.save_mainfile()
    return file, baked


def test_linked_hair_is_not_baked_over_the_bake_of_its_library(shot, capfd):
    file, baked = shot
    assert command_line.run(["bake", "--scene", file]) == 1
    assert "it is linked from groom.blend" in capfd.readouterr().err
    with pytest.raises(HairloomError, match="Make a library override"):
        free(bpy.data.objects["Hair"], bpy.context.evaluated_depsgraph_get())
    assert Cache(baked).facts.frame_count == 3


def test_a_scene_that_would_not_play_the_bake_of_linked_hair_is_not_saved(shot, tmp_path, capfd):
    """The bake itself may be written to a folder, to be exported."""
    file, folder, saved = shot[0], tmp_path / "out", tmp_path / "played.blend"
    bake = ["bake", "--scene", file, "--output", str(folder)]
    for option in (["--save"], ["--save-as", str(saved)]):
        assert command_line.run([*bake, *option]) == 1
        assert "would not play its bake" in capfd.readouterr().err
    assert not folder.exists() and not saved.exists()
    assert command_line.run(bake) == 0
    assert Cache(folder).facts.frame_count == 2 and Cache(shot[1]).facts.frame_count == 3


def test_settings_that_a_saved_scene_would_lose_are_refused(library, tmp_path, capfd):
    """An override of an object has its own dynamics; its curves, with the look, stay linked."""
    linked = next(obj for obj in brought(library, link=True).objects if obj.type == "CURVES")
    bpy.context.scene.collection.objects.link(linked)
    hair = linked.override_create(remap_local_usages=True)
    assert hair.library is None and hair.data.library is not None
    hair.hairloom.dynamics.device, hair.hairloom.dynamics.collider_resolution = "numpy", 8
    file = str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bake = ["bake", "--scene", file, "--output", str(tmp_path / "out"), "--frames", "1", "1"]
    for lost in (["--preset", "looks/blond"], ["--set", "shading.ambient=0.25"]):
        assert command_line.run([*bake, "--save", *lost]) == 1
        assert "would not have these settings" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
    assert command_line.run([*bake, "--save", "--set", "dynamics.damping=5"]) == 0
    bpy.ops.wm.open_mainfile(filepath=file)
    hair = next(obj for obj in bpy.context.scene.objects if obj.type == "CURVES")
    assert hair.hairloom.dynamics.damping == 5.0


@pytest.mark.parametrize("is_alone", [True, False])
def test_hair_of_an_instance_is_reported_as_left_out(library, new_hair, tmp_path, capfd, is_alone):
    """The usual layout of shots: instances of characters, whose hair the render engine draws."""
    if not is_alone:
        new_hair()
    empty = bpy.data.objects.new("Anna", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", brought(library, link=True)
    bpy.context.scene.collection.objects.link(empty)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    scene = ["--scene", str(tmp_path / "shot.blend")]
    for verb in (["export", "--output", str(tmp_path / "a.tfx")], ["bake", "--frames", "1", "1"]):
        assert command_line.run([*verb, *scene]) == (1 if is_alone else 0)
        output = capfd.readouterr()
        (line,) = [one for one in (output.err + output.out).splitlines() if "an instance" in one]
        assert line.startswith("hairloom: Anna: its hair") and "library override" in line


def test_saving_leaves_the_file_of_the_library_as_it_is(override, library, tmp_path):
    before = Path(library).read_bytes()
    saved_and_loaded(tmp_path)
    assert Path(library).read_bytes() == before


def test_a_file_of_an_old_version_keeps_its_settings_and_gets_defaults_for_new_ones(extension):
    bpy.ops.wm.open_mainfile(filepath=str(OLD))
    hair = bpy.data.objects["Hair"]
    found = GroomSettings.of(hair)
    assert found[ShadingSettings].base_color == (0.5, 0.25, 0.125)
    assert found[DynamicsSettings].damping == 2.0
    assert found[VolumeSettings] == VolumeSettings() and found.debug_view == "none"
    assert hair.hairloom.shown_overlays == set()
    assert plays(hair)


def keyed(owner, path, values):
    """Keyframe a setting: frame -> value."""
    group, _, name = path.rpartition(".")
    for frame, value in values.items():
        setattr(owner.path_resolve(group) if group else owner, name, value)
        owner.keyframe_insert(path, frame=frame)


def driven(owner, path, source):
    """Drive a setting by the x coordinate of an object."""
    driver = owner.driver_add(path).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id = source
    variable.targets[0].transform_type = "LOC_X"


def frames(scene, last):
    for frame in range(1, last + 1):
        scene.frame_set(frame)


def test_keyframes_and_drivers_act_in_preview_and_engine(new_hair, sphere, get_depsgraph):
    hair, scene = new_hair(sphere), bpy.context.scene
    source = bpy.data.objects.new("Source", None)
    scene.collection.objects.link(source)
    keyed(hair.data, "hairloom.strands.fullness", {1: 1.0, 5: 3.0})
    driven(hair.data, "hairloom.shading.ambient", source)
    session = previews.start(hair, get_depsgraph())
    source.location.x = 0.75
    scene.frame_set(5)
    snapshot = overlay.drawing_of(session.uid).snapshot
    assert (snapshot.strand_settings.fullness, snapshot.shading.ambient) == (3.0, 0.75)
    found = engine_hair.read_groom(hair, get_depsgraph())
    assert (found.strand_settings.fullness, found.shading.ambient) == (3.0, 0.75)


@pytest.mark.slow(instead="test_keyframes_and_drivers_act_in_preview_and_engine")
@pytest.mark.parametrize("is_previewed", few_in_commits([True, False]))
def test_a_rendered_animation_has_the_settings_of_each_frame(
    is_previewed, engine_scene, new_hair, sphere, get_depsgraph, monkeypatch, tmp_path
):
    hair, source = new_hair(sphere), bpy.data.objects.new("Source", None)
    engine_scene.collection.objects.link(source)
    keyed(hair.data, "hairloom.strands.fullness", {1: 1.0, 3: 3.0})
    keyed(hair, "hairloom.debug_view", {1: "none", 3: "guide"})
    driven(hair.data, "hairloom.shading.ambient", source)
    keyed(source, "location", {1: (0.0, 0.0, 0.0), 3: (1.0, 0.0, 0.0)})
    if is_previewed:
        previews.start(hair, get_depsgraph())
    found, read = {}, engine_hair.read_groom

    def reading(*arguments, **named):
        snapshot = read(*arguments, **named)
        values = snapshot.strand_settings.fullness, snapshot.shading.ambient
        found[engine_scene.frame_current] = (*values, snapshot.debug_view)
        return snapshot

    monkeypatch.setattr(engine_hair, "read_groom", reading)
    engine_scene.frame_start, engine_scene.frame_end, engine_scene.render.filepath = (
        1,
        3,
        str(tmp_path / "frame_"),
    )
    bpy.ops.render.render(animation=True)
    assert found[1] == (1.0, 0.0, "none") and found[2][:2] == pytest.approx((2.0, 0.5))
    assert found[3] == (3.0, 1.0, "guide")


@pytest.mark.parametrize("animated_by", ["keyframe", "driver"])
def test_an_animated_wind_blows_hair_in_playback_and_in_a_bake(
    animated_by, new_hair, sphere, get_depsgraph, tmp_path
):
    hair, scene = new_hair(sphere), bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 6
    hair.hairloom.bake.follows = True
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.gusts = 0.0
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 16
    session = previews.start(hair, get_depsgraph())
    frames(scene, 6)
    still = strand_grid(session)
    path = "hairloom.dynamics.wind_speed"
    if animated_by == "keyframe":
        keyed(hair, path, {1: 0.0, 3: 40.0})
    else:
        source = bpy.data.objects.new("Source", None)
        scene.collection.objects.link(source)
        key_x(source, {1: 0.0, 3: 40.0})
        driven(hair, path, source)
    frames(scene, 6)
    blown = strand_grid(session)
    assert (blown - still)[:, -1, 0].mean() > 0.005
    list(Bake.of([hair], scene).steps())
    baked = baked_grid(playback.cache_of(hair), 6)
    np.testing.assert_array_equal(baked, blown)


def test_an_override_is_baked_and_shown_in_renders(override, tmp_path):
    """The overridden collection takes no other objects, so the scene's collection gets the copy."""
    override.hairloom.dynamics.collider_resolution = 8
    override.hairloom.bake.folder = str(tmp_path / "bake")
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 2
    list(Bake.of([override], bpy.context.scene).steps())
    show_in_renders([override], bpy.context.evaluated_depsgraph_get())
    copy = override.hairloom.bake.copy
    assert override.hide_render and copy.users_scene == (bpy.context.scene,)


def a_ring():
    """An Empty, a ring around z above the head."""
    ring = bpy.data.objects.new("Ring", None)
    ring.empty_display_type, ring.empty_display_size = "CIRCLE", 0.09
    ring.rotation_euler.x, ring.location.z = np.pi / 2.0, 0.12  # Blender draws circles around y
    return ring


def held_strands(hair, head):
    """The number of held strands, all of which must follow their anchor when the head moves."""
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    assert previews.play(bpy.context.evaluated_depsgraph_get()) == []
    rig = session.rig
    at = (rig.holds.strand, np.round(rig.holds.place).astype(int))
    before = strand_grid(session)[at]
    for _ in range(4):
        head.location.x += 0.02
        previews.advance(bpy.context.evaluated_depsgraph_get(), FRAME_S)
    np.testing.assert_allclose(
        strand_grid(session)[at] - before, [[0.08, 0, 0]] * len(before), atol=4e-3
    )
    assert session.warnings == ()
    count = len(rig.holds.strand)
    previews.stop_all()
    return count


@pytest.mark.slow
def test_hair_of_an_override_is_tied_by_the_button_and_stays_tied(override, tmp_path):
    ring, head = a_ring(), override.parent
    bpy.context.scene.collection.objects.link(ring)
    ring.parent = head
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    ring.select_set(True)
    override.select_set(True)
    bpy.context.view_layer.objects.active = override
    assert bpy.ops.hairloom.add_hair_tie() == {"FINISHED"}
    count = held_strands(override, head)
    assert count > 3
    hair = saved_and_loaded(tmp_path)
    assert hair.hairloom.tie_collection.objects[:] == [bpy.data.objects["Ring"]]
    assert held_strands(hair, hair.parent) == count


@pytest.mark.slow(instead="test_an_override_is_baked_and_shown_in_renders")
def test_ties_of_a_library_hold_hair_of_its_override(library):
    bpy.ops.wm.open_mainfile(filepath=library)
    ties = bpy.data.collections.new("Ties")
    bpy.data.collections["Groom"].children.link(ties)
    ties.objects.link(a_ring())
    bpy.data.objects["Ring"].parent = bpy.data.objects["Head"]
    bpy.data.objects["Hair"].hairloom.tie_collection = ties
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene, layer = bpy.context.scene, bpy.context.view_layer
    brought(library, link=True).override_hierarchy_create(scene, layer)
    hair = next(obj for obj in scene.objects if obj.type == "CURVES")
    assert held_strands(hair, hair.parent) > 3
