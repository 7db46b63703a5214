"""Hairstyles: each is added as ordinary hair curves with ordinary modifiers, or not at all."""

import importlib
import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector
from tiers import few_in_commits

from hairloom.addon.blender.base.attributes import read_attribute
from hairloom.addon.blender.base.outcome import past_reports
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.command_line.command_line import run
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.properties.presets import named_preset
from hairloom.addon.blender.scene import hair_nodes
from hairloom.addon.blender.scene.curves import curve_points, read_curves, set_points
from hairloom.addon.blender.scene.sag_correction import set_full_sag_correction
from hairloom.addon.blender.scene.shape_backup import BEFORE_SETTLE
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.setup import hairstyles
from hairloom.addon.blender.setup.hairstyles import (
    add_hairstyle,
    add_head,
    is_bust,
    named_hairstyle,
    shipped_hairstyles,
)
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.hairstyles import Hairstyle, NodeModifier
from hairloom.addon.strands.closest_point import search_of
from hairloom.addon.ui import operators_hairstyles

pytestmark = [pytest.mark.usefixtures("extension")]
NAMES = [entry.name for entry in shipped_hairstyles()]
#: styles for any mesh
FUR = ["short_coat", "shaggy_coat"]
ON_HEADS = [name for name in NAMES if name not in FUR]
TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add styles without their children, which take most of the time."""

    def with_few(name: str) -> Hairstyle:
        style = named_hairstyle(name)
        growth = {key: values for key, values in style.settings.items() if key == "grow"}
        return replace(style, settings={"children": {"method": "none"}} | growth)

    monkeypatch.setattr(operators_hairstyles, "named_hairstyle", with_few)


@pytest.fixture
def head() -> bpy.types.Object:
    made = run_parts(add_head(bpy.context.collection, "light"))
    bpy.context.view_layer.update()
    return made


def depsgraph() -> bpy.types.Depsgraph:
    return bpy.context.evaluated_depsgraph_get()


def added(style: Hairstyle, head: bpy.types.Object) -> bpy.types.Object:
    hair = run_parts(add_hairstyle(style, head, depsgraph(), bpy.context.collection)).hair
    bpy.context.view_layer.update()
    return hair


def everything() -> set[str]:
    kinds = bpy.data.objects, bpy.data.hair_curves, bpy.data.meshes
    return {each.name for kind in kinds for each in kind}


@pytest.mark.alike
@pytest.mark.parametrize("name", few_in_commits(ON_HEADS, 8))
def test_each_style_that_ships_is_curves_on_the_scalp_with_its_settings(
    name: str, head: bpy.types.Object
) -> None:
    style = named_hairstyle(name)
    assert style.guides is not None
    hair = added(style, head)
    assert hair.type == "CURVES" and hair.data.surface == head and hair.parent == head
    assert len(hair.data.curves) == len(style.guides.group)
    assert [each.node_group.name for each in hair.modifiers] == [m.nodes for m in style.modifiers]
    for section, values in style.settings.items():
        owner = hair.data.hairloom if hasattr(hair.data.hairloom, section) else hair.hairloom
        for key, value in values.items():
            found = getattr(getattr(owner, section), key)
            expected = tuple(value) if isinstance(value, (tuple, list)) else value
            found = found[:] if isinstance(expected, tuple) else found
            assert found == pytest.approx(expected), key
    look = named_preset(style.presets[0]).settings
    assert hair.data.hairloom.shading.base_color[:] == pytest.approx(look.base_color)
    assert hair.hairloom.children_density in head.vertex_groups
    # roots are on the skin by Blender's own nearest-point search
    roots = read_curves(hair, depsgraph()).strands.roots
    evaluated = head.evaluated_get(depsgraph())
    for root in roots[:: len(roots) // 30]:
        found, place, *_ = evaluated.closest_point_on_mesh(root.tolist())
        assert found and (np.array(place) - root) @ (np.array(place) - root) < 1e-8


def test_guides_outside_of_the_hairline_are_left_out_on_the_built_in_head_too(head) -> None:
    style = named_hairstyle("bob")
    group = head.vertex_groups.new(name="front")
    vertices = head.data.vertices
    group.add([v.index for v in vertices if v.co.y < -0.02 and v.co.z > 0.03], 1.0, "REPLACE")
    adding = add_hairstyle(style, head, depsgraph(), bpy.context.collection, hairline="front")
    hair = run_parts(adding).hair
    roots = read_curves(hair, depsgraph()).strands.roots
    assert 200 < len(roots) < 500 and (roots[:, 1] < 0.0).all() and (roots[:, 2] > 0.01).all()
    group.remove(range(len(vertices)))
    chin = [v.index for v in vertices if v.co.z < -0.1 and v.co.y < -0.06]
    group.add(chin, 1.0, "REPLACE")
    with pytest.raises(HairloomError, match="zero wherever this hair grows"):
        run_parts(hairstyles.fit_again([hair], depsgraph()))
    assert len(hair.data.curves) == len(roots)


def monkey(size: float) -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(size=size, location=(1.0, 2.0, 3.0))
    bpy.context.view_layer.update()
    return bpy.context.object


@pytest.mark.slow
@pytest.mark.parametrize("name", FUR)
def test_fur_grows_on_any_mesh_and_by_its_size(name: str) -> None:
    style, lengths = named_hairstyle(name), []
    assert style.guides is None and not style.masks
    for size in (0.2, 20.0):
        hair = added(style, monkey(size))
        assert [one.node_group.name for one in hair.modifiers] == [m.nodes for m in style.modifiers]
        hair.modifiers.clear()  # keeps the grown curves
        strands = read_curves(hair, depsgraph()).strands
        count = style.settings["grow"]["strand_count"]
        assert 0.85 * count < strands.strand_count < count, "none on the eyes' back, in the head"
        surface = read_surface(hair.parent, depsgraph(), need_uv=False, place="monkey")
        inside = strands.points[np.abs(winding_number(strands.points, surface)) > 0.5]
        deep = search_of(surface).closest(inside).distance.max(initial=0.0)
        assert deep < 0.007 * size, "a fifth of a cell of its distance field"
        evaluated = hair.parent.evaluated_get(depsgraph())
        for root in strands.roots[::300]:
            local = hair.parent.matrix_world.inverted() @ Vector(root.tolist())
            found, place, *_ = evaluated.closest_point_on_mesh(local)
            assert found and (place - local).length < 1e-4 * size
        lengths.append(float(np.median(strands.lengths())))
        children = hair.data.hairloom.children
        assert children.strand_count == style.settings["children"]["strand_count"]
        assert hair.hairloom.children_density == ""
    assert 0.5 < lengths[0] / style.settings["grow"]["length"] < 1.0
    assert lengths[1] > 20.0 * lengths[0]


@pytest.mark.usefixtures("few")
def test_fur_grows_on_the_selected_mesh_in_one_step() -> None:
    mesh = monkey(0.2)
    bpy.ops.ed.undo_push(message="before")
    before = everything()
    bpy.ops.hairloom.add_hairstyle("EXEC_DEFAULT", True, style="short_coat", plays=False)
    assert bpy.context.object.parent == mesh
    assert everything() - before == {f"{mesh.name} Short Coat"}
    bpy.ops.ed.undo()
    assert everything() == before


@pytest.mark.slow(instead="test_from_nothing_there_is_a_head_with_brows_and_lashes")
@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("style", ["brows", "lashes"])
def test_brows_and_lashes_from_nothing_come_once(style: str) -> None:
    """The added head has brows or lashes only, not both."""
    bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
    assert {obj.name for obj in bpy.data.objects} == {"Head", f"Head {style.title()}"}


@pytest.mark.usefixtures("few")
def test_the_result_of_modifiers_is_simulated_unless_they_are_muted(
    head: bpy.types.Object,
) -> None:
    bpy.context.view_layer.objects.active = head
    assert bpy.ops.hairloom.add_hairstyle(style="curls", plays=False) == {"FINISHED"}
    hair = bpy.context.object
    (session,) = previews.sessions()
    curled = session.rig.strands.lengths().sum()
    evaluated = read_curves(hair, depsgraph()).strands
    assert curled == pytest.approx(evaluated.lengths().sum(), rel=0.01)
    bpy.ops.hairloom.preview()
    for modifier in hair.modifiers:
        modifier.show_viewport = False
    bpy.ops.hairloom.preview()
    (session,) = previews.sessions()
    straight = session.rig.strands.lengths().sum()
    assert straight < 0.9 * curled
    assert straight == pytest.approx(read_curves(hair, depsgraph()).strands.lengths().sum(), 0.01)


def test_a_moved_turned_and_larger_head_has_the_same_hair(head: bpy.types.Object) -> None:
    style = named_hairstyle("buzz_cut")
    before = read_curves(added(style, head), depsgraph()).strands.points
    head.location, head.rotation_euler, head.scale = (1.0, 2.0, 3.0), (0.3, -0.2, 0.9), (2, 2, 2)
    bpy.context.view_layer.update()
    after = read_curves(added(style, head), depsgraph()).strands.points
    matrix = np.array(head.matrix_world)
    expected = before @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.abs(after - expected).max() < 1e-4


@pytest.mark.slow(instead="test_a_moved_turned_and_larger_head_has_the_same_hair")
def test_curls_of_a_giant_are_as_much_larger(head: bpy.types.Object) -> None:
    style = named_hairstyle("curls")
    before = read_curves(added(style, head), depsgraph()).strands
    head.scale = (20.0, 20.0, 20.0)
    bpy.context.view_layer.update()
    after = read_curves(added(style, head), depsgraph()).strands
    off = np.abs(after.lengths() / before.lengths() / 20.0 - 1.0)
    # where two clumps are equally near, rounding decides which one a curve joins
    assert (off < 1e-3).mean() > 0.97 and off.max() < 0.2


@pytest.mark.usefixtures("few")
def test_from_nothing_there_is_a_head_with_brows_and_lashes() -> None:
    assert bpy.ops.hairloom.add_hairstyle(style="buzz_cut", plays=False) == {"FINISHED"}
    names = {obj.name for obj in bpy.data.objects}
    assert names == {"Head", "Head Brows and Lashes", "Head Buzz Cut"}
    assert bpy.context.object.name == "Head Buzz Cut" and len(previews.sessions()) == 2
    # the next style grows on the same head, whatever object is active
    bpy.ops.hairloom.add_hairstyle(style="stubble", plays=False)
    assert sum(is_bust(obj) for obj in bpy.data.objects) == 1


def test_landmarks_are_placed_once_and_the_report_counts_them(head: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = head
    for pattern in (r"placed \d+ missing landmarks$", "it has all landmarks already$"):
        head.select_set(True)
        assert bpy.ops.hairloom.place_landmarks() == {"FINISHED"}
        assert re.search(pattern, past_reports[-1].text)


@pytest.mark.slow(
    instead="tests/blender/test_foreign_heads.py::test_the_button_adds_to_the_selected_head_and_one_undo_takes_it_away"
)
@pytest.mark.usefixtures("few")
def test_one_undo_takes_it_all_away(head: bpy.types.Object) -> None:
    bpy.ops.ed.undo_push(message="before")
    before = everything()
    bpy.ops.hairloom.add_hairstyle("EXEC_DEFAULT", True, style="curls", plays=False)
    assert everything() != before
    bpy.ops.ed.undo()
    assert everything() == before


def refused(style: Hairstyle, head: bpy.types.Object, problem: str) -> None:
    """Assert an error with a remedy, and an unchanged scene."""
    before = everything()
    with pytest.raises(HairloomError, match=problem) as error:
        added(style, head)
    assert error.value.remedy and everything() == before


def test_hair_that_is_fitted_again_is_as_it_was_added(head: bpy.types.Object) -> None:
    """On a scaled, moved and turned head, hair gets its added shape, not the settled one, back."""
    hair = added(named_hairstyle("buzz_cut"), head)
    added_points, radius = curve_points(hair.data), read_attribute(hair.data, "radius", "POINT")
    hair.hairloom.dynamics.sag_compensation = 0.5
    head.matrix_world = Matrix.LocRotScale((0.3, 0.0, 0.1), Euler((0.0, 0.4, 0.0)), (2.0,) * 3)
    bpy.context.view_layer.update()
    BEFORE_SETTLE.save(hair)
    set_points(hair.data, added_points * np.float32(1.05))
    BEFORE_SETTLE.mark_result(hair)
    assert set_full_sag_correction(hair.data) and BEFORE_SETTLE.exists(hair)
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.hairloom.fit_again() == {"FINISHED"}
    assert curve_points(hair.data) == pytest.approx(added_points, abs=1e-5)
    assert read_attribute(hair.data, "radius", "POINT") == pytest.approx(radius, rel=1e-3)
    assert not BEFORE_SETTLE.exists(hair) and hair.hairloom.dynamics.sag_compensation == 0.5


def test_empty_masks_are_refused(head: bpy.types.Object) -> None:
    style = named_hairstyle("buzz_cut")
    group = head.vertex_groups["scalp"]
    group.remove(range(len(head.data.vertices)))
    bpy.context.view_layer.update()
    refused(style, head, "zero everywhere")
    head.vertex_groups.remove(group)
    refused(style, head, "neither a vertex group nor an attribute")


@pytest.mark.slow(instead="test_the_result_of_modifiers_is_simulated_unless_they_are_muted")
def test_nodes_that_are_replaced_renamed_or_not_there(
    head: bpy.types.Object, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    style = named_hairstyle("curls")
    other = bpy.data.node_groups.new("Curl Hair Curves", "GeometryNodeTree")
    hair = added(style, head)
    groups = [each.node_group for each in hair.modifiers]
    assert other not in groups, "Blender's own is taken, not one without inputs"
    again = added(style, head)
    strange = Hairstyle("Odd", style.guides, modifiers=(NodeModifier("Braid Hairs", {}),))
    refused(strange, head, "no hair nodes 'Braid Hairs'")
    unknown = NodeModifier("Clump Hair Curves", {"Fluff": 1.0})
    refused(Hairstyle("Odd", style.guides, modifiers=(unknown,)), head, "no input 'Fluff'")
    for obj in (hair, again):
        bpy.data.objects.remove(obj)
    for group in list(bpy.data.node_groups):
        bpy.data.node_groups.remove(group)
    monkeypatch.setattr(hair_nodes, "library_path", lambda: tmp_path / "none.blend")
    refused(style, head, "built without its hair nodes")


@pytest.mark.portable
def test_this_blender_brings_all_node_groups_that_styles_use(head: bpy.types.Object) -> None:
    expected = {one.nodes: one.inputs for n in NAMES for one in named_hairstyle(n).modifiers}
    hair = added(named_hairstyle("buzz_cut"), head)
    for nodes, inputs in expected.items():
        assert hair_nodes.add_hair_nodes(hair, nodes, inputs).node_group.name == nodes


@pytest.mark.draws
@pytest.mark.usefixtures("few")
@pytest.mark.slow
def test_the_command_line_draws_and_saves_a_style(tmp_path: Path, capsys) -> None:
    scene = tmp_path / "styled.blend"
    arguments = ["run", "add_hairstyle", "--set", "style=buzz_cut", "--output", str(scene)]
    assert run(arguments) == 0 and scene.is_file()
    picture = tmp_path / "buzz.png"
    size = ["--width", "48", "--height", "48", "--samples", "1"]
    few = ["--set", "children.strand_count=500"]
    assert run(["render", "--style", "buzz_cut", *few, *size, "--output", str(picture)]) == 0
    assert picture.is_file()
    again = ["render", "--style", "buzz_cut", "--groom", "Hair", "--output", str(picture)]
    assert run(again) == 1
    assert "not both" in capsys.readouterr().err


@pytest.mark.slow
def test_the_files_are_what_the_recipes_make() -> None:
    sys.path.insert(0, str(TOOLS))
    try:
        growth, recipes = map(importlib.import_module, ("style_growth", "style_recipes"))
    finally:
        sys.path.remove(str(TOOLS))
    assert set(recipes.RECIPES) == set(NAMES)
    head = growth.Head()
    for style in ("shaggy_coat", "buzz_cut"):
        made, kept = recipes.RECIPES[style](head), named_hairstyle(style)
        for name in ("title", "order", "masks", "modifiers", "presets", "settings"):
            assert getattr(made, name) == getattr(kept, name)
    assert kept.guides is not None
    assert np.abs(made.guides.shape - kept.guides.shape).max() < 3e-5
    assert np.abs(made.guides.root_uv - kept.guides.root_uv).max() < 1e-6


def test_every_style_has_a_picture_and_is_a_small_file() -> None:
    for entry in shipped_hairstyles():
        picture = entry.path.with_suffix(".png")
        assert picture.is_file() and picture.stat().st_size < 60_000, "run make styles"
        guides = entry.path.with_suffix(".npz")
        if entry.name in FUR:
            assert not guides.exists()
        else:
            assert guides.stat().st_size < 700_000


@pytest.mark.slow
@pytest.mark.draws
def test_another_file_of_a_style_makes_its_job_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, report = tmp_path / "styles", tmp_path / "report.json"
    shutil.copytree(hairstyles.HAIRSTYLE_FOLDER, folder)
    monkeypatch.setattr(hairstyles, "HAIRSTYLE_FOLDER", folder)

    def status() -> str:
        options = ["--width", "32", "--height", "32", "--samples", "1", "--skip-existing"]
        options += ["--set", "children.strand_count=100", "--report", str(report)]
        options += ["--output", str(tmp_path / "buzz.png")]
        assert run(["render", "--style", "buzz_cut", *options]) == 0
        return str(json.loads(report.read_text())["status"])

    assert status() == "done" and status() == "skipped"
    shutil.copy(folder / "bob.npz", folder / "buzz_cut.npz")
    assert status() == "done"
