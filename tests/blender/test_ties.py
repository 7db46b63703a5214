"""Hair ties in a scene: found, carried, baked, released."""

import json

import bpy
import numpy as np
import pytest
from grids import baked_grid, strand_grid
from mathutils import Matrix
from swinging import shake_head
from tiers import few_in_commits

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.bakes.stale_bakes import changed_inputs
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.strands import StrandSet

LAST = 8
RADIUS = 0.09


def ring(kind="circle", place=(0.0, 0.0, 0.12)):
    """A tie around z above the head, which follows the head."""
    if kind in ("circle", "ball"):
        obj = bpy.data.objects.new("Ring", None)
        obj.empty_display_type = "CIRCLE" if kind == "circle" else "SPHERE"
        obj.empty_display_size = RADIUS
        obj.rotation_euler.x = np.pi / 2.0  # Blender draws circles around y
        bpy.context.collection.objects.link(obj)
    elif kind == "curve":
        bpy.ops.curve.primitive_bezier_circle_add(radius=RADIUS)
        obj = bpy.context.object
    else:
        bpy.ops.mesh.primitive_torus_add(major_radius=RADIUS, minor_radius=0.004)
        obj = bpy.context.object
    obj.location = place
    obj.parent = bpy.data.objects["Head"]
    bpy.context.view_layer.update()
    return obj


def tie(hair, *rings):
    collection = bpy.data.collections.new("Ties")
    bpy.context.scene.collection.children.link(collection)
    for each in rings:
        collection.objects.link(each)
    hair.hairloom.tie_collection = collection
    return collection


