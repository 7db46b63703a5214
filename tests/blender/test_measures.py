"""Times and memory in the panel and the viewport."""

from dataclasses import dataclass

import bpy
import numpy as np
import pytest
from grids import strand_grid

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.sessions import measures


def test_the_median_of_the_last_frames_is_shown(monkeypatch):
    now, times = [0.0], measures.FrameTimes()
    monkeypatch.setattr(measures.time, "perf_counter", lambda: now[0])
    for spent in (0.004, 0.004, 0.9):  # the median ignores one slow frame
        with times.measured("simulation"):
            now[0] += spent
    assert times.milliseconds("simulation") == pytest.approx(4.0)
    assert times.text == "simulation 4.0 ms"
    assert measures.FrameTimes().text == ""
    now[0] += 100.0
    assert times.text == "", "what was long ago is no news"


def test_a_frame_of_many_seconds_has_both_its_parts(monkeypatch):
    now, times = [0.0], measures.FrameTimes()
    monkeypatch.setattr(measures.time, "perf_counter", lambda: now[0])
    for part, spent in (("simulation", 1.0), ("drawing", 12.0)):
        with times.measured(part):
            now[0] += spent
    assert times.text == "simulation 1000.0 ms   drawing 12000.0 ms"


def test_what_goes_on_is_of_the_same_frame(monkeypatch):
    now, times = [0.0], measures.FrameTimes()
    monkeypatch.setattr(measures.time, "perf_counter", lambda: now[0])
    for spent, goes_on in ((0.002, False), (0.003, True), (0.002, False), (0.003, True)):
        with times.measured("drawing", goes_on=goes_on):
            now[0] += spent
    assert times.history("drawing") == pytest.approx([5.0, 5.0])


def test_an_array_counts_once_and_a_view_is_its_array():
    @dataclass
    class Held:
        one: np.ndarray
        more: tuple
        text: str = "x"

    array = np.zeros(1000, np.float32)
    held = Held(array, (array[:10], {"a": np.zeros(10, np.uint8), "b": [array]}))
    assert measures.array_bytes(held, held) == 4010


def test_a_session_measures_itself(new_hair, sphere, get_depsgraph):
    session = previews.start(new_hair(sphere), get_depsgraph())
    session.play(get_depsgraph())
    session.advance(get_depsgraph(), 1.0 / 24.0)
    assert session.times.milliseconds("simulation") > 0.0
    assert measures.array_bytes(session.rig) >= session.rig.strands.points.nbytes


def test_figures_are_those_of_the_frame_that_is_shown(new_hair, sphere, get_depsgraph):
    """Figures equal those computed from the drawn strands and a spherical head."""
    hair = new_hair(sphere)
    sphere.hairloom.collider_shape = "sphere"
    session = previews.start(hair, get_depsgraph())
    previews.begin(session, get_depsgraph(), blocking=True)
    sphere.location.x += 0.05
    previews.advance(get_depsgraph(), 1.0 / 24.0)
    assert session.figures is None
    session.measure()
    found, points = session.figures, strand_grid(session)
    assert session.are_figures_current
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    assert found.strands_stretch_max_percent == pytest.approx(
        100.0 * np.abs(length / 0.08 - 1.0).max(), abs=1e-3
    )
    # roots on the sphere may count as inside or outside, so they are left out of the depth
    depth = 0.1 - np.linalg.norm(points[:, 1:] - [0.05, 0.0, 0.0], axis=2).min()
    assert found.strands_penetration_max_mm == pytest.approx(max(0.0, 1000.0 * depth), abs=0.1)
    previews.advance(get_depsgraph(), 1.0 / 24.0)
    assert session.figures is found and not session.are_figures_current, "of another moment"
    previews.rest(get_depsgraph(), keep_playing=True)
    assert session.figures is None


def test_measuring_needs_hair_that_is_simulated(new_hair, sphere, get_depsgraph):
    session = previews.start(new_hair(sphere), get_depsgraph())
    assert not bpy.ops.hairloom.measure.poll()
    session.play(get_depsgraph())
    assert bpy.ops.hairloom.measure() == {"FINISHED"}
    assert session.figures.strands_stretch_max_percent < 1e-3
