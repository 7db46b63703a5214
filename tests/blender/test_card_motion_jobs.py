"""Cards in motion, exported by a button, by the command line, and cancelled halfway."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from swinging import key_x

bpy = pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from waiting import wait_until  # noqa: E402

from hairloom.addon.blender.cards.files import CardExport, CardOutput  # noqa: E402
from hairloom.addon.blender.command_line import command_line  # noqa: E402
from hairloom.addon.blender.preview.bake import Bake  # noqa: E402
from hairloom.addon.cards.export_settings import CardExportSettings  # noqa: E402


@pytest.mark.usefixtures("extension")
@pytest.mark.slow
def test_the_command_line_writes_a_bake(tmp_path: Path, capfd: Any) -> None:
    few = [
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=60",
        "--set",
        "guides.guide_count=12",
    ]
    few += ["--set", "grow.length=0.06"]
    bake = str(tmp_path / "bake")
    assert command_line.run(["simulate", *few, "--seconds", "0.2", "--output", bake]) == 0
    small = ["--set", "cards.source=guides", "--levels", "1", "--set", "atlas.source=made"]
    arguments = ["cards", *few, *small, "--output", str(tmp_path / "hair.glb")]
    moving = ["--motion", "joints", "--chains", "4"]
    assert command_line.run([*arguments, *moving]) == 1
    assert "--bake" in capfd.readouterr().err
    assert command_line.run([*arguments, "--bake", bake]) == 1
    assert "--motion" in capfd.readouterr().err
    assert command_line.run([*arguments, *moving, "--bake", bake, "--frames", "2", "99"]) == 1
    assert "frames 0 to 12" in capfd.readouterr().err
    report = ["--report", str(tmp_path / "report.json")]
    some = ["--bake", bake, "--frames", "2", "9"]
    assert command_line.run([*arguments, *moving, *some, *report]) == 0
    facts = json.loads((tmp_path / "report.json").read_text("utf-8"))
    assert 0.0 <= facts["cards_stretch_max_percent"] < 0.1
    assert 0.0 <= facts["cards_penetration_p99_mm"] <= facts["cards_penetration_max_mm"] < 0.5
    assert facts["cards_inside_percent"] == facts["cards_stretched_percent"] == 0.0
    entry = json.loads((tmp_path / "hair.hairloom.json").read_text("utf-8"))["motion"]
    assert entry["frames"] == {"first": 2, "count": 8, "rate": 60.0}
    assert entry["chains"] <= 4
    springs = ["--motion", "springs", "--spring-joints", "9", "--bake", bake]
    assert command_line.run([*arguments, *springs, "--motion-space", "world"]) == 1
    refused = capfd.readouterr().err
    assert "--motion-space" in refused and "--motion joints or texture" in refused
    assert command_line.run([*arguments, *springs]) == 0
    entry = json.loads((tmp_path / "hair.hairloom.json").read_text("utf-8"))["motion"]
    assert (entry["kind"], entry["joints"] <= 9) == ("springs", True)
    assert "head_bone" not in entry


@pytest.mark.slow
@pytest.mark.usefixtures("extension")
def test_a_button_writes_the_bake(sphere: Any, tmp_path: Path) -> None:
    """The button writes all frames of the bake or a chosen range; without a bake it reports an
    error and writes nothing."""
    bpy.ops.object.select_all(action="DESELECT")
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.hairloom.grow(strand_count=60, length=0.05)
    hair, scene = bpy.context.object, bpy.context.scene
    hair.data.hairloom.guides.guide_count = 8
    hair.data.hairloom.card_occlusion.rays = 8
    hair.data.hairloom.cards.order_by = "distance"
    hair.data.hairloom.cards.source, hair.data.hairloom.atlas.source = "guides", "made"
    scene.frame_start, scene.frame_end = 3, 9
    key_x(sphere, {frame: 0.03 * (frame % 2) for frame in (3, 6, 9)})
    path = tmp_path / "out" / "hair.glb"
    options = {"filepath": str(path), "motion": "joints", "chains": 4}
    with pytest.raises(RuntimeError, match="it has no bake"):
        bpy.ops.hairloom.export_cards(**options)
    assert not path.parent.exists()
    scene.frame_set(3)
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    list(Bake.of([hair], scene).steps())
    for chosen, first, count in (
        ({}, 3, 7),
        ({"own_frames": True, "first_frame": 4, "last_frame": 6}, 4, 3),
    ):
        assert bpy.ops.hairloom.export_cards(**options, **chosen) == {"FINISHED"}
        entry = json.loads((path.parent / "hair.hairloom.json").read_text("utf-8"))["motion"]
        assert (entry["frames"]["first"], entry["frames"]["count"]) == (first, count)
    sphere.vertex_groups.new(name="Bone").add(range(len(sphere.data.vertices)), 1.0, "REPLACE")
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Bone")
    bone.tail = (0.0, 0.0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    sphere.modifiers.new("Armature", "ARMATURE").object = armature
    bpy.context.view_layer.objects.active = hair
    sprung = options | {"motion": "springs", "spring_joints": 9}
    assert bpy.ops.hairloom.export_cards(**sprung) == {"FINISHED"}
    entry = json.loads((path.parent / "hair.hairloom.json").read_text("utf-8"))["motion"]
    assert (entry["kind"], entry["head_bone"]) == ("springs", "Bone")
    with pytest.raises(RuntimeError, match="holds frames 3 to 9"):
        bpy.ops.hairloom.export_cards(**options, own_frames=True, first_frame=4, last_frame=20)


@pytest.mark.alike
@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize(
    ("kind", "amid"),
    [
        ("joints", "Moving the cards"),
        ("joints", "Fitting joints"),
        ("springs", "Fitting springs"),
        ("texture", "Writing"),
    ],
)
def test_cancelling_keeps_the_old_files(kind: str, amid: str, sphere: Any, tmp_path: Path) -> None:
    """The steps are closed at this stage, as Esc in the window does."""
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.hairloom.grow(strand_count=40, length=0.05)
    hair, scene = bpy.context.object, bpy.context.scene
    hair.data.hairloom.cards.source = "guides"
    hair.data.hairloom.card_occlusion.rays = 8
    hair.data.hairloom.cards.order_by = "distance"
    hair.data.hairloom.atlas.source = "made"
    scene.frame_start, scene.frame_end = 1, 6
    key_x(sphere, {frame: 0.02 * frame for frame in (1, 6)})
    scene.frame_set(1)
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    list(Bake.of([hair], scene).steps())
    folder = tmp_path / "out"
    folder.mkdir()
    old = {"hair.glb": b"old mesh", "hair_base.png": b"old picture", "note.txt": b"the artist's"}
    for name, content in old.items():
        (folder / name).write_bytes(content)
    plan = CardExport.of(
        hair,
        bpy.context.evaluated_depsgraph_get(),
        folder / "hair.glb",
        CardOutput(settings=CardExportSettings(motion=kind)),
    )
    making = plan.building()
    wait_until(making.run_main_thread_steps)
    writing = plan.writing(making.result())
    for text, fraction in writing:
        if text == amid and (fraction or text == "Writing"):  # in the middle of it
            break
    else:
        pytest.fail(f"it never comes to '{amid}'")
    writing.close()
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == old
