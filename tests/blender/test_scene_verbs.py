"""Verbs that change a scene do what the button does and save it, or change nothing."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from sorting import sort_mesh
from swinging import key_x

from hairloom.addon.blender.bakes.guide_motion import BakedGuides
from hairloom.addon.blender.cards.adopt import SortOptions
from hairloom.addon.blender.cards.mesh import reorder_faces
from hairloom.addon.blender.colliders.spheres import fitted_collections
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.command_line.run_job import OPERATORS
from hairloom.addon.blender.properties import presets
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.scene.fin_modifier import fin_modifier
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.shading.settings import ShadingSettings

FEW = [
    "--set",
    "grow.method=normals",
    "--set",
    "children.method=none",
    "--set",
    "grow.strand_count=40",
    "--set",
    "grow.length=0.05",
]


@pytest.fixture
def scene(sphere: Any, new_hair: Callable[..., Any], tmp_path: Path) -> Path:
    """A saved file with hair on a head; the open scene is empty."""
    new_hair(sphere)
    group = sphere.vertex_groups.new(name="Top")
    group.add([v.index for v in sphere.data.vertices if v.co.z > 0.05], 1.0, "REPLACE")
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return path


def make_active(obj: bpy.types.Object) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def run(scene: Path, verb: str, *arguments: str) -> dict[str, Any]:
    """Run a verb that saves to another file, and open that; returns the report."""
    report, output = scene.with_name("report.json"), scene.with_name("out.blend")
    saving = ["--output", str(output), "--report", str(report)]
    before = scene.read_bytes()
    assert command_line.run([verb, "--scene", str(scene), *arguments, *saving]) == 0
    assert scene.read_bytes() == before, "the scene itself has changed"
    bpy.ops.wm.open_mainfile(filepath=str(output))
    facts: dict[str, Any] = json.loads(report.read_text())
    assert facts["status"] == "done" and facts["outputs"] == ["out.blend"]
    return facts


def test_hair_grows_on_a_mesh(scene: Path) -> None:
    look = ["--preset", "looks/blond", "--set", "shading.primary_strength=3"]
    facts = run(scene, "grow", "--head", "Head", "--name", "Fringe", *FEW, *look)
    hair = bpy.data.objects["Fringe"]
    assert facts["strands"] == len(hair.data.curves) == 40 and facts["object"] == "Fringe"
    assert hair.data.surface == bpy.data.objects["Head"]
    blond = presets.named_preset("looks/blond").settings.as_dict()
    assert list(hair.data.hairloom.shading.base_color) == pytest.approx(blond["base_color"])
    assert hair.data.hairloom.shading.primary_strength == 3.0


def test_the_verb_grows_hair_as_the_button_does_once_its_options_are_set(scene: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "command-line.md").read_text(encoding="utf-8")
    (row,) = re.findall(r"^\| `grow` \| (.+) \| scene \|$", page, flags=re.M)
    options = " ".join(re.findall("`([^`]+)`", row)).split()
    assert "--fit" in options
    for name, more in (("Plain", []), ("Dressed", options)):
        run(scene, "grow", "--head", "Head", "--name", name, *FEW, *more)
        make_active(bpy.data.objects["Head"])
        few = {"method": "normals", "strand_count": 40, "length": 0.05}
        assert bpy.ops.hairloom.add_groom(plays=False, **few) == {"FINISHED"}
        bpy.context.object.data.hairloom.children.method = "none"
        # grown hair has no colours, so both sources give the same look
        bpy.data.objects[name].data.hairloom.shading.color_source = "own"
        verb, button = (
            GroomSettings.of(each).sections for each in (bpy.data.objects[name], bpy.context.object)
        )
        other = {each for each in ALL_SETTINGS.values() if verb[each] != button[each]}
        assert other == ({ShadingSettings, DynamicsSettings} if name == "Plain" else set())


def test_hair_grows_where_a_group_says(scene: Path) -> None:
    run(scene, "grow", "--head", "Head", "--name", "Tuft", "--density-group", "Top", *FEW)
    curves = bpy.data.objects["Tuft"].data
    points = np.empty(len(curves.points) * 3, np.float32)
    curves.position_data.foreach_get("vector", points)
    roots = points.reshape(len(curves.curves), -1, 3)[:, 0]
    assert roots[:, 2].min() > 0.02


def test_growth_refuses_a_density_of_children_that_the_mesh_lacks(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = ["grow", "--scene", str(scene), "--head", "Head", "--children-density", "Nowhere", *FEW]
    assert command_line.run([*job, "--output", str(scene.with_name("out.blend"))]) == 1
    assert "neither a vertex group nor an attribute named 'Nowhere'" in capsys.readouterr().err


def test_hair_that_has_grown_follows_its_settings(scene: Path) -> None:
    run(scene, "grow", "--head", "Head", "--name", "Tuft", *FEW)
    assert bpy.data.objects["Tuft"].data.hairloom.grow.length == pytest.approx(0.05)
    grown = scene.with_name("out.blend").rename(scene.with_name("grown.blend"))
    run(grown, "run", "--object", "Tuft", "--set", "grow.strand_count=30")
    assert len(bpy.data.objects["Tuft"].data.curves) == 30


def test_hair_from_elsewhere_grows_only_by_its_button(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = ["run", "--scene", str(scene), "--object", "Hair", *FEW]
    assert command_line.run([*job, "--output", str(scene.with_name("out.blend"))]) == 1
    assert "growing again would lose" in capsys.readouterr().err
    run(scene, "run", "grow_again", "--object", "Hair", *FEW)
    assert len(bpy.data.objects["Hair"].data.curves) == 40


def test_settings_go_onto_the_hair_that_is_named(scene: Path) -> None:
    run(scene, "run", "--object", "Hair", "--preset", "dynamics/soft", "--set", "cards.levels=2")
    hair = bpy.data.objects["Hair"]
    soft = presets.named_preset("dynamics/soft").settings.as_dict()
    assert hair.hairloom.dynamics.damping == pytest.approx(soft["damping"])
    assert hair.data.hairloom.cards.levels == 2


def test_the_look_of_a_material_is_copied(scene: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    material = bpy.data.materials.new("Red")
    material.node_tree.nodes.clear()
    node = material.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    node.inputs["IOR"].default_value = 1.3
    bpy.data.objects["Hair"].data.materials.append(material)
    bpy.ops.wm.save_mainfile()
    run(scene, "run", "look_from_material", "--object", "Hair")
    assert bpy.data.objects["Hair"].data.hairloom.shading.index_of_refraction == pytest.approx(1.3)


def test_a_preset_is_applied_to_hair_of_a_file(scene: Path) -> None:
    facts = run(scene, "run", "apply_preset", "--object", "Hair", "--set", "name=looks/blond")
    assert facts["operator"] == "apply_preset"
    blond = presets.named_preset("looks/blond").settings.as_dict()
    shading = bpy.data.objects["Hair"].data.hairloom.shading
    assert list(shading.base_color) == pytest.approx(blond["base_color"])


def test_presets_are_kept_and_deleted_without_saving_a_scene(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(presets, "own_folder", lambda: tmp_path / "own")
    keep = ["--object", "Hair", "--set", "section=shading", "--set", "title=Mine"]
    assert command_line.run(["run", "save_preset", "--scene", str(scene), *keep]) == 0
    assert [path.name for path in (tmp_path / "own").iterdir()] == ["mine.json"]
    assert command_line.run(["run", "delete_preset", "--set", "name=own/mine"]) == 0
    assert not list((tmp_path / "own").iterdir())
    assert command_line.run(["run", "delete_preset", "--set", "name=looks/blond"]) == 1


def test_operators_are_listed_with_their_properties(
    extension: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command_line.run(["run"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in OPERATORS:
        about = getattr(bpy.ops.hairloom, name).get_rna_type().description
        assert f"{name}: {' '.join(about.split())}." in lines
    assert any(line.startswith("    sphere_count: ") for line in lines)
    assert not any("filter_glob" in line for line in lines), "it only filters a file browser"


def test_a_scene_without_an_action_is_an_error(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for target in (["--output", str(scene.with_name("out.blend"))], ["--save"]):
        assert command_line.run(["run", "--scene", str(scene), "--object", "Hair", *target]) == 1
        output = capsys.readouterr()
        assert "there is nothing to do" in output.err and "sphere_count" not in output.out


def test_a_mesh_becomes_a_fin_and_a_mesh_again(scene: Path) -> None:
    facts = run(scene, "run", "fin_add", "--object", "Head", "--set", "fin.damping=5")
    head = bpy.data.objects["Head"]
    assert fin_modifier(head) is not None and head.hairloom.fin.pin_group == "Top"
    assert head.hairloom.fin.damping == 5.0
    assert facts["messages"] == ["Pinned by the vertex group Top"]
    other = scene.with_name("out.blend").rename(scene.with_name("fin.blend"))
    run(other, "run", "fin_remove", "--object", "Head")
    assert fin_modifier(bpy.data.objects["Head"]) is None


def test_spheres_are_fitted_and_removed(scene: Path) -> None:
    """The head is four times as long as wide, so that no single ball covers it."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    for vertex in bpy.data.objects["Head"].data.vertices:
        vertex.co.x *= 4.0
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    facts = run(scene, "run", "fit_spheres", "--object", "Head", "--set", "sphere_count=6")
    head, hair = bpy.data.objects["Head"], bpy.data.objects["Hair"]
    (collection,) = fitted_collections(head)
    count = len(collection.objects)
    assert count == 6 and facts["messages"][0].startswith(f"{count} spheres in ")
    assert hair.hairloom.collider_collection == collection
    assert head.hairloom.collider_shape == "none"
    other = scene.with_name("out.blend").rename(scene.with_name("fitted.blend"))
    facts = run(other, "run", "remove_spheres", "--object", "Head")
    assert facts["messages"] == [f"{count} spheres removed; Head collides by itself again"]
    assert not fitted_collections(bpy.data.objects["Head"])


