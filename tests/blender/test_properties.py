"""Blender properties from parameter declarations, and their values."""

import math
import re
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

import hairloom
from hairloom import register, unregister
from hairloom.addon.blender.engine import hair_scene
from hairloom.addon.blender.preview import handlers, previews
from hairloom.addon.blender.properties import changed, groups
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.properties.properties import property_group, settings_of
from hairloom.addon.blender.scene import look_materials
from hairloom.addon.blender.sessions import solvers
from hairloom.addon.blender.strands import growing
from hairloom.addon.errors import HairloomError
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.curve import KNOT_POSITIONS
from hairloom.addon.params.docs import parameter_table
from hairloom.addon.params.field import NAME_KINDS

pytestmark = pytest.mark.portable

SECTIONS = list(groups.SECTION_GROUPS)
#: section -> its first number
NUMBERS = {
    section: number
    for section in SECTIONS
    for number in [each for each in ALL_SETTINGS[section].parameters() if each.kind == "number"][:1]
}


@pytest.fixture
def group_of(new_hair):
    """A function that returns the property group of a section on a new hair object."""
    hair = new_hair()
    hair.data.hairloom.widths.property_unset("method")
    hair.data.hairloom.children.property_unset("method")

    def get(section):
        owners = {"groom": hair.data, "character": hair, "scene": bpy.context.scene}
        return getattr(owners[ALL_SETTINGS[section].owner].hairloom, section)

    return get


@pytest.mark.parametrize("section", SECTIONS)
def test_the_page_of_parameters_says_where_a_script_finds_a_section(section, group_of):
    table = parameter_table(ALL_SETTINGS[section])
    (place,) = re.findall("^In Python: `(.+)`$", table, flags=re.M)
    group = group_of(section)
    here = {"obj": bpy.data.objects["Hair"], "scene": bpy.context.scene}
    assert eval(place, here) == group


@pytest.mark.parametrize("section", NUMBERS)
def test_an_error_names_the_object_and_the_label_that_the_artist_sees(section, group_of):
    settings, group, number = ALL_SETTINGS[section], group_of(section), NUMBERS[section]
    setattr(group, number.name, math.nan)
    owner = "Scene" if settings.owner == "scene" else "Hair"
    with pytest.raises(HairloomError) as error:
        settings_of(group, settings)
    assert str(error.value).startswith(
        f"{owner}, {settings.title}: '{number.label}' is nan, but it must be finite. Use "
    )


def test_a_device_that_does_not_work_is_said_of_the_hair(new_hair, monkeypatch):
    monkeypatch.setattr(solvers, "compute_problem", lambda: "no driver")
    hair = new_hair()
    hair.hairloom.dynamics.device = "compute"
    problem = re.escape("Hair, Dynamics: the GPU cannot compute here (no driver). Set Device to")
    with pytest.raises(HairloomError, match=problem):
        previews.start(hair, bpy.context.evaluated_depsgraph_get())


def differing(section, check):
    """The parameters of a section that fail `check`, with the messages."""
    found = {}
    for parameter in ALL_SETTINGS[section].parameters():
        try:
            check(parameter)
        except (AssertionError, HairloomError) as error:
            found[parameter.name] = str(error)
    return found


@pytest.mark.parametrize("section", SECTIONS)
def test_untouched_properties_are_the_declared_defaults(section, group_of):
    assert settings_of(group_of(section), ALL_SETTINGS[section]) == ALL_SETTINGS[section]()


@pytest.mark.parametrize("section", SECTIONS)
def test_properties_show_what_was_declared(section, group_of):
    properties = group_of(section).bl_rna.properties

    def check(parameter):
        shown = properties[parameter.name]
        assert (shown.name, shown.description) == (parameter.label, parameter.description)
        if parameter.kind in ("number", "integer"):
            hard, soft = (shown.hard_min, shown.hard_max), (shown.soft_min, shown.soft_max)
            assert hard == pytest.approx(parameter.hard_range)
            assert soft == pytest.approx(parameter.soft_range)
        if parameter.unit == "angle":
            assert shown.subtype == "ANGLE"
        elif parameter.kind == "number":
            assert round(parameter.default, shown.precision) == pytest.approx(parameter.default)
        if parameter.unit == "length":
            assert shown.unit == "LENGTH"
        if parameter.kind == "color":
            assert shown.subtype == "COLOR"

    assert differing(section, check) == {}