def wavy():
    """Strands on the sphere, with slack between root and tie."""
    random = np.random.default_rng(5)
    outward = random.normal([0.0, 0.0, 1.0], 0.5, (60, 1, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    along = np.linspace(0.0, 1.0, 16)[:, None]
    across = np.cross(outward, [1.0, 0.0, 0.0]) * np.sin(along * 12.0) * 0.008
    points = outward * (0.1 + 0.08 * along) + across * np.minimum(along * 4.0, 1.0)
    count = np.arange(61) * 16
    return StrandSet(points.reshape(-1, 3), count, np.full(960, 4e-5), np.zeros(60, np.int32))


@pytest.fixture
def swinging(new_hair, sphere, tmp_path):
    """Hair on a head that shakes for some frames: (hair, head)."""
    return shake_head(new_hair(sphere), sphere, LAST, tmp_path / "bake")


def escape(session):
    """The largest distance [m] of held strands, if long enough, from their holds."""
    rig, pose, strands = session.rig, session.solver.pose, strand_grid(session)
    holds = rig.holds.where(pose.anchors)
    first = holds.place.astype(int)
    part = (holds.place - first)[:, None]
    after = np.minimum(first + 1, strands.shape[1] - 1)

    def at(grid):
        return grid[holds.strand, first] * (1 - part) + grid[holds.strand, after] * part

    rest = np.concatenate([at(rig.strands.grid), np.ones((len(first), 1))], axis=1)
    target = np.einsum("nij,nj->ni", pose.anchors[holds.anchor], rest)[:, :3]
    length = np.linalg.norm(np.diff(rig.strands.grid[holds.strand], axis=1), axis=2)
    cv = np.arange(length.shape[1])
    reach = np.where((cv >= 1) & (cv < first[:, None]), length, 0.0).sum(axis=1)
    point = np.concatenate(
        [rig.strands.grid[holds.strand, first], np.ones((len(first), 1))], axis=1
    )
    point = np.einsum("nij,nj->ni", pose.anchors[holds.anchor], point)[:, :3]
    is_reached = np.linalg.norm(point - strands[holds.strand, 1], axis=1) < reach + 1e-5
    gap = np.linalg.norm(at(strands) - target, axis=1)[is_reached]
    assert len(gap) > 3 or not len(first)
    return float(gap.max(initial=0.0))


def played(hair, first=1, last=LAST):
    shown = []
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)
        shown.append(strand_grid(previews.session_of(hair)))
    return np.array(shown)


@pytest.mark.alike
@pytest.mark.parametrize("kind", ["circle", "ball", "curve", "torus"])
def test_a_ring_of_any_kind_holds_what_passes_through_it(swinging, get_depsgraph, kind):
    """It holds the strands that cross its disc at z = 0.12, whatever kind of object it is."""
    hair, _ = swinging
    tie(hair, ring(kind))
    session = previews.start(hair, get_depsgraph())
    out = session.rig.strands.roots / 0.1
    length = 0.12 / np.maximum(out[:, 2], 1e-6)
    inside = length * np.hypot(out[:, 0], out[:, 1])
    expected = (length <= 0.18) & (inside < RADIUS)
    if kind == "ball":
        near = out * np.clip(0.12 * out[:, 2:], 0.1, 0.18)
        expected = np.linalg.norm(near - [0.0, 0.0, 0.12], axis=1) < RADIUS
    close = np.abs(inside - RADIUS) < 0.002
    held = np.zeros(len(out), bool)
    held[session.rig.holds.strand] = True
    assert (held == expected)[~close].all()
    assert 3 < held.sum() < 40
    played(hair)
    assert escape(session) < 1e-3


@pytest.mark.parametrize("device", few_in_commits(["numpy", "compute"]))
def test_held_strands_stay_with_a_ring_that_moves_by_itself(
    new_hair, swinging, get_depsgraph, gpu_context, device
):
    hair = new_hair(swinging[1], wavy())
    hair.hairloom.dynamics.device = device
    one = ring()
    one.keyframe_insert("location", frame=1)
    one.location.z += 0.002  # as far as these strands can reach
    one.keyframe_insert("location", frame=LAST)
    bpy.context.scene.frame_set(1)
    tie(hair, one)
    session = previews.start(hair, get_depsgraph())
    for frame in range(2, LAST + 1):
        bpy.context.scene.frame_set(frame)
        assert escape(session) < 1e-3
    assert session.solver.device == device


def test_a_tie_that_is_deleted_in_mid_play_lets_go(swinging, get_depsgraph):
    hair, _ = swinging
    one = ring()
    tie(hair, one)
    session = previews.start(hair, get_depsgraph())
    played(hair, 1, 4)
    assert escape(session) < 1e-3
    rig = session.rig
    bpy.data.objects.remove(one)
    shown = played(hair, 5, LAST)
    assert np.isfinite(shown).all()
    session = previews.session_of(hair)
    assert session.rig is rig
    assert len(rig.holds.where(session.solver.pose.anchors).strand) == 0
    assert any("this tie is gone" in text for text in session.warnings)


@pytest.mark.alike
@pytest.mark.parametrize("how", ["disabled", "scaled to zero", "taken out", "head at zero"])
def test_unusable_ties_are_reported_and_hold_nothing(swinging, get_depsgraph, how):
    hair, head = swinging
    one = ring()
    collection = tie(hair, one)
    session = previews.start(hair, get_depsgraph())
    played(hair, 1, 3)
    if how == "disabled":
        one.hide_viewport = True
    elif how == "scaled to zero":
        one.scale = (0.0, 0.0, 0.0)
    elif how == "taken out":
        collection.objects.unlink(one)
    else:
        head.scale = (0.0, 0.0, 0.0)
    shown = played(hair, 4, LAST)
    assert np.isfinite(shown).all()
    pose = session.solver.pose
    assert len(session.rig.holds.where(pose.anchors).strand) == 0
    warnings = [text for text in session.warnings if "Ring" in text]
    assert bool(warnings) == (how != "taken out")


def test_a_ring_beside_the_hair_is_said(swinging, get_depsgraph):
    hair, _ = swinging
    tie(hair, ring(place=(9.0, 0.0, 0.0)))
    session = previews.start(hair, get_depsgraph())
    assert any("No hair passes through the tie Ring" in text for text in session.warnings)
    assert np.isfinite(played(hair)).all()


def test_what_cannot_be_a_tie_is_said(swinging, get_depsgraph):
    hair, _ = swinging
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    flat = bpy.data.objects.new("Dot", bpy.data.meshes.new("Dot"))
    for obj in (light, flat):
        bpy.context.collection.objects.link(obj)
    tie(hair, light, flat)
    session = previews.start(hair, get_depsgraph())
    text = " ".join(session.warnings)
    assert "Lamp: it is a light object" in text
    assert "Dot: its points do not form a ring" in text


def test_tips_on_a_mesh_follow_its_deformation(swinging, get_depsgraph):
    hair, head = swinging
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.18, segments=24, ring_count=12)
    bun = bpy.context.object
    bun.name, bun.parent = "Bun", head
    hair.hairloom.tip_surface = bun
    hair.data.hairloom.guides.tip_distance = 0.1
    session = previews.start(hair, get_depsgraph())
    assert len(session.rig.holds.strand) > 50
    before = strand_grid(session)
    swell = bun.modifiers.new("Swell", "DISPLACE")
    swell.mid_level, swell.strength = 0.0, -0.01
    bpy.context.view_layer.update()
    after = strand_grid(session)
    inwards = np.linalg.norm((after - before)[session.rig.holds.strand, -1], axis=1)
    assert inwards == pytest.approx(np.full(len(inwards), 0.01), rel=0.2)
    assert np.abs(after[:, 0] - before[:, 0]).max() < 1e-6


