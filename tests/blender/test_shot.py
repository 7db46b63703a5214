"""Moving hair in shots: cuts without a whip, hair that already moves at the start, slow motion."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from swinging import key_x
from tiers import few_in_commits

from hairloom.addon import motion_flow
from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.bakes.stale_bakes import changed_inputs
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake

pytestmark = pytest.mark.draws(light=False)
SOFT = {"style_root": 1.0, "style_tip": 0.2, "sag_compensation": 0.0}


@pytest.fixture(params=few_in_commits(["numpy", "compute"]))
def playing(request, gpu_context, new_hair, sphere, get_depsgraph):
    """Soft hair that plays on a head: (settings, head, session)."""
    hair = new_hair(sphere)
    settings = hair.hairloom.dynamics
    for name, value in SOFT.items():
        setattr(settings, name, value)
    settings.device = request.param
    session = previews.start(hair, get_depsgraph())
    assert previews.play(get_depsgraph()) == []
    assert session.solver.device == request.param
    return settings, sphere, session


def advance(get_depsgraph, frames=1, each=lambda frame: None):
    for frame in range(frames):
        each(frame)
        bpy.context.view_layer.update()
        previews.advance(get_depsgraph(), 1.0 / 24.0)


def on_head(session, head):
    """Guides in the head's local space."""
    inverse = np.array(head.matrix_world.inverted())
    return session.solver.guides() @ inverse[:3, :3].T + inverse[:3, 3]


def speed(session):
    dynamics = session.solver.motion.dynamics
    return float(np.abs(dynamics.position - dynamics.previous).max()) / dynamics.substep


def cut(head):
    head.matrix_world = Matrix.Translation((4.0, -3.0, 1.0)) @ Matrix.Rotation(2.5, 4, "Y")


@pytest.mark.parametrize("playing", ["numpy", "compute"], indirect=True)
def test_hair_goes_along_at_a_cut_and_has_no_speed_after_it(playing, get_depsgraph):
    _, head, session = playing
    advance(get_depsgraph, 6, lambda frame: setattr(head.location, "x", 0.02 * frame))
    assert speed(session) > 0.05
    before = on_head(session, head)
    cut(head)
    advance(get_depsgraph)
    np.testing.assert_allclose(on_head(session, head), before, atol=2e-6)
    assert speed(session) == 0.0
    advance(get_depsgraph, 3)
    assert 0.0 < speed(session) < 2.0, "it falls on, and does not whip"


def test_hair_whips_at_a_cut_without_cut_detection(playing, get_depsgraph):
    settings, head, session = playing
    settings.jump_distance = settings.jump_turn = 0.0
    advance(get_depsgraph, 2)
    cut(head)
    advance(get_depsgraph)
    assert speed(session) > 10.0


@pytest.mark.parametrize("limit", ["jump_distance", "jump_turn"])
def test_distance_and_angle_limits_each_detect_a_jump(playing, get_depsgraph, limit):
    settings, head, session = playing
    setattr(settings, {"jump_distance": "jump_turn", "jump_turn": "jump_distance"}[limit], 0.0)
    advance(get_depsgraph, 2)
    if limit == "jump_distance":
        head.location.y = 5.0
    else:
        head.rotation_euler.z = 2.5
    before = on_head(session, head)
    advance(get_depsgraph)
    assert speed(session) == 0.0
    np.testing.assert_allclose(on_head(session, head)[:, 0], before[:, 0], atol=5e-6)


def test_a_fast_car_is_no_jump(playing, get_depsgraph):
    """A constant 5 m per frame: only the first frame could count as a jump."""
    _, head, session = playing
    advance(get_depsgraph, 2, lambda frame: setattr(head.location, "x", 5.0 * (frame + 1)))
    advance(get_depsgraph, 1, lambda frame: setattr(head.location, "x", 15.0))
    assert speed(session) > 50.0


