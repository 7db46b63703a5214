"""Light of the world, compared with a rendering by Cycles in another Blender."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from engine_stage import background_node, set_panorama
from waiting import run_steps_until

from hairloom.addon.blender.scene import world as world_module
from hairloom.addon.blender.scene.world import read_environment, world_notes
from hairloom.addon.shading.environment import (
    Environment,
    panorama_directions,
    radiance_from,
)

DIRECTIONS, _ = panorama_directions(12, 24)


@pytest.fixture
def scene() -> Any:
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    return scene


def uneven() -> np.ndarray:
    directions, _ = panorama_directions(64, 128)
    x, y, z = np.moveaxis(directions, -1, 0)
    radiance = np.stack([1.0 + 0.8 * x, 1.0 + 0.7 * y, 1.0 + 0.5 * z + 0.4 * x * y], axis=-1)
    radiance[44:46, 30:32] += 400.0
    return radiance


def by_cycles(scene: Any) -> Environment:
    """The same world rendered by another Blender: a Gamma of 1 prevents our reading it."""
    tree, shader = scene.world.node_tree, background_node(scene)
    gamma = tree.nodes.new("ShaderNodeGamma")
    tree.links.new(shader.inputs["Color"].links[0].from_socket, gamma.inputs["Color"])
    tree.links.new(gamma.outputs["Color"], shader.inputs["Color"])
    found = read_environment(scene)
    assert not world_notes(scene)
    return found


def assert_alike(found: Environment, expected: Environment) -> None:
    assert found.ambient == pytest.approx(expected.ambient, rel=0.02)
    assert radiance_from(found, DIRECTIONS) == pytest.approx(
        radiance_from(expected, DIRECTIONS), abs=0.05
    )
    for ours, theirs in zip(found.suns, expected.suns, strict=True):
        assert np.degrees(np.arccos(min(np.dot(ours.vector, theirs.vector), 1.0))) < 1.0
        assert ours.power == pytest.approx(theirs.power, rel=0.06)


def test_no_world_is_black_and_one_without_nodes_has_its_color(scene: Any) -> None:
    scene.world.node_tree.nodes.clear()
    scene.world.color = (0.1, 0.2, 0.3)
    assert read_environment(scene).ambient == pytest.approx((0.1, 0.2, 0.3))
    scene.world = None
    assert read_environment(scene).is_black and not world_notes(scene)


@pytest.mark.parametrize("has_node", [False, True])
def test_a_plain_color_is_even(scene: Any, has_node: bool) -> None:
    shader = background_node(scene)
    shader.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1.0)
    shader.inputs["Strength"].default_value = 2.0
    if has_node:
        node = scene.world.node_tree.nodes.new("ShaderNodeRGB")
        node.outputs[0].default_value = shader.inputs["Color"].default_value
        scene.world.node_tree.links.new(node.outputs[0], shader.inputs["Color"])
    found = read_environment(scene)
    assert found.ambient == pytest.approx((0.2, 0.4, 0.8))
    assert found.harmonics is None and not found.suns
    assert read_environment(scene) is found


def test_an_image_lights_from_where_its_pixels_are(scene: Any) -> None:
    radiance = uneven()
    set_panorama(scene, radiance)
    background_node(scene).inputs["Strength"].default_value = 0.7
    found = read_environment(scene)
    directions, solid_angle = panorama_directions(64, 128)
    (sun,) = found.suns
    lamp = directions[44:46, 30:32].reshape(-1, 3).mean(axis=0)
    assert np.dot(sun.vector, lamp / np.linalg.norm(lamp)) > np.cos(np.radians(1.0))
    whole = 0.7 * (radiance * solid_angle[..., None]).sum(axis=(0, 1)) / (4.0 * np.pi)
    spot = np.array(sun.power) / (4.0 * np.pi)
    assert found.ambient + spot == pytest.approx(whole, rel=0.02)


@pytest.mark.slow(instead="test_an_image_lights_from_where_its_pixels_are")
def test_an_image_lights_as_in_cycles(scene: Any) -> None:
    set_panorama(scene, uneven())
    background_node(scene).inputs["Strength"].default_value = 0.7
    found = read_environment(scene)
    assert found.harmonics is not None and len(found.suns) == 1
    assert read_environment(scene) is found, "nothing has changed"
    assert_alike(found, by_cycles(scene))


def test_another_image_of_the_same_name_is_another_world(scene: Any) -> None:
    node = set_panorama(scene, uneven())
    found = read_environment(scene)
    bpy.data.images.remove(node.image)
    scene.world.node_tree.nodes.remove(node)
    assert set_panorama(scene, 2.0 * uneven()).image.name == "Panorama"
    assert read_environment(scene).ambient == pytest.approx(2.0 * np.array(found.ambient))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_a_mapping_turns_it_as_in_cycles(scene: Any, kind: str) -> None:
    node, tree = set_panorama(scene, uneven()), scene.world.node_tree
    place, mapping = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = kind
    mapping.inputs["Rotation"].default_value = (0.4, -0.2, 1.3)
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    found = read_environment(scene)
    assert_alike(found, by_cycles(scene))


@pytest.mark.slow
def test_the_views_picture_turns_as_blenders_nodes_do(scene: Any, tmp_path: Any) -> None:
    """Material Preview rotates the world by a Vector Rotate around Z with the view's angle."""
    node, tree = set_panorama(scene, uneven()), scene.world.node_tree
    node.image.filepath_raw, node.image.file_format = str(tmp_path / "view.exr"), "OPEN_EXR"
    node.image.save()
    ours = world_module._studio_light(str(tmp_path / "view.exr"), 0.8, 1.0)
    place, turn = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorRotate")
    turn.rotation_type = "Z_AXIS"
    turn.inputs["Angle"].default_value = 0.8
    tree.links.new(place.outputs["Generated"], turn.inputs["Vector"])
    tree.links.new(turn.outputs["Vector"], node.inputs["Vector"])
    assert_alike(ours, read_environment(scene))


