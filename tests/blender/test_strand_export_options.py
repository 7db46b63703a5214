"""Exports of strands: bones, the check, collections, and importing the files again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog
from strand_files import needs_usd, read_alembic_curves, straight_strands
from tfxbone_reader import read_tfxbone

from hairloom.addon.blender.base.outcome import Outcome
from hairloom.addon.blender.base.thread_work import ThreadWork
from hairloom.addon.blender.scene.curves import write_curves
from hairloom.addon.blender.scene.groom_attributes import store_groom
from hairloom.addon.blender.strands.read_hair import ExportRequest, read_still_hair
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import read_hair_file
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.ui.strand_export import StrandExportOperator


@pytest.fixture
def read_output(capfd: pytest.CaptureFixture[str]) -> Callable[[], str]:
    return lambda: "".join(capfd.readouterr())


def skinned(head: Any) -> Any:
    """Skin a head to two bones, for its upper and lower half, and a third that does not deform;
    returns the armature."""
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("skull", "jaw", "ik"):
        bone = armature.data.edit_bones.new(name)
        bone.tail = (0.0, 0.0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data.bones["ik"].use_deform = False
    for name, is_upper in (("skull", True), ("jaw", False), ("ik", True)):
        chosen = [v.index for v in head.data.vertices if (v.co.z > 0.0) == is_upper]
        head.vertex_groups.new(name=name).add(chosen, 1.0, "REPLACE")
    modifier = head.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    return armature


def test_bones_of_a_skinned_head_lie_beside_tressfx(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    skinned(sphere)
    new_hair(sphere)
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "hair.tfx"), up="Z", pad_to_64=True)
    read = read_tfx(tmp_path / "hair.tfx", up="Z").strands
    assert read.strand_count == 64 and set(read.point_counts) == {8}
    bones = read_tfxbone(tmp_path / "hair.tfxbone")
    assert bones.names == ("skull", "jaw") and bones.strand_count == 64
    carrier = bones.bone[np.arange(64), bones.weight.argmax(axis=1)]
    clear = np.abs(read.roots[:, 2]) > 0.03
    np.testing.assert_array_equal(carrier[clear], (read.roots[:, 2] < 0.0)[clear])

    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "split.tfx"), by_group=True, up="Z")
    names = {f"split_group{g}{suffix}" for g in (0, 1) for suffix in (".tfx", ".tfxbone")}
    assert {p.name for p in tmp_path.glob("split*")} == names
    part = read_tfxbone(tmp_path / "split_group1.tfxbone")
    np.testing.assert_array_equal(part.bone[:30], bones.bone[1:60:2])


def test_bones_are_left_out_where_they_are_not_wanted_or_not_there(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    new_hair(sphere)
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "a.tfx"))
    skinned(sphere)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects["Hair"].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "b.tfx"), bones=False)
    assert {p.name for p in tmp_path.iterdir()} == {"a.tfx", "b.tfx"}


@pytest.mark.parametrize(
    ("renamed", "sentence"),
    [
        (("skull",), "strands, so they follow jaw. Weight the head there"),
        (("skull", "jaw"), "Head: no bone of Rig moves it, so no .tfxbone was written"),
    ],
    ids=["head", "all"],
)
def test_renamed_bones_are_reported(
    new_hair: Any,
    sphere: Any,
    tmp_path: Path,
    read_output: Callable[[], str],
    renamed: tuple[str, ...],
    sentence: str,
) -> None:
    """As after a rig was rebuilt: Blender renames only the groups of its own bones."""
    armature = skinned(sphere)
    new_hair(sphere)
    for name in renamed:
        armature.data.bones[name].name = f"Kopf_{name}"
        sphere.vertex_groups[f"Kopf_{name}"].name = name
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "hair.tfx"))
    assert sentence in read_output()
    assert (tmp_path / "hair.tfxbone").exists() == (renamed == ("skull",))


def test_an_armature_that_is_scaled_by_100_changes_nothing(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """As imported from FBX in centimetres: a large armature with a small head in it."""
    armature = skinned(sphere)
    new_hair(sphere)
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "hair.tfx"))
    armature.scale = (100.0, 100.0, 100.0)
    sphere.parent = armature
    for vertex in sphere.data.vertices:
        vertex.co *= 0.01
    for point in bpy.data.objects["Hair"].data.points:
        point.position *= 0.01
        point.radius *= 0.01
    bpy.context.view_layer.update()
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "large.tfx"))
    before, after = (read_tfx(tmp_path / f"{name}.tfx").strands for name in ("hair", "large"))
    np.testing.assert_allclose(after.points, before.points, atol=2e-6)
    np.testing.assert_allclose(after.radius, before.radius, rtol=1e-4)
    small, large = (read_tfxbone(tmp_path / f"{name}.tfxbone") for name in ("hair", "large"))
    assert small.names == large.names
    np.testing.assert_array_equal(small.bone, large.bone)


def test_the_check_says_what_the_engine_will_see(
    new_hair: Any, sphere: Any, read_output: Callable[[], str]
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 10
    assert bpy.ops.hairloom.check_export(engine="alembic unreal") == {"FINISHED"}
    text = read_output()
    assert "60 strands, 10 guides, 560 points" in text
    assert "Width: 0.01 cm" in text and "Z up, left-handed" in text
    hair.data.remove_curves()
    bpy.ops.hairloom.check_export(engine="usd maya")
    assert "no curves" in read_output()


@needs_usd
def test_a_collection_writes_its_own_hair(new_hair: Any, sphere: Any, tmp_path: Path) -> None:
    other = bpy.data.collections.new("Other")
    bpy.context.scene.collection.children.link(other)
    write_curves("Brows", hedgehog(20, 5), sphere, other)
    new_hair(sphere)
    for operator, suffix in (
        ("alembic", "abc"),
        ("usd", "usda"),
        ("tressfx", "tfx"),
        ("hair", "hair"),
    ):
        path = tmp_path / f"a.{suffix}"
        run = getattr(bpy.ops.hairloom, f"export_{operator}")
        assert run(filepath=str(path), collection="Other") == {"FINISHED"}
    assert read_hair_file(tmp_path / "a.hair").strands.strand_count == 20
    with pytest.raises(RuntimeError, match="no hair to write"):
        bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "b.tfx"), collection="Nothing")
    for name, suffixes in (("alembic", ".abc"), ("usd", ".usdc;.usd;.usda"), ("tressfx", ".tfx")):
        handler = getattr(bpy.types, f"HAIRLOOM_FH_export_{name}")
        assert handler.bl_export_operator == f"hairloom.export_{name}"
        assert handler.bl_file_extensions == suffixes


def test_a_collection_leaves_out_what_is_hidden_or_empty(
    new_hair: Any, sphere: Any, tmp_path: Path, read_output: Callable[[], str]
) -> None:
    other = bpy.data.collections.new("Other")
    bpy.context.scene.collection.children.link(other)
    write_curves("Brows", hedgehog(20, 5), sphere, other)
    hidden = write_curves("Combed", hedgehog(20, 5), sphere, other)
    hidden.hide_render = hidden.hide_viewport = True
    other.objects.link(bpy.data.objects.new("Nothing", bpy.data.hair_curves.new("Nothing")))
    path = tmp_path / "a.tfx"
    bpy.ops.hairloom.export_tressfx(filepath=str(path), collection="Other")
    assert read_tfx(path).strands.strand_count == 20
    said = read_output()
    assert "Combed: it is hidden in viewport and renders, and is left out" in said
    assert "Nothing: it has no curves, and is left out" in said


def test_a_collections_exporter_is_run_by_blender(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """As Properties > Collection > Exporters does."""
    new_hair(sphere)
    collection = bpy.context.scene.collection
    if not hasattr(bpy.ops.collection, "exporter_add"):
        pytest.skip("this Blender has no exporters of collections")
    with bpy.context.temp_override(collection=collection):
        assert bpy.ops.collection.exporter_add(name="HAIRLOOM_FH_export_hair") == {"FINISHED"}
        (exporter,) = collection.exporters
        exporter.export_properties.filepath = str(tmp_path / "own.hair")
        assert bpy.ops.collection.exporter_export(index=0) == {"FINISHED"}
    assert read_hair_file(tmp_path / "own.hair").strands.strand_count == 60


@needs_usd
def test_without_alembics_library_usd_is_offered(
    new_hair: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    new_hair(strands=straight_strands())
    monkeypatch.setitem(sys.modules, "alembic3d", None)
    with pytest.raises(RuntimeError, match=r"alembic3d.*Use USD instead"):
        bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    assert bpy.ops.hairloom.export_usd(filepath=str(tmp_path / "a.usdc")) == {"FINISHED"}


def test_hair_of_guides_alone_is_written_as_strands(new_hair: Any, tmp_path: Path) -> None:
    """As an import with separate guides leaves it."""
    hair = new_hair()
    store_groom(hair.data, Groom(hedgehog(), is_guide=np.ones(60, bool)))
    bpy.ops.hairloom.export_hair(filepath=str(tmp_path / "a.hair"))
    assert read_hair_file(tmp_path / "a.hair").strands.strand_count == 60
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = read_alembic_curves(tmp_path / "a.abc").values()
    assert "groom_guide" not in curves
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "g.abc"), parts="guides")
    (curves,) = read_alembic_curves(tmp_path / "g.abc").values()
    assert curves["groom_guide"].all()


@pytest.mark.parametrize(
    ("operator", "suffix", "options"),
    [
        ("export_alembic", ".abc", {"engine": "blender"}),
        ("export_alembic", ".abc", {"engine": "unreal"}),
        pytest.param(
            "export_usd", ".usdc", {"engine": "blender", "parts": "both"}, marks=needs_usd
        ),
        pytest.param("export_usd", ".usda", {"engine": "maya", "parts": "both"}, marks=needs_usd),
        ("export_tressfx", ".tfx", {}),
        ("export_hair", ".hair", {}),
    ],
)
def test_exported_grooms_can_be_imported_again(
    new_hair: Any, sphere: Any, tmp_path: Path, operator: str, suffix: str, options: Any
) -> None:
    strands = replace(hedgehog(), color=np.random.default_rng(8).random((480, 3)))
    hair = new_hair(sphere, strands)
    said = Groom(
        strands,
        strand_id=np.arange(60) + 5,
        group_names={0: "crown", 1: "nape"},
    )
    store_groom(hair.data, said)

    def groom_of(hair: bpy.types.Object) -> Groom:
        request = ExportRequest(guides=False)
        return read_still_hair(hair, bpy.context.evaluated_depsgraph_get(), request).groom

    before = groom_of(hair)
    path = tmp_path / f"hair{suffix}"
    getattr(bpy.ops.hairloom, operator)(filepath=str(path), **options)
    bpy.ops.object.select_all(action="DESELECT")
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    assert bpy.ops.hairloom.import_strands(filepath=str(path)) == {"FINISHED"}
    again = next(o for o in bpy.data.objects if o.type == "CURVES" and o != hair)
    again.data.hairloom.widths.method = "own"
    after = groom_of(again)
    bits = options.get("engine") == "blender"
    tolerance = 0.0 if bits else 1e-6
    np.testing.assert_allclose(after.strands.points, before.strands.points, atol=tolerance, rtol=0)
    np.testing.assert_allclose(after.strands.radius, before.strands.radius, rtol=1e-5)
    np.testing.assert_allclose(after.color, before.color, atol=1e-6)
    if suffix != ".hair":
        np.testing.assert_allclose(after.strands.root_uv, before.strands.root_uv, atol=1e-4)
    if suffix not in (".hair", ".tfx"):
        np.testing.assert_array_equal(after.strands.group, before.strands.group)
        np.testing.assert_array_equal(after.strand_id, before.strand_id)
        assert dict(after.group_names) == dict(before.group_names)


def test_esc_says_how_many_of_several_files_are_written() -> None:
    """Esc is pressed when the frames of the second file begin."""
    written = ThreadWork(lambda _: Outcome("Wrote a.abc", {}), "a.abc")
    still = SimpleNamespace(frames=None, write_in_thread=lambda path: written)
    moving = SimpleNamespace(frames=range(2), frame_count=2)
    plans = [(Path("a.abc"), still), (Path("b.abc"), moving)]
    operator = SimpleNamespace(
        _plans=lambda *_: plans, bl_idname="", bl_label="", report=lambda *_: None
    )
    steps = StrandExportOperator.steps(operator, bpy.context)
    assert any(step.text == "0 of 2 frames" for step in steps)
    steps.close()
    assert operator.state_after_cancel == "1 of 2 files are written"
