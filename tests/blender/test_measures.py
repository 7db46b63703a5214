"""Times and memory, as panel and viewport report them."""

from dataclasses import dataclass

import numpy as np
import pytest

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.sessions import measures


def test_the_median_of_the_last_frames_is_told(monkeypatch):
    now, times = [0.0], measures.FrameTimes()
    monkeypatch.setattr(measures.time, "perf_counter", lambda: now[0])
    for spent in (0.004, 0.004, 0.9):  # one slow frame is none of them
        with times.measured("simulation"):
            now[0] += spent
    assert times.milliseconds("simulation") == pytest.approx(4.0)
    assert times.line == "simulation 4.0 ms"
    assert measures.FrameTimes().line == ""
    now[0] += 100.0
    assert times.line == "", "what was long ago is no news"


def test_an_array_counts_once_and_a_view_is_its_array():
    @dataclass
    class Held:
        one: np.ndarray
        more: tuple
        text: str = "x"

    array = np.zeros(1000, np.float32)
    held = Held(array, (array[:10], {"a": np.zeros(10, np.uint8), "b": [array]}))
    assert measures.array_bytes(held, held) == 4010


def test_a_session_measures_itself(new_hair, sphere, evaluated):
    session = previews.start(new_hair(sphere), evaluated())
    session.play(evaluated())
    session.advance(evaluated(), 1.0 / 24.0)
    assert session.times.milliseconds("simulation") > 0.0
    assert measures.array_bytes(session.rig) >= session.rig.strands.points.nbytes
