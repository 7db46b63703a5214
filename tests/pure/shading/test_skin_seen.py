"""Skin seen from hair, against brute-force rays and known means."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon import light_flow, rig_flow
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.shading import skin_seen as skin_seen_module
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.skin_seen import (
    ABSORBED_FRACTION,
    CLUMPING,
    SkinSeen,
    far_skin_light,
    plane_beneath,
    skin_field,
    skin_seen,
    through_hair,
)
from hairloom.addon.strands import StrandSet, Surface

RADIUS = 0.1


def ball(radius: float = RADIUS, rings: int = 48) -> Surface:
    """A ball around the origin whose faces point outwards."""
    polar, round_ = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1),
        np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1),
        indexing="ij",
    )
    positions = radius * np.stack(
        [
            np.sin(polar) * np.cos(round_),
            np.sin(polar) * np.sin(round_),
            np.cos(polar) + 0.0 * round_,
        ],
        axis=-1,
    )
    index = np.arange(positions.shape[0] * positions.shape[1]).reshape(positions.shape[:2])
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return Surface(positions.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32))


def hair(points: np.ndarray, radius: float) -> StrandSet:
    """Strands through points (n, cvs, 3)."""
    count, cvs = points.shape[:2]
    return StrandSet(
        points.reshape(-1, 3).astype(np.float32),
        np.arange(0, count * cvs + 1, cvs),
        np.full(count * cvs, radius, np.float32),
        np.zeros(count, np.int32),
    )


def spikes(count: int = 40, length: float = 0.12) -> StrandSet:
    """Strands straight out of the ball, too thin to block light."""
    random = np.random.default_rng(3)
    out = random.normal(size=(count, 1, 3))
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return hair(out * (RADIUS + length * np.linspace(0.0, 1.0, 7)[None, :, None]), 1e-9)


def light_of_ball(points: np.ndarray, to_light: np.ndarray) -> np.ndarray:
    """Mean light over all directions at points beside a white ball under one sun, relative to a
    surface that faces the sun, by rays without a grid.
    """
    random = np.random.default_rng(5)
    ways = random.normal(size=(4000, 3))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    found = []
    for point in points:
        middle = ways @ point
        inner = middle**2 - (point @ point - RADIUS**2)
        is_met = (inner > 0.0) & (middle < 0.0)
        away = -middle - np.sqrt(np.maximum(inner, 0.0))
        normal = (point + away[:, None] * ways) / RADIUS
        found.append(np.where(is_met, np.maximum(normal @ to_light, 0.0), 0.0).mean())
    return np.array(found)


def test_light_off_a_ball_is_that_of_rays() -> None:
    strands = spikes()
    seen = skin_seen(strands, strands.points, ball(), 1.0)
    # nearer, cells make the ball half a cell larger; farther away, few of 26 directions hit it
    away = np.linalg.norm(strands.points, axis=1) / RADIUS
    some = (away > 1.35) & (away < 1.9)
    sun = np.array([0.6, 0.0, 0.8])
    found, expected = (
        far_skin_light(seen.received, sun)[some],
        light_of_ball(strands.points[some], sun),
    )
    assert found.mean() == pytest.approx(expected.mean(), rel=0.25)
    assert np.corrcoef(found, expected)[0, 1] > 0.95
    assert np.abs(found - expected).mean() < 0.4 * expected.mean()


def test_what_lies_right_beneath_is_not_far() -> None:
    """At the ball all skin is right beneath, with the ball's normal; away from it none is."""
    strands = spikes()
    seen = skin_seen(strands, strands.points, ball(), 1.0)
    height = np.linalg.norm(strands.points, axis=1) - RADIUS
    out = strands.points / np.linalg.norm(strands.points, axis=1, keepdims=True)
    at_root, far = height < 1e-3, height > 0.035
    facing = np.sum(seen.beneath * out, axis=1)
    assert facing[at_root].min() > 0.85
    assert facing[at_root].max() < 1.1
    assert np.abs(seen.beneath[far]).max() < 0.05
    assert seen.received[at_root, 0].max() < 0.3 * seen.received[far & (height < 0.05), 0].max()


