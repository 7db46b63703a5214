"""Scripts call operators with whatever is at hand: each call works, or its error is a sentence of
ours and the scene is as it was before."""

import re

import bpy
import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon import registration

pytestmark = pytest.mark.usefixtures("extension")

_MOST = float(np.finfo(np.float32).max)
#: operators that bring their own hair, or change presets, clipboard or folders
ELSEWHERE = {"add_hairstyle", "sample_scene", "help", "self_test", "copy_report", "copy_reports"}
ELSEWHERE |= {"save_preset"}
#: type of a property -> the range of one without limits
UNLIMITED = {"INT": (-(2**31), 2**31 - 1), "FLOAT": (-_MOST, _MOST)}


def operators():
    return [each for each in registration.CLASSES if issubclass(each, bpy.types.Operator)]


def test_a_script_can_call_every_operator():
    """Blender drops the call of an operator that has `invoke` alone, without an error."""
    ours = [kind for each in operators() for kind in each.__mro__ if "hairloom" in kind.__module__]
    without = [
        each.bl_idname
        for each in operators()
        if not any("execute" in vars(kind) for kind in each.__mro__ if kind in ours)
    ]
    assert without == []


def a_mesh_without_vertices(_):
    bpy.context.collection.objects.link(bpy.data.objects.new("Nothing", bpy.data.meshes.new("No")))
    select(bpy.data.objects["Nothing"])


def hair_on_a_mesh_without_vertices(new_hair):
    a_mesh_without_vertices(new_hair)
    select(new_hair(bpy.data.objects["Nothing"]))


def hair_without_curves(new_hair):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.1, subdivisions=1)
    hair = bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair"))
    bpy.context.collection.objects.link(hair)
    select(hair)


def select(obj):
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()


def snapshot():
    if bpy.context.object is None:
        return None
    shown = [(obj.name, obj.select_get(), obj.hide_get()) for obj in bpy.context.view_layer.objects]
    data = [bpy.data.meshes, bpy.data.hair_curves, bpy.data.collections, bpy.data.materials]
    return shown, [len(each) for each in data], bpy.context.mode, bpy.context.object.name


SCENES = [a_mesh_without_vertices, hair_without_curves, hair_on_a_mesh_without_vertices]


@pytest.mark.parametrize("scene", few_in_commits(SCENES, 2), ids=lambda scene: scene.__name__)
def test_what_cannot_be_used_is_said_and_stays_as_it_is(new_hair, scene):
    """All operators whose button is not greyed out, without arguments."""
    errors, before = {}, "not made yet"
    for each in operators():
        name = each.bl_idname.removeprefix("hairloom.")
        if snapshot() != before:
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            scene(new_hair)
            before = snapshot()
        if name in ELSEWHERE or not getattr(bpy.ops.hairloom, name).poll():
            continue
        try:
            getattr(bpy.ops.hairloom, name)()
        except RuntimeError as error:
            errors[name] = str(error)
            assert snapshot() == before, name
    assert len(errors) > 5
    assert {name: text for name, text in errors.items() if "Traceback" in text} == {}


def test_a_file_that_is_not_named_is_said(new_hair, sphere):
    select(new_hair(sphere))
    by_path = ("import_strands", "export_alembic", "export_hair", "export_cards", "contact_sheet")
    for name in by_path:
        with pytest.raises(RuntimeError, match=": no file is named"):
            getattr(bpy.ops.hairloom, name)(filepath="")
    with pytest.raises(RuntimeError, match="preset: no preset is named"):
        bpy.ops.hairloom.add_preset()
    with pytest.raises(RuntimeError, match=r"preset: no preset is named\. (Name one of|Save one)"):
        bpy.ops.hairloom.delete_preset()


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 0.0, -1.0])
def test_an_import_blames_the_scale_that_cannot_be_used(value, new_hair, sphere, tmp_path):
    select(new_hair(sphere))
    bpy.ops.hairloom.export_hair(filepath=str(tmp_path / "hair.hair"))
    select(sphere)
    before = set(bpy.data.objects)
    for name, place in (("scale", "scale"), ("head_scale", "scale of the head")):
        with pytest.raises(RuntimeError, match=f"Error: {place}: .* cannot be used. Use a number"):
            bpy.ops.hairloom.import_strands(filepath=str(tmp_path / "hair.hair"), **{name: value})
    assert set(bpy.data.objects) == before and tuple(sphere.scale) == (1.0, 1.0, 1.0)


