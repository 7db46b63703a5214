"""Children between guides: in the panel, in a preview, in a bake and on the command line."""

import json
import re
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from grids import baked_grid, strand_grid
from swinging import key_x

from hairloom.addon import rig_flow
from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.groom_hashes import groom_rig_hash
from hairloom.addon.blender.bakes.simulation import differences
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.blender.sessions.prepared_groom import requested_rig
from hairloom.addon.blender.strands.strand_export import StrandExport
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import TRESSFX
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.settings import GuideSettings

LAST = 6


@pytest.fixture
def hair(new_hair, sphere):
    """60 guide curves on a head, with 200 children between them."""
    hair = new_hair(sphere)
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", 200
    hair.hairloom.dynamics.device = "numpy"
    return hair


@pytest.fixture
def moving(hair, sphere, tmp_path):
    """`hair` on a head that moves."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    key_x(sphere, {1: 0.0, 3: 0.1, LAST: -0.05})
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    return hair


def catch_up(get_depsgraph):
    """Update the previews, as a timer does once edits have settled."""
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())


def bake(hair):
    return list(Bake.of([hair], bpy.context.scene).steps())


def played(session):
    shown = []
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        shown.append(strand_grid(session))
    return np.array(shown)


def upper_half(head, name):
    """A vertex group of weight 1 above the middle of the head."""
    group = head.vertex_groups.new(name=name)
    group.add([v.index for v in head.data.vertices if v.co.z > 0.001], 1.0, "REPLACE")
    return group


@pytest.mark.parametrize("method", ["multi", "single"])
def test_guides_come_first_and_children_after_them(method, hair, get_depsgraph):
    hair.data.hairloom.children.method = method
    session = previews.start(hair, get_depsgraph())
    rig = session.rig
    assert (len(rig.guides), rig.strands.strand_count) == (60, 260)
    np.testing.assert_array_equal(rig.guides, np.arange(60))
    np.testing.assert_array_equal(rig.weights.guide[:60, 0], np.arange(60))
    np.testing.assert_array_equal(rig.weights.weight[:60], np.tile([1.0, 0.0, 0.0], (60, 1)))
    assert rig.weights.guide.max() < 60
    np.testing.assert_allclose(rig.weights.weight.sum(axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(rig.strands.roots, axis=1), 0.1, rtol=0.05)
    assert session.warnings == ()
    assert overlay.drawing_of(session.uid).snapshot.strand_count == 260


def test_method_none_keeps_the_artists_own_hair(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    hair.data.hairloom.children.strand_count = 17
    session = previews.start(hair, get_depsgraph())
    plain = rig_flow.prepare(
        session.source.strands, session.source.head, session.settings[GuideSettings], place="Hair"
    )
    np.testing.assert_array_equal(session.rig.strands.points, plain.strands.points)
    np.testing.assert_array_equal(session.rig.weights.weight, plain.weights.weight)
    hair.data.hairloom.children.strand_count = 18
    assert not session.is_stale, "settings of children that are not there change nothing"


def test_more_children_leave_those_before_bit_for_bit(hair, get_depsgraph):
    session = previews.start(hair, get_depsgraph())
    before = session.rig
    hair.data.hairloom.children.strand_count = 300
    assert session.is_stale
    catch_up(get_depsgraph)
    assert session.rig.strands.strand_count == 360 and not session.is_stale
    np.testing.assert_array_equal(session.rig.strands.grid[:260], before.strands.grid)
    np.testing.assert_array_equal(session.rig.weights.guide[:260], before.weights.guide)
    np.testing.assert_array_equal(session.rig.weights.weight[:260], before.weights.weight)


def test_no_children_at_all_are_the_guides(hair, get_depsgraph):
    hair.data.hairloom.children.strand_count = 0
    session = previews.start(hair, get_depsgraph())
    assert session.rig.strands.strand_count == len(session.rig.guides) == 60


@pytest.mark.slow
def test_a_hundred_thousand_children_are_made(hair, get_depsgraph):
    session = previews.start(hair, get_depsgraph())
    rig = rig_flow.prepare(
        session.source.strands,
        session.source.head,
        session.settings[GuideSettings],
        place="Hair",
        children=replace(session.settings[ChildrenSettings], strand_count=100_000),
    )
    assert rig.strands.strand_count == 100_060
    np.testing.assert_array_equal(rig.strands.grid[:260], session.rig.strands.grid)


def test_without_a_surface_there_are_no_children_and_a_note_says_why(new_hair, get_depsgraph):
    hair = new_hair()
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.guides.guide_count = 20
    session = previews.start(hair, get_depsgraph())
    assert (session.rig.strands.strand_count, session.rig.child_count) == (60, 0)
    (note,) = session.rig.notes
    assert f"Hair: {note}" in session.warnings and "surface" in note


def test_children_grow_where_the_artist_has_painted(hair, sphere, get_depsgraph):
    upper_half(sphere, "Top")
    hair.hairloom.children_density = "Top"
    session = previews.start(hair, get_depsgraph())
    assert session.warnings == ()
    assert session.rig.strands.roots[60:, 2].min() > -0.03
    assert session.rig.strands.roots[:60, 2].min() < -0.05, "guides are the artist's"


def test_painted_weights_are_followed(hair, sphere, get_depsgraph):
    group = upper_half(sphere, "Top")
    hair.hairloom.children_density = "Top"
    session = previews.start(hair, get_depsgraph())
    rig = session.rig
    sphere.data.update()
    bpy.context.view_layer.update()
    assert session.is_stale
    catch_up(get_depsgraph)
    assert session.rig is rig, "touched but not changed"
    group.add([v.index for v in sphere.data.vertices], 1.0, "REPLACE")
    sphere.data.update()
    catch_up(get_depsgraph)
    assert session.rig is not rig
    assert session.rig.strands.roots[60:, 2].min() < -0.05


def test_unusable_weights_are_reported(hair, sphere, get_depsgraph):
    sphere.vertex_groups.new(name="Nowhere")
    hair.hairloom.children_density = "Nowhere"
    session = previews.start(hair, get_depsgraph())
    (warning,) = session.warnings
    assert warning.startswith("Head: ") and "'Nowhere'" in warning and "Paint" in warning
    assert session.rig.strands.strand_count == 260
    broken = sphere.data.attributes.new("Broken", "FLOAT", "POINT")
    broken.data[0].value = float("nan")
    hair.hairloom.children_density = "Broken"
    catch_up(get_depsgraph)
    assert "'Broken'" in session.warnings[0] and session.rig.strands.strand_count == 260


def tips(session):
    """The children's strands by the bytes of their root."""
    rig = session.rig
    each = np.split(rig.strands.points, rig.strands.offsets[1:-1])[rig.own_count :]
    return {strand[0].tobytes(): strand for strand in each}


