"""Children that curl, against the formula of a helix, and fly-aways."""

from __future__ import annotations

import numpy as np
import pytest
from flat_ground import children_settings, guides_at, sheet

from hairloom.addon import rig_flow
from hairloom.addon.arrays import Floats
from hairloom.addon.groom import children
from hairloom.addon.groom.children import make_children
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params.curve import sample_curve
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.arc_length import typical_length

SURFACE = sheet()
LENGTH = 0.2
EVEN = (1.0, 1.0, 1.0, 1.0, 1.0)


def standing(cv_count: int = 9) -> StrandSet:
    """Straight guides of one length on all of the sheet."""
    x, y = np.meshgrid(*[np.linspace(0.05, 0.95, 8)] * 2)
    root = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    return guides_at(SURFACE, root, np.tile([0.0, 0.0, LENGTH], (len(root), 1)), cv_count=cv_count)


def grown(settings: ChildrenSettings, cv_count: int = 9) -> Floats:
    """Points of each child from its root, (child_count, cv_count, 3)."""
    grid = make_children(standing(cv_count), SURFACE, settings, place="test").strands.grid
    return (grid - grid[:, :1]).astype(np.float64)


def helix_length(settings: ChildrenSettings) -> float:
    """The length of the helix around a straight guide, by 100,000 chords."""
    part, size = np.linspace(0.0, 1.0, 100_001), typical_length(standing().lengths())
    radius = settings.curl * size * sample_curve(settings.curl_along, part)
    angle = 2.0 * np.pi * part * LENGTH / (settings.curl_length * size)
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle), LENGTH * part])
    return float(np.linalg.norm(np.diff(places), axis=0).sum())


@pytest.mark.parametrize(("curl", "turn"), [(0.03, 0.2), (0.1, 0.11)])
def test_curls_are_helices_around_the_path(curl: float, turn: float) -> None:
    grid = grown(children_settings(curl=curl, curl_length=turn, curl_along=EVEN))[:, 1:]
    part, size = np.linspace(0.0, 1.0, grid.shape[1] + 1)[1:], typical_length(standing().lengths())
    step = 2.0 * np.pi * part[0] * LENGTH / (turn * size)
    away = np.hypot(grid[..., 0], grid[..., 1])
    expected = curl * size * (step / 2.0) / np.sin(step / 2.0)
    assert np.abs(away - expected).max() < 1e-6
    assert expected < 1.01 * curl * LENGTH
    assert np.abs(grid[..., 2] - LENGTH * part).max() < 1e-6
    turned = np.unwrap(np.arctan2(grid[..., 1], grid[..., 0]))
    assert np.abs(turned - turned[:, :1] - step * np.arange(len(part))).max() < 1e-3


@pytest.mark.parametrize(("curl", "turn"), [(0.02, 0.5), (0.03, 0.12), (0.02, 0.06), (0.05, 0.05)])
def test_no_curl_loses_more_length_than_points_by_need_may(curl: float, turn: float) -> None:
    settings = children_settings(curl=curl, curl_length=turn, strand_count=100)
    rig = rig_flow.prepare(
        standing(16), SURFACE, GuideSettings(cv_count=16), place="test", children=settings
    )
    children = rig.strands.take(np.arange(64, rig.strands.strand_count))
    kept = children.lengths() / helix_length(settings)
    assert kept.min() >= 0.995
    assert kept.max() < 1.001
    assert not any("Curls need" in note for note in rig.notes)


