"""The objects that buttons and jobs act on, in a view layer that Blender has not updated yet."""

from types import SimpleNamespace

import bpy
import pytest
from panel_layout import Layout
from selecting import select

from hairloom.addon.blender.base.objects import objects_in
from hairloom.addon.blender.cards.occluders import read_occluders
from hairloom.addon.blender.colliders.spheres import hair_on
from hairloom.addon.blender.command_line import bake_job, object_settings
from hairloom.addon.blender.preview.diagnostics import nearest_surface
from hairloom.addon.blender.sessions.fins import fins_in
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.ui import menus
from hairloom.addon.ui.panels import HAIRLOOM_PT_data
from hairloom.addon.ui.selection import target_hair


@pytest.fixture
def hair(new_hair, sphere):
    """Hair on a selected sphere, beside an object that was just removed."""
    hair = new_hair(sphere)
    other = bpy.data.objects.new("Other", None)
    bpy.context.collection.objects.link(other)
    hair.select_set(False)
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    assert other.name in bpy.context.view_layer.objects
    bpy.data.objects.remove(other)
    assert None in list(bpy.context.view_layer.objects), "Blender leaves no gap any more"
    return hair


@pytest.mark.parametrize(
    ("name", "has_hair", "remedy"),
    [
        (
            "settle",
            False,
            "Select hair curves first, or add some: Add > Curve > Hairloom Hairstyle",
        ),
        ("convert_particles", False, "Select a mesh that has particle hair"),
        ("discard_card_edits", True, "press Make Cards first"),
        ("revert_trim", True, "press Trim to Shape first"),
        ("revert_flow", True, "press Comb Along Flow first"),
    ],
)
def test_a_button_that_is_greyed_out_says_what_to_do(name, has_hair, remedy, new_hair):
    if has_hair:
        select(new_hair())
    with pytest.raises(RuntimeError, match=remedy):
        getattr(bpy.ops.hairloom, name)()


def test_an_object_that_was_just_removed_is_no_obstacle(hair, sphere):
    layer = bpy.context.view_layer
    assert objects_in(layer) == [sphere, hair]
    assert target_hair(bpy.context) == [hair]
    assert fins_in(layer) == []
    assert hair_on(sphere, layer) == [hair]


def test_a_removed_object_is_no_obstacle_for_cards(hair):
    """Displayed cards are built with the depsgraph as it is."""
    depsgraph = bpy.context.view_layer.depsgraph
    assert read_occluders(CardOcclusionSettings(others=True), hair, depsgraph).cards() == ((), ())


def test_a_removed_object_is_no_obstacle_for_a_job(hair):
    assert object_settings.grooms_to_export([]) == ([hair], ())
    assert bake_job._objects_to_bake([]) == ([hair], ())


def test_a_removed_object_is_no_obstacle_for_growing(hair, sphere):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert nearest_surface(hair, objects_in(bpy.context.view_layer), depsgraph) == sphere


def test_hair_on_a_selected_mesh_is_not_that_which_is_hidden(hair, sphere):
    """Such as after Make Real. If there is only hidden hair, its panels are shown."""
    combed = hair.copy()
    bpy.context.collection.objects.link(combed)
    hair.hide_render = hair.hide_viewport = True
    bpy.context.view_layer.update()
    assert target_hair(bpy.context) == [combed]
    combed.hide_render = combed.hide_viewport = True
    bpy.context.view_layer.update()
    assert set(target_hair(bpy.context)) == {hair, combed}


def test_a_pinned_properties_editor_is_about_the_hair_that_it_shows(hair, new_hair):
    """The object or its curves may be pinned; a pinned mesh does not count."""
    other = new_hair()
    screens = (each for each in bpy.data.screens if each.name == "Layout")
    area = next(each for each in next(screens).areas if each.type == "PROPERTIES")
    space = area.spaces.active
    with bpy.context.temp_override(area=area):
        assert target_hair(bpy.context)[0] == other
        for pinned in (hair, hair.data):
            space.pin_id = None  # Blender accepts only an ID of the kind that is pinned
            space.pin_id, space.use_pin_id = pinned, True
            assert target_hair(bpy.context) == [hair]
            assert HAIRLOOM_PT_data.poll(bpy.context)
        space.use_pin_id = False
        assert target_hair(bpy.context)[0] == other
        space.pin_id = None
        space.pin_id, space.use_pin_id = hair.data.surface, True
        assert target_hair(bpy.context)[0] == other
        space.pin_id, space.use_pin_id = None, False


def test_hair_of_another_view_layer_is_reported_instead_of_selected(hair, sphere):
    """Such as hair that is previewed in a scene that is not shown."""
    bpy.ops.hairloom.preview()
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    assert target_hair(bpy.context) == [hair]
    with pytest.raises(RuntimeError, match="Hair: it is not in this view layer"):
        bpy.ops.hairloom.show_settings()


@pytest.mark.parametrize(
    "name", ["grow", "add_groom", "import_strands", "mirror_hair", "make_real"]
)
def test_tools_that_add_or_shape_hair_need_object_mode(name, hair, sphere):
    button = getattr(bpy.ops.hairloom, name)
    assert button.poll()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not button.poll()


@pytest.mark.parametrize("what", ["hair", "mesh", "nothing"])
def test_the_pie_menu_offers_to_comb_what_blender_combs(what, hair, sphere):
    active = {"hair": hair, "mesh": sphere, "nothing": None}[what]
    bpy.context.view_layer.objects.active = active
    layout = Layout([])
    layout.menu_pie = layout.column
    menus.HAIRLOOM_MT_pie.draw(SimpleNamespace(layout=layout), bpy.context)
    (pie,) = layout.parts
    assert len(pie.parts) == 8, "each button stays at its place"
    try:
        bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        can_comb = True
    except (TypeError, RuntimeError):
        can_comb = False
    assert can_comb is (what == "hair") is ("Comb" in dict(layout.texts))
