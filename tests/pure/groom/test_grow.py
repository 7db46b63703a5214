"""Grown hair: bound, of the set length, outside the head, falling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.groom import grow as grow_module
from hairloom.addon.groom.grow import _WHORL, grow
from hairloom.addon.groom.growth_surface import GrowthSurface
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.groom.scalp import find_cranium, scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.strands import StrandSet, Surface

SMALL = GrowSettings(strand_count=400)
#: no wave, frizz or clump: hair as the comb and gravity leave it
PLAIN = GrowSettings(strand_count=400, clump=0.0, wave=0.0, frizz=0.0)


@pytest.fixture(scope="module")
def grown(egg: Surface) -> StrandSet:
    return grow(egg, SMALL, scalp_density(egg))


def outside_by(points: np.ndarray) -> np.ndarray:
    """A lower bound of the distance outside the egg: (|p / axes| - 1) times the smallest
    semi-axis."""
    return (np.linalg.norm(points / [0.08, 0.1, 0.12], axis=-1) - 1.0) * 0.08


def test_strands_are_bound_where_they_start(egg: Surface, grown: StrandSet) -> None:
    assert grown.strand_count == 400
    assert grown.grid.shape == (400, SMALL.cv_count, 3)
    assert grown.root_triangle is not None
    assert grown.root_barycentric is not None
    corners = egg.corners[grown.root_triangle]
    origin = np.einsum("nk,nkj->nj", grown.root_barycentric, corners)
    assert grown.roots == pytest.approx(origin, abs=1e-6)
    again = bind_roots(grown, egg, place="test")
    assert again.distance.max() < 1e-6
    assert grown.root_uv == pytest.approx(again.strands.root_uv, abs=1e-3)


def test_lengths_lie_between_the_shortest_and_the_longest(grown: StrandSet) -> None:
    shortest = SMALL.length * (1.0 - SMALL.length_variation)
    lengths = grown.lengths()
    assert lengths.min() > 0.97 * shortest
    assert lengths.max() < 1.03 * SMALL.length
    assert np.ptp(lengths) > 0.5 * SMALL.length * SMALL.length_variation


def test_segments_lengthen_by_the_ratio(egg: Surface) -> None:
    settings = GrowSettings(strand_count=50, segment_ratio=1.2, lift=1.0, droop=0.0, volume=0.0)
    grid = grow(egg, settings, scalp_density(egg)).grid
    segments = np.linalg.norm(np.diff(grid, axis=1), axis=2)
    ratio = np.median(segments[:, 1:] / segments[:, :-1], axis=0)
    assert ratio == pytest.approx(np.full(14, 1.2), abs=0.02)


def test_hair_stays_out_of_the_head(grown: StrandSet) -> None:
    """A quarter of a metre of hair on a head of 20 cm lies over it, not through it."""
    assert outside_by(grown.grid[:, 1:]).min() > 0.0
    assert outside_by(grown.grid[:, 5:]).min() > 0.25 * SMALL.clearance


def test_without_pushing_out_it_would_go_through(egg: Surface) -> None:
    """The test above can fail: straight falling strands from the same roots enter the head."""
    strands = grow(egg, PLAIN, scalp_density(egg))
    straight = strands.roots[:, None] + np.linspace(0, 0.2, 16)[:, None] * np.array(
        [0.0, 0.0, -1.0]
    )
    assert outside_by(straight[:, 1:]).min() < -0.02


def test_hair_falls_and_leaves_the_face_free(grown: StrandSet) -> None:
    tips, roots = grown.grid[:, -1], grown.roots
    assert (tips[:, 2] < roots[:, 2]).mean() > 0.95
    is_before_face = (np.abs(grown.points[:, 0]) < 0.03) & (grown.points[:, 1] < -0.06)
    assert not (is_before_face & (grown.points[:, 2] < 0.0)).any()


def test_lift_raises_the_root_and_full_lift_follows_the_normal(egg: Surface) -> None:
    def steepness(lift: float) -> float:
        settings = GrowSettings(
            strand_count=200, lift=lift, droop=0.0, clump=0.0, wave=0.0, frizz=0.0, volume=0.0
        )
        grid = grow(egg, settings, scalp_density(egg)).grid
        first = grid[:, 1] - grid[:, 0]
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        normal = grid[:, 0] / np.array([0.08, 0.1, 0.12]) ** 2
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return float(np.einsum("ij,ij->i", first, normal).mean())

    flat, half, full = steepness(0.0), steepness(0.5), steepness(1.0)
    assert flat < half - 0.2 < full - 0.4
    assert full == pytest.approx(1.0, abs=0.01)


def test_locks_draw_tips_together(egg: Surface) -> None:
    def nearest_tips(clump: float) -> float:
        plain = {"strand_count": 400, "wave": 0.0, "frizz": 0.0, "volume": 0.01}
        settings = GrowSettings(clump=clump, clump_size=20, **plain)
        tips = grow(egg, settings, scalp_density(egg)).grid[:, -1]
        apart = np.linalg.norm(tips[:, None] - tips[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        return float(np.median(apart.min(axis=1)))

    assert nearest_tips(0.95) < 0.6 * nearest_tips(0.0)


def test_clumps_draw_no_strand_across_the_parting(egg: Surface) -> None:
    """Otherwise it would have to pass the head, and would be pushed out over the face."""
    settings = GrowSettings(strand_count=1500, wave=0.0, frizz=0.0)
    grid = grow(egg, settings, scalp_density(egg)).grid
    # at the back of the head both sides hang beside each other
    at_front = grid[:, 0, 1] < 0.0
    across = grid[at_front, -1, 0] * np.sign(grid[at_front, 0, 0])
    assert across.min() > 0.0


def along_skin(grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The direction from root to tip of strands on the egg: its unit vector along the skin, (n, 3),
    and the sine of the angle to the skin, (n,)."""
    way = grid[:, -1] - grid[:, 0]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    normal = grid[:, 0] / np.array([0.08, 0.1, 0.12]) ** 2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    sine = np.einsum("ij,ij->i", way, normal)
    flat = way - sine[:, None] * normal
    return flat / np.linalg.norm(flat, axis=1, keepdims=True), sine