def test_a_renamed_mesh_holds_the_same_tips(swinging, get_depsgraph):
    """Also when hair is read again while the mesh is away from its place at rest."""
    hair, _ = swinging
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.18, segments=24, ring_count=12)
    bun = bpy.context.object
    hair.hairloom.tip_surface = bun
    hair.data.hairloom.guides.tip_distance = 0.1
    session = previews.start(hair, get_depsgraph())
    held = session.rig.holds
    bun.location.z += 0.5
    bun.name = "Knot"
    bpy.context.view_layer.update()
    session.read_again(get_depsgraph())
    assert session.rig.holds is held


def test_tips_are_held_where_a_vertex_group_says(swinging, get_depsgraph):
    """Tips are held where the interpolated weight is at least 0.5, tested to within one edge. A
    bake becomes stale, and a missing group is named."""
    hair, head = swinging
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.18, segments=24, ring_count=12)
    bun = bpy.context.object
    bun.name, bun.parent = "Bun", head
    hair.hairloom.tip_surface = bun
    hair.data.hairloom.guides.tip_distance = 0.1
    session = previews.start(hair, get_depsgraph())
    everywhere = set(session.rig.holds.strand)
    tips = session.rig.strands.points[session.rig.strands.offsets[1:] - 1]
    list(Bake.of([hair], bpy.context.scene).steps())
    cache = playback.cache_of(hair)
    on_right = [vertex.index for vertex in bun.data.vertices if vertex.co.x > 0.01]
    bun.vertex_groups.new(name="Right").add(on_right, 1.0, "REPLACE")
    assert changed_inputs(hair, cache, get_depsgraph()) == ()
    hair.hairloom.tip_group = "Right"
    assert changed_inputs(hair, cache, get_depsgraph()) == ("ties",)
    session = previews.start(hair, get_depsgraph())
    held = set(session.rig.holds.strand)
    spacing = 0.18 * 2.0 * np.pi / 24
    local = moved_by(np.linalg.inv(np.array(bun.matrix_world)), tips)[:, 0]
    on_it = {one for one in everywhere if local[one] > spacing}
    assert on_it and on_it <= held < everywhere
    assert all(local[one] > -spacing for one in held)
    hair.hairloom.tip_group = "Left"
    session = previews.start(hair, get_depsgraph())
    assert session.rig.holds is None
    assert any("Bun: it has neither" in text and "'Left'" in text for text in session.warnings)