def test_a_sky_is_rendered_once(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its sun has the node's elevation; other values of the node are another sky."""
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type, sky.sun_size = "MULTIPLE_SCATTERING", np.radians(3.0)
    sky.sun_elevation = 0.6
    tree.links.new(sky.outputs[0], background_node(scene).inputs["Color"])
    runs: list[Any] = []
    run = world_module.run_child
    monkeypatch.setattr(
        world_module,
        "run_child",
        lambda *given, **named: runs.append(given) or run(*given, **named),
    )
    found = read_environment(scene)
    assert not world_notes(scene) and found.harmonics is not None
    assert np.arcsin(found.suns[0].vector[2]) == pytest.approx(0.6, abs=0.02)
    # bluer overhead than at the horizon
    above, beside = radiance_from(found, np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
    assert above[2] / above[0] > beside[2] / beside[0]
    assert read_environment(scene) is found and len(runs) == 1
    sky.sun_elevation = 0.5
    assert world_module._state(tree) != world_module._state(bpy.data.worlds.new("W").node_tree)
    monkeypatch.setattr(world_module, "run_child", lambda *_, **__: runs.append(0) or fail())
    assert read_environment(scene) is not found and len(runs) == 2


def test_in_the_window_it_is_rendered_beside(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until it arrives, the plain colour is used; later, the previous result."""
    tree = scene.world.node_tree
    gradient = tree.nodes.new("ShaderNodeTexGradient")
    tree.links.new(gradient.outputs["Color"], background_node(scene).inputs["Color"])

    def arrived() -> Environment:
        run_steps_until(lambda: not world_module._job.is_pending)
        return read_environment(scene, blocking=False)

    plain = read_environment(scene, blocking=False)
    assert plain.harmonics is None
    first = arrived()
    assert first.harmonics is not None and not world_notes(scene)
    background_node(scene).inputs["Strength"].default_value = 3.0
    monkeypatch.setattr(world_module, "run_child", lambda *_, **__: fail())
    assert read_environment(scene, blocking=False) is first
    assert arrived() is not first and "no such program" in world_notes(scene)[0]


def fail() -> Any:
    raise OSError("no such program")


def test_nodes_that_cannot_be_rendered_leave_the_plain_color(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    tree = scene.world.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], background_node(scene).inputs["Color"])
    background_node(scene).inputs["Color"].default_value = (0.3, 0.2, 0.1, 1.0)
    monkeypatch.setattr(world_module, "run_child", lambda *_, **__: fail())
    assert read_environment(scene).ambient == pytest.approx((0.3, 0.2, 0.1))
    (note,) = world_notes(scene)
    assert "World" in note and "no such program" in note and "Environment Texture" in note


def test_a_missing_file_is_reported_and_black(scene: Any) -> None:
    tree = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = bpy.data.images.new("Gone", 4, 2)
    node.image.source, node.image.filepath = "FILE", "//gone.exr"
    tree.links.new(node.outputs["Color"], background_node(scene).inputs["Color"])
    assert read_environment(scene).is_black
    (note,) = world_notes(scene)
    assert "Gone" in note and "Find Missing Files" in note


def test_broken_pixels_leave_light_finite(scene: Any) -> None:
    radiance = uneven()
    radiance[5, 5], radiance[6, 6], radiance[7, 7] = np.nan, np.inf, 1.0e6
    set_panorama(scene, radiance)
    found = read_environment(scene)
    assert np.isfinite(found.ambient).all() and np.isfinite(found.harmonics).all()
    assert any(max(sun.power) > 500.0 for sun in found.suns)
