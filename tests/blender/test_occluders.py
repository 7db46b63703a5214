"""Cards of other grooms can shade cards that are made, written or sorted."""

from __future__ import annotations

import threading

import bpy
import numpy as np
import pytest
from sorting import sort_mesh
from tiers import few_in_commits
from waiting import run_steps_until

from hairloom.addon import card_flow
from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.cards.adopt import SortOptions
from hairloom.addon.blender.cards.build import read_inputs
from hairloom.addon.blender.cards.made_objects import card_objects
from hairloom.addon.blender.cards.occluders import read_occluders
from hairloom.addon.blender.engine.engine_hair import read_groom
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings


@pytest.fixture
def hair(new_hair, sphere):
    """A hedgehog on a sphere, with cards of its own."""
    made = new_hair(sphere)
    groom = made.data.hairloom
    groom.cards.source, groom.cards.card_count, groom.cards.levels = "clusters", 12, 2
    groom.atlas.source, groom.card_occlusion.rays = "made", 64
    groom.cards.order_by = "distance"
    groom.card_texture.height = groom.card_texture.variant_width = 32
    bpy.context.view_layer.update()
    press()
    return made


@pytest.fixture
def other(hair):
    first = card_objects(hair)[0]
    copy = first.copy()
    copy.data = first.data.copy()
    copy.name = "Other"
    copy.hairloom.card_object.groom = None
    copy.rotation_euler.z += 0.3
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    return copy


def press():
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}
    bpy.context.view_layer.update()


def openness(obj):
    values = np.empty(len(obj.data.vertices), np.float32)
    obj.data.attributes["occlusion"].data.foreach_get("value", values)
    return values


def test_occluders_shade_new_cards_only_while_visible(hair, other):
    alone = openness(card_objects(hair)[0])
    hair.data.hairloom.card_occlusion.others = True
    press()
    both = openness(card_objects(hair)[0])
    assert both.mean() < alone.mean() - 0.02
    other.hide_set(True)
    press()
    np.testing.assert_array_equal(openness(card_objects(hair)[0]), alone)


def test_inputs_of_exported_cards_have_the_same_occluders(hair, other):
    settings = hair.data.hairloom.card_occlusion
    assert read_inputs(hair, bpy.context.evaluated_depsgraph_get())[0].occluders.cards() == ((), ())
    settings.others = True
    (shade,), notes = read_inputs(hair, bpy.context.evaluated_depsgraph_get())[0].occluders.cards()
    assert notes == ()
    mesh = other.data
    assert len(shade.mesh.triangles) == len(mesh.polygons)
    assert shade.alpha.shape[0] > 1 and 0.0 < shade.alpha.mean() < 1.0
    middle = np.array([tuple(other.matrix_world @ each.center) for each in mesh.polygons])
    found = shade.mesh.positions[shade.mesh.triangles].mean(axis=1)
    np.testing.assert_allclose(found, middle, atol=1e-6)


@pytest.mark.slow(instead="test_occluders_shade_new_cards_only_while_visible")
def test_grooms_without_cards_shade_by_their_strands(hair, new_hair, sphere):
    alone = openness(card_objects(hair)[0])
    strands = new_hair(sphere)
    strands.rotation_euler.z += 0.3
    strands.data.hairloom.strands.fullness = 20.0
    bpy.context.view_layer.update()
    on = CardOcclusionSettings(others=True)
    (shade,), notes = read_occluders(on, hair).cards()
    assert notes == () and shade.alpha is not None and (shade.alpha > 0.0).all()
    hair.data.hairloom.card_occlusion.others = True
    bpy.context.view_layer.objects.active = hair
    press()
    assert openness(card_objects(hair)[0]).mean() < alone.mean() - 0.02
    # once it has cards, these replace its strands as occluders
    bpy.context.view_layer.objects.active = strands
    strands.data.hairloom.atlas.source = "made"
    press()
    (other,), _ = read_occluders(on, hair).cards()
    assert len(other.mesh.triangles) == len(card_objects(strands)[0].data.polygons)


def test_hair_that_cannot_be_used_shades_nothing_and_says_why(hair, new_hair, sphere):
    strands = new_hair(sphere)
    strands.name = "Bald"
    strands.data.remove_curves()
    bpy.context.view_layer.update()
    shades, (note,) = read_occluders(CardOcclusionSettings(others=True), hair).cards()
    assert shades == () and "Bald" in note and "no curves" in note


@pytest.fixture
def shaded(hair, new_hair, sphere, get_depsgraph):
    """Hair shown as cards, and other hair whose strands shade them."""
    strands = new_hair(sphere)
    strands.name = "Shading"
    strands.data.hairloom.strands.fullness = 20.0
    groom = hair.data.hairloom
    groom.card_occlusion.others, groom.card_drawing.shown_as = True, "cards"
    bpy.context.view_layer.update()
    session = previews.start(hair, get_depsgraph())
    yield session, strands
    previews.stop_all()


def shown(session):
    """The occlusion of the cards that are drawn."""
    return overlay.drawing_of(session.uid).snapshot.cards.mesh.occlusion


def follow(get_depsgraph):
    """Run the handlers of an update."""
    bpy.context.view_layer.update()
    scene_events.updated(get_depsgraph())
    scene_events.catch_up(get_depsgraph())


def test_the_preview_follows_other_hair(shaded, get_depsgraph):
    session, strands = shaded
    near = shown(session)
    follow(get_depsgraph)
    assert shown(session) is near, "nothing has moved"
    strands.location.x = 5.0
    follow(get_depsgraph)
    assert shown(session).mean() > near.mean() + 0.02