def moved_by(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def test_a_bake_keeps_what_ties_hold(swinging, get_depsgraph):
    hair, _ = swinging
    one = ring()
    tie(hair, one)
    previews.start(hair, get_depsgraph())
    live = played(hair)
    list(Bake.of([hair], bpy.context.scene).steps())
    np.testing.assert_array_equal(played(hair), live)
    cache = playback.cache_of(hair)
    bpy.context.scene.frame_set(3)
    assert changed_inputs(hair, cache, get_depsgraph()) == ()
    np.testing.assert_array_equal(baked_grid(cache, 3), live[2])
    assert playback.pose_in(cache, 3, 0.5).anchors.shape == (1, 4, 4)
    one.location.z += 0.01
    bpy.context.view_layer.update()
    assert changed_inputs(hair, cache, get_depsgraph()) == ("ties",)
    one.location.z -= 0.01
    hair.hairloom.tie_collection = None
    assert "ties" in changed_inputs(hair, cache, get_depsgraph())


def test_a_tie_added_during_a_preview_takes_effect(swinging, get_depsgraph):
    from hairloom.addon.blender.preview import scene_events

    hair, _ = swinging
    session = previews.start(hair, get_depsgraph())
    assert session.rig.holds is None
    tie(hair, ring())
    bpy.context.view_layer.update()
    assert session.is_stale
    scene_events.catch_up(get_depsgraph())
    assert len(previews.session_of(hair).rig.holds.strand) > 3
    assert not session.is_stale


def test_the_button_adds_the_selected_ring_or_a_new_one(swinging):
    hair, head = swinging
    one = ring()
    for obj in (hair, one):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.hairloom.add_hair_tie() == {"FINISHED"}
    assert hair.hairloom.tie_collection.objects.values() == [one]
    assert bpy.ops.hairloom.remove_hair_tie(tie="Ring") == {"FINISHED"}
    assert len(hair.hairloom.tie_collection.objects) == 0
    one.select_set(False)
    bpy.context.scene.cursor.matrix = Matrix.Translation((0.0, 0.0, 0.14))
    assert bpy.ops.hairloom.add_hair_tie() == {"FINISHED"}
    made = hair.hairloom.tie_collection.objects[0]
    assert (made.empty_display_type, made.parent) == ("CIRCLE", head)
    assert made.matrix_world.translation.z == pytest.approx(0.14)


def test_objects_that_cannot_hold_hair_become_no_tie(swinging):
    hair, _ = swinging
    one, flat = ring(), ring()
    flat.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    for obj in (hair, one, flat):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = hair
    with pytest.raises(RuntimeError, match="its scale is zero"):
        bpy.ops.hairloom.add_hair_tie()
    assert hair.hairloom.tie_collection is None


def test_ties_survive_saving_and_opening(swinging, tmp_path, get_depsgraph):
    hair, _ = swinging
    tie(hair, ring())
    hair.hairloom.tip_surface = bpy.data.objects["Head"]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "tied.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "tied.blend"))
    hair = bpy.data.objects["Hair"]
    assert hair.hairloom.tie_collection.name == "Ties"
    assert hair.hairloom.tip_surface.name == "Head"
    session = previews.start(hair, get_depsgraph())
    assert len(session.rig.holds.strand) > 3


def bone_in(head):
    """An armature with one bone that moves all of the head's vertices."""
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    rig.name = "Rig"
    group = head.vertex_groups.new(name="Bone")
    group.add(list(range(len(head.data.vertices))), 1.0, "REPLACE")
    modifier = head.modifiers.new("Armature", "ARMATURE")
    modifier.object = rig
    return rig


@pytest.mark.parametrize("how", ["child of the bone", "skinned"])
def test_ties_move_with_bones(new_hair, sphere, get_depsgraph, how):
    rig = bone_in(sphere)
    hair = new_hair(sphere)
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    if how == "skinned":
        one = ring("torus")
        one.parent = None
        group = one.vertex_groups.new(name="Bone")
        group.add(list(range(len(one.data.vertices))), 1.0, "REPLACE")
        one.modifiers.new("Armature", "ARMATURE").object = rig
    else:
        one = ring()
        matrix = one.matrix_world.copy()
        one.parent, one.parent_type, one.parent_bone = rig, "BONE", "Bone"
        one.matrix_world = matrix
    bone = rig.pose.bones["Bone"]
    bone.rotation_mode = "XYZ"
    bone.keyframe_insert("rotation_euler", frame=1)
    bone.rotation_euler = (0.6, 0.3, 0.0)
    bone.keyframe_insert("rotation_euler", frame=LAST)
    bpy.context.scene.frame_set(1)
    tie(hair, one)
    session = previews.start(hair, get_depsgraph())
    assert len(session.rig.holds.strand) > 3
    begun = strand_grid(session)
    for frame in range(2, LAST + 1):
        bpy.context.scene.frame_set(frame)
        assert escape(session) < 1e-3
    turned = session.solver.pose.anchors[0, :3, :3]
    assert np.degrees(np.arccos((np.trace(turned) - 1.0) / 2.0)) == pytest.approx(38.0, abs=4.0)
    assert np.linalg.norm((strand_grid(session) - begun)[:, -1], axis=1).max() > 0.05
    # the bone carries head and tie alike, so the distance between them is unchanged
    root = strand_grid(session)[session.rig.holds.strand, 0]
    assert np.isfinite(root).all()


def test_undo_brings_back_a_tie_that_was_deleted(swinging, get_depsgraph):
    hair, _ = swinging
    tie(hair, ring())
    previews.start(hair, get_depsgraph())
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects.remove(bpy.data.objects["Ring"])
    bpy.ops.ed.undo_push(message="deleted")
    bpy.context.scene.frame_set(2)
    bpy.ops.ed.undo()
    hair = bpy.data.objects["Hair"]
    assert hair.hairloom.tie_collection.objects[0].name == "Ring"
    bpy.context.scene.frame_set(3)
    session = previews.session_of(hair)
    pose = session.solver.pose
    assert np.isfinite(pose.anchors).all()
    assert not [text for text in session.warnings if "Ring" in text]


def test_verbs_hold_hair_by_its_ties_as_the_window_does(swinging, tmp_path, get_depsgraph):
    hair, _ = swinging
    tie(hair, ring())
    expected = len(np.unique(previews.start(hair, get_depsgraph()).rig.holds.strand))
    report, output = tmp_path / "report.json", str(tmp_path / "hair.tfx")
    arguments = ["export", "--groom", "Hair", "--output", output, "--report", str(report)]
    assert command_line.run(arguments) == 0
    assert json.loads(report.read_text())["held_strands"] == expected > 0


def test_the_verb_shakes_hair_with_its_ties(swinging, tmp_path):
    hair, head = swinging
    head.animation_data_clear()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.18, segments=24, ring_count=12)
    hair.hairloom.tip_surface = bpy.context.object
    tie(hair, ring(), ring("torus", (0.0, 0.0, -0.12)))
    objects, collections = len(bpy.data.objects), len(bpy.data.collections)
    small = ["--set", "dynamics.collider_resolution=8", "--set", "guides.tip_distance=0.1"]
    where = ["--seconds", "0.2", "--output", str(tmp_path / "shaken")]
    arguments = ["simulate", "--groom", "Hair", "--head", "Head", *small, *where]
    assert command_line.run(arguments) == 0
    assert (len(bpy.data.objects), len(bpy.data.collections)) == (objects, collections)
    cache = Cache(tmp_path / "shaken")
    baked = playback.rig_in(cache)
    assert baked.rig.holds.tie_count == 2
    assert set(np.minimum(baked.rig.holds.anchor, 2)) == {0, 1, 2}
    last = cache.frame(cache.facts.last)
    expected = np.broadcast_to(last["matrix"], last["anchors"].shape)
    np.testing.assert_allclose(last["anchors"], expected, atol=1e-5)
    assert np.abs(last["matrix"] - np.eye(4)).max() > 0.001
