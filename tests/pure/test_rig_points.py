"""`rig_flow.prepare`: what is said of strands that need more points than there are."""

import numpy as np

from hairloom.addon import rig_flow
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet


def notes_of(turns: float) -> tuple[str, ...]:
    """Of three coils of 4,000 points, 25 cm long and 8 mm around."""
    along = np.linspace(0.0, 1.0, 4000)
    angle = 2.0 * np.pi * turns * along
    coil = np.stack([0.008 * np.cos(angle), 0.008 * np.sin(angle), -0.25 * along], axis=1)
    points = (coil[None] + np.array([0.0, 0.1, 0.2])[:, None, None]).reshape(-1, 3)
    strands = StrandSet(points, np.arange(4) * 4000, np.full(12_000, 1e-4), np.zeros(3))
    return rig_flow.prepare(strands, None, GuideSettings(guide_count=3), place="coils").notes


def test_too_many_turns_are_counted_with_what_they_lose() -> None:
    assert notes_of(20.0) == ()
    (note,) = notes_of(100.0)
    assert note.startswith("3 strands need more than 512 points")
    # an even polygon of five segments a turn is by 6.5 % shorter than the circle
    lost = float(note.split("up to ")[1].split(" %")[0])
    assert abs(lost - 100.0 * (1.0 - np.sinc(100.0 / 511.0))) < 0.2