def test_an_export_names_the_operator_and_the_label_of_a_value_that_cannot_be_used(new_hair):
    select(new_hair())
    with pytest.raises(RuntimeError, match=r"Error: Export Cem Yuksel's \.hair: 'Scale' is nan"):
        bpy.ops.hairloom.export_hair(filepath="hair.hair", scale=float("nan"))


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("usd", {"filepath": "a.usdc", "scale": -1.0}, "'Scale' is -1.0, .* from 0 to 1e"),
        ("hair", {"filepath": "a.hair", "scale": 1.0e7}, "'Scale' is 1.*, .* from 0 to 1e"),
        ("tressfx", {"filepath": "a.tfx", "held_count": 9}, "'Held Vertices' is 9, .* 0 to 8"),
        ("cards", {"filepath": "a.glb", "joints": 1}, "'Joints' is 1, .* from 2 to 16"),
        ("cards", {"filepath": "a.glb", "own_levels": True, "levels": 6}, "'Levels' is 6, .* to 5"),
    ],
)
def test_an_export_refuses_a_number_out_of_range(name, values, message, new_hair):
    """Blender itself would use the nearest valid number, without a word."""
    select(new_hair())
    label = getattr(bpy.ops.hairloom, f"export_{name}").get_rna_type().name
    with pytest.raises(RuntimeError, match=f"Error: {re.escape(label)}: {message}"):
        getattr(bpy.ops.hairloom, f"export_{name}")(**values)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("settle", {"seconds": 1.0e6}, "Settle: 'Time' is 1.*, .* from 0 to 60"),
        ("grow", {"strand_count": -3}, "'Strands' is -3, "),
        ("turntable", {"directory": "a", "frames": 0}, "turntable: frames cannot be 0"),
        ("contact_sheet", {"filepath": "a.png", "size": 8}, "contact sheet: size cannot be 8"),
    ],
)
def test_an_operator_refuses_a_number_out_of_range(name, values, message, new_hair, sphere):
    select(sphere if name == "grow" else new_hair(sphere))
    before = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match=f"Error: .*{message}"):
        getattr(bpy.ops.hairloom, name)(**values)
    assert set(bpy.data.objects) == before


def test_blender_limits_only_numbers_without_an_upper_limit(extension):
    """Blender would use the nearest valid number without a word. A factor or a tile below the
    lowest one is as good as that one."""
    clamped = {
        (name, prop.identifier)
        for name in dir(bpy.ops.hairloom)
        for prop in getattr(bpy.ops.hairloom, name).get_rna_type().properties
        if prop.type in UNLIMITED and (prop.hard_min, prop.hard_max) != UNLIMITED[prop.type]
    }
    assert clamped == {
        ("card_width", "root"),
        ("card_width", "tip"),
        ("card_tile", "number"),
        ("add_card_along_curve", "width"),
        ("add_card_along_curve", "tile"),
    }


def properties():
    """The properties of all operators and settings."""
    classes = [each for each in registration.CLASSES if hasattr(each, "bl_rna")]
    operators = [getattr(bpy.ops.hairloom, name).get_rna_type() for name in dir(bpy.ops.hairloom)]
    for rna in (*operators, *(each.bl_rna for each in classes)):
        yield from ((rna.identifier, prop) for prop in rna.properties)


def test_every_path_property_supports_the_folder_of_the_blend_file(extension):
    paths = [
        (owner, prop.identifier, prop.is_path_supports_blend_relative)
        for owner, prop in properties()
        if prop.type == "STRING" and prop.subtype in ("FILE_PATH", "DIR_PATH")
    ]
    assert len(paths) > 8
    assert [each for each in paths if not each[-1]] == []


def test_a_path_beside_a_file_that_has_not_been_saved_is_refused(new_hair, sphere, tmp_path):
    select(new_hair(sphere))
    for name in ("import_strands", "export_hair", "export_cards", "contact_sheet", "add_preset"):
        with pytest.raises(RuntimeError, match=r"//x: // is .* not been saved\. Save it, or"):
            getattr(bpy.ops.hairloom, name)(filepath="//x")
    with pytest.raises(RuntimeError, match=r"//: // is .* not been saved"):
        bpy.ops.hairloom.import_strands(directory="//", files=[{"name": "hair.tfx"}])
    with pytest.raises(RuntimeError, match=r"//: // is .* not been saved"):
        bpy.ops.hairloom.turntable(directory="//")
    with pytest.raises(RuntimeError, match=r"//look.json: // is .* not been saved"):
        bpy.ops.hairloom.apply_preset(name="//look.json")


def test_paths_may_begin_at_the_folder_of_the_blend_file(new_hair, sphere, tmp_path, recwarn):
    hair = new_hair(sphere)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    select(hair)
    bpy.ops.hairloom.export_tressfx(filepath="//hair.tfx")
    assert (tmp_path / "hair.tfx").is_file()
    select(sphere)
    bpy.ops.hairloom.import_strands(filepath="//hair.tfx")
    bpy.ops.hairloom.import_strands(directory="//", files=[{"name": "hair.tfx"}])
    assert len(bpy.data.hair_curves) == 3
    (tmp_path / "look.json").write_text(
        '{"hairloom": 1, "section": "shading", "title": "Look", "values": {}}', encoding="utf-8"
    )
    select(hair)
    assert bpy.ops.hairloom.apply_preset(name="//look.json") == {"FINISHED"}
    assert not [each for each in recwarn if "blend relative" in str(each.message)]
