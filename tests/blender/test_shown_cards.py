"""Hair shown as cards: in the overlay, while it moves, and in renders."""

from __future__ import annotations

import numpy as np
import pytest
from waiting import run_steps_until

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.base import latest_job  # noqa: E402
from hairloom.addon.blender.engine.engine_hair import read_groom  # noqa: E402
from hairloom.addon.blender.preview import previews, scene_events  # noqa: E402
from hairloom.addon.blender.viewport import overlay  # noqa: E402

pytestmark = pytest.mark.draws(light=False)


@pytest.fixture
def preview(new_hair, sphere, get_depsgraph):
    """Hair on the sphere, shown as cards."""
    hair = new_hair(sphere)
    hair.data.hairloom.cards.source = "guides"
    hair.data.hairloom.card_occlusion.rays = 4
    hair.data.hairloom.cards.order_by = "distance"
    hair.data.hairloom.atlas.size = "256"
    hair.data.hairloom.card_drawing.shown_as = "cards"
    session = previews.start(hair, get_depsgraph())
    yield hair, sphere, session
    previews.stop_all()


@pytest.fixture
def in_window(preview, monkeypatch):
    """The preview, with cards that are built in a thread as in a window."""
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    return preview


def drawn(session):
    return overlay.drawing_of(session.uid).snapshot


def served(session):
    """The displayed cards once all pending builds have arrived."""
    run_steps_until(lambda: not session.cards.is_pending)
    return drawn(session).cards


def test_cards_are_drawn_instead_of_strands(preview):
    hair, _, session = preview
    snapshot = drawn(session)
    assert snapshot.strand_count == 0 and snapshot.cards.mesh.card_count > 0
    assert overlay.drawing_of(session.uid).card_counts[0] == snapshot.cards.mesh.card_count
    hair.data.hairloom.card_drawing.shown_as = "strands"
    snapshot = drawn(session)
    assert snapshot.strand_count == 60 and snapshot.cards is None
    assert overlay.drawing_of(session.uid).card_counts == ()


def test_settings_of_cards_act(preview):
    hair, _, session = preview
    before = drawn(session).cards
    hair.data.hairloom.cards.segment_count = 5
    now = drawn(session).cards
    assert len(now.mesh.triangles) != len(before.mesh.triangles)
    hair.data.hairloom.card_drawing.passes = "three"
    assert drawn(session).cards.drawing.passes == "three"
    assert drawn(session).cards.mesh.triangles is now.mesh.triangles, "nothing is built for that"
    hair.data.hairloom.shading.base_color = (1.0, 0.5, 0.25)
    assert drawn(session).cards.mesh.triangles is now.mesh.triangles


def test_colourings_are_seen_on_strands(preview):
    hair, _, session = preview
    hair.hairloom.debug_view = "guide"
    assert drawn(session).strand_count == 60 and drawn(session).cards is None


def test_cards_go_with_the_head(preview, get_depsgraph):
    _, head, session = preview
    before = drawn(session).cards.mesh
    head.location.x = 0.5
    head.rotation_euler.z = 1.0
    bpy.context.view_layer.update()
    scene_events.updated(get_depsgraph())
    after = drawn(session).cards.mesh
    turn = np.array(head.matrix_world)
    expected = before.positions @ turn[:3, :3].T + turn[:3, 3]
    np.testing.assert_allclose(after.positions, expected, atol=2e-6)
    np.testing.assert_allclose(after.normal, before.normal @ turn[:3, :3].T, atol=1e-3)


def test_cards_swing_with_their_guides(preview, get_depsgraph):
    _, head, session = preview
    session.play(get_depsgraph())
    before = drawn(session).cards
    head.location.x = 0.1
    bpy.context.view_layer.update()
    for _ in range(5):
        session.advance(get_depsgraph(), 0.04)
        previews.publish(previews.previews[session.uid], get_depsgraph())
    after = drawn(session).cards
    assert after.mesh.triangles is before.mesh.triangles
    moved = after.mesh.positions - before.mesh.positions
    roots, tips = moved[after.mesh.along < 0.01], moved[after.mesh.along > 0.99]
    assert roots[:, 0] == pytest.approx(0.1, abs=0.01)
    assert np.abs(tips[:, 0] - 0.1).max() > 0.002, "tips lag behind or fall"
    assert np.isfinite(after.mesh.positions).all()


def test_undo_brings_strands_back(preview, get_depsgraph):
    hair, _, session = preview
    hair.data.hairloom.card_drawing.shown_as = "strands"
    hair.data.hairloom.card_drawing.shown_as = "cards"
    scene_events.undone()
    scene_events.catch_up(get_depsgraph())
    assert drawn(session).cards is not None


def test_a_render_shows_the_same_cards(preview, get_depsgraph):
    hair, _, session = preview
    shown = read_groom(hair, get_depsgraph())
    assert shown.strand_count == 0
    np.testing.assert_allclose(
        shown.cards.mesh.positions, drawn(session).cards.mesh.positions, atol=1e-6
    )
    again = read_groom(hair, get_depsgraph())
    assert again.cards.mesh.triangles is shown.cards.mesh.triangles, "nothing is built again"
    hair.data.hairloom.card_drawing.shown_as = "strands"
    assert read_groom(hair, get_depsgraph()).strand_count == 60


def test_in_a_window_old_cards_stay_until_others_are_built(in_window):
    hair, _, session = in_window
    before = drawn(session).cards.mesh
    for count in (4, 6, 7):  # a slider is dragged
        hair.data.hairloom.cards.segment_count = count
        assert len(drawn(session).cards.mesh.triangles) == len(before.triangles)
    mesh = served(session).mesh
    assert len(mesh.triangles) == len(before.triangles) * 7 // 12


