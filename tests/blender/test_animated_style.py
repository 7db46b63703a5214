"""Curves that nodes move are the style of each frame; unsimulated hair follows them exactly."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.bakes.playback import rig_in
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.strands.import_groom import import_strands, read_import_surface
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom, GroomMotion
from hairloom.addon.strands.strand_set import StrandSet

sys.path.append(str(Path(__file__).parents[2] / "bench"))
from _moving_curves import apart, lose_curves, move_by_nodes

pytestmark = pytest.mark.draws(light=False)
LAST = 8


@pytest.fixture(params=few_in_commits(["compute", "numpy"]))
def moving(request: Any, gpu_context: Any, new_hair: Any, sphere: Any, tmp_path: Any) -> Any:
    """Hair that nodes move, on a head that turns, with an animated style."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    hair = new_hair(sphere)
    move_by_nodes(hair)
    for frame, turn in ((1, 0.0), (LAST, 1.0)):
        sphere.rotation_euler.x = turn
        sphere.keyframe_insert("rotation_euler", frame=frame)
    dynamics = hair.hairloom.dynamics
    dynamics.device, dynamics.animated_style = request.param, True
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    return hair


def session_at_start(hair: Any, get_depsgraph: Any) -> Any:
    session = previews.start(hair, get_depsgraph())
    assert session.solver.device == hair.hairloom.dynamics.device
    hair.hairloom.bake.follows = True
    bpy.context.scene.frame_set(1)
    return session


def seen(hair: Any, get_depsgraph: Any) -> StrandSet:
    """The curves as Blender itself evaluates them."""
    return read_curves(hair, get_depsgraph()).strands


def test_at_0_hair_is_where_blender_shows_its_curves(moving: Any, get_depsgraph: Any) -> None:
    moving.hairloom.dynamics.influence = 0.0
    session = session_at_start(moving, get_depsgraph)
    first = seen(moving, get_depsgraph).points
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        now = seen(moving, get_depsgraph)
        assert apart(session.strands, session.rig.strands.offsets, now) < 2e-6, frame
    assert np.abs(now.points - first).max() > 0.05


def test_at_1_hair_lags_behind_its_style_and_has_the_lengths_of_that(
    moving: Any, get_depsgraph: Any
) -> None:
    session = session_at_start(moving, get_depsgraph)
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
    now, rig = seen(moving, get_depsgraph), session.rig
    assert 0.005 < apart(session.strands, rig.strands.offsets, now) < 0.1
    lengths = rig.strands.with_points(session.strands).lengths()
    np.testing.assert_allclose(lengths, now.lengths(), rtol=0.01)
    assert np.ptp(now.lengths()) > 0.01, "some strands have become longer"


def test_hair_painted_0_follows_the_style_and_other_hair_is_simulated(
    moving: Any, get_depsgraph: Any
) -> None:
    head = moving.data.surface
    group = head.vertex_groups.new(name="Loose")
    upper = [vertex.index for vertex in head.data.vertices if vertex.co.z > -0.02]
    group.add(upper, 1.0, "REPLACE")
    moving.hairloom.dynamics.influence_mask = "Loose"
    session = session_at_start(moving, get_depsgraph)
    is_upper = session.rig.strands.roots[session.rig.guides, 2]
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
    rig, now = session.rig, seen(moving, get_depsgraph)
    lines = now.take(rig.guides)
    away = [
        apart(guide, np.array([0, len(guide)]), lines.take(np.array([number])))
        for number, guide in enumerate(session.solver.guides())
    ]
    lower, upper = np.array(away)[is_upper < -0.06], np.array(away)[is_upper > 0.02]
    assert lower.max() < 2e-3 and upper.min() > 5e-3  # CVs lie on the chords between points