@pytest.mark.parametrize("kind", ["group", "attribute"])
def test_a_mask_shapes_the_children_where_it_is_painted(hair, sphere, get_depsgraph, kind):
    children = hair.data.hairloom.children
    children.frizz = 0.05
    session = previews.start(hair, get_depsgraph())
    before = tips(session)
    if kind == "group":
        upper_half(sphere, "Top")
    else:
        top = sphere.data.attributes.new("Top", "FLOAT", "POINT")
        top.data.foreach_set("value", [float(v.co.z > 0.0) for v in sphere.data.vertices])
    children.frizz_mask = "Top"
    catch_up(get_depsgraph)
    after = tips(session)
    assert session.warnings == () and after.keys() == before.keys()
    children.frizz_mask, children.frizz = "", 0.0
    catch_up(get_depsgraph)
    smooth = tips(session)
    for root, strand in after.items():
        if strand[0, 2] > 0.03:
            np.testing.assert_array_equal(strand, before[root])
        if strand[0, 2] < -0.03:
            np.testing.assert_array_equal(strand, smooth[root])
            assert not np.array_equal(strand, before[root])


def test_a_brush_on_a_mask_is_followed_with_the_update(hair, sphere, get_depsgraph):
    children = hair.data.hairloom.children
    children.length_variation = 0.0
    group = upper_half(sphere, "Top")
    children.length_mask = "Top"
    session = previews.start(hair, get_depsgraph())
    own, lengths = session.rig.own_count, session.rig.strands.lengths()
    group.add([v.index for v in sphere.data.vertices], 0.5, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    at_once = session.rig.strands.lengths()[own:]
    assert session.is_stale and not np.allclose(at_once, lengths[own:])
    catch_up(get_depsgraph)
    assert session.rig.strands.lengths()[own:] == pytest.approx(at_once, rel=1e-3)


def test_unusable_masks_are_reported_and_have_no_effect(hair, sphere, get_depsgraph):
    children = hair.data.hairloom.children
    session = previews.start(hair, get_depsgraph())
    before = session.rig.strands.points
    broken = sphere.data.attributes.new("Broken", "FLOAT", "POINT")
    broken.data[0].value = float("nan")
    sphere.data.attributes.new("Numbers", "INT", "POINT")
    sphere.vertex_groups.new(name="Nowhere")
    for name, message in (
        ("Gone", "neither a vertex group nor an attribute"),
        ("Broken", "not finite"),
        ("Numbers", "INT on POINT"),
    ):
        children.frizz_mask = name
        catch_up(get_depsgraph)
        (warning,) = session.warnings
        assert warning.startswith("Head: ") and f"'{name}'" in warning and message in warning
        np.testing.assert_array_equal(session.rig.strands.points, before)
    children.frizz_mask = "Nowhere"
    catch_up(get_depsgraph)
    (warning,) = session.warnings
    assert "'Nowhere' is 0 everywhere, and so is Frizz" in warning
    assert not np.array_equal(session.rig.strands.points, before)
    children.frizz_mask = ""
    catch_up(get_depsgraph)
    assert session.warnings == ()
    np.testing.assert_array_equal(session.rig.strands.points, before)


def test_a_bake_is_stale_once_a_mask_is_painted(hair, sphere):
    group = upper_half(sphere, "Top")
    settings = GroomSettings.of(hair)
    hair.data.hairloom.children.clump_mask = "Top"
    named = GroomSettings.of(hair)
    hashes = [groom_rig_hash(hair, sphere, each, bpy.context.scene) for each in (settings, named)]
    group.add([0, 1, 2], 0.3, "REPLACE")
    hashes.append(groom_rig_hash(hair, sphere, named, bpy.context.scene))
    assert len(set(hashes)) == 3
    assert differences(hashes[1], hashes[2]) == ("children",)


def test_an_unknown_density_is_reported_and_a_bake_refuses_it(hair, sphere, get_depsgraph):
    upper_half(sphere, "Top")
    session = previews.start(hair, get_depsgraph())
    hair.hairloom.children_density = "Bottom"
    catch_up(get_depsgraph)
    (warning,) = session.warnings
    assert warning.startswith("Head: ") and "'Bottom'" in warning and "Top" in warning
    assert session.rig.strands.strand_count == 260, "children grow everywhere until it is mended"
    with pytest.raises(HairloomError, match="Bottom"):
        Bake.of([hair], bpy.context.scene)
    hair.hairloom.children_density = "Top"
    catch_up(get_depsgraph)
    assert session.warnings == () and session.rig.strands.roots[60:, 2].min() > -0.03


def test_a_bake_of_children_plays_back_bit_for_bit(moving, get_depsgraph):
    session = previews.start(moving, get_depsgraph())
    shown = played(session)
    assert np.ptp(shown[:, 60:, -1] - shown[:, 60:, 0], axis=0).max() > 0.01
    bake(moving)
    np.testing.assert_array_equal(played(session), shown)
    cache = playback.cache_of(moving)
    for frame in range(1, LAST + 1):
        np.testing.assert_array_equal(baked_grid(cache, frame), shown[frame - 1])
    previews.stop(session)
    bpy.context.scene.frame_set(4)
    again = previews.start(moving, get_depsgraph())
    np.testing.assert_array_equal(strand_grid(again), shown[3])
    assert previews.previews[again.uid].bake.changed_inputs == ()


def test_a_bake_keeps_its_warnings(new_hair, get_depsgraph, tmp_path):
    hair = new_hair()
    hair.data.hairloom.children.method = "multi"
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.device = "numpy"
    bpy.context.scene.frame_end = 2
    plan = Bake.of([hair], bpy.context.scene)
    list(plan.steps())
    (note,) = previews.start(hair, get_depsgraph()).rig.notes
    assert f"Hair: {note}" in plan.notes
    assert playback.rig_in(playback.cache_of(hair)).rig.notes == (note,)


@pytest.mark.slow
def test_a_bake_says_when_children_have_changed(moving, sphere, get_depsgraph):
    upper_half(sphere, "Top")
    session = previews.start(moving, get_depsgraph())
    bake(moving)

    def changed():
        catch_up(get_depsgraph)
        return previews.previews[session.uid].bake.changed_inputs

    children = moving.data.hairloom.children
    assert changed() == ()
    clump, children.clump = children.clump, 0.9
    assert changed() == ("children",)
    children.clump = clump
    assert changed() == ()
    moving.hairloom.children_density = "Top"
    assert changed() == ("children",)
    moving.hairloom.children_density = ""
    children.method = "none"
    assert changed() == ("children",)


def test_hair_that_plays_goes_on_while_children_change(moving, sphere, get_depsgraph):
    session = previews.start(moving, get_depsgraph())
    previews.play(get_depsgraph())

    def go(frames):
        for _ in range(frames):
            sphere.location.x += 0.02
            bpy.context.view_layer.update()
            previews.advance(get_depsgraph(), 1.0 / 24.0)

    go(4)
    guides = session.solver.guides()
    moving.data.hairloom.children.strand_count = 50
    moving.data.hairloom.children.frizz = 0.004
    catch_up(get_depsgraph)
    assert session.is_playing and session.rig.strands.strand_count == 110
    np.testing.assert_array_equal(session.solver.guides(), guides)
    np.testing.assert_allclose(strand_grid(session)[:60, -1], guides[:, -1], atol=1e-3)
    go(2)
    assert np.abs(session.solver.guides() - guides).max() > 0.01
    moving.data.hairloom.guides.guide_count = 30
    catch_up(get_depsgraph)
    assert session.is_playing and strand_grid(session).shape[0] == 110, "other guides begin at rest"
    go(1)
    assert previews.sessions() == (session,)


def test_undo_brings_the_children_back(hair, get_depsgraph):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="begin")
    session = previews.start(hair, get_depsgraph())
    before = strand_grid(session)
    bpy.data.objects["Hair"].data.hairloom.children.strand_count = 90
    bpy.ops.ed.undo_push(message="fewer")
    catch_up(get_depsgraph)
    assert strand_grid(session).shape[0] == 150
    bpy.ops.ed.undo()
    catch_up(get_depsgraph)
    assert previews.sessions() == (session,)
    np.testing.assert_allclose(strand_grid(session), before, atol=1e-6)