def test_in_a_window_textures_are_on_the_gpu_before_cards_are_shown(in_window, gpu_context):
    hair, _, session = in_window
    assert drawn(session).cards.device is None, "in the background each draw has its own"
    hair.data.hairloom.cards.segment_count = 5
    cards = served(session)
    before = cards.device.texture("alpha")
    cards.device.upload(cards)
    assert cards.device.texture("alpha") is before, "the draw uploads them again"
    assert (before.height, before.width) > cards.textures.alpha.shape, "it holds the mip maps too"


def test_strands_again_give_up_what_is_being_built(in_window):
    hair, _, session = in_window
    hair.data.hairloom.cards.segment_count = 5
    assert session.cards.is_pending
    hair.data.hairloom.card_drawing.shown_as = "strands"
    assert not session.cards.is_pending and drawn(session).cards is None
    assert latest_job.run_steps() is None, "it is waited for"


def test_cards_throw_the_shadow_of_their_strands(preview):
    hair, _, session = preview
    before = drawn(session).cards.thickness
    assert before > 0.0 and before != 1.0
    hair.data.hairloom.strands.fullness *= 2.0
    assert drawn(session).cards.thickness == pytest.approx(2.0 * before, rel=1e-3)


def test_cards_that_cannot_be_made_leave_strands_and_say_why(preview):
    hair, _, session = preview
    groom = hair.data.hairloom
    groom.atlas.size, groom.atlas.columns, groom.atlas.rows = "512", 256, 256
    groom.cards.card_count = 60
    groom.cards.source = "clusters"
    assert drawn(session).cards is None and drawn(session).strand_count == 60
    (warning,) = session.cards.warnings
    assert "no cards" in warning and "atlas" in warning.lower()


#: of building cards with two coarser levels, in order
STAGES = (
    "Other hair",
    "Cards from strands",
    "Levels of detail",
    "Atlas",
    "Ambient occlusion",
    "Order of level 0",
    "Order of level 1",
    "Order of level 2",
    "Check of the order",
    "Textures",
)


def test_lines_say_what_is_built_and_what_is_shown(in_window):
    hair, _, session = in_window
    cards, triangles, vertices = session.cards.counts
    mesh = drawn(session).cards.mesh
    assert (cards, triangles, vertices) == (60, len(mesh.triangles), len(mesh.positions))
    assert session.cards.lines[0] == f"60 cards, {triangles:,} triangles"
    assert "% of pixels blend in the wrong order" in session.cards.lines[1]
    hair.data.hairloom.card_drawing.shown_as = "strands"
    assert session.cards.lines == () and session.cards.counts == (0, 0, 0)
    hair.data.hairloom.card_drawing.shown_as = "cards"
    assert session.cards.lines == () and session.cards.is_pending
    stages = []
    run_steps_until(lambda: stages.append(session.cards.stage) or not session.cards.is_pending)
    # a thread builds, and may finish a short stage before the next look
    shown = list(dict.fromkeys(each for each in stages if each))
    assert shown and shown == [each for each in STAGES if each in shown], stages
    assert session.cards.stage == "" and len(session.cards.lines) == 2


def test_cancel_shows_strands_in_place_of_cards_that_are_being_built(in_window):
    hair, _, session = in_window
    hair.select_set(True)
    assert not bpy.ops.hairloom.cancel_build.poll(), "nothing is being made"
    hair.data.hairloom.cards.segment_count += 1
    assert session.cards.is_pending and bpy.ops.hairloom.cancel_build() == {"FINISHED"}
    assert not session.cards.is_pending and not hair.data.hairloom.use_cards
    assert drawn(session).cards is None and drawn(session).strand_count == 60


@pytest.mark.slow(instead="test_in_a_window_old_cards_stay_until_others_are_built")
def test_cards_of_the_rig_before_stay_until_those_of_other_hair_are_built(in_window, get_depsgraph):
    """Old cards do not ride on new guides, but they are drawn with the current settings."""
    hair, _, session = in_window
    before = drawn(session).cards
    position = hair.data.attributes["position"]
    places = np.empty(len(hair.data.points) * 3, np.float32)
    position.data.foreach_get("vector", places)
    position.data.foreach_set("vector", places * 1.1)
    hair.data.update_tag()
    bpy.context.view_layer.update()
    scene_events.updated(get_depsgraph())
    scene_events.catch_up(get_depsgraph())
    run_steps_until(lambda: not session.is_pending)
    assert session.cards.is_pending
    assert np.array_equal(drawn(session).cards.mesh.positions, before.mesh.positions)
    before = drawn(session).cards
    hair.data.hairloom.card_drawing.passes = "three"
    hair.data.hairloom.strands.tip_width = 0.9
    assert drawn(session).cards.drawing.passes == "three"
    assert drawn(session).cards.mesh is before.mesh
    after = served(session).mesh
    np.testing.assert_allclose(
        np.ptp(after.positions, axis=0), 1.1 * np.ptp(before.mesh.positions, axis=0), rtol=0.01
    )


@pytest.mark.slow(instead="test_cards_that_cannot_be_made_leave_strands_and_say_why")
def test_cards_that_can_be_made_again_warn_of_nothing(preview):
    hair, _, session = preview
    groom = hair.data.hairloom
    groom.atlas.size, groom.atlas.columns, groom.atlas.rows = "512", 256, 256
    groom.cards.source = "clusters"
    assert session.cards.warnings
    groom.card_drawing.shown_as = "strands"
    assert session.cards.warnings == ()
    groom.card_drawing.shown_as = "cards"
    assert session.cards.warnings
    groom.cards.source = "guides"
    groom.atlas.source = "made"
    assert not any("no cards" in each for each in session.cards.warnings)
    assert drawn(session).cards is not None
