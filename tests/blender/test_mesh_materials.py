"""Materials of meshes: the values that are read, and textured planes compared with Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.scene import mesh_materials
from hairloom.addon.blender.scene.mesh_materials import (
    MeshMaterial,
    material_of,
    may_be_transparent,
)
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshPictures, MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.draws

SIZE = 64


def picture(name: str, pixels: np.ndarray, space: str = "sRGB") -> bpy.types.Image:
    """An image of these stored values, (height, width, 4)."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=True)
    image.colorspace_settings.name = space
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    return image


@pytest.fixture
def material() -> bpy.types.Material:
    """A Principled material without specular reflection."""
    made = bpy.data.materials.new("Skin")
    node = made.node_tree.nodes["Principled BSDF"]
    node.inputs["Roughness"].default_value = 1.0
    node.inputs["Specular IOR Level"].default_value = 0.0
    return made


def give(material: bpy.types.Material, image: bpy.types.Image | None, socket: str) -> Any:
    """Connect an image texture to an input of Principled; returns its node."""
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Linear"
    output = texture.outputs["Color"]
    if socket == "Normal":
        bump = tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(output, bump.inputs["Color"])
        output = bump.outputs["Normal"]
    tree.links.new(output, tree.nodes["Principled BSDF"].inputs[socket])
    return texture


def test_without_a_material_it_is_blenders_grey() -> None:
    assert material_of(None) == MeshMaterial()


def test_values_are_read(material: bpy.types.Material) -> None:
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (0.2, 0.4, 0.6, 1.0)
    inputs["Alpha"].default_value = 0.3
    found = material_of(material)
    assert found.color == pytest.approx((0.2, 0.4, 0.6)) and found.specular == 0.0
    assert (found.alpha, found.transparency) == (pytest.approx(0.3), "hashed")
    material.surface_render_method = "BLENDED"
    assert material_of(material).transparency == "blended"


def test_a_picture_is_read_as_light_and_kept(material: bpy.types.Material) -> None:
    """A stored sRGB 0.5 is 0.214 scene-linear. The array is reused while the image is the same."""
    pixels = np.full((4, 6, 4), 0.5)
    pixels[..., 3] = 0.25
    texture = give(material, picture("Checks", pixels), "Base Color")
    texture.image.pack()
    found = material_of(material)
    assert found.pictures is not None and found.pictures.color is not None
    assert found.pictures.color.shape == (4, 6, 4)
    assert found.color == pytest.approx((0.2140, 0.2140, 0.2140), abs=2e-3)
    # alpha counts only if it is connected
    assert found.transparency == "opaque" and (found.pictures.color[..., 3] == 1.0).all()
    again = material_of(material).pictures
    assert again is not None and again.color is found.pictures.color
    tree = material.node_tree
    tree.links.new(texture.outputs["Alpha"], tree.nodes["Principled BSDF"].inputs["Alpha"])
    clear = material_of(material)
    assert clear.transparency == "hashed" and clear.pictures is not None
    assert clear.pictures.color is not None
    assert clear.pictures.color[..., 3] == pytest.approx(0.25, abs=2e-3)


def test_a_missing_picture_leaves_the_value_and_a_message(
    material: bpy.types.Material, tmp_path: Path
) -> None:
    image = bpy.data.images.new("Gone", 4, 4)
    image.source, image.filepath = "FILE", str(tmp_path / "gone.png")
    give(material, image, "Base Color")
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (
        *(0.1, 0.2, 0.3),
        1.0,
    )
    found = material_of(material)
    assert found.pictures is None and found.color == pytest.approx((0.1, 0.2, 0.3))
    (note,) = found.notes
    assert "Gone" in note and "Missing Files" in note


