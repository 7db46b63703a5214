"""Times and memory, as panel and viewport tell them."""

from dataclasses import dataclass

import numpy as np
import pytest

from hairloom.addon.blender.preview import live
from hairloom.addon.blender.sessions import measures


@pytest.fixture(autouse=True)
def nothing_measured():
    measures._times.clear()


def test_the_median_of_the_last_frames_is_told(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(measures.time, "perf_counter", lambda: now[0])
    for spent in (0.004, 0.004, 0.9):  # one slow frame is none of them
        with measures.measured(7, "simulation"):
            now[0] += spent
    assert measures.milliseconds(7, "simulation") == pytest.approx(4.0)
    assert measures.frame_line(7) == "simulation 4.0 ms"
    assert measures.frame_line(8) == ""
    now[0] += 100.0
    assert measures.frame_line(7) == "", "what was long ago is no news"


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
    session = live.start(new_hair(sphere), evaluated())
    session.play(evaluated())
    session.advance(evaluated(), 1.0 / 24.0)
    assert measures.milliseconds(session.uid, "simulation") > 0.0
    assert measures.array_bytes(session.rig) >= session.rig.strands.points.nbytes
    live.stop(session)
    assert measures.milliseconds(session.uid, "simulation") is None