@pytest.mark.slow
def test_cards_are_one_a_guide_and_tressfx_holds_all(hair, get_depsgraph, tmp_path, capfd):
    settings = hair.data.hairloom
    settings.cards.source, settings.atlas.size = "guides", "512"
    settings.cards.order_by, settings.card_occlusion.rays = "distance", 16
    assert bpy.ops.hairloom.export_cards(filepath=str(tmp_path / "cards.glb")) == {"FINISHED"}
    assert "Wrote 60 cards" in capfd.readouterr().out
    plan = StrandExport.of([hair], get_depsgraph(), TRESSFX, StrandExportSettings(up="Z"))
    assert "260 strands" in plan.write(tmp_path / "hair.tfx").result
    written = read_tfx(tmp_path / "hair.tfx", up="Z", scale=1.0).strands
    session = previews.start(hair, get_depsgraph())
    np.testing.assert_allclose(written.points, session.rig.strands.points, atol=1e-6)


def on_the_command_line(sphere, tmp_path, verb, *more):
    report = tmp_path / "report.json"
    arguments = [
        verb,
        "--head",
        sphere.name,
        "--set",
        "children.method=multi",
        "--report",
        str(report),
    ]
    arguments += ["--set", "grow.method=normals", "--set", "grow.strand_count=80"]
    code = command_line.run([*arguments, "--output", str(tmp_path / "hair.tfx"), *more])
    return code, json.loads(report.read_text()) if code == 0 else {}


