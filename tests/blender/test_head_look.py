"""The look of heads: their own materials, those of the bust, or plain skin."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.blender.command_line.inputs import Sources, read_inputs
from hairloom.addon.blender.pictures.head_parts import head_parts
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.bust import bust_object
from hairloom.addon.blender.scene.head_look import head_look
from hairloom.addon.blender.scene.mesh_files import import_mesh_file, read_mesh_file
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.render.snapshot import MeshSnapshot
from hairloom.addon.strands import Surface


def in_scene(obj: bpy.types.Object) -> Surface:
    bpy.context.scene.collection.objects.link(obj)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_surface(obj, depsgraph, need_uv=False, place=obj.name)


def cube(name: str, colors: list[tuple[float, float, float]]) -> bpy.types.Object:
    """A cube whose faces have materials of these colours in turn."""
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    obj.name = name
    for number, color in enumerate(colors):
        material = bpy.data.materials.new(f"{name} {number}")
        shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (*color, 1.0)
        shader.inputs["Roughness"].default_value = 0.3
        obj.data.materials.append(material)
    for face in obj.data.polygons:
        face.material_index = face.index % max(len(colors), 1)
    return obj


@pytest.mark.parametrize("tone", few_in_commits(["light", "dark"]))
def test_the_bust_of_a_scene_looks_as_the_built_in_one(tone: str) -> None:
    """The materials in the scene decide, whatever --skin says."""
    bust = bust_object("Bust in a scene", tone)
    surface, wanted = in_scene(bust), built_in_head().look(tone)
    found = head_look(bust.name, surface, "medium")
    assert found is not None
    for (triangles, material), (other, expected) in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(triangles, other)
        assert material.roughness == pytest.approx(expected.roughness)
        assert material.specular == pytest.approx(expected.specular, abs=1e-5)
        one, two = material.pictures, expected.pictures
        assert one is not None and two is not None
        assert one.color is not None and two.color is not None
        assert np.abs(one.color - two.color).max() < 0.01


def test_the_bust_without_materials_is_known_by_its_mesh() -> None:
    bust = bust_object("Bare bust", None)
    found = head_look(bust.name, in_scene(bust), "dark")
    assert found is not None
    assert found[0][1].color == built_in_head().look("dark")[0][1].color
    assert head_look(None, built_in_head().surface, "dark") is not None


def test_another_mesh_has_its_own_materials_or_plain_skin(tmp_path: Path) -> None:
    colors = [(0.1, 0.2, 0.3), (0.5, 0.4, 0.1)]
    painted = cube("Painted", colors)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surface = read_surface(painted, depsgraph, need_uv=False, place="cube")
    found = head_look("Painted", surface, "light")
    assert found is not None and [material.color for _, material in found] == [
        pytest.approx(color) for color in colors
    ]
    assert all(material.roughness == pytest.approx(0.3) for _, material in found)
    parts = head_parts(MeshSnapshot.of(surface, is_skin=True), found)
    assert sum(len(part.surface.triangles) for part in parts) == len(surface.triangles)
    assert [part.color for part in parts] == [material.color for _, material in found]

    file = tmp_path / "painted.obj"
    bpy.ops.wm.obj_export(filepath=str(file), export_selected_objects=True)
    read = head_look(str(file), read_mesh_file(file, need_uv=False)[0], "light")
    assert read is not None
    assert sorted(material.color for _, material in read) == [
        pytest.approx(color, abs=1e-3) for color in sorted(colors)
    ]

    plain = cube("Plain", [])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    bare = read_surface(plain, depsgraph, need_uv=False, place="cube")
    assert head_look("Plain", bare, "light") is None
    # materials of another mesh are not used for a bake's mesh that has changed since
    fewer = Surface(bare.positions, bare.triangles[:-1], None)
    assert head_look("Painted", fewer, "light") is None


def test_hair_on_the_bust_of_a_scene_comes_with_brows_and_lashes() -> None:
    in_scene(bust_object("Bust with groups", None))
    settings = GrowSettings(strand_count=80, cv_count=4)
    grown = read_inputs(Sources(head="Bust with groups"), settings).strands
    assert (
        np.unique(grown.group).tolist()
        == np.unique(read_inputs(Sources(), settings).strands.group).tolist()
    )
    assert len(np.unique(grown.group)) == 3


def test_a_rigged_file_that_is_read_leaves_nothing_in_the_scene(tmp_path: Path) -> None:
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("head").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.location.x = 1.0
    rig.keyframe_insert("location", frame=1)
    mesh = cube("Painted", [(1.0, 0.0, 0.0)])
    mesh.parent, mesh.shape_key_add(name="Basis").value = rig, 0.0
    file = tmp_path / "rigged.glb"
    bpy.ops.export_scene.gltf(filepath=str(file))
    bpy.ops.wm.read_homefile(use_empty=True)

    def everything() -> dict[str, int]:
        kinds = (
            each.identifier for each in bpy.data.bl_rna.properties if each.type == "COLLECTION"
        )
        return {kind: len(getattr(bpy.data, kind)) for kind in kinds}

    before = everything()
    read_mesh_file(file, need_uv=False)
    assert everything() == before
    broken = tmp_path / "broken.glb"
    broken.write_bytes(file.read_bytes()[:-200])
    with pytest.raises(HairloomError):
        import_mesh_file(broken)
    assert everything() == before