def test_frozen_hair_goes_along_and_then_goes_on(playing, get_depsgraph):
    settings, head, session = playing
    advance(get_depsgraph, 6, lambda frame: setattr(head.location, "x", 0.02 * frame))
    before, fast = on_head(session, head), speed(session)
    settings.time_scale = 0.0
    session.take_settings()

    def turn(frame):
        head.rotation_euler.y = 0.2 * frame

    advance(get_depsgraph, 4, turn)
    np.testing.assert_allclose(on_head(session, head), before, atol=5e-6)
    assert speed(session) == pytest.approx(fast, rel=0.2)
    settings.time_scale = 1.0
    session.take_settings()
    advance(get_depsgraph)
    assert np.abs(on_head(session, head) - before).max() > 1e-3


@pytest.mark.parametrize("is_cut", [True, False])
def test_hair_goes_along_as_far_as_it_is_simulated(playing, get_depsgraph, is_cut):
    """At a cut and when frozen, unselected or unsimulated hair is exactly in its style."""
    settings, head, session = playing
    chosen = np.arange(0, len(session.hair.resolve().data.curves), 2)
    select(session.hair.resolve(), "CURVE", chosen)
    settings.only_selected = True
    session.read_again(get_depsgraph())
    session.play(get_depsgraph())
    advance(get_depsgraph, 3, lambda frame: setattr(head.location, "x", 0.05 * frame**2))
    settings.time_scale = 1.0 if is_cut else 0.0
    for simulated, is_seen in ((1.0, np.isin(session.rig.guides, chosen)), (0.0, False)):
        settings.influence = simulated
        session.take_settings()
        advance(get_depsgraph, 1, lambda frame: cut(head))
        style = motion_flow.style_of_guides(session.rig, session.solver.pose)
        away = np.abs(session.solver.guides() - style).max(axis=(1, 2))
        np.testing.assert_array_equal(away > 0.003, is_seen)
        assert (away[~(away > 0.003)] == 0.0).all()
        head.matrix_world = Matrix.Translation((9.0, 0.0, 0.0))
        advance(get_depsgraph)


def test_the_end_of_slow_motion_is_no_cut(playing, get_depsgraph):
    """The head moves at a constant rate of scene time, so do the roots in the last frame."""
    settings, head, session = playing

    def driven(frame):
        settings.time_scale = 0.1 if frame < 4 else 1.0
        session.take_settings()
        head.location.x = 5.0 * (frame + 1)

    advance(get_depsgraph, 5, driven)
    dynamics = session.solver.motion.dynamics
    moved = (dynamics.position - dynamics.previous)[0, 0] / dynamics.substep
    np.testing.assert_allclose(moved, 5.0 * 24.0, rtol=1e-3)


def test_at_half_the_speed_two_frames_are_one(playing, get_depsgraph):
    settings, head, session = playing
    advance(get_depsgraph, 4)
    once = on_head(session, head)
    previews.rest(get_depsgraph(), keep_playing=True)
    settings.time_scale = 0.5
    session.take_settings()
    advance(get_depsgraph, 4)
    assert np.abs(on_head(session, head) - once).max() > 1e-3
    advance(get_depsgraph, 4)
    np.testing.assert_allclose(on_head(session, head), once, atol=2e-5)


def test_pre_roll_is_what_frames_at_the_start_would_be(playing, get_depsgraph):
    settings, head, session = playing
    advance(get_depsgraph, 5)
    expected = on_head(session, head)
    settings.pre_roll = 5
    session.take_settings()
    previews.rest(get_depsgraph(), keep_playing=True)
    np.testing.assert_allclose(on_head(session, head), expected, atol=1e-6)
    previews.rest(get_depsgraph(), keep_playing=False)
    assert np.abs(on_head(session, head) - expected).max() > 1e-3, "at rest there is none"


