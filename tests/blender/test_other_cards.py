"""Cards of other grooms shade those that are made, written or sorted, by choice."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.host.cards.adopted_cards import SortChoices, sort_mesh
from hairloom.addon.host.cards.card_object import card_objects
from hairloom.addon.host.cards.other_cards import other_cards
from hairloom.addon.host.preview import live, overlay, reactions
from hairloom.addon.host.strands.groom_files import card_choices


@pytest.fixture
def hair(new_hair, sphere):
    """A hedgehog on a sphere, with cards, and a larger copy of them that is nobody's."""
    made = new_hair(sphere)
    groom = made.data.hairloom
    groom.cards.way, groom.cards.card_count, groom.cards.levels = "clusters", 12, 2
    groom.atlas.source, groom.card_occlusion.rays = "made", 64
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


def test_they_shade_what_is_made_and_only_while_they_are_seen(hair, other):
    alone = openness(card_objects(hair)[0])
    hair.data.hairloom.card_occlusion.others = True
    press()
    both = openness(card_objects(hair)[0])
    assert both.mean() < alone.mean() - 0.02
    other.hide_set(True)
    press()
    np.testing.assert_array_equal(openness(card_objects(hair)[0]), alone)


def test_what_is_written_has_the_same_shade(hair, other):
    settings = hair.data.hairloom.card_occlusion
    assert card_choices(hair)[0].others == ()
    settings.others = True
    (shade,) = card_choices(hair)[0].others
    mesh = other.data
    assert len(shade.mesh.triangles) == len(mesh.polygons)
    assert shade.alpha.shape[0] > 1 and 0.0 < shade.alpha.mean() < 1.0
    middle = np.array([tuple(other.matrix_world @ each.center) for each in mesh.polygons])
    found = shade.mesh.positions[shade.mesh.triangles].mean(axis=1)
    np.testing.assert_allclose(found, middle, atol=1e-6)


def test_grooms_without_cards_shade_by_their_strands(hair, new_hair, sphere):
    alone = openness(card_objects(hair)[0])
    strands = new_hair(sphere)
    strands.rotation_euler.z += 0.3
    strands.data.hairloom.strands.width_scale = 20.0
    bpy.context.view_layer.update()
    on = CardOcclusionSettings(others=True)
    (shade,), notes = other_cards(on, hair)
    assert notes == [] and shade.alpha is not None and (shade.alpha > 0.0).all()
    hair.data.hairloom.card_occlusion.others = True
    bpy.context.view_layer.objects.active = hair
    press()
    assert openness(card_objects(hair)[0]).mean() < alone.mean() - 0.02
    # its own cards stand for them once there are some
    bpy.context.view_layer.objects.active = strands
    strands.data.hairloom.atlas.source = "made"
    press()
    (other,), _ = other_cards(on, hair)
    assert len(other.mesh.triangles) == len(card_objects(strands)[0].data.polygons)


def test_hair_that_cannot_be_used_shades_nothing_and_says_why(hair, new_hair, sphere):
    strands = new_hair(sphere)
    strands.name = "Bald"
    strands.data.remove_curves()
    bpy.context.view_layer.update()
    shades, (note,) = other_cards(CardOcclusionSettings(others=True), hair)
    assert shades == () and "Bald" in note and "no curves" in note


def test_the_preview_follows_other_hair(hair, new_hair, sphere, evaluated):
    strands = new_hair(sphere)
    strands.data.hairloom.strands.width_scale = 20.0
    groom = hair.data.hairloom
    groom.card_occlusion.others, groom.card_drawing.shown_as = True, "cards"
    bpy.context.view_layer.update()
    session = live.start(hair, evaluated())
    try:

        def shown():
            return overlay.drawing_of(session.uid).snapshot.cards.mesh.occlusion

        near = shown()
        reactions.updated(evaluated())
        reactions.catch_up(evaluated())
        assert shown() is near, "nothing has moved"
        strands.location.x = 5.0
        bpy.context.view_layer.update()
        reactions.updated(evaluated())
        reactions.catch_up(evaluated())
        assert shown().mean() > near.mean() + 0.02
    finally:
        live.stop_all()


def test_own_cards_and_coarser_levels_and_other_meshes_are_left_out(hair, sphere):
    on = CardOcclusionSettings(others=True)
    for obj in card_objects(hair):
        obj.hide_set(False)
        obj.hide_viewport = False
    assert other_cards(on, hair) == ((), [])
    (shade,), _ = other_cards(on, sphere)
    assert len(shade.mesh.triangles) == len(card_objects(hair)[0].data.polygons)


def test_they_shade_what_is_sorted(hair, other, evaluated):
    def sorted_by(others):
        choices = SortChoices(occlusion=CardOcclusionSettings(rays=64, others=others))
        sort_mesh(other, evaluated(), choices)
        return openness(other).mean()

    assert sorted_by(True) < sorted_by(False) - 0.02


def test_without_uvs_or_a_picture_they_are_opaque_and_without_faces_nothing(hair, other):
    on = CardOcclusionSettings(others=True)
    other.data.materials[0] = None
    (shade,), notes = other_cards(on, hair)
    assert shade.alpha is None and "Other: No material" in notes[0]
    for layer in list(other.data.uv_layers):
        other.data.uv_layers.remove(layer)
    bpy.context.view_layer.update()
    (shade,), _ = other_cards(on, hair)
    assert shade.alpha is None
    other.data.clear_geometry()
    bpy.context.view_layer.update()
    assert other_cards(on, hair) == ((), [])
