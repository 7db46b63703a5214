"""`rig_flow.prepare`: strands with any number of points, and the note on those that need too
many."""

import numpy as np
import pytest

from hairloom.addon import motion_flow, rig_flow
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.groom.ties import Holders, Tie
from hairloom.addon.strands import StrandSet


def notes_of(turns: float) -> tuple[str, ...]:
    """The notes on three coils of 4,000 points, 25 cm long, with a radius of 8 mm."""
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
    # a regular polygon of five segments per turn is 6.5 % shorter than the circle
    lost = float(note.split("up to ")[1].split(" %")[0])
    assert abs(lost - 100.0 * (1.0 - np.sinc(100.0 / 511.0))) < 0.2


def straight(count: int, lengthening: float) -> StrandSet:
    """Eight strands that hang down, 25 cm long, each segment longer than the one before by this
    factor."""
    steps = lengthening ** np.arange(count - 1)
    place = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
    roots = np.arange(8)[:, None, None] * np.array([0.05, 0.0, 0.0])
    points = (roots + place[:, None] * np.array([0.0, 0.0, -0.25])).reshape(-1, 3)
    return StrandSet(points, np.arange(9) * count, np.full(8 * count, 4e-5), np.zeros(8))


def bent(guides: np.ndarray) -> np.ndarray:
    """Guides bent in the plane of x and z, more and more towards the tip; lengths stay."""
    step = np.linalg.norm(np.diff(guides, axis=1), axis=2, keepdims=True)
    angle = 1.5 * ((np.arange(step.shape[1]) + 0.5) / step.shape[1])[:, None] ** 2
    away = np.concatenate([np.sin(angle), 0.0 * angle, -np.cos(angle)], axis=1)
    moved = guides.copy()
    moved[:, 1:] = guides[:, :1] + np.cumsum(step * away, axis=1)
    return moved


@pytest.mark.parametrize("count", [15, 16, 17])
@pytest.mark.parametrize("lengthening", [1.0, 1.06, 1.3])
def test_strands_go_with_their_guides_whatever_their_spacing(
    count: int, lengthening: float
) -> None:
    """The tip of each guide's own strand stays at the guide's tip, also where strands have as many
    points as guides have CVs."""
    settings = GuideSettings(guide_count=8, cv_count=16)
    rig = rig_flow.prepare(straight(count, lengthening), None, settings, place="wig")
    step = np.linalg.norm(np.diff(rig.guide_grid, axis=1), axis=2)
    np.testing.assert_allclose(step, 0.25 / 15, rtol=1e-4)
    now = bent(rig.guide_grid)
    strands = motion_flow.strands_at(rig, rig.rest_pose, now)
    tips = strands[rig.strands.offsets[1:] - 1][rig.guides]
    assert np.linalg.norm(now[:, -1] - rig.guide_grid[:, -1], axis=1).min() > 0.1
    assert np.linalg.norm(tips - now[:, -1], axis=1).max() < 0.01 * 0.25


@pytest.mark.parametrize("count", [16, 17])
def test_guides_are_held_where_their_strands_are(count: int) -> None:
    """A ring 10 cm below the roots holds guides at 10 cm of their length, although the points of
    their strands are unevenly spaced."""
    shape = np.diag([0.3, 0.3, 0.3, 1.0])
    shape[:3, 3] = [0.175, 0.0, -0.1]
    rig = rig_flow.prepare(
        straight(count, 1.2),
        None,
        GuideSettings(guide_count=8, cv_count=16),
        place="wig",
        holders=Holders((Tie("Ring", shape),)),
    )
    assert rig.guide_holds is not None
    np.testing.assert_allclose(rig.guide_holds.place, 15 * 0.1 / 0.25, atol=1e-3)