def test_a_bake_applies_all_shot_settings(new_hair, sphere, tmp_path):
    """Pre-roll, a cut in frame 4, and hair that is frozen by keyframes from frame 6 on."""
    hair = new_hair(sphere)
    scene, settings = bpy.context.scene, hair.hairloom.dynamics
    scene.frame_start, scene.frame_end = 1, 8
    for name, value in SOFT.items():
        setattr(settings, name, value)
    settings.device, settings.pre_roll = "numpy", 6
    key_x(sphere, {3: 0.0, 4: 6.0})
    for frame, scale in ((5, 1.0), (6, 0.0)):
        settings.time_scale = scale
        hair.keyframe_insert("hairloom.dynamics.time_scale", frame=frame)
    assert command_line.run(["bake", "--output", str(tmp_path / "bake")]) == 0
    bake = Cache(tmp_path / "bake")
    frames = [bake.frame(frame)["guides"] for frame in range(1, 9)]
    fallen = (frames[0][:, -1] - frames[0][:, 0])[:, 2].mean()
    settings.pre_roll = 0
    assert command_line.run(["bake", "--output", str(tmp_path / "without")]) == 0
    combed = Cache(tmp_path / "without").frame(1)["guides"]
    assert fallen < (combed[:, -1] - combed[:, 0])[:, 2].mean() - 1e-3, "it falls before the start"
    assert np.abs(frames[3] - frames[2] - [6.0, 0.0, 0.0]).max() < 1e-5
    assert np.abs(frames[4] - frames[3]).max() > 1e-5
    for later in frames[6:]:
        np.testing.assert_allclose(later, frames[5], atol=1e-6)


def test_hair_that_inherits_all_motion_stays_in_its_style(playing, get_depsgraph):
    settings, head, session = playing
    settings.inherit_location = settings.inherit_rotation = 1.0
    settings.gravity, settings.jump_turn = 0.0, 0.0
    before = on_head(session, head)

    def thrown(frame):
        head.matrix_world = Matrix.Translation((0.1 * frame**2, 0.0, 0.0)) @ Matrix.Rotation(
            0.3 * frame**2, 4, "Y"
        )

    advance(get_depsgraph, 4, thrown)
    np.testing.assert_allclose(on_head(session, head), before, atol=1e-4)


def test_hair_without_inherited_motion_lags(playing, get_depsgraph):
    _, head, session = playing
    before = on_head(session, head)
    advance(get_depsgraph, 4, lambda frame: setattr(head.location, "x", 0.1 * frame**2))
    assert np.abs(on_head(session, head) - before).max() > 0.01


def select(hair, domain, chosen):
    """Select curves by index, as Sculpt Mode or Edit Mode of curves stores it."""
    curves = hair.data
    attribute = curves.attributes.get(".selection")
    if attribute is None:
        attribute = curves.attributes.new(".selection", "BOOLEAN", domain)
    values = np.isin(np.arange(len(curves.curves)), chosen)
    if domain == "POINT":  # only one of a curve's points
        firsts = np.array([curve.first_point_index for curve in curves.curves])
        values = np.isin(np.arange(len(curves.points)), firsts[values])
    attribute.data.foreach_set("value", values)


@pytest.mark.parametrize("domain", ["CURVE", "POINT"])
def test_only_selected_curves_are_simulated(playing, get_depsgraph, domain):
    """Unselected guides are exactly in their style."""
    settings, head, session = playing
    hair = session.hair.resolve()
    chosen = np.arange(0, len(hair.data.curves), 2)
    select(hair, domain, chosen)
    settings.only_selected = True
    session.read_again(get_depsgraph())
    session.play(get_depsgraph())
    advance(get_depsgraph, 4, lambda frame: setattr(head.location, "x", 0.05 * frame**2))
    rig = session.rig
    style = motion_flow.style_of_guides(rig, session.solver.pose)
    away = np.abs(session.solver.guides() - style).max(axis=(1, 2))
    is_chosen = np.isin(rig.guides, chosen)
    assert is_chosen.any() and not is_chosen.all()
    assert (away[is_chosen] > 0.003).all()
    assert (away[~is_chosen] == 0.0).all()


