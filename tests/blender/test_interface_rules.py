"""Rules for everything that artists see: texts, units, limits, greyed-out buttons."""

import re

import bpy
import pytest

from hairloom.addon import registration

pytestmark = pytest.mark.usefixtures("extension")

#: words that stay in lower case in a title
SMALL = {"a", "an", "and", "as", "at", "by", "for", "from", "in", "of", "on", "or", "per", "the"}
SMALL |= {"to", "with", "x", "fps"}
#: groups of properties, and operators
HOLDERS = [
    each
    for each in registration.CLASSES
    if issubclass(each, bpy.types.PropertyGroup | bpy.types.Operator | bpy.types.AddonPreferences)
]


def own_properties(holder):
    """The properties that a class declares itself, without those that Blender adds."""
    bases = {prop.identifier for prop in holder.bl_rna.base.properties}
    blenders = {"check_existing", "directory", "filepath", "files", "filter_glob"}
    for prop in holder.bl_rna.properties:
        if prop.identifier not in bases | blenders:
            yield prop


def wrong(check):
    """Our visible properties for which `check` is false."""
    return [
        f"{holder.__name__}.{prop.identifier}: {prop.name!r}, {prop.description!r}"
        for holder in HOLDERS
        for prop in own_properties(holder)
        if not prop.is_hidden and not check(prop)
    ]


def test_everything_has_a_title_in_title_case_and_a_description():
    assert sum(1 for holder in HOLDERS for _ in own_properties(holder)) > 200
    assert wrong(lambda prop: prop.description and not prop.description.endswith(".")) == []
    assert wrong(lambda prop: is_title(prop.name)) == []
    assert wrong(lambda prop: all(i.name for i in getattr(prop, "enum_items_static", ()))) == []


def is_title(name):
    words = [word for word in re.split(r"[\s,/&()]+", name) if word and word not in SMALL]
    return bool(name) and all(not word[0].islower() for word in words)


def test_titles_are_distinguished_from_other_texts():
    assert is_title("Levels of Detail") and is_title("Fly-Aways") and not is_title("Tip width")


def test_numbers_have_soft_limits_within_hard_ones():
    def is_limited(prop):
        if prop.type not in {"INT", "FLOAT"}:
            return True
        is_within = prop.hard_min <= prop.soft_min < prop.soft_max <= prop.hard_max
        return is_within and (prop.soft_max < 1.0e5 or prop.type == "INT")

    assert wrong(is_limited) == []


def test_units_are_those_that_were_declared():
    """Lengths have the scene's units, angles degrees, times seconds, as the parameters declare."""
    expected = {"length": "LENGTH", "angle": "ROTATION", "time": "TIME_ABSOLUTE"}
    expected |= {"speed": "VELOCITY", "acceleration": "ACCELERATION"}
    checked = 0
    for group in registration.groups.SECTION_GROUPS.values():
        for parameter in group.settings.parameters():
            shown = group.bl_rna.properties[parameter.name]
            if parameter.unit in expected:
                assert shown.unit == expected[parameter.unit], parameter.name
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


def test_settings_panels_start_closed_except_the_first():
    """Subpanels start closed: fourteen open ones would fill the screen."""
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
    """No operator shows Blender's text for a poll without a reason, "context is incorrect"."""
    scene(new_hair)
    mute, greyed = [], 0
    for name in dir(bpy.ops.hairloom):
        operator = getattr(bpy.ops.hairloom, name)
        if operator.poll():
            continue
        greyed += 1
        with pytest.raises(RuntimeError) as error:
            operator()
        if "context is incorrect" in str(error.value):
            mute.append(name)
    assert mute == []
    assert greyed