@pytest.mark.slow
def test_the_command_line_makes_children(sphere, tmp_path, capfd):
    upper_half(sphere, "Top")
    code, report = on_the_command_line(
        sphere, tmp_path, "export", "--set", "children.strand_count=500"
    )
    assert code == 0
    assert (report["strands"], report["guides"], report["children"]) == (580, 80, 500)
    everywhere = read_tfx(tmp_path / "hair.tfx", up="Y").strands
    assert everywhere.strand_count == 580 and everywhere.roots[80:, 2].min() < -0.05
    code, _ = on_the_command_line(sphere, tmp_path, "export", "--children-density", "Top")
    painted = read_tfx(tmp_path / "hair.tfx", up="Y").strands
    assert code == 0 and painted.roots[80:, 2].min() > -0.03
    capfd.readouterr()
    assert on_the_command_line(sphere, tmp_path, "export", "--children-density", "Left")[0] == 1
    assert "Left" in capfd.readouterr().err


@pytest.mark.slow(instead="test_guides_come_first_and_children_after_them")
def test_the_report_of_a_picture_counts_drawn_children(sphere, tmp_path, gpu_context):
    report = tmp_path / "report.json"
    arguments = ["render", "--head", sphere.name, "--width", "96", "--height", "96"]
    arguments += ["--set", "grow.method=normals", "--set", "grow.strand_count=80"]
    arguments += ["--set", "children.method=multi", "--set", "children.strand_count=400"]
    arguments += ["--output", str(tmp_path / "still.png"), "--report", str(report)]
    drawn = {}
    for lod_size in (0, 300):
        more = ["--set", f"detail.lod_size={lod_size}", "--set", "detail.culling=none"]
        assert command_line.run([*arguments, *more]) == 0
        drawn[lod_size] = json.loads(report.read_text())["drawn"]
    assert drawn[0]["strands"] == 480 and drawn[0]["pieces"] >= 480 * 15
    assert drawn[300]["strands"] < 480 and drawn[300]["vertices"] < drawn[0]["vertices"]


def test_the_command_line_reports_missing_groups(hair, sphere, tmp_path, capfd):
    hair.data.surface = hair.parent = None
    report = tmp_path / "report.json"
    arguments = ["export", "--groom", "Hair", "--set", "children.method=multi"]
    arguments += ["--report", str(report), "--output", str(tmp_path / "hair.tfx")]
    assert command_line.run(arguments) == 0
    assert "Hair: Children need a surface" in capfd.readouterr().out
    facts = json.loads(report.read_text())
    assert facts["children"] == 0
    assert sum("Children need a surface" in note for note in facts["notes"]) == 1


@pytest.mark.slow(instead="test_guides_come_first_and_children_after_them")
def test_the_example_of_the_page_makes_its_hairs(extension, sphere, get_depsgraph):
    """All but its last line, as Play needs a window."""
    page = (Path(__file__).parents[2] / "docs" / "refinement.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S)
    code, play = code.rstrip("\n").rsplit("\n", 1)
    assert play == "bpy.ops.hairloom.play()"
    known = {}
    exec(compile(code, "block", "exec"), known)
    rig = requested_rig(GroomSource(known["hair"], get_depsgraph()).request)
    assert (len(rig.guides), rig.strands.strand_count) == (762, 762 + 4095)