def test_a_clump_winds_as_one_and_clumps_each_their_own_way() -> None:
    settings = children_settings(curl=0.04, curl_along=EVEN, clump=0.05, clump_size=200)
    made = make_children(standing(), SURFACE, settings, place="test")
    plain = make_children(
        standing(), SURFACE, children_settings(clump=0.05, clump_size=200), place="test"
    )
    count = made.strands.grid.shape[1]
    path = plain.strands.grid[:, [0, -1]]
    aside = made.strands.grid[:, -1] - path[:, -1]
    clump = made.growth.clumps.outermost()
    assert count > plain.strands.grid.shape[1]
    middles = np.unique(clump)
    assert 15 < len(middles) <= 20
    for middle in middles:
        own = aside[clump == middle]
        assert np.linalg.norm(own - own.mean(axis=0), axis=1).max() < 0.3 * 0.04 * LENGTH
    angle = np.sort(np.arctan2(*aside[middles, :2].T[::-1]))
    assert np.diff(angle).max() < 2.0  # all around


def test_curls_that_have_no_room_say_so_and_are_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = children_settings(curl=0.02, curl_length=0.005, strand_count=100)
    made = make_children(standing(), SURFACE, settings, place="test")
    assert made.strands.grid.shape[1] == 512
    assert any("Curls need 4,801 points per child and have 512" in each for each in made.notes)
    monkeypatch.setattr(children, "CHILD_POINTS", 10_000)
    many = children_settings(curl=0.02, curl_length=0.1, strand_count=10_000 // 50)
    count = make_children(standing(), SURFACE, many, place="test").growth.cv_count
    assert count == 50


def test_without_curls_and_fly_aways_nothing_changes() -> None:
    plain = grown(children_settings(frizz=0.01, clump=0.5))
    other = children_settings(frizz=0.01, clump=0.5, curl_length=0.5, curl_along=EVEN)
    assert np.array_equal(plain, grown(other))


def test_combed_children_curl_and_stray_as_they_grew() -> None:
    """Shapes computed again from the stored growth are the same, bit for bit."""
    settings = children_settings(
        curl=0.03, fly_aways=0.3, clump=0.5, frizz=0.01, length_variation=0.3
    )
    guides = standing()
    made = make_children(guides, SURFACE, settings, place="test")
    chosen = np.arange(3, 400, 7)
    shapes = made.growth.shapes(guides.grid, chosen)
    assert np.array_equal(shapes, made.strands.grid[chosen])


def test_fly_aways_are_as_many_as_they_should_and_keep_their_lengths() -> None:
    plain = grown(children_settings(strand_count=3000))
    few, more = (
        grown(children_settings(strand_count=3000, fly_aways=part)) for part in (0.1, 0.25)
    )
    strays, others = ((each != plain).any(axis=(1, 2)) for each in (few, more))
    assert strays.mean() == pytest.approx(0.1, abs=4.0 * np.sqrt(0.09 / 3000))
    assert others.mean() == pytest.approx(0.25, abs=4.0 * np.sqrt(0.19 / 3000))
    assert np.array_equal(few[strays], more[strays])
    length = np.linalg.norm(np.diff(more, axis=1), axis=2).sum(axis=1)
    assert np.abs(length - LENGTH).max() < 1e-6
    fewer = grown(children_settings(strand_count=1000, fly_aways=0.25))
    assert np.array_equal(fewer, more[:1000])


def test_fly_aways_stray_smoothly_and_the_farther_the_nearer_to_their_tips() -> None:
    grid = grown(children_settings(strand_count=2000, fly_aways=1.0), cv_count=17)
    away = np.linalg.norm(grid - [0.0, 0.0, 1.0] * grid[..., 2:], axis=2).mean(axis=0)
    assert (np.diff(away) > 0.0).all()
    assert (np.diff(away, n=2) > -1e-4 * LENGTH).all()  # it leaves its path tangentially
    assert 0.05 < away[-1] / LENGTH < 0.35
    step = np.diff(grid, axis=1)
    step /= np.linalg.norm(step, axis=2, keepdims=True)
    turn = np.arccos(np.clip(np.einsum("scj,scj->sc", step[:, 1:], step[:, :-1]), -1.0, 1.0))
    # the tangent is at most 0.55 (1 + 1), grows along the strand, and its wave turns 0.8 times
    most = 0.55 * (2.0 + 2.0 * np.pi * 0.8) / 16
    assert turn.max() < most