def test_emission_is_read_and_is_none_by_default(material: bpy.types.Material) -> None:
    assert material_of(material).emission == (0.0, 0.0, 0.0)
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["Emission Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    node.inputs["Emission Strength"].default_value = 4.0
    assert material_of(material).emission == pytest.approx((4.0, 2.0, 1.0))
    material.node_tree.nodes.remove(node)
    shining = material.node_tree.nodes.new("ShaderNodeEmission")
    shining.inputs["Color"].default_value = (0.5, 0.5, 1.0, 1.0)
    shining.inputs["Strength"].default_value = 2.0
    found = material_of(material)
    assert found.emission == pytest.approx((1.0, 1.0, 2.0)) and found.color == (0.0, 0.0, 0.0)


def test_nodes_that_are_not_read_are_reported(material: bpy.types.Material) -> None:
    tree = material.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    for socket in ("Base Color", "Alpha", "Normal"):
        tree.links.new(noise.outputs[1], tree.nodes["Principled BSDF"].inputs[socket])
    found = material_of(material)
    assert found.pictures is None and found.alpha == 1.0
    assert [note.split(" comes")[0] for note in found.notes] == [
        "Skin: Alpha",
        "Skin: Base Color",
        "Skin: Normal",
    ]


def square() -> Surface:
    """A square from -0.5 to 0.5 in x and y; its UVs are rotated by 90 degrees and half as wide."""
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[0.0, 0.0], [0.0, 1.0], [-0.5, 1.0], [-0.5, 0.0]])
    return Surface(corners, triangles, uv[triangles])


def waves() -> tuple[np.ndarray, np.ndarray]:
    """Stored values of a colour gradient, and of a normal map of waves in both directions."""
    place = (np.arange(32) + 0.5) / 32.0
    color = np.ones((32, 32, 4))
    color[..., 0], color[..., 1], color[..., 2] = place, place[:, None], 0.5
    normal = np.ones((32, 32, 4))
    normal[..., 0] = 0.4 * np.sin(2.0 * np.pi * place)
    normal[..., 1] = 0.3 * np.sin(2.0 * np.pi * place)[:, None]
    normal[..., 2] = np.sqrt(1.0 - normal[..., 0] ** 2 - normal[..., 1] ** 2)
    normal[..., :3] = 0.5 * normal[..., :3] + 0.5
    return color, normal


def of_cycles(material: bpy.types.Material, sun: np.ndarray, folder: Path) -> np.ndarray:
    from mathutils import Vector

    surface, scene = square(), bpy.context.scene
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata(surface.positions.tolist(), [], surface.triangles.tolist())
    assert surface.corner_uv is not None
    mesh.uv_layers.new().uv.foreach_set("vector", surface.corner_uv.ravel())
    mesh.materials.append(material)
    lamp, eye = bpy.data.lights.new("Sun", "SUN"), bpy.data.cameras.new("Camera")
    lamp.energy, lamp.angle = np.pi, 0.0
    eye.type, eye.ortho_scale = "ORTHO", 1.0
    things = [bpy.data.objects.new(data.name, data) for data in (mesh, lamp, eye)]
    for thing in things:
        scene.collection.objects.link(thing)
    things[1].rotation_euler = Vector(sun).to_track_quat("Z", "Y").to_euler()
    things[2].location.z = 2.0
    scene.camera, scene.world = things[2], None
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 64, 0
    scene.cycles.pixel_filter_type = "BOX"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "square.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels[:]).reshape(SIZE, SIZE, 4)


