"""Detail, culling, and their overlays in the viewport: from the settings to the snapshot.

Drawing is tested in tests/gpu, and in a window in tests/window.
"""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.sessions.occluder_spheres import OccluderSpheres
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.blender.viewport.overlay_text import counts_line, free_corner
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.shader_source import DEBUG_VIEWS
from hairloom.addon.render.strand_pass import Statistics, StrandPass
from hairloom.addon.rig_flow import Pose
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.draws(light=False)


def drawing(session):
    return overlay.drawing_of(session.uid)


def update():
    bpy.context.view_layer.update()


def surface_of(head):
    """The mesh of an object without transform."""
    mesh = head.data
    mesh.calc_loop_triangles()
    positions = np.array([vertex.co for vertex in mesh.vertices], np.float32)
    return Surface(positions, np.array([each.vertices for each in mesh.loop_triangles]))


def test_detail_acts_at_once(preview):
    hair, _, session = preview
    rig, before = session.rig, drawing(session).snapshot
    detail = hair.data.hairloom.detail
    detail.mode, detail.subdivisions, detail.lod_size = "fixed", 7, 0.0
    snapshot = drawing(session).snapshot
    assert (snapshot.detail.mode, snapshot.detail.subdivisions) == ("fixed", 7)
    assert session.rig is rig and not session.is_stale
    assert snapshot.rank is before.rank and snapshot.guide is before.guide


def test_the_snapshot_has_guides_groups_and_ranks(preview):
    _, _, session = preview
    snapshot, rig = drawing(session).snapshot, session.rig
    np.testing.assert_array_equal(snapshot.guide, rig.weights.guide[:, 0])
    np.testing.assert_array_equal(snapshot.group, np.arange(60) % 2)
    assert snapshot.rank.min() >= 0.0 and snapshot.rank.max() < 1.0
    assert len(np.unique(snapshot.rank)) == 60