def test_keyframes_turn_only_selected_on_and_off(new_hair, sphere, tmp_path, get_depsgraph):
    """All curves are simulated in frames 1, 2 and 4, only selected ones in frame 3. No frame of the
    bake is stale until the selection changes; then only frame 3 is."""
    hair, scene = new_hair(sphere), bpy.context.scene
    for name, value in SOFT.items():
        setattr(hair.hairloom.dynamics, name, value)
    hair.hairloom.bake.folder, scene.frame_end = str(tmp_path / "bake"), 4
    chosen = np.arange(0, len(hair.data.curves), 2)
    select(hair, "CURVE", chosen)
    for frame in (1, 2, 3, 4):
        hair.hairloom.dynamics.only_selected = frame == 3
        hair.keyframe_insert("hairloom.dynamics.only_selected", frame=frame)
        sphere.location.x = 0.05 * frame**2
        sphere.keyframe_insert("location", frame=frame)
    list(Bake.of([hair], scene).steps())
    cache = playback.cache_of(hair)
    rig = playback.rig_in(cache)
    for frame in (2, 3, 4):
        scene.frame_set(frame)
        assert changed_inputs(hair, cache, get_depsgraph()) == ()
        arrays = cache.frame(frame)
        style = motion_flow.style_of_guides(rig.rig, rig.pose(arrays))
        is_away = (arrays["guides"] != style).any(axis=(1, 2))
        np.testing.assert_array_equal(is_away, np.isin(rig.rig.guides, chosen) | (frame != 3))
    select(hair, "CURVE", chosen[:4])
    assert changed_inputs(hair, cache, get_depsgraph()) == ()
    scene.frame_set(3)
    assert changed_inputs(hair, cache, get_depsgraph()) == ("selection",)


def test_without_a_selection_attribute_all_hair_is_simulated(playing, get_depsgraph):
    settings, head, session = playing
    settings.only_selected = True
    session.read_again(get_depsgraph())
    session.play(get_depsgraph())
    advance(get_depsgraph, 3, lambda frame: setattr(head.location, "x", 0.05 * frame**2))
    style = motion_flow.style_of_guides(session.rig, session.solver.pose)
    assert (np.abs(session.solver.guides() - style).max(axis=(1, 2)) > 0.0).all()
    assert session.warnings == ()


def test_a_selection_of_nothing_is_named(playing, get_depsgraph):
    settings, head, session = playing
    select(session.hair.resolve(), "CURVE", [])
    settings.only_selected = True
    session.read_again(get_depsgraph())
    session.play(get_depsgraph())
    advance(get_depsgraph, 3, lambda frame: setattr(head.location, "x", 0.05 * frame**2))
    style = motion_flow.style_of_guides(session.rig, session.solver.pose)
    np.testing.assert_array_equal(session.solver.guides(), style)
    assert "none of its curves is selected" in session.warnings[0]


def test_frozen_hair_that_inherits_goes_on_without_a_whip(playing, get_depsgraph):
    """The head moves and turns on while time stands still."""
    settings, head, session = playing
    settings.inherit_location = settings.inherit_rotation = 1.0
    settings.gravity, settings.jump_turn, settings.jump_distance = 0.0, 0.0, 0.0
    before = on_head(session, head)

    def moving(frame):
        settings.time_scale = 0.0 if 4 <= frame < 8 else 1.0
        turn = Matrix.Rotation(0.25 * frame, 4, "Y")
        head.matrix_world = turn @ Matrix.Translation((0.5, 0.0, 0.1 * frame))

    advance(get_depsgraph, 1, moving)
    advance(get_depsgraph, 12, moving)
    np.testing.assert_allclose(on_head(session, head), before, atol=1e-3)