def test_a_root_a_little_below_the_skin_sees_it() -> None:
    """Although it lies among cells inside the body, which have no values."""
    strands = spikes()
    out = strands.roots / np.linalg.norm(strands.roots, axis=1, keepdims=True)
    seen = skin_seen(strands, (RADIUS - 0.005) * out, ball(), 1.0)
    assert np.sum(seen.beneath * out, axis=1).min() > 0.9


def test_no_light_comes_off_skin_within_a_body() -> None:
    """A ball inside a larger one receives no light."""
    strands, one, around = spikes(), ball(), ball(2.6 * RADIUS)
    both = Surface(
        np.concatenate([one.positions, around.positions]),
        np.concatenate([one.triangles, around.triangles + len(one.positions)]),
    )
    alone, shut_in = (
        skin_seen(strands, strands.points, skin, 1.0).received[:, 0].mean() for skin in (one, both)
    )
    assert shut_in < 0.05 * alone


def cloud(count: int, low: float, high: float) -> tuple[StrandSet, float]:
    """Short strands around the ball, evenly between two radii, and their radial optical depth."""
    random = np.random.default_rng(8)
    half, width = 0.01, 3e-4
    out, across = random.normal(size=(2, count, 3))
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    across = np.cross(out, across)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    middle = out * random.uniform(low, high, (count, 1))
    area = count * 2.0 * width * 2.0 * half * np.pi / 4.0
    depth = area / (4.0 / 3.0 * np.pi * (high**3 - low**3)) * (high - low)
    return hair(np.stack([middle - half * across, middle + half * across], axis=1), width), depth


def outside_of(strands: StrandSet) -> StrandSet:
    """Short strands farther out than others, too thin to block light."""
    out = strands.points[::2] / np.linalg.norm(strands.points[::2], axis=-1, keepdims=True)
    outside = 2.0 * RADIUS * out[:400]
    return hair(np.stack([outside, 1.005 * outside], axis=1), 1e-9)


def test_hair_in_the_way_is_counted_on_both_ways() -> None:
    """Light goes to the ball and back through a cloud around it: each time, on average over all
    directions, through 1 to 1.5 times its radial depth.
    """
    strands, depth = cloud(6000, 1.3 * RADIUS, 1.8 * RADIUS)
    seen = skin_seen(strands, outside_of(strands).points, ball(), 1.0)
    assert 2.0 * depth < np.median(seen.depth) < 3.0 * depth


def test_hair_on_the_side_of_the_light_shades_the_skin() -> None:
    """With hair on the right of a ball, light from the left is reflected by it, but hardly any from
    the right; without the hair both are."""
    around, depth = cloud(60_000, 1.15 * RADIUS, 1.5 * RADIUS)
    middle = around.points[::2]
    is_right = middle[:, 0] > 0.25 * np.linalg.norm(middle, axis=1)
    points = outside_of(around).points
    ways = points / np.linalg.norm(points, axis=1, keepdims=True)
    beside = points[np.abs(ways[:, 0]) < 0.1]
    thin = replace(around, radius=np.full_like(around.radius, 1e-9))
    assert depth > 2.0

    def light(strands: StrandSet, side: float) -> float:
        seen = skin_seen(strands, beside, ball(), 1.0)
        return float(far_skin_light(seen.received, np.array([side, 0.0, 0.0])).mean())

    right = around.take(np.flatnonzero(is_right))
    assert light(thin, 1.0) == pytest.approx(light(thin, -1.0), rel=0.25)
    assert light(right, -1.0) > 0.6 * light(thin, -1.0)
    assert light(right, 1.0) < 0.4 * light(right, -1.0)


def test_gaps_let_through_what_a_spread_of_depths_does() -> None:
    """Against means of exp(-x tau) over gamma-distributed depths with a variance of CLUMPING times
    the squared mean, relative to strands that absorb ABSORBED_FRACTION.
    """
    random = np.random.default_rng(2)
    depths = random.gamma(1.0 / CLUMPING, CLUMPING, 400_000)
    for taken in (0.1, 1.0):
        expected = np.exp(-taken * depths).mean() / np.exp(-ABSORBED_FRACTION * depths).mean()
        found = through_hair(np.array(1.0), np.array(taken))
        assert found == pytest.approx(expected, rel=5e-3)