@pytest.mark.parametrize(
    "change", few_in_commits(["deleted", "hidden", "left out of renders and views"])
)
def test_the_preview_follows_other_hair_that_is_hidden_deleted_and_restored(
    shaded, get_depsgraph, change
):
    session, strands = shaded
    near, before = shown(session), session.cards.shaded_by
    if change == "hidden":
        strands.hide_set(True)
    elif change == "deleted":
        bpy.data.objects.remove(strands)
    else:
        strands.hide_viewport = True
    follow(get_depsgraph)
    assert shown(session).mean() > near.mean() + 0.02 and session.cards.shaded_by == frozenset()
    if change == "deleted":
        return
    strands.hide_set(False)
    strands.hide_viewport = False
    follow(get_depsgraph)
    np.testing.assert_array_equal(shown(session), near)
    assert session.cards.shaded_by == before


def test_the_preview_follows_the_settings_of_other_hair(shaded, get_depsgraph):
    session, strands = shaded
    near = shown(session)
    strands.data.hairloom.strands.fullness = 1.0
    scene_events.catch_up(get_depsgraph())
    assert shown(session).mean() > near.mean() + 0.02
    before = shown(session)
    strands.data.hairloom.shading.color_variation = 0.5
    scene_events.catch_up(get_depsgraph())
    assert shown(session) is before, "colours shade nothing"


def test_undo_has_cards_shaded_again(shaded, get_depsgraph):
    session, strands = shaded
    near = shown(session)
    strands.location.x = 5.0
    bpy.context.view_layer.update()  # as undo does, without update events for objects
    scene_events.undone()
    scene_events.catch_up(get_depsgraph())
    assert shown(session).mean() > near.mean() + 0.02


def test_hair_that_moves_with_other_hair_keeps_its_occlusion(shaded, sphere, get_depsgraph):
    session, strands = shaded
    near, before = shown(session), strands.matrix_world.copy()
    sphere.location.x, sphere.rotation_euler.z = 0.25, 1.0
    follow(get_depsgraph)
    assert strands.matrix_world != before, "both are children of the head"
    assert shown(session) is near, "the same cards, elsewhere"
    session.cards.forget()  # built again at the new place
    session.take_settings()
    np.testing.assert_allclose(shown(session), near, atol=0.02)


def threads_of(name):
    """The running threads of this name."""
    return {each for each in threading.enumerate() if each.name == name}


def test_other_hair_is_made_into_cards_in_the_thread(shaded, get_depsgraph, monkeypatch):
    session, strands = shaded
    threads = []
    occluder_of = card_flow.occluder_of
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    monkeypatch.setattr(
        card_flow,
        "occluder_of",
        lambda *given: threads.append(threading.current_thread()) or occluder_of(*given),
    )
    near = shown(session)
    strands.location.x = 5.0
    follow(get_depsgraph)
    assert session.cards.is_pending and shown(session) is near
    first = threads_of("hairloom cards")
    strands.location.x = 0.0
    strands.rotation_euler.z += 0.3
    follow(get_depsgraph)
    assert threads_of("hairloom cards") - first, "it moves while a build is pending"
    run_steps_until(lambda: not session.cards.is_pending)
    assert shown(session) is not near
    assert threads and threading.main_thread() not in threads


def test_a_render_has_the_current_occlusion_by_other_hair(shaded, get_depsgraph):
    session, strands = shaded
    hair = session.hair.resolve()

    def rendered():
        return read_groom(hair, get_depsgraph()).cards.mesh.occlusion

    near = rendered()
    np.testing.assert_allclose(near, shown(session), atol=1e-6)
    np.testing.assert_array_equal(rendered(), near)
    strands.hide_set(True)
    bpy.context.view_layer.update()
    assert rendered().mean() > near.mean() + 0.02
    strands.hide_set(False)
    strands.location.x = 5.0
    bpy.context.view_layer.update()
    assert rendered().mean() > near.mean() + 0.02


def test_cards_report_occluders_that_cannot_be_built(shaded, hair, get_depsgraph):
    """Its roots are far from its head, which is detected only in the thread."""
    session, strands = shaded
    strands.data.attributes["position"].data[0].vector.x = np.inf
    for each in strands.data.attributes["position"].data:
        each.vector = each.vector * 1000.0
    strands.data.update_tag()
    follow(get_depsgraph)
    assert any("It occludes nothing" in note for note in session.cards.warnings)


def test_own_cards_and_coarser_levels_and_other_meshes_are_left_out(hair, sphere):
    on = CardOcclusionSettings(others=True)
    for obj in card_objects(hair):
        obj.hide_set(False)
        obj.hide_viewport = False
    assert read_occluders(on, hair).cards() == ((), ())
    (shade,), _ = read_occluders(on, sphere).cards()
    assert len(shade.mesh.triangles) == len(card_objects(hair)[0].data.polygons)


def test_occluders_shade_sorted_meshes(hair, other, get_depsgraph):
    def sorted_by(others):
        choices = SortOptions(occlusion=CardOcclusionSettings(rays=64, others=others))
        sort_mesh(other, get_depsgraph(), choices)
        return openness(other).mean()

    assert sorted_by(True) < sorted_by(False) - 0.02


def test_without_uvs_or_a_picture_they_are_opaque_and_without_faces_nothing(hair, other):
    on = CardOcclusionSettings(others=True)
    other.data.materials[0] = None
    (shade,), notes = read_occluders(on, hair).cards()
    assert shade.alpha is None and "Other: No material" in notes[0]
    for layer in list(other.data.uv_layers):
        other.data.uv_layers.remove(layer)
    bpy.context.view_layer.update()
    (shade,), _ = read_occluders(on, hair).cards()
    assert shade.alpha is None
    other.data.clear_geometry()
    bpy.context.view_layer.update()
    assert read_occluders(on, hair).cards() == ((), ())