def test_a_bake_has_the_style_of_each_frame(moving: Any, get_depsgraph: Any) -> None:
    moving.hairloom.dynamics.influence = 0.3
    session = session_at_start(moving, get_depsgraph)
    played = []
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        played.append(session.strands.copy())
    for _ in Bake.of([moving], bpy.context.scene).steps():
        pass
    cache = Cache(Path(moving.hairloom.bake.folder))
    figures = cache.facts.figures
    assert figures is not None, "it was measured"
    assert figures.stretch_max_percent < 1.5 and figures.strands_stretch_max_percent < 1.5
    for frame, strands in enumerate(played, 1):
        np.testing.assert_allclose(rig_in(cache).strands(cache.frame(frame)), strands, atol=2e-6)
    bpy.context.scene.frame_set(5)
    np.testing.assert_allclose(session.strands, played[4], atol=2e-6)
    previews.stop(session)
    fresh = previews.start(moving, get_depsgraph())
    assert fresh.rig.strands.point_count == len(played[4])
    np.testing.assert_allclose(fresh.strands, played[4], atol=2e-6)


def test_the_last_style_that_fits_stays_when_curves_disappear_during_playback(
    moving: Any, get_depsgraph: Any
) -> None:
    lose_curves(moving, 5)
    session = session_at_start(moving, get_depsgraph)
    for frame in range(1, 5):
        bpy.context.scene.frame_set(frame)
    assert not any("Animated Style" in each for each in session.warnings)
    style, before = session.rig, session.strands.copy()
    bpy.context.scene.frame_set(5)
    assert session.rig is style and session.is_playing
    assert 0.0 < np.abs(session.strands - before).max() < 0.05, "it goes on"
    (warning,) = (each for each in session.warnings if "Animated Style" in each)
    assert "frame 5" in warning and "57 usable curves" in warning and "not 60" in warning


def test_an_animated_groom_is_imported_with_all_its_frames(
    moving: Any, get_depsgraph: Any, tmp_path: Path
) -> None:
    """An imported animated file gives each frame's points and is the animated style at once."""
    pytest.importorskip("alembic3d", reason="it is missing: `make setup` installs it")
    shown = []
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        shown.append(seen(moving, get_depsgraph).points)
    strands = seen(moving, get_depsgraph)
    rate, path = 24.0, tmp_path / "hair.abc"
    first = Groom(strands.with_points(shown[0]))
    write_groom_alembic(path, first, motion=GroomMotion(shown, rate))
    bpy.context.scene.frame_set(1)
    (hair,), outcome = import_strands(
        path, read_import_surface(moving.data.surface, get_depsgraph()), bpy.context.collection
    )
    assert "moving in 8 frames" in outcome.result and hair.hairloom.dynamics.animated_style
    hair.hairloom.dynamics.device = moving.hairloom.dynamics.device
    hair.hairloom.dynamics.influence = 0.0
    session = session_at_start(hair, get_depsgraph)
    for frame, points in enumerate(shown, 1):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(seen(hair, get_depsgraph).points, points, atol=1e-6)
        expected = strands.with_points(points)
        assert apart(session.strands, session.rig.strands.offsets, expected) < 2e-6


def test_numpy_and_compute_solver_agree_at_half_strength(moving: Any, get_depsgraph: Any) -> None:
    moving.hairloom.dynamics.influence = 0.5
    session, found = session_at_start(moving, get_depsgraph), []
    for form in ("numpy", "compute"):
        moving.hairloom.dynamics.device = form
        for frame in range(1, LAST + 1):
            bpy.context.scene.frame_set(frame)
        assert session.solver.device == form
        found.append(session.strands.copy())
    np.testing.assert_allclose(*found, atol=2e-4)


def test_the_verb_simulates_the_style_of_each_frame(moving: Any, tmp_path: Any) -> None:
    """The verb and a bake in the scene store equal arrays in each frame."""
    moving.hairloom.dynamics.influence = 0.3
    for _ in Bake.of([moving], bpy.context.scene).steps():
        pass
    baked, verb = Cache(Path(moving.hairloom.bake.folder)), tmp_path / "verb"
    asked = ["simulate", "--groom", "Hair", "--animated", "--output", str(verb)]
    assert command_line.run(asked) == 0
    found = Cache(verb)
    for frame in range(1, LAST + 1):
        expected, own = baked.frame(frame), found.frame(frame)
        assert own.keys() == expected.keys()
        for name, values in expected.items():
            np.testing.assert_array_equal(own[name], values, err_msg=f"{name} at {frame}")