def test_cards_are_made_as_objects_and_sorted(scene: Path, gpu_context: object) -> None:
    small = ["--set", "cards.source=clusters", "--set", "atlas.size=512", "--set", "cards.levels=1"]
    facts = run(scene, "run", "make_cards", "--object", "Hair", *small)
    (cards,) = [obj for obj in bpy.data.objects if obj.hairloom.card_object.groom]
    count = len(cards.data.polygons)
    assert f"{count:,} triangles" in facts["messages"][0]
    name = cards.name
    reorder_faces(cards.data, np.arange(count)[::-1])
    shuffled = scene.with_name("shuffled.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(shuffled))
    sort = ["--set", "head=Head", "--set", "use_occlusion=false"]
    facts = run(shuffled, "run", "sort_cards", "--object", name, *sort)
    (output,) = facts["messages"]
    moved = int(output.partition("; ")[2].split()[0])
    assert output.startswith("Sorted ") and moved > count / 2
    order = vertices_of(name)
    bpy.ops.wm.open_mainfile(filepath=str(shuffled))
    assert vertices_of(name) != order
    choices = SortOptions(head=bpy.data.objects["Head"], occlusion=None)
    sort_mesh(bpy.data.objects[name], bpy.context.evaluated_depsgraph_get(), choices)
    assert vertices_of(name) == order, "the button gives another order"


def vertices_of(name: str) -> list[tuple[int, ...]]:
    return [tuple(polygon.vertices) for polygon in bpy.data.objects[name].data.polygons]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "fin_add"], "--output"),
        (["run", "fin_add", "--save", "--output", "x.blend"], "both --output"),
        (["run", "fin_add", "--output", "x.png"], ".blend"),
        (["run", "fin_add", "--object", "Nobody", "--output", "x.blend"], "Nobody"),
        (["run", "--object", "Hair", "--set", "shading.no=1", "--output", "x.blend"], "'no'"),
        (["run", "--object", "Hair", "--set", "no=1", "--output", "x.blend"], "'no=1'"),
        (["run", "--object", "Cube", "--set", "cards.levels=1", "--output", "x.blend"], "Cube"),
        (["run", "fit_sphere", "--output", "x.blend"], "fit_spheres"),
        (["run", "play", "--output", "x.blend"], "no operator 'play'"),
        (["run", "fit_spheres", "--set", "sphere_cont=6", "--output", "x.blend"], "sphere_count"),
        (["run", "fit_spheres", "--set", "sphere_count=0", "--output", "x.blend"], "from 1 to"),
        (["run", "fit_spheres", "--set", "sphere_count=six", "--output", "x.blend"], "whole"),
        (["run", "fit_spheres", "--set", "replace_mesh=1", "--output", "x.blend"], "true or false"),
        (["run", "sort_cards", "--set", "by=peaces", "--output", "x.blend"], "pieces"),
        (["grow", "--head", "Hair", "--output", "x.blend"], "Hair"),
        (
            ["run", "fin_remove", "--object", "Head", "--output", "x.blend"],
            "Select a mesh that is cloth",
        ),
        (["run", "sort_cards", "--object", "Hair", "--output", "x.blend"], "Select a mesh"),
        (
            [
                *("run", "sort_cards", "--object", "Head", "--set", "alpha=No"),
                *("--output", "x.blend"),
            ],
            "No",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_input_saves_nothing(
    arguments: list[str],
    message: str,
    scene: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    there = sorted(tmp_path.iterdir())
    placed = [str(tmp_path / word) if word.startswith("x.") else word for word in arguments]
    assert command_line.run([placed[0], "--scene", str(scene), *placed[1:]]) == 1
    output = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hairloom:")]
    assert len(output) == 1 and message in output[0]
    assert sorted(tmp_path.iterdir()) == there


def test_a_scene_that_moves_keeps_its_bakes(scene: Path, tmp_path: Path) -> None:
    """The bake's folder is stored relative to the new place."""
    other = tmp_path / "shots" / "seven" / "wig.blend"
    quick = ["--set", "dynamics.device=numpy", "--set", "dynamics.collider_resolution=8"]
    bake = ["bake", "--scene", str(scene), "--frames", "1", "3", *quick]
    folder = tmp_path / "baked"
    assert command_line.run([*bake, "--output", str(folder), "--save-as", str(other)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(other))
    hair = bpy.data.objects["Hair"]
    assert hair.hairloom.bake.folder == "//../../baked"
    assert bpy.data.objects["Hair Baked"].data.hairloom.baked_in == "//../../baked"
    assert command_line.run(["bake", "--scene", str(other), "--delete", "--save"]) == 0
    assert not folder.exists() and "Hair Baked" not in bpy.data.objects


def test_hair_is_made_ready(scene: Path) -> None:
    """Loose hair on a head without UVs gets a surface, UVs, roots on it, and an applied scale."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    hair.data.surface = hair.parent = None
    hair.scale = (1.0, 1.0, 1.2)
    head.data.uv_layers.remove(head.data.uv_layers[0])
    bpy.ops.wm.save_mainfile()
    steps = ("set_surface", "unwrap_surface", "snap_roots", "apply_scale")
    for number, operator in enumerate(steps):
        facts = run(scene, "run", operator, "--object", "Hair")
        assert facts["operator"] == operator
        scene = scene.with_name("out.blend").rename(scene.with_name(f"step_{number}.blend"))
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    assert hair.data.surface == head and len(head.data.uv_layers) == 1
    assert list(hair.scale) == pytest.approx([1.0, 1.0, 1.0])
    points = np.empty(len(hair.data.points) * 3, np.float32)
    hair.data.position_data.foreach_get("vector", points)
    roots = points.reshape(len(hair.data.curves), -1, 3)[:, 0]
    # the ball's faces are flat, and its scaled hair started up to 2 cm above it
    np.testing.assert_allclose(np.linalg.norm(roots, axis=1), 0.1, atol=2e-3)


def test_a_button_that_would_be_grey_is_an_error(
    scene: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--scene", str(scene), "--object", "Hair", "--output", str(tmp_path / "x.blend")]
    assert command_line.run(["run", "unwrap_surface", *arguments]) == 1
    assert "hairloom: unwrap_surface: The surface has UVs already. " in capfd.readouterr().err


def test_particle_hair_becomes_curves(scene: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    head = bpy.data.objects["Head"]
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.particle_system_add()
    settings = head.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 30, 0.05
    bpy.ops.wm.save_mainfile()
    run(scene, "run", "convert_particles", "--object", "Head")
    (made,) = [o for o in bpy.data.objects if o.type == "CURVES" and o.name != "Hair"]
    assert len(made.data.curves) == 30 and made.data.surface == bpy.data.objects["Head"]


@pytest.mark.slow
def test_a_sample_scene_is_shown_when_its_file_is_opened(extension: None, tmp_path: Path) -> None:
    path = tmp_path / "sample.blend"
    assert command_line.run(["run", "sample_scene", "--output", str(path)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert bpy.context.scene.name == "Hairloom Sample" and bpy.context.scene.camera
    assert any(obj.type == "CURVES" for obj in bpy.context.scene.objects)


def test_the_self_test_lists_what_this_machine_can_do(
    extension: None, tmp_path: Path, gpu_context: object
) -> None:
    report = tmp_path / "report.json"
    assert command_line.run(["self-test", "--report", str(report)]) == 0
    outcomes = [check["outcome"] for check in json.loads(report.read_text())["checks"]]
    assert "passed" in outcomes and "failed" not in outcomes


@pytest.mark.slow
def test_hair_of_a_scene_is_taken_with_its_own_settings(scene: Path, tmp_path: Path) -> None:
    """Files have the artist's settings; --set overrides them."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    groom = bpy.data.objects["Hair"].data.hairloom
    groom.children.method, groom.children.strand_count = "single", 300
    bpy.ops.wm.save_mainfile()

    def exported(*more: str) -> int:
        report = tmp_path / "report.json"
        arguments = ["export", "--scene", str(scene), *more, "--report", str(report)]
        assert command_line.run([*arguments, "--output", str(tmp_path / "out.tfx")]) == 0
        return int(json.loads(report.read_text())["preflight"]["strands"])

    assert exported("--groom", "Hair") == exported("--object", "Hair") == exported()
    assert exported() == pytest.approx(300, rel=0.3)
    fewer = exported("--groom", "Hair", "--set", "children.method=none")
    assert fewer == exported("--object", "Hair", "--set", "children.method=none") < exported()


def test_settings_that_no_object_has_are_refused(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The head is a mesh: cards are settings of its hair, and only cloth has dynamics."""
    for setting in ("cards.card_count=50", "dynamics.damping=2"):
        whole = ["run", "make_cards", "--scene", str(scene), "--object", "Head", "--set", setting]
        assert command_line.run([*whole, "--output", str(scene.with_name("out.blend"))]) == 1
        message = capsys.readouterr().err
        assert f"Head: it has no settings of '{setting.partition('.')[0]}'" in message
        assert "Name the hair curves with --object" in message
    for name, preset in (("Head", "looks/blond"), ("Hair", "stage/daylight")):
        whole = ["run", "--scene", str(scene), "--object", name, "--preset", preset]
        assert command_line.run([*whole, "--output", str(scene.with_name("out.blend"))]) == 1
        assert f"{name}: it has no settings of '" in capsys.readouterr().err
    assert not scene.with_name("out.blend").exists()


def test_growth_refuses_settings_that_hair_does_not_have(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Hair keeps no stage, so a look of the stage would be lost."""
    job = ["grow", "--scene", str(scene), "--head", "Head", "--name", "Tuft", *FEW]
    for option in (("--preset", "stage/daylight"), ("--set", "stage.exposure=1")):
        output = scene.with_name("out.blend")
        assert command_line.run([*job, *option, "--output", str(output)]) == 1
        assert "Tuft: it has no settings of 'stage'" in capsys.readouterr().err
        assert not output.exists()


@pytest.mark.parametrize("verb", ["bake", "export"])
def test_settings_that_a_verb_does_not_use_are_refused(
    verb: str, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither a bake nor an export has a stage."""
    output = scene.with_name("out.usdc" if verb == "export" else "baked")
    base = [verb, "--scene", str(scene), "--object", "Hair", "--output", str(output)]
    for option in (("--preset", "stage/daylight"), ("--set", "stage.exposure=1")):
        assert command_line.run([*base, *option]) == 1
        assert "Hair: it has no settings of 'stage'" in capsys.readouterr().err
    assert not output.exists()


def test_a_render_of_a_scene_draws_its_hair(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a single groom, none needs to be named; with several, the error lists them."""
    report = scene.with_name("report.json")
    simulated = ["simulate", "--scene", str(scene), "--report", str(report), "--seconds", "0.05"]
    small = ["--set", "dynamics.device=numpy", "--set", "dynamics.collider_resolution=8"]
    output = ["--output", str(scene.with_name("baked"))]
    assert command_line.run([*simulated, *small, *output]) == 0
    facts = json.loads(report.read_text())
    assert facts["outputs"] == ["baked"] and "strands_inside_percent" in facts
    assert "reading Hair" in capsys.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    other = bpy.data.objects["Hair"].copy()
    other.name = "Fringe"
    bpy.context.collection.objects.link(other)
    bpy.ops.wm.save_mainfile()
    assert command_line.run([*simulated, *small, *output]) == 1
    message = capsys.readouterr().err
    assert "several objects: Fringe, Hair" in message and "--groom" in message


@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize("keeps", [(), ("Cube",)])
def test_the_cube_of_the_start_up_scene_is_not_around_the_head(
    keeps: tuple[str, ...], tmp_path: Path
) -> None:
    """It is kept if it is named, as the head of a job or as an object."""
    output = tmp_path / "wig.blend"
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    command = ["run", "add_hairstyle", "--set", "style=buzz_cut", "--set", "plays=false"]
    if keeps:
        command = ["grow", "--head", "Cube", "--set", "grow.strand_count=20"]
    assert command_line.run([*command, "--output", str(output)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(output))
    names = {each.name for each in bpy.data.objects}
    assert {"Light", "Camera"} <= names and ("Cube" in names) == bool(keeps)


@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize("change", ["shape", "linked duplicate"])
def test_a_cube_that_someone_has_changed_is_kept(change: str, tmp_path: Path) -> None:
    output = tmp_path / "wig.blend"
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    cube = bpy.data.objects["Cube"]
    if change == "shape":
        cube.data.vertices[0].co.z = 2.0
    else:
        bpy.context.collection.objects.link(bpy.data.objects.new("Box", cube.data))
    arguments = ["--set", "style=brows", "--set", "plays=false", "--output", str(output)]
    assert command_line.run(["run", "add_hairstyle", *arguments]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(output))
    names = {each.name for each in bpy.data.objects}
    assert "Cube" in names and ("Box" in names) == (change != "shape")


def test_a_scene_that_is_already_open_gives_the_hair_or_has_none(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in `blender -b wig.blend --command hairloom`: no other hair is grown in its place."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    job = ["simulate", "--seconds", "0.05", "--output", str(scene.with_name("baked"))]
    assert command_line.run(["export", "--output", str(scene.with_name("out.tfx"))]) == 0
    assert "Wrote 60 strands to out.tfx" in capsys.readouterr().out
    bpy.data.objects.remove(bpy.data.objects["Hair"])
    bpy.ops.wm.save_mainfile()
    for more in ([], ["--scene", str(scene)]):
        assert command_line.run([*job, *more]) == 1
        assert f"{scene}: there is no hair in this scene. " in capsys.readouterr().err


@pytest.mark.alike
@pytest.mark.parametrize("how", ["collection", "collider", "left out"])
def test_a_shake_of_a_groom_stays_out_of_its_colliders(scene: Path, how: str) -> None:
    """A ball in the middle of the hair: as the shake starts, hair leaves it at a limited speed."""
    middle, radius = np.array([0.0, 0.16, -0.05]), 0.06
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    hair = bpy.data.objects["Hair"]
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=middle, segments=48, ring_count=24)
    ball = bpy.context.active_object
    ball.hairloom.collider_shape = "sphere"
    if how == "collider":
        hair.hairloom.collider = ball
    else:
        hair.hairloom.collider_collection = bpy.data.collections.new("Balls")
        hair.hairloom.collider_collection.objects.link(ball)
        ball.hide_viewport = how == "left out"
    bpy.ops.wm.save_mainfile()
    output = scene.with_name("baked")
    soft = ["dynamics.style_root=2", "dynamics.style_tip=0.5", "dynamics.device=numpy"]
    chosen = [part for each in soft for part in ("--set", each)]
    simulated = ["simulate", "--scene", str(scene), "--groom", "Hair", "--seconds", "0.5", *chosen]
    assert command_line.run([*simulated, "--output", str(output)]) == 0
    motion, nearest = BakedGuides.in_folder(output), np.inf
    for frame in motion.frames[-10:]:
        pose, guides = motion.at(frame)
        local = (guides - pose.matrix[:3, 3]) @ pose.matrix[:3, :3]
        nearest = min(nearest, np.linalg.norm(local[:, 2:] - middle, axis=2).min())
    assert (nearest > 0.999 * radius) == (how != "left out"), nearest


def exported(scene: Path, *arguments: str, code: int = 0) -> dict[str, Any]:
    """The report of an export to .tfx."""
    report, output = scene.with_name("report.json"), scene.with_name("out.tfx")
    whole = ["export", "--scene", str(scene), *arguments, "--report", str(report)]
    assert command_line.run([*whole, "--output", str(output)]) == code
    facts: dict[str, Any] = json.loads(report.read_text())
    return facts


def beside(scene: Path, make: Callable[[bpy.types.Object], bpy.types.Object]) -> None:
    """Add an object made from the scene's hair to the scene's file."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.context.collection.objects.link(make(bpy.data.objects["Hair"]))
    bpy.ops.wm.save_mainfile()


def hidden_copy(hair: bpy.types.Object) -> bpy.types.Object:
    other = hair.copy()
    other.name, other.hide_render, other.hide_viewport = "Combed", True, True
    return other


def empty_curves(_hair: bpy.types.Object) -> bpy.types.Object:
    return bpy.data.objects.new("Nothing", bpy.data.hair_curves.new("Nothing"))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (hidden_copy, "Combed: it is hidden in viewport and renders, and is left out"),
        (empty_curves, "Nothing: it has no curves, and is left out"),
    ],
)
def test_jobs_on_all_hair_of_a_scene_leave_out_what_is_hidden_or_empty(
    scene: Path, make: Callable[[Any], Any], message: str
) -> None:
    """Make Real, for example, hides the hair that it has converted."""
    plain = ["--set", "children.method=none"]
    alone = exported(scene, *plain)["preflight"]["strands"]
    beside(scene, make)
    facts = exported(scene, *plain)
    assert facts["preflight"]["strands"] == alone
    assert [note for note in facts["notes"] if message in note], facts["notes"]
    small = ["--set", "dynamics.device=numpy", "--set", "dynamics.collider_resolution=8"]
    report, folder = scene.with_name("report.json"), scene.with_name("bake")
    bake = ["bake", "--scene", str(scene), "--frames", "1", "1", *small, "--report", str(report)]
    assert command_line.run([*bake, "--output", str(folder)]) == 0
    facts = json.loads(report.read_text())
    assert [each["object"] for each in facts["baked"]] == ["Hair"]
    assert [note for note in facts["notes"] if message in note]
    moved = ["simulate", "--scene", str(scene), "--seconds", "0.02", *small]
    output = ["--output", str(scene.with_name("moved")), "--report", str(report)]
    assert command_line.run([*moved, *output]) == 0
    assert [note for note in json.loads(report.read_text())["notes"] if message in note]


def test_hidden_hair_is_used_if_it_is_named(scene: Path) -> None:
    plain = ["--set", "children.method=none"]
    alone = exported(scene, *plain)["preflight"]["strands"]
    beside(scene, hidden_copy)
    named = exported(scene, "--object", "Hair", "--object", "Combed", *plain)
    assert named["preflight"]["strands"] == 2 * alone
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.objects.remove(bpy.data.objects["Hair"])
    bpy.ops.wm.save_mainfile()
    refused = exported(scene, code=1)
    assert "Combed: it is hidden" in refused["error"]["problem"]
    assert "--object" in refused["error"]["remedy"]


def test_strands_of_a_scene_that_are_left_out_are_named_or_refused(
    scene: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    curves = bpy.data.objects["Hair"].data
    points = np.empty(len(curves.points) * 3, np.float32)
    curves.position_data.foreach_get("vector", points)
    points[0] = np.nan
    curves.position_data.foreach_set("vector", points)
    bpy.ops.wm.save_mainfile()
    for which in ([], ["--object", "Hair"]):
        facts = exported(scene, *which)
        assert sum(facts["dropped"].values()) == 1
        assert "Hair: dropped strands: 1 with" in capfd.readouterr().out
        error = exported(scene, *which, "--strict", code=1)["error"]
        assert "strands would be dropped: 1 with" in error["problem"] and error["place"] == "Hair"


@pytest.mark.parametrize(
    ("arguments", "option", "why"),
    [
        ("export --object Hair --style brows", "--style", "its own groom, head and bake"),
        ("export --object Hair --head Head", "--head", "its own groom, head and bake"),
        ("export --collider Head", "--collider", "its own groom, head and bake"),
        ("export --object Hair --groom-up Y", "--groom-up", "its own groom, head and bake"),
        ("export --object Hair --frame 1 --frames 1 2", "--frame", "--frames already says"),
        ("export --groom Hair --frame 30", "--frame", "no bake is given"),
        ("export --no-use-bake", "--use-bake", "over several frames"),
        ("render --frame 30", "--frame", "no bake is given"),
        ("turntable --frame 30", "--frame", "no bake is given"),
        ("turntable --no-video --frame-rate 30", "--frame-rate", "makes none"),
        ("sheet --groom Hair --groom-scale 0.01", "--groom-scale", "read from a file"),
        ("render --groom Hair --density-group Top", "--density-group", "grown by this job"),
        ("render --bake somewhere --length-group Top", "--length-group", "grown by this job"),
        ("simulate --animated --seconds 3", "--seconds", "frame rate of the scene"),
        ("cards --page-texture 512", "--page-texture", "no web page"),
        ("cards --no-page-head", "--page-head", "no web page"),
        ("render --head Head --skin dark", "--skin", "only the built-in head"),
        ("cards --levels 9", "--levels", "cannot be used"),
        (
            "export --vertex-count 8 --format alembic",
            "--vertex-count",
            "not an option of Groom Alembic",
        ),
        ("bake --delete --frames 1 2", "--frames", "--delete does not use it"),
        ("render --groom Hair --collider Head", "--collider", "simulated"),
        ("cards --groom Hair --collider Head", "--collider", "simulated"),
        ("export --preflight --skip-existing", "--skip-existing", "writes no output"),
    ],
)
def test_options_without_effect_are_refused(
    scene: Path, capsys: pytest.CaptureFixture[str], arguments: str, option: str, why: str
) -> None:
    """The error names the option, and nothing is written."""
    verb, *more = arguments.split()
    output = {"export": "out.tfx", "render": "out.png", "sheet": "out.png", "cards": "out.glb"}
    made = "out.abc" if "alembic" in more else output.get(verb, "out")
    where = [] if "--delete" in more else ["--output", str(scene.with_name(made))]
    few = FEW if "--skin" in more else []
    assert command_line.run([verb, "--scene", str(scene), *more, *few, *where]) == 1
    message = capsys.readouterr().err
    assert f"hairloom: {option}: " in message and why in message, message
    assert [path.name for path in scene.parent.iterdir()] == [scene.name]


def test_hair_of_a_scene_leaves_as_it_is_at_a_frame(scene: Path) -> None:
    """Exported roots follow the animated object."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    hair = bpy.data.objects["Hair"]
    key_x(hair, {frame: 0.0005 * frame for frame in (1, 30)})
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_mainfile()
    roots = {}
    for frame in (1, 30):
        exported(scene, "--frame", str(frame))
        roots[frame] = read_tfx(scene.with_name("out.tfx")).strands.roots
    np.testing.assert_allclose(
        roots[30] - roots[1], [[0.0145, 0.0, 0.0]] * len(roots[1]), atol=1e-5
    )


def test_hair_of_a_scene_is_checked_like_hair_of_files(scene: Path) -> None:
    """UVs with --strict, and the vertex group that children grow by."""
    children = ["--set", "children.method=multi", "--set", "children.strand_count=200"]
    fraction = {}
    for which in ([], ["--children-density", "Top"]):
        exported(scene, *children, *which)
        height = read_tfx(scene.with_name("out.tfx")).strands.roots[:, 2]
        fraction[len(which)] = (height > 0.05).mean()
    assert fraction[2] > fraction[0] + 0.2
    exported(scene, *children, "--children-density", "Nowhere", code=1)
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    mesh = bpy.data.objects["Head"].data
    for layer in list(mesh.uv_layers):
        mesh.uv_layers.remove(layer)
    bpy.ops.wm.save_mainfile()
    assert exported(scene)["status"] == "done"
    error = exported(scene, "--strict", code=1)["error"]
    assert error["place"] == "Head" and "UV" in error["problem"]