def test_light_off_one_normal_is_that_of_a_matt_surface() -> None:
    """q0 and q of a cosine reproduce the cosine, and those of uniform light its mean."""
    random = np.random.default_rng(4)
    lights = random.normal(size=(500, 3))
    lights /= np.linalg.norm(lights, axis=-1, keepdims=True)
    normal = np.array([0.0, 0.6, 0.8])
    one = far_skin_light(0.5 * np.array([0.25, *(0.5 * normal)]) * np.ones((500, 1)), lights)
    np.testing.assert_allclose(one, 0.5 * np.maximum(lights @ normal, 0.0), atol=1e-9)
    even = far_skin_light(np.array([0.3, 0.0, 0.0, 0.0]) * np.ones((500, 1)), lights)
    np.testing.assert_allclose(even, 0.3, atol=1e-9)


def seen_at_rest(strands: StrandSet, head: Surface) -> np.ndarray | None:
    rig = rig_flow.prepare(strands, head, GuideSettings(), place="hair")
    return light_flow.rest_light(rig, AmbientSettings()).skin_seen


def test_what_strands_see_turns_with_them() -> None:
    """In the axes of the strand, values do not change when hair and head turn by 90 degrees."""
    strands, head = spikes(), ball()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(strands, points=strands.points @ turn.T)
    turned_head = replace(head, positions=head.positions @ turn.T)
    one, other = (seen_at_rest(*each) for each in ((strands, head), (turned, turned_head)))
    assert one is not None
    assert other is not None
    # the depth is that of almost no hair
    np.testing.assert_allclose(other[:, :7], one[:, :7], atol=0.02)
    assert one[:, 4].max() > 0.7, "spikes run along the normal of what lies beneath"


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_scale_does_not_matter(factor: float) -> None:
    strands, head = spikes(), ball()
    thick = replace(strands, radius=np.full_like(strands.radius, 2e-3))
    larger = replace(
        thick, points=thick.points * np.float32(factor), radius=thick.radius * np.float32(factor)
    )
    large_head = replace(head, positions=head.positions * np.float32(factor))
    one, other = (
        skin_seen(each, each.points, surface, 1.0)
        for each, surface in ((thick, head), (larger, large_head))
    )
    for name in ("received", "depth", "beneath"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=0.05, atol=2e-2)


@pytest.mark.parametrize("place", [0.0, 1.0])
def test_hair_without_any_size(place: float) -> None:
    strands = hair(np.full((3, 2, 3), place), 1e-4)
    seen = skin_seen(strands, strands.points, ball(), 1.0)
    assert all(np.isfinite(each).all() for each in (seen.received, seen.depth, seen.beneath))


def test_a_plane_alone_is_as_before() -> None:
    normal = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    seen: SkinSeen = plane_beneath(normal)
    assert not far_skin_light(seen.received, normal).any()
    np.testing.assert_array_equal(seen.beneath, normal)


def test_skin_in_cells_is_found_once_for_hair_that_keeps_its_grid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As under a comb; other cells or another head are computed again. The field is the same bit
    for bit."""
    found: list[int] = []
    cut = skin_seen_module.subdivided_triangles
    monkeypatch.setattr(
        skin_seen_module,
        "subdivided_triangles",
        lambda corners, *box: found.append(len(corners)) or cut(corners, *box),
    )
    head = ball()
    around = ball(1.3 * RADIUS, 8).positions[::3]
    points = np.stack([around, 1.4 * around], axis=1)
    combed = points.copy()
    combed[len(points) // 2, 1] *= 0.95

    def field(points: np.ndarray, head: Surface) -> np.ndarray:
        return skin_field(hair(points, 1e-3), head, 1.0, 20).values

    field(points, head)
    np.testing.assert_array_equal(field(combed, head), field(combed, ball()))
    assert len(found) == 2, "once for each head"
    np.testing.assert_array_equal(field(2.0 * points, head), field(2.0 * points, ball()))
    np.testing.assert_array_equal(field(points, head), field(points, ball()))
    assert len(found) == 6, "one grid is kept for a head"