@pytest.mark.parametrize("length", [0.012, 0.035])
def test_short_hair_lies_as_it_grows(egg: Surface, length: float) -> None:
    """Forward on the forehead, down at the nape, around the whorl, and nowhere like spines."""
    settings = GrowSettings(strand_count=1500, length=length)
    grid = grow(egg, settings, scalp_density(egg)).grid.astype(np.float64)
    way, sine = along_skin(grid)
    root = grid[:, 0]
    assert np.degrees(np.arcsin(sine.mean())) < 50.0 and np.quantile(sine, 0.95) < 0.95
    front = (np.abs(root[:, 0]) < 0.04) & (root[:, 1] < -0.04)
    assert (way[front, 1] < 0.0).mean() > 0.95
    low = (root[:, 1] > 0.03) & (root[:, 2] < 0.0)
    assert (way[low, 2] < 0.0).mean() > 0.95
    # seen from above it turns clockwise around the whorl, which is not in the middle
    cranium = find_cranium(egg.positions)
    away = root - cranium.center - cranium.half_depth * np.array(_WHORL)
    distance = np.linalg.norm(away, axis=1)
    turn = (away[:, 0] * way[:, 1] - away[:, 1] * way[:, 0]) / distance
    near = distance < 0.03
    assert near.sum() > 20 and turn[near].mean() < -0.15
    # single strands differ from their neighbours in direction and length
    far = np.linalg.norm(root[:, None] - root[None], axis=2)
    np.fill_diagonal(far, np.inf)
    beside = way[far.argmin(axis=1)]
    assert 5.0 < np.degrees(np.arccos(np.clip((way * beside).sum(axis=1), -1, 1))).mean() < 45.0


def test_long_hair_is_combed_whatever_the_whorl(egg: Surface) -> None:
    one, other = (
        grow(egg, GrowSettings(strand_count=100, length=0.3, whorl=whorl), scalp_density(egg))
        for whorl in (0.0, 1.0)
    )
    np.testing.assert_array_equal(one.points, other.points)


def test_hair_bends_over_its_length_not_over_centimetres(egg: Surface) -> None:
    """Half the length on a head of half the size gives the same groom."""

    def tips(scale: float) -> np.ndarray:
        settings = GrowSettings(
            strand_count=200,
            length=0.03 * scale,
            volume=0.024 * scale,
            clearance=0.002 * scale,
            wave=0.0,
            frizz=0.0,
            droop=0.0,
        )
        surface = Surface(egg.positions * np.float32(scale), egg.triangles)
        return grow(surface, settings, scalp_density(egg)).grid[:, -1] / scale

    np.testing.assert_allclose(tips(0.5), tips(1.0), atol=2e-4)


def test_no_strand_folds_back_on_itself(egg: Surface) -> None:
    """Not even where its clump is on the other side of the head; no bend exceeds 90 degrees."""
    for clump_size in (30, 200):
        settings = GrowSettings(strand_count=400, clump=1.0, clump_size=clump_size)
        segment = np.diff(grow(egg, settings).grid, axis=1)
        segment /= np.linalg.norm(segment, axis=2, keepdims=True)
        cosine = np.einsum("scj,scj->sc", segment[:, 1:], segment[:, :-1])
        assert np.degrees(np.arccos(cosine.min())) < 90.0


