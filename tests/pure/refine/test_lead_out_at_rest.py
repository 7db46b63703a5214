"""Children at rest: none passes through the head, here a ball, so that depths are known."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon import rig_flow
from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.refine.lead_out_at_rest import DEEP, lead_out_at_rest
from hairloom.addon.rig_flow import Rig
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.arc_length import segment_lengths

RADIUS = 0.1


@pytest.fixture(scope="module")
def ball() -> Surface:
    """A fine ball: its facets lie less than 0.06 mm below the sphere."""
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, 97)[:-1], np.linspace(0, np.pi, 49))
    place = np.stack(
        [np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1
    )
    number = np.arange(place[..., 0].size).reshape(place.shape[:2])
    a, b = number[:-1], number[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Surface(RADIUS * place.reshape(-1, 3), faces)


@pytest.fixture(scope="module")
def field(ball: Surface) -> DistanceField:
    return DistanceField.from_surface(ball, DynamicsSettings())


def parted() -> StrandSet:
    """Guides at the top that fall to two sides, along the ball and then on below it."""
    points = []
    for side in (-1.0, 1.0):
        for across in np.linspace(-0.4, 0.4, 9):
            angle = np.minimum(np.linspace(0.12, 2.4, 20), np.pi / 2.0)
            below = 0.1 * (np.linspace(0.12, 2.4, 20) - angle)
            out = (RADIUS + 0.002) * np.sin(angle)
            height = (RADIUS + 0.002) * np.cos(angle) - below
            place = side * out * np.cos(across), out * np.sin(across), height
            points.append(np.stack(place, axis=1))
    return strand_set(np.array(points))


def strand_set(grid: np.ndarray) -> StrandSet:
    """Strands with these points (n, cv_count, 3)."""
    count, cv_count, _ = grid.shape
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(count + 1) * cv_count,
        radius=np.full(count * cv_count, 1.0e-4),
        group=np.zeros(count, np.int32),
    )


def made(ball: Surface, field: DistanceField | None) -> Rig:
    density = (ball.positions[:, 2] > 0.97 * RADIUS).astype(np.float32)
    return rig_flow.prepare(
        parted(),
        ball,
        GuideSettings(),
        place="parted",
        children=ChildrenSettings(method="multi", strand_count=400, parting=0.0),
        placement=rig_flow.ChildPlacement(density, head_field=lambda: field),
    )


def depth(strands: StrandSet) -> np.ndarray:
    """The greatest depth of each strand in the ball [m]."""
    away = np.linalg.norm(strands.points.astype(float), axis=1)
    return RADIUS - np.minimum.reduceat(away, strands.offsets[:-1])


def test_children_that_went_through_the_head_go_around_it(
    ball: Surface, field: DistanceField
) -> None:
    before, after = made(ball, None), made(ball, field)
    own = after.own_count
    assert own == 18
    children = depth(before.strands)[own:]
    assert (children > 0.005).sum() > 20, "without it, children go through"
    found = depth(after.strands)
    kept = DynamicsSettings().radius_root * float(np.median(after.strands.lengths()))
    assert found[own:].max() < DEEP * 1.1 * kept
    assert after.child_count > 0.9 * before.child_count
    # the artist's strands are unchanged
    first = slice(0, int(after.strands.offsets[own]))
    np.testing.assert_array_equal(after.strands.points[first], before.strands.points[first])
    assert len(after.weights.guide) == after.strands.strand_count


def test_lengths_and_roots_stay_and_strands_outside_are_not_touched(field: DistanceField) -> None:
    count = 12
    angle = np.linspace(0.0, 1.0, 30)
    root = RADIUS * np.array([np.cos(angle), 0.0 * angle, np.sin(angle)]).T
    through = np.linspace(0.0, 0.12, count)[None, :, None] * [[[0.0, 1.0, 0.2]]]
    inward = root[:15, None] * (1.0 - np.linspace(0.0, 0.5, count)[None, :, None]) + through
    outward = root[15:, None] * (1.0 + np.linspace(0.0, 1.0, count)[None, :, None])
    strands = strand_set(np.concatenate([inward, outward]))
    led, is_out = lead_out_at_rest(strands, field, 0.25)
    assert is_out.all()
    np.testing.assert_array_equal(led.roots, strands.roots)
    np.testing.assert_allclose(
        segment_lengths(led.points, led.offsets),
        segment_lengths(strands.points, strands.offsets),
        atol=1e-6,
    )
    np.testing.assert_array_equal(led.points[15 * count :], strands.points[15 * count :])
    assert depth(strands)[:15].min() > 0.004 and depth(led).max() < 0.0006


def test_what_nothing_leads_out_is_left_out_and_said(
    ball: Surface, field: DistanceField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hairloom.addon.refine.lead_out_at_rest.lead_out", lambda *_: None)
    before, after = made(ball, None), made(ball, field)
    inside = depth(before.strands)[before.own_count :] > 0.001
    assert after.child_count <= before.child_count - inside.sum()
    (note,) = set(after.notes) - set(before.notes)
    assert "would lie in the surface" in note and "Comb" in note
