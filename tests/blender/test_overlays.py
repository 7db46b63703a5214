"""Overlay lines in the viewport lie on the things that they represent."""

import threading

import bpy
import numpy as np
import pytest
from waiting import wait_until

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.colliders import fields
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.properties.groups import OVERLAYS
from hairloom.addon.blender.viewport import motion_lines, overlay
from hairloom.addon.blender.viewport.debug_lines import shape_lines
from hairloom.addon.blender.viewport.overlay_text import graph_lines
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)

pytestmark = pytest.mark.draws(light=False)


@pytest.fixture
def preview(new_hair, sphere, get_depsgraph):
    """Hair on a head, previewed: (hair, head, session)."""
    hair = new_hair(sphere)
    hair.hairloom.dynamics.collider_resolution = 16
    return hair, sphere, previews.start(hair, get_depsgraph())


def overlays(session):
    return overlay.drawing_of(session.uid).lines


def lines_of(hair, session, kind):
    hair.hairloom.shown_overlays = {kind}
    (lines,) = overlays(session)
    assert lines.points.dtype == np.float32 and len(lines.points) % 2 == 0
    return lines.points


def test_lines_of_a_collider_that_is_being_made_come_when_it_is_there(preview, monkeypatch):
    hair, _, session = preview
    is_made = threading.Event()
    make = DistanceField.from_surface

    def late(*arguments, **settings):
        assert is_made.wait(30.0)
        return make(*arguments, **settings)

    fields.forget()
    monkeypatch.setattr(DistanceField, "from_surface", late)
    hair.hairloom.shown_overlays = {"colliders"}
    assert overlays(session) == () and latest_job.run_steps() == latest_job.POLL_INTERVAL
    is_made.set()
    wait_until(fields.are_ready)
    assert latest_job.run_steps() is None
    assert len(overlays(session)) == 1


@pytest.mark.parametrize(
    "collider",
    [
        SphereCollider(np.array([0.1, 0.2, 0.3]), 0.5),
        CapsuleCollider(np.array([0.0, 0.0, -1.0]), np.array([0.3, 0.1, 1.0]), 0.4),
        CapsuleCollider(np.zeros(3), np.zeros(3), 0.4),
        SphereSetCollider(np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), np.array([0.5, 0.2])),
    ],
    ids=["ball", "capsule", "capsule without length", "balls"],
)
def test_the_lines_of_a_shape_lie_on_its_surface(collider):
    points = shape_lines(collider).astype(np.float32)
    distance, _ = collider.distance(np.ascontiguousarray(points.T))
    assert len(points) >= 96 and np.abs(distance).max() < 1e-5


def test_overlays_are_off_by_default(preview):
    hair, _, session = preview
    assert overlays(session) == ()
    hair.hairloom.shown_overlays = {kind for kind, _, _ in OVERLAYS}
    hair.hairloom.shown_overlays = set()
    assert overlays(session) == ()


def test_the_box_of_a_field_is_around_its_mesh_and_follows_it(preview, get_depsgraph):
    hair, head, session = preview
    previews.play(get_depsgraph())
    for x in (0.0, 0.3):
        head.location.x = x
        bpy.context.view_layer.update()
        previews.advance(get_depsgraph(), 0.04)
        points = lines_of(hair, session, "colliders")
        assert len(points) == 24
        middle, size = (points.min(axis=0) + points.max(axis=0)) / 2.0, np.ptp(points, axis=0)
        assert middle == pytest.approx([x, 0.0, 0.0], abs=0.01)
        assert size == pytest.approx([0.2] * 3, abs=0.03)


def test_the_arrow_points_where_the_wind_blows_and_is_as_long_as_it_is_strong(preview):
    hair, _, session = preview
    hair.hairloom.shown_overlays = {"wind"}
    assert overlays(session) == (), "still air"
    lengths = []
    for speed in (5.0, 10.0):
        hair.hairloom.dynamics.wind_speed = speed
        hair.hairloom.dynamics.wind_direction = np.pi / 2.0
        tail, tip = lines_of(hair, session, "wind")[:2]
        lengths.append(np.linalg.norm(tip - tail))
        assert (tip - tail) / lengths[-1] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert lengths[1] == pytest.approx(2.0 * lengths[0])
    hair.hairloom.dynamics.wind_speed = 0.0
    field = bpy.data.objects.new("Wind", None)
    bpy.context.collection.objects.link(field)
    with bpy.context.temp_override(object=field, active_object=field):
        bpy.ops.object.forcefield_toggle()
    field.field.type, field.field.strength = "WIND", 10.0
    bpy.context.view_layer.update()
    tails, tips = lines_of(hair, session, "wind").reshape(-1, 2, 3).transpose(1, 0, 2)
    assert len(np.unique(tails, axis=0)) > 10, "force fields are shown where they act"
    expected = np.tile([0.0, 0.0, lengths[1]], (len(tails), 1))
    np.testing.assert_allclose(tips - tails, expected, rtol=1e-5, atol=1e-6)