@pytest.mark.parametrize("section", SECTIONS)
def test_every_value_that_blender_takes_is_one_that_settings_take(section, group_of):
    """Blender stores float32: rounding must not put the ends of a range outside it."""
    group, settings = group_of(section), ALL_SETTINGS[section]

    def check(parameter):
        if parameter.hard_range is None:
            return
        is_whole = parameter.kind == "integer"
        values = {"color": 3, "curve": len(KNOT_POSITIONS)}.get(parameter.kind)
        for requested in (-math.inf, *parameter.hard_range, math.inf):
            limited = max(-(2**31), min(requested, 2**31 - 1)) if is_whole else requested
            setattr(group, parameter.name, (limited,) * values if values else limited)
            value = getattr(settings_of(group, settings), parameter.name)
            if math.isfinite(requested):
                assert value == pytest.approx((requested,) * values if values else requested)
        group.property_unset(parameter.name)

    assert differing(section, check) == {}


def test_a_changed_value_reaches_the_settings_as_it_was_typed(group_of):
    group = group_of("shading")
    group.primary_shift = 0.1
    assert settings_of(group, ALL_SETTINGS["shading"]).primary_shift == 0.1


def test_an_edit_names_the_data_block_at_once(new_hair):
    hair, named = new_hair(), {"settings": [], "display": [], "bake": []}
    for kind, owners in named.items():
        changed.subscribe(kind, owners.append)
    try:
        hair.data.hairloom.shading.ambient = 0.5
        hair.hairloom.dynamics.damping = 2.0
        hair.hairloom.hide_original = False
        hair.hairloom.bake.is_shown = False
    finally:
        for kind, owners in named.items():
            changed.unsubscribe(kind, owners.append)
    assert named == {"settings": [hair.data, hair], "display": [hair], "bake": [hair]}


def test_the_preview_listens_while_hairloom_is_enabled_and_no_longer(extension):
    heard = {kind: list(listeners) for kind, listeners in changed._listeners.items()}
    own = (*handlers.LISTENERS, growing.LISTENER, look_materials.LISTENER, *hair_scene.LISTENERS)
    for kind, listener in own:
        heard[kind].remove(listener)
    assert not any(heard.values())
    hairloom.unregister()
    try:
        assert not any(changed._listeners.values())
    finally:
        hairloom.register()


def test_checkboxes_in_headers_go_back_to_what_was_declared(new_hair):
    groom = new_hair().data.hairloom
    for name, section, parameter in (
        ("use_children", "children", "method"),
        ("use_shadows", "volume", "shadows"),
    ):
        setattr(groom, name, False)
        assert getattr(getattr(groom, section), parameter) == "none"
        setattr(groom, name, True)
        default = ALL_SETTINGS[section]()
        assert getattr(getattr(groom, section), parameter) == getattr(default, parameter)


def test_choices_and_toggles_have_properties_too(extension):
    """A section that only this test declares has both kinds."""
    from dataclasses import dataclass

    from hairloom.addon.params import Settings, choice, toggle

    @dataclass(frozen=True, kw_only=True)
    class Example(Settings):
        section = "example"
        title = "Example"
        lamp: bool = toggle(True, label="Lamp", description="On or off")
        up: str = choice("Y", (("Y", "Y", "y up"), ("Z", "Z", "z up")), label="Up", description="?")

    group = property_group(Example)
    bpy.utils.register_class(group)
    bpy.types.Scene.hairloom_example = bpy.props.PointerProperty(type=group)
    try:
        values = bpy.context.scene.hairloom_example
        assert settings_of(values, Example) == Example()
        values.lamp, values.up = False, "Z"
        assert settings_of(values, Example) == Example(lamp=False, up="Z")
    finally:
        del bpy.types.Scene.hairloom_example
        bpy.utils.unregister_class(group)