def test_of_children_the_last_to_grow_are_the_first_to_go(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 240
    rank = drawing(previews.start(hair, get_depsgraph())).snapshot.rank
    assert (np.diff(rank[60:]) > 0.0).all() and rank[60] == 0.0 and rank[-1] < 1.0
    # the artist's own strands have ranks spread evenly from 0 to 1
    assert sorted(rank[:60]) == pytest.approx(np.arange(60) / 60, abs=1e-6)


@pytest.mark.parametrize("view", DEBUG_VIEWS)
def test_a_debug_view_reaches_the_snapshot_and_brings_its_counts(view, preview):
    hair, _, session = preview
    assert drawing(session).counts_name == ""
    hair.hairloom.debug_view = view
    assert drawing(session).snapshot.debug_view == view
    assert drawing(session).counts_name == ("" if view == "none" else "Hair")
    hair.hairloom.show_counts = True
    assert drawing(session).counts_name == "Hair" and drawing(session).guide_count == 60


def test_balls_inside_the_head_follow_it(preview):
    _, head, session = preview
    before = drawing(session).snapshot.occluder_spheres
    assert (np.linalg.norm(before[:, :3], axis=1) + before[:, 3] < 0.1).all()
    matrix = Matrix.LocRotScale((0.5, -1.0, 2.0), Matrix.Rotation(1.2, 3, (1, 2, 3)), (2, 2, 2))
    head.matrix_world = matrix
    update()
    after = drawing(session).snapshot.occluder_spheres
    expected = before[:, :3] @ np.array(matrix)[:3, :3].T + np.array(matrix)[:3, 3]
    np.testing.assert_allclose(after[:, :3], expected, atol=1e-5)
    np.testing.assert_allclose(after[:, 3], 2.0 * before[:, 3], rtol=1e-3)


def test_balls_stay_inside_a_head_that_bends(sphere):
    """The front is pressed in deeper and deeper; no vertex is ever inside a sphere."""
    surface = surface_of(sphere)
    occluder_spheres = OccluderSpheres(surface, surface.positions)
    radius = occluder_spheres.at(Pose(surface.positions, np.eye(4)))[:, 3].sum()
    for depth in (0.01, 0.03, 0.08):
        bent = surface.positions.copy()
        bent[:, 1] = np.maximum(bent[:, 1], depth - 0.1)
        balls = occluder_spheres.at(Pose(bent, np.eye(4)))
        balls = np.zeros((0, 4)) if balls is None else balls
        assert balls[:, 3].sum() < radius
        away = np.linalg.norm(bent[:, None] - balls[None, :, :3], axis=2)
        assert (away >= balls[:, 3]).all()


@pytest.mark.parametrize("how", ["eye", "wire", "glass"])
def test_a_head_that_is_not_seen_hides_nothing(how, preview):
    hair, head, session = preview
    assert drawing(session).snapshot.occluder_spheres is not None
    assert drawing(session).head is session.posed_head
    if how == "eye":
        head.hide_set(True)
    elif how == "wire":
        head.display_type = "WIRE"
    else:
        head.color[3] = 0.5
    for culling in ("hidden", "away"):
        hair.data.hairloom.detail.culling = culling
        update()
        shown = drawing(session).snapshot
        assert shown.occluder_spheres is None and shown.detail.culling == "none"
    # a head that is shown as a solid, transparent or not, hides hair in views without overlays
    assert (drawing(session).head is None) is (how != "glass")
    head.hide_set(False)
    head.display_type, head.color[3] = "TEXTURED", 1.0
    update()
    assert drawing(session).snapshot.detail.culling == "away"
    hair.data.hairloom.detail.culling = "hidden"
    assert drawing(session).snapshot.occluder_spheres is not None


def test_hair_without_a_head_has_nothing_to_hide_it(new_hair, get_depsgraph):
    session = previews.start(new_hair(), get_depsgraph())
    assert drawing(session).snapshot.occluder_spheres is None


@pytest.mark.parametrize(
    ("kind", "xray", "expected"),
    [
        ("WIREFRAME", False, True),
        ("SOLID", True, True),
        ("SOLID", False, False),
        ("RENDERED", True, False),
    ],
)
def test_views_that_show_hidden_strands_cull_nothing(kind, xray, expected):
    assert overlay.is_x_ray(SimpleNamespace(type=kind, show_xray=xray)) is expected


def test_the_counts_are_what_was_drawn(preview, gpu_context):
    hair, _, session = preview
    hair.data.hairloom.detail.mode = "fixed"
    hair.data.hairloom.detail.subdivisions = 3
    hair.data.hairloom.detail.culling = "none"
    hair.data.hairloom.detail.lod_size = 0.0
    shown, strand_pass = drawing(session).snapshot, StrandPass()
    low, high = shown.points.min(axis=0), shown.points.max(axis=0)
    camera = frame_camera((low, high), (0.0, -1.0, 0.0), 0.5, 1.0)
    target = gpu_context.types.GPUOffScreen(64, 64)
    with target.bind():
        strand_pass.draw(shown, camera, 64, 64)
    target.free()
    drawn, segments = strand_pass.statistics, shown.layout.cv_count - 1
    assert (drawn.strands, drawn.pieces) == (60, 60 * 3 * segments)
    assert drawn.vertices == 60 * 2 * (3 * segments + 1)
    line = counts_line("Hair", 60, shown.strand_count, drawn)
    shown = "Hairloom Hair   guides 60   strands 60 of 60   pieces 2,700   vertices 5,520"
    assert line == shown


def region(kind, alignment, x, y, width, height):
    return SimpleNamespace(type=kind, alignment=alignment, x=x, y=y, width=width, height=height)


def test_the_counts_stand_beside_what_lies_over_the_view():
    view = region("WINDOW", "NONE", 100, 50, 800, 600)
    tools = region("TOOLS", "LEFT", 100, 50, 60, 600)
    shelf = region("ASSET_SHELF", "BOTTOM", 100, 50, 800, 90)
    hidden = region("ASSET_SHELF_HEADER", "BOTTOM", 100, 50, 1, 1)
    sidebar = region("UI", "RIGHT", 700, 50, 200, 600)
    redo = region("HUD", "FLOAT", 170, 150, 200, 30)

    def corner(*others):
        return free_corner(SimpleNamespace(regions=[view, *others]), view)

    assert corner() == (0, 0)
    assert corner(tools, sidebar) == (60, 0)
    assert corner(tools, hidden, shelf) == (60, 90)
    assert corner(tools, redo) == (60, 130)
    beside = region("TOOLS", "LEFT", 40, 50, 60, 600)
    assert corner(beside) == (0, 0)


def test_statistics_begin_with_nothing():
    assert counts_line("Hair", 5, 10, Statistics()) == (
        "Hairloom Hair   guides 5   strands 0 of 10   pieces 0   vertices 0"
    )


def test_stretch_and_depth_account_for_style_and_colliders(preview, get_depsgraph):
    """The snapshot has the strands at rest for "stretch", the moved head's collider for "depth"."""
    hair, head, session = preview
    hair.hairloom.debug_view = "stretch"
    assert drawing(session).snapshot.rest is session.rig.strands.points
    hair.hairloom.debug_view = "depth"
    session.play(get_depsgraph())
    head.location.x += 0.5
    bpy.context.view_layer.update()
    (solid,) = drawing(session).snapshot.solids
    np.testing.assert_allclose(solid.matrix_now, np.array(head.matrix_world), atol=1e-6)
    hair.hairloom.debug_view = "none"
    plain = drawing(session).snapshot
    assert plain.rest is None and plain.solids == ()