def test_the_seed_decides_and_nothing_else_does(egg: Surface) -> None:
    def points(seed: int) -> np.ndarray:
        return grow(egg, GrowSettings(strand_count=50, seed=seed)).points

    assert (points(1) == points(1)).all()
    assert (points(1) != points(2)).any()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_strands(egg: Surface, count: int) -> None:
    strands = grow(egg, GrowSettings(strand_count=count, cv_count=4), scalp_density(egg))
    assert strands.strand_count == count
    assert np.isfinite(strands.points).all()
    assert strands.is_bound


@pytest.mark.parametrize("extreme", ["low", "high"])
def test_all_extremes_of_the_sliders_give_finite_hair(egg: Surface, extreme: str) -> None:
    side = 0 if extreme == "low" else 1
    values = {
        p.name: p.soft_range[side]
        for p in GrowSettings.parameters()
        if p.soft_range is not None and p.name != "strand_count"
    }
    strands = grow(egg, GrowSettings.from_dict(values | {"strand_count": 60}, "test"))
    assert np.isfinite(strands.points).all()
    assert (strands.lengths() > 0.0).all()


def test_a_head_without_faces_is_reported(egg: Surface) -> None:
    with pytest.raises(HairloomError):
        grow(Surface(egg.positions, np.zeros((0, 3))), SMALL)


def test_hair_bridges_hollows_and_lies_over_bumps() -> None:
    """Over a plane, in arcs of 5 mm: a hollow arc is flattened to less than half, a bump stays."""
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    plane = Surface(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    along = np.linspace(0.0, 0.3, 16)
    arc = 0.005 * np.sin(np.pi * along / 0.3)
    height = 0.01 + np.stack([-arc, arc])
    grid = np.stack([np.stack([along, np.zeros(16), each], axis=1) for each in height])
    nothing = np.zeros((2, 15))
    plan = grow_module._Plan(nothing, nothing, GrowthSurface(plane, reach=0.05, cell=0.004))
    hollow, bump = grow_module._stretched_over_hollows(grid, plan)[..., 2]
    # the first segment keeps its direction from the skin
    assert np.diff(hollow[1:], 2).max() < 0.5 * np.diff(height[0], 2).max()
    assert (hollow >= height[0]).all() and hollow[8] > height[0, 8] + 0.001
    assert np.allclose(bump[2:-1], height[1, 2:-1], atol=1e-9)


@pytest.mark.parametrize("back", [1.0, -1.0])
def test_hair_is_combed_back_or_forward_along_the_skin(egg: Surface, back: float) -> None:
    """Against (0, +-1, -0.35) without its component along the normal, the gradient of the egg's
    equation."""
    settings = replace(
        PLAIN, comb_back=back, lift=0.0, droop=0.0, whorl=0.0, volume=0.0, clearance=0.0
    )
    grid = grow(egg, settings, scalp_density(egg)).grid.astype(np.float64)
    root, way = grid[:, 0], grid[:, 1] - grid[:, 0]
    normal = root / np.square([0.08, 0.1, 0.12])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    comb = np.array([0.0, back, -0.35])
    comb = comb - normal * (normal @ comb)[:, None]
    cosine = np.einsum("ij,ij->i", comb, way)
    cosine /= np.linalg.norm(comb, axis=1) * np.linalg.norm(way, axis=1)
    assert np.quantile(cosine, 0.05) > np.cos(np.radians(15.0))
    tips = grid[:, -1] - root
    assert np.median(tips[:, 1]) * back > 0.03


def test_each_side_has_a_direction_of_its_own(egg: Surface) -> None:
    both = grow(egg, replace(PLAIN, comb_back=0.9), scalp_density(egg))
    alike = replace(PLAIN, comb_back=0.9, each_side=True, right_back=0.9, right_aside=1.0)
    assert np.array_equal(grow(egg, alike, scalp_density(egg)).points, both.points)
    parted = grow(egg, replace(alike, right_back=-0.9), scalp_density(egg)).grid
    is_right = parted[:, 0, 0] < find_cranium(egg.positions).center[0]
    assert np.array_equal(parted[~is_right], both.grid[~is_right])
    ahead = parted[is_right, 5, 1] - both.grid[is_right, 5, 1]
    assert (ahead < 0.0).mean() > 0.95


def test_hair_of_one_side_is_combed_over_to_the_other(egg: Surface) -> None:
    over = replace(PLAIN, comb_back=0.1, each_side=True, right_back=0.1, right_aside=-1.0)
    grid = grow(egg, over, scalp_density(egg)).grid
    is_above = grid[:, 0, 2] > 0.08
    assert is_above.sum() > 30
    gone = grid[is_above, 5, 0] - grid[is_above, 0, 0]
    assert (gone > 0.0).mean() > 0.95
    right = grow(egg, replace(over, right_aside=1.0), scalp_density(egg)).grid[is_above]
    assert ((right[:, 5, 0] < right[:, 0, 0]) == (right[:, 0, 0] < 0.0)).mean() > 0.9