def test_each_light_has_a_line_towards_it(preview):
    hair, _, session = preview
    for kind, place in (("POINT", (0.0, 0.0, 5.0)), ("SUN", (3.0, 0.0, 0.0))):
        light = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        light.location = place
        bpy.context.collection.objects.link(light)
    bpy.context.view_layer.update()
    points = lines_of(hair, session, "lights")
    ways = np.diff(points.reshape(2, -1, 3)[:, :2], axis=1)[:, 0]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    assert sorted(ways[:, 2]) == pytest.approx([1.0, 1.0], abs=1e-3), "a sun shines down"


def played(preview, get_depsgraph, kind):
    """Hair that plays with an overlay: (session, lines of the overlay)."""
    hair, _, session = preview
    previews.play(get_depsgraph())
    hair.hairloom.shown_overlays = {kind}
    return session, overlays(session)


def test_stretch_shows_each_segment_of_the_guides_once_and_none_at_rest_as_stretched(
    preview, get_depsgraph
):
    session, found = played(preview, get_depsgraph, "stretch")
    guides = session.solver.guides()
    (lines,) = found
    assert lines.color == motion_lines.STRETCH_COLORS[0][1]
    np.testing.assert_array_equal(lines.points[::2], guides[:, :-1].reshape(-1, 3))
    longer = guides.copy()
    longer[3, -1] = guides[3, -2] + 1.1 * (guides[3, -1] - guides[3, -2])
    session.solver.show_baked(session.solver.pose, longer)
    worst = dict(motion_lines.stretch_lines(session))[motion_lines.STRETCH_COLORS[2][1]]
    np.testing.assert_allclose(worst, longer[3, -2:], atol=1e-6)


def test_contacts_show_touching_points_and_depths_of_others(preview, get_depsgraph, monkeypatch):
    """A ball around a tip."""
    session, _ = played(preview, get_depsgraph, "contacts")
    tip = session.solver.guides()[0, -1]
    center = (tip + [0.004, 0.0, 0.0]).astype(np.float32)
    ball = PosedCollider(SphereCollider(center, 0.01), np.eye(4), np.eye(4))
    monkeypatch.setattr(session, "_posed_colliders", (ball,))
    inside = dict(motion_lines.contact_lines(session))[motion_lines.INSIDE_COLOR].reshape(-1, 2, 3)
    assert (np.abs(inside[:, 0] - tip).max(axis=1) < 1e-6).any()
    away = np.linalg.norm(inside - center, axis=2)
    assert away[:, 0].max() < 0.01
    np.testing.assert_allclose(away[:, 1], 0.01, rtol=1e-3)


def test_density_shows_the_cells_that_two_slices_cut(preview, get_depsgraph):
    session, found = played(preview, get_depsgraph, "density")
    guides = session.solver.guides()
    cell = session.solver.motion.dynamics.rest.hair_grid.cell
    squares = np.concatenate([lines.points.reshape(-1, 8, 3) for lines in found])
    flat = np.ptp(squares, axis=1)
    assert (flat.min(axis=1) < 1e-5).all(), "each lies in a plane"
    np.testing.assert_allclose(np.sort(flat, axis=1)[:, 1:], 0.88 * cell, rtol=1e-3)
    middle = guides[:, 0].mean(axis=0)
    points = guides.reshape(-1, 3) - middle + motion_lines.GRID_OFFSET * cell
    cells = np.unique(np.floor(points / cell), axis=0)
    cut = sum((cells[:, axis] == 0.0).sum() for axis in (0, 1))
    assert len(squares) == cut > 10


def test_the_graph_of_milliseconds_goes_from_edge_to_edge_and_up_by_its_values():
    corner, extent = np.array([10.0, 20.0]), np.array([100.0, 40.0])
    lines = graph_lines([0.0, 25.0, 50.0], 50.0, corner, extent)
    np.testing.assert_allclose(lines, [[10, 20], [60, 40], [60, 40], [110, 60]])
    assert len(graph_lines([1.0], 50.0, corner, extent)) == 0


def test_a_field_without_an_inside_has_no_lines():
    """As of a mesh that is thinner than a cell."""
    field = DistanceField(np.ones((3, 3, 3), np.float32), np.zeros(3), 0.1)
    assert shape_lines(field).shape == (0, 3)