def _another(value, parameter):
    if parameter.kind == "choice":
        return next(one for one, *_ in parameter.choices if one != value)
    if parameter.kind == "toggle":
        return not value
    if parameter.kind in ("color", "curve"):
        return tuple(0.5 * each + 0.1 for each in value)
    low, high = parameter.hard_range
    return low if value == high else type(value)(min(value + 1, high))


def test_keyframes_change_nothing_that_needs_other_hair(new_hair):
    """No frame reads the hair again, so properties that need it cannot be keyed. Exceptions:
    wetness, which look and weight follow, and Only Selected, which reads curves only to warn."""
    hair, tried, known = new_hair(), 0, {"wetness", "only_selected"}
    hair.data.hairloom.children.method = "multi"
    for owner in (hair.data, hair):
        for section, kind in ALL_SETTINGS.items():
            group = getattr(owner.hairloom, section, None)
            for parameter in kind.parameters() if group is not None else ():
                if parameter.kind in NAME_KINDS or parameter.name in known:
                    continue
                before, value = GroomSettings.of(hair), getattr(group, parameter.name)
                value = tuple(value) if parameter.kind in ("color", "curve") else value
                setattr(group, parameter.name, _another(value, parameter))
                needs_other_hair = not GroomSettings.of(hair).needs_no_rebuild(before)
                setattr(group, parameter.name, value)
                is_keyed = group.bl_rna.properties[parameter.name].is_animatable
                assert not (needs_other_hair and is_keyed), (section, parameter.name)
                tried += needs_other_hair
    assert tried > 30
    with pytest.raises(TypeError, match="not animatable"):
        hair.data.hairloom.children.keyframe_insert("clump")


def test_a_copy_of_the_curves_has_the_same_settings(new_hair):
    hair = new_hair()
    hair.data.hairloom.shading.ambient = 0.5
    assert hair.data.copy().hairloom.shading.ambient == 0.5


def test_settings_survive_saving_also_by_a_blender_without_hairloom(new_hair, tmp_path):
    hair = new_hair()
    hair.data.hairloom.shading.base_color = (0.5, 0.25, 0.125)
    hair.hairloom.dynamics.damping = 2.0
    file = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    unregister()
    bpy.ops.wm.open_mainfile(filepath=file)
    assert not hasattr(bpy.data.objects["Hair"], "hairloom")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    register()
    bpy.ops.wm.open_mainfile(filepath=file)
    hair = bpy.data.objects["Hair"]
    assert hair.data.hairloom.shading.base_color[:] == (0.5, 0.25, 0.125)
    assert hair.hairloom.dynamics.damping == 2.0


OPENED = """
import sys
sys.path.insert(0, {tools!r})
from extension_loader import load_package
import bpy
load_package().register()
bpy.ops.wm.open_mainfile(filepath={file!r})
for name in ("Hair", "Bare"):
    volume = bpy.data.objects[name].data.hairloom.volume
    print("found", name, volume.shadows, volume.is_property_set("shadows"))
"""


@pytest.mark.skipif(not bpy.app.module, reason="starts another Python that has bpy")
def test_a_file_from_before_shadows_shows_the_default_and_keeps_what_was_set(new_hair, tmp_path):
    """Another process opens the file: values that it does not store have their defaults."""
    hair, bare = new_hair(), new_hair()
    bare.name = "Bare"
    hair.data.hairloom.volume.shadows = "slices"
    hair.data.hairloom.volume.property_unset("shadows")
    bare.data.hairloom.volume.shadows = "none"
    file = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    tools = str(Path(__file__).parents[2] / "tools")
    script = OPENED.format(tools=tools, file=file)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    default = ALL_SETTINGS["volume"]().shadows
    assert default != "none"
    assert f"found Hair {default} False" in done.stdout
    assert "found Bare none True" in done.stdout


def test_settings_out_of_range_in_a_script_are_clamped_by_blender(group_of):
    group = group_of("detail")
    group.subdivisions = 10**6
    settings = settings_of(group, ALL_SETTINGS["detail"])
    assert settings.subdivisions == 64
    with pytest.raises(HairloomError, match="64"):
        type(settings)(subdivisions=10**6)