@pytest.mark.alike
@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize(
    ("bump", "level", "roughness"),
    [(1.0, 0.0, 1.0), (0.5, 0.0, 1.0), (1.0, 0.5, 0.45), (1.0, 0.5, 0.3)],
    ids=["bumps", "lower", "skin", "glossy"],
)
def test_a_plane_with_pictures_is_as_in_cycles(
    material: bpy.types.Material, tmp_path: Path, bump: float, level: float, roughness: float
) -> None:
    """For matt and glossy planes, the mean difference from Cycles is below 1 % of the mean
    radiance, and its 99th percentile below 0.03."""
    from hairloom.addon.render import frame

    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Specular IOR Level"].default_value, inputs["IOR"].default_value = level, 1.4
    inputs["Roughness"].default_value = roughness

    color, normal = waves()
    give(material, picture("Color", color), "Base Color")
    give(material, picture("Normal", normal, "Non-Color"), "Normal")
    (node,) = (each for each in material.node_tree.nodes if each.type == "NORMAL_MAP")
    node.inputs["Strength"].default_value = bump
    sun = np.array([0.4, 0.2, 0.9]) / np.linalg.norm([0.4, 0.2, 0.9])
    read = material_of(material)
    assert not read.notes
    none = np.zeros((0, 2, 3), np.float32)
    surface = square()
    mesh = MeshSnapshot(
        surface,
        np.tile(np.float32([0, 0, 1]), (4, 1)),
        color=read.color,
        specular=read.specular,
        roughness=read.roughness,
        pictures=read.pictures,
    )
    snapshot = Snapshot(
        none,
        none[..., 0],
        meshes=(mesh,),
        lights=(Light.sun(-sun, (1.0, 1.0, 1.0), np.pi),),
        ambient=(0.0, 0.0, 0.0),
    )
    view = look_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, orthographic(1.0, 1.0, 0.0, 3.0))
    ours = frame.render_image(snapshot, camera, SIZE, SIZE, 4)[4:-4, 4:-4, :3]
    truth = of_cycles(material, sun, tmp_path)[4:-4, 4:-4, :3]
    assert truth.std(axis=(0, 1)).max() > 0.1
    assert np.abs(ours - truth).mean() < 0.01 * truth.mean()
    assert np.percentile(np.abs(ours - truth), 99.0) < 0.03


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("transparency", ["opaque", "hashed", "blended"])
def test_meshes_cover_as_much_as_their_alpha_says(transparency: str) -> None:
    """A red sheet with alpha 0.5 over a blue one; the red one comes first in the list."""
    from hairloom.addon.render import frame

    surface = square()
    behind = Surface(surface.positions - np.float32([0, 0, 0.2]), surface.triangles)
    up, none = np.tile(np.float32([0, 0, 1]), (4, 1)), np.zeros((0, 2, 3), np.float32)
    red = MeshPictures(color=np.full((2, 2, 4), (1.0, 0.0, 0.0, 0.5), np.float32))
    for pictures, alpha in ((None, 0.5), (red, 1.0)):
        sheet = MeshSnapshot(
            surface,
            up,
            color=(1.0, 0.0, 0.0),
            specular=0.0,
            pictures=pictures,
            alpha=alpha,
            transparency=transparency,
        )
        floor = MeshSnapshot(behind, up, color=(0.0, 0.0, 1.0), specular=0.0)
        snapshot = Snapshot(none, none[..., 0], meshes=(sheet, floor), ambient=(1.0, 1.0, 1.0))
        view = look_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
        camera = Camera(view, orthographic(1.0, 1.0, 0.0, 3.0))
        seen = frame.render_image(snapshot, camera, 32, 32, 4)
        expected = (1.0, 0.0, 0.0) if transparency == "opaque" else (0.5, 0.0, 0.5)
        assert seen[2:-2, 2:-2, :3].mean(axis=(0, 1)) == pytest.approx(expected, abs=0.02)
        assert seen[2:-2, 2:-2, 3].min() == pytest.approx(1.0)


