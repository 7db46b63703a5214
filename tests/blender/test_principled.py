"""Reading a material's Principled Hair; tests/pure/test_principled.py tests the mapping itself."""

from __future__ import annotations

from typing import Any

import bpy
import pytest

from hairloom.addon.blender.command_line import command_line, job_options
from hairloom.addon.blender.scene.principled import _values, has_principled_hair, look_from_material
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.marschner.principled import PrincipledHair
from hairloom.addon.shading.settings import ShadingSettings


@pytest.fixture
def hair(new_hair: Any) -> Any:
    return new_hair()


def material(hair: Any, **inputs: Any) -> Any:
    """A material with the node at its output, as Blender's default for hair; returns the node."""
    made = bpy.data.materials.new("Hair")
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    output = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
    made.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    hair.data.materials.append(made)
    return node


def look(hair: Any) -> Any:
    return look_from_material(hair, bpy.context.evaluated_depsgraph_get())


def test_our_defaults_are_those_of_the_node(hair: Any) -> None:
    """Inputs that a node hides then have the values that Blender uses."""
    node, ours = material(hair), vars(PrincipledHair())
    assert (node.model, node.parametrization) == (ours["model"], ours["parametrization"])
    found = {"model", "parametrization"}
    for model in ("CHIANG", "HUANG"):
        for parametrization in ("COLOR", "MELANIN", "ABSORPTION"):
            node.model, node.parametrization = model, parametrization
            for name, value in _values(node)[0].items():
                if name not in ("model", "parametrization"):
                    assert value == pytest.approx(ours[name], abs=1e-5), name
                    found.add(name)
    assert found == set(ours)


def test_the_operator_takes_it_over_with_undo(hair: Any) -> None:
    node = material(hair)
    node.parametrization = "MELANIN"
    node.inputs["Melanin"].default_value = 0.35
    node.inputs["IOR"].default_value = 1.4
    node.inputs["Offset"].default_value = 0.06
    shading = hair.data.hairloom.shading
    shading.sparkle = 0.25
    assert bpy.ops.hairloom.look_from_material() == {"FINISHED"}
    assert (shading.model, shading.pigment) == ("marschner", "melanin")
    assert shading.melanin == pytest.approx(0.35)
    assert shading.index_of_refraction == pytest.approx(1.4)
    assert shading.cuticle_tilt == pytest.approx(0.06)
    assert shading.sparkle == pytest.approx(0.25), "what a material does not speak of stays"
    operator = bpy.types.HAIRLOOM_OT_look_from_material
    assert "UNDO" in operator.bl_options


def test_huangs_model_is_read_with_its_own_inputs(hair: Any) -> None:
    node = material(hair)
    node.model = "HUANG"
    node.inputs["Aspect Ratio"].default_value = 0.7
    node.inputs["Transmission"].default_value = 0.5
    settings, notes = look(hair)
    assert settings.eccentricity == pytest.approx(0.7)
    assert settings.strength_tt == pytest.approx(0.5)
    assert any("Huang" in note for note in notes)


def test_constants_of_other_nodes_are_read_and_varying_inputs_are_reported(hair: Any) -> None:
    node = material(hair)
    tree = node.id_data
    constant = tree.nodes.new("ShaderNodeRGB")
    constant.outputs[0].default_value = (0.4, 0.2, 0.1, 1.0)
    tree.links.new(constant.outputs[0], node.inputs["Color"])
    varying = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(varying.outputs[0], node.inputs["Roughness"])
    settings, (note,) = look(hair)
    assert settings.base_color == pytest.approx((0.4, 0.2, 0.1), rel=1e-3)
    assert note.startswith("Roughness comes from other nodes")


def test_the_active_material_is_used_and_named(hair: Any) -> None:
    material(hair, Color=(1.0, 0.0, 0.0, 1.0))
    assert look(hair)[1] == ()
    material(hair, Color=(0.0, 1.0, 0.0, 1.0))
    hair.active_material_index = 0
    settings, (note,) = look(hair)
    assert settings.base_color[0] > settings.base_color[1]
    assert note == "it has several materials; the look was taken from the active one, Hair"


@pytest.mark.parametrize("link_kind", ["mixed", "in a group"])
def test_the_hair_node_is_found_behind_other_nodes(hair: Any, link_kind: str) -> None:
    node = material(hair, IOR=1.3)
    tree = node.id_data
    output = tree.get_output_node("ALL")
    if link_kind == "mixed":
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(node.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
    else:
        inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        inside = inner.nodes.new("ShaderNodeBsdfHairPrincipled")
        inside.inputs["IOR"].default_value = 1.3
        inner.links.new(inside.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
        group = tree.nodes.new("ShaderNodeGroup")
        group.node_tree = inner
        tree.links.new(group.outputs[0], output.inputs["Surface"])
        tree.nodes.remove(node)
    assert has_principled_hair(hair)
    assert look(hair)[0].index_of_refraction == pytest.approx(1.3)


def test_without_such_a_node_it_is_refused_and_the_button_is_grey(hair: Any) -> None:
    for _ in range(2):  # first without a material, then with one that has another node
        assert not has_principled_hair(hair)
        with pytest.raises(HairloomError, match="no Principled Hair"):
            look(hair)
        assert not bpy.ops.hairloom.look_from_material.poll()
        hair.data.materials.append(bpy.data.materials.new("Skin"))


def test_a_node_that_is_muted_or_not_linked_does_not_count(hair: Any) -> None:
    node = material(hair)
    node.mute = True
    assert not has_principled_hair(hair)
    node.mute = False
    node.id_data.links.clear()
    assert not has_principled_hair(hair)


def settings_by(*arguments: str) -> Any:
    parser = command_line.parser()
    options = parser.parse_args(["render", "--output", "x.png", *arguments])
    job_options.name_grooms(options)
    return job_options.settings_from_options(options)[ShadingSettings]


def test_the_command_line_starts_from_the_material_and_single_values_go_over_it(
    hair: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    node = material(hair, IOR=1.3)
    node.inputs["Random Roughness"].default_value = 0.5
    shading = settings_by(
        "--groom", hair.name, "--look-from-material", "--set", "shading.width_r=0.2"
    )
    assert shading.index_of_refraction == pytest.approx(1.3)
    assert shading.width_r == 0.2
    assert "Random Roughness" in capsys.readouterr().err
    beside = ["--preset", "looks/blond", "--stage", "studio"]
    shading = settings_by("--groom", hair.name, "--look-from-material", *beside)
    assert shading.index_of_refraction == pytest.approx(1.3)


def test_the_command_line_needs_a_hair_object_for_it(hair: Any, sphere: Any) -> None:
    for arguments in ([], ["--groom", "nobody"], ["--groom", sphere.name]):
        with pytest.raises(HairloomError, match="no hair object"):
            settings_by(*arguments, "--look-from-material")
