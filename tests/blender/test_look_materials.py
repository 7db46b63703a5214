"""The material of a look follows the look until somebody else changes its nodes."""

from __future__ import annotations

import bpy
import pytest

from hairloom.addon.blender.properties import changed
from hairloom.addon.blender.properties.presets import apply, named_preset
from hairloom.addon.blender.scene import look_materials
from hairloom.addon.blender.scene.principled import look_from_material

pytestmark = pytest.mark.usefixtures("extension")


@pytest.fixture
def hair(sphere):
    bpy.ops.hairloom.add_groom(strand_count=20, plays=False)
    return bpy.context.object


def node(hair):
    nodes = hair.data.materials[0].node_tree.nodes
    return next(each for each in nodes if each.type == "BSDF_HAIR_PRINCIPLED")


def melanin(hair):
    return node(hair).inputs["Melanin"].default_value


def test_a_slider_of_the_look_moves_the_material_of_a_new_groom(hair):
    look, material = hair.data.hairloom.shading, hair.data.materials[0]
    look.color_variation = look.tip_tint = look.grey_fraction = 0.0
    look.melanin = 0.2
    assert melanin(hair) == pytest.approx(0.2)
    look.melanin = 0.8
    assert melanin(hair) == pytest.approx(0.8) and hair.data.materials[0] == material
    before = node(hair).inputs["Roughness"].default_value
    look.width_trt *= 2.0
    assert node(hair).inputs["Roughness"].default_value > before
    found, _ = look_from_material(hair, bpy.context.evaluated_depsgraph_get())
    assert found.melanin == pytest.approx(0.8) and found.pigment == "melanin"


def test_a_material_whose_nodes_an_artist_changed_is_the_artists_own(hair):
    look = hair.data.hairloom.shading
    look.melanin = 0.2
    node(hair).inputs["Random Roughness"].default_value = 0.7
    look.melanin = 0.9
    assert melanin(hair) != pytest.approx(0.9)
    assert node(hair).inputs["Random Roughness"].default_value == pytest.approx(0.7)
    bpy.ops.hairloom.look_to_material()
    look.melanin = 0.3
    look.tip_tint = look.color_variation = look.grey_fraction = 0.0
    assert melanin(hair) == pytest.approx(0.3), "since the button was pressed it follows again"


def test_hair_with_another_material_keeps_it(hair):
    own = bpy.data.materials.new("Own")
    hair.data.materials[0] = own
    count = len(bpy.data.materials)
    hair.data.hairloom.shading.melanin = 0.9
    assert hair.data.materials[0] == own and len(bpy.data.materials) == count


def test_it_follows_in_a_file_that_was_saved(hair, tmp_path):
    hair.data.hairloom.shading.melanin = 0.2
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hair.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "hair.blend"))
    hair = next(obj for obj in bpy.data.objects if obj.type == "CURVES")
    look = hair.data.hairloom.shading
    look.color_variation = look.tip_tint = look.grey_fraction = 0.0
    look.melanin = 0.7
    assert melanin(hair) == pytest.approx(0.7)


def test_a_preset_writes_the_material_once(hair, monkeypatch):
    """A preset sets its settings one by one."""
    (settings, *_) = named_preset("looks/blond").all
    written, put = [], look_materials.apply_look
    monkeypatch.setattr(
        look_materials, "apply_look", lambda each: written.append(each) or put(each)
    )
    apply(settings, hair)
    assert written == [hair]


def test_settings_set_together_are_one_change(hair):
    notified = []
    listener = ("settings", notified.append)
    changed.subscribe(*listener)
    try:
        with changed.as_one_change():
            hair.data.hairloom.shading.melanin = 0.31
            hair.data.hairloom.shading.tip_tint = 0.2
            assert notified == []
        assert notified == [hair.data]
        hair.data.hairloom.shading.melanin = 0.32
    finally:
        changed.unsubscribe(*listener)
    assert notified == [hair.data, hair.data]


def test_a_duplicate_follows_its_own_look(hair):
    """Blender gives a duplicate the same material."""
    hair.data.hairloom.shading.melanin = 0.2
    twin = hair.copy()
    twin.data = hair.data.copy()
    bpy.context.collection.objects.link(twin)
    assert twin.data.materials[0] == hair.data.materials[0]
    for each in (hair, twin):
        look = each.data.hairloom.shading
        look.color_variation = look.tip_tint = look.grey_fraction = 0.0
    twin.data.hairloom.shading.melanin = 0.8
    assert (melanin(hair), melanin(twin)) == pytest.approx((0.2, 0.8))
    hair.data.hairloom.shading.melanin = 0.4
    assert (melanin(hair), melanin(twin)) == pytest.approx((0.4, 0.8))


@pytest.mark.parametrize("also", ["a fake user", "a baked copy"])
def test_hair_whose_material_nobody_else_has_keeps_it(also, hair):
    material = hair.data.materials[0]
    if also == "a fake user":
        material.use_fake_user = True
    else:
        copy = bpy.data.objects.new("Baked", bpy.data.hair_curves.new("Baked"))
        copy.data.materials.append(material)
        hair.hairloom.bake.copy = copy
    look = hair.data.hairloom.shading
    look.color_variation = look.tip_tint = look.grey_fraction = 0.0
    look.melanin = 0.8
    assert hair.data.materials[0] == material and melanin(hair) == pytest.approx(0.8)
