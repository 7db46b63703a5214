"""What holds for all that the artist meets: texts, units, limits, greyed-out buttons."""

import re

import bpy
import pytest

from hairloom.addon import registration

pytestmark = pytest.mark.usefixtures("extension")

#: words of a title that are not written large
SMALL = {"a", "an", "and", "as", "at", "by", "for", "from", "in", "of", "on", "or", "per", "the"}
SMALL |= {"to", "with", "x", "fps"}
#: groups of properties, and operators
HOLDERS = [
    each
    for each in registration.CLASSES
    if issubclass(each, bpy.types.PropertyGroup | bpy.types.Operator | bpy.types.AddonPreferences)
]


def own_properties(holder):
    """What it declares itself, not what Blender gives to every class of its kind."""
    bases = {prop.identifier for prop in holder.bl_rna.base.properties}
    blenders = {"check_existing", "directory", "filepath", "files", "filter_glob"}
    for prop in holder.bl_rna.properties:
        if prop.identifier not in bases | blenders:
            yield prop


ALL = [pytest.param(each, id=each.__name__) for each in HOLDERS]


@pytest.mark.parametrize("holder", ALL)
def test_everything_has_a_title_in_title_case_and_a_description(holder):
    for prop in own_properties(holder):
        if "HIDDEN" in prop.tags or prop.is_hidden:
            continue
        assert prop.description, prop.identifier
        assert not prop.description.endswith("."), prop.identifier
        assert is_title(prop.name), f"{prop.identifier}: {prop.name!r}"
        for item in getattr(prop, "enum_items_static", ()):
            assert item.name, f"{prop.identifier}: {item.identifier}"


def is_title(name):
    words = [word for word in re.split(r"[\s,/&()]+", name) if word and word not in SMALL]
    return bool(name) and all(not word[0].islower() for word in words)


def test_titles_are_told_from_other_texts():
    assert is_title("Levels of Detail") and is_title("Fly-aways") and not is_title("Tip width")


@pytest.mark.parametrize("holder", ALL)
def test_numbers_have_soft_limits_within_hard_ones(holder):
    for prop in own_properties(holder):
        if prop.type in {"INT", "FLOAT"} and not prop.is_hidden:
            assert prop.hard_min <= prop.soft_min < prop.soft_max <= prop.hard_max, prop.identifier
            assert prop.soft_max < 1.0e5 or prop.type == "INT", f"{prop.identifier} has no limit"


def test_units_are_those_that_were_declared():
    """A length is shown in the scene's units, an angle in degrees, a time in seconds."""
    wanted = {"length": "LENGTH", "angle": "ROTATION", "time": "TIME_ABSOLUTE"}
    wanted |= {"speed": "VELOCITY", "acceleration": "ACCELERATION"}
    checked = 0
    for group in registration.groups.SECTION_GROUPS.values():
        for parameter in group.settings.parameters():
            shown = group.bl_rna.properties[parameter.name]
            if parameter.unit in wanted:
                assert shown.unit == wanted[parameter.unit], parameter.name
                checked += 1
            if parameter.unit == "factor" and parameter.kind == "number":
                assert shown.subtype == "FACTOR", parameter.name
            if parameter.unit == "pixels":
                assert shown.subtype == "PIXEL", parameter.name
    assert checked > 10


@pytest.mark.parametrize("kind", [bpy.types.Panel, bpy.types.Menu, bpy.types.Operator])
def test_every_panel_menu_and_operator_says_what_it_is(kind):
    for each in registration.CLASSES:
        if issubclass(each, kind):
            assert is_title(each.bl_label), each.bl_label
            assert (each.__doc__ or "").strip(), each.__name__


def test_settings_open_closed_except_the_first():
    """Fourteen open sections would fill the screen."""
    below = [p for p in registration.CLASSES if getattr(p, "bl_parent_id", "").startswith("HAIR")]
    assert below and all("DEFAULT_CLOSED" in panel.bl_options for panel in below)


def nothing_there(_new_hair):
    return None


def a_mesh(_new_hair):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)


def hair_in_the_air(new_hair):
    new_hair()


def hair_on_a_mesh(new_hair):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    new_hair(bpy.context.object)


def a_mesh_in_edit_mode(_new_hair):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.ops.object.mode_set(mode="EDIT")


SCENES = [nothing_there, a_mesh, hair_in_the_air, hair_on_a_mesh, a_mesh_in_edit_mode]


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_a_button_that_is_greyed_out_says_why(new_hair, scene):
    """Blender's own words for a poll without a reason are "context is incorrect"."""
    scene(new_hair)
    mute, greyed = [], 0
    for name in dir(bpy.ops.hairloom):
        operator = getattr(bpy.ops.hairloom, name)
        if operator.poll():
            continue
        greyed += 1
        with pytest.raises(RuntimeError) as told:
            operator()
        if "context is incorrect" in str(told.value):
            mute.append(name)
    assert mute == []
    assert greyed