@pytest.mark.usefixtures("gpu_context")
def test_blended_meshes_are_drawn_from_far_to_near() -> None:
    """In either order of the list, the nearer of two sheets with alpha 0.5 weighs more."""
    from hairloom.addon.render import frame

    surface, none = square(), np.zeros((0, 2, 3), np.float32)
    up = np.tile(np.float32([0, 0, 1]), (4, 1))
    sheets = [
        MeshSnapshot(
            Surface(surface.positions + np.float32([0, 0, z]), surface.triangles),
            up,
            color=color,
            specular=0.0,
            alpha=0.5,
            transparency="blended",
        )
        for z, color in ((0.3, (1.0, 0.0, 0.0)), (0.0, (0.0, 0.0, 1.0)))
    ]
    view = look_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, orthographic(1.0, 1.0, 0.0, 3.0))
    for order in (sheets, sheets[::-1]):
        snapshot = Snapshot(none, none[..., 0], meshes=tuple(order), ambient=(1.0, 1.0, 1.0))
        seen = frame.render_image(snapshot, camera, 16, 16, 1)
        assert seen[8, 8] == pytest.approx((0.5, 0.0, 0.25, 0.75), abs=1e-3)


def test_the_engine_reports_what_is_missing(sphere: Any, new_hair: Any, material: Any) -> None:
    """Warnings name a missing file, and a head without UVs once its shadows are soft."""
    from hairloom.addon.blender.engine.engine_scene import SceneReader

    def warnings() -> str:
        sphere.data.update_tag()
        bpy.context.view_layer.update()
        reader.read(bpy.context.evaluated_depsgraph_get())
        return "\n".join(reader.warnings)

    reader, hair = SceneReader(), new_hair(sphere)
    hair.data.hairloom.volume.shadows = "none"
    sphere.data.materials.append(material)
    image = bpy.data.images.new("Gone", 4, 4)
    image.source, image.filepath = "FILE", "/nowhere/gone.png"
    give(material, image, "Base Color")
    assert "Gone" in warnings() and "UVs" not in warnings()
    while sphere.data.uv_layers:
        sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    assert "UVs" not in warnings()
    hair.data.hairloom.volume.shadows = "deep"
    assert "the head has no UVs" in warnings()


def test_a_picture_whose_file_was_written_again_is_read_again(
    material: bpy.types.Material, tmp_path: Path
) -> None:
    image = picture("Skin", np.full((4, 4, 4), 0.5))
    image.filepath_raw, image.file_format = str(tmp_path / "skin.png"), "PNG"
    image.save()
    give(material, image, "Base Color")
    before = material_of(material).color
    other = picture("Other", np.ones((4, 4, 4)))
    other.filepath_raw, other.file_format = image.filepath_raw, "PNG"
    other.save()
    image.reload()
    assert material_of(material).color == pytest.approx((1.0, 1.0, 1.0)) != before


def test_few_pictures_are_kept(material: bpy.types.Material) -> None:
    texture = give(material, picture("First", np.ones((2, 2, 4))), "Base Color")
    for number in range(40):
        texture.image = picture(f"Picture {number}", np.ones((2, 2, 4)))
        material_of(material)
    assert len(mesh_materials._picture_cache) == mesh_materials._CACHE_SIZE
    mesh_materials.clear_cache()
    assert not mesh_materials._picture_cache


@pytest.mark.parametrize(
    "how", ["object", "colour", "method", "alpha", "picture", "mixed", "nothing"]
)
def test_which_materials_are_transparent(material: bpy.types.Material, how: str) -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane, node = bpy.context.object, material.node_tree.nodes["Principled BSDF"]
    assert not may_be_transparent(plane), "without a material it cannot"
    plane.data.materials.append(bpy.data.materials.new("Opaque"))
    plane.data.materials.append(material)
    if how == "object":
        plane.color[3] = 0.5
    elif how == "colour":
        material.diffuse_color[3] = 0.5
    elif how == "method":
        material.surface_render_method = "BLENDED"
    elif how == "alpha":
        node.inputs["Alpha"].default_value = 0.5
    elif how == "picture":
        give(material, None, "Alpha")
    elif how == "mixed":
        material.node_tree.nodes.new("ShaderNodeBsdfTransparent")
    assert may_be_transparent(plane) is (how != "nothing")
