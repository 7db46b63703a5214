"""Strands along the normals: straight or lying, of the set length, by the density."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.normal_growth import grow_along_normals
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.strands import StrandSet, Surface

SEMI_AXES = np.array([0.08, 0.1, 0.12])
GUIDES = GrowSettings(
    method="normals",
    strand_count=300,
    cv_count=12,
    length=0.1,
    length_variation=0.0,
    segment_ratio=1.2,
    lift=1.0,
)
PER_VERTEX = GrowSettings(
    method="normals",
    per_vertex=True,
    cv_count=8,
    length=0.1,
    length_variation=0.0,
    segment_ratio=1.5,
)


def ball(rows: int = 40, columns: int = 60) -> Surface:
    """A sphere of radius 1 around the origin, welded, with triangles at the poles."""
    up = np.linspace(0.0, np.pi, rows + 1)[1:-1, None]
    around = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    ring = [np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up) + 0.0 * around]
    positions = np.concatenate([np.stack(ring, axis=-1).reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    a = np.arange((rows - 2) * columns)
    b = a - a % columns + (a + 1) % columns
    quads = [np.stack([a, a + columns, b + columns], 1), np.stack([a, b + columns, b], 1)]
    first, last = np.arange(columns), (rows - 2) * columns + np.arange(columns)
    north, south = np.full(columns, len(positions) - 2), np.full(columns, len(positions) - 1)
    caps = [
        np.stack([north, first, np.roll(first, -1)], 1),
        np.stack([south, np.roll(last, -1), last], 1),
    ]
    return Surface(positions, np.concatenate([*quads, *caps]))


@pytest.fixture(scope="module")
def sphere() -> Surface:
    return ball()


def directions(strands: StrandSet) -> Floats:
    """Unit directions of all segments, (strand_count, cv_count - 1, 3)."""
    segment = np.diff(strands.grid.astype(np.float64), axis=1)
    return segment / np.linalg.norm(segment, axis=2, keepdims=True)


# --- form ----------------------------------------------------------------------------------------


def test_one_strand_a_vertex_stands_on_it_along_the_normal(sphere: Surface) -> None:
    strands = grow_along_normals(sphere, PER_VERTEX)
    assert strands.roots == pytest.approx(sphere.positions, abs=1e-7)
    outward = sphere.positions / np.linalg.norm(sphere.positions, axis=1, keepdims=True)
    along = np.einsum("scj,sj->sc", directions(strands), outward)
    assert along.min() > 0.9999  # the normals of a welded sphere are nearly exact
    assert strands.grid[:, -1] == pytest.approx(outward * 1.1, abs=2e-3)


def test_strands_between_vertices_follow_the_smooth_normal(sphere: Surface) -> None:
    strands = grow_along_normals(sphere, GUIDES)
    outward = strands.roots / np.linalg.norm(strands.roots, axis=1, keepdims=True)
    along = np.einsum("scj,sj->sc", directions(strands), outward)
    assert along.min() > np.cos(np.radians(0.5))  # the flat triangles are off by up to 3 degrees


def test_strands_are_straight_and_segments_grow_by_the_ratio(egg: Surface) -> None:
    grid = grow_along_normals(egg, GUIDES).grid.astype(np.float64)
    segment = np.linalg.norm(np.diff(grid, axis=1), axis=2)
    assert segment[:, 1:] / segment[:, :-1] == pytest.approx(np.full((300, 10), 1.2), rel=1e-3)
    assert segment.sum(axis=1) == pytest.approx(np.full(300, 0.1), rel=1e-5)
    assert np.linalg.norm(grid[:, -1] - grid[:, 0], axis=1) == pytest.approx(
        np.full(300, 0.1), rel=1e-5
    )


def test_strands_are_bound_where_they_stand(egg: Surface) -> None:
    for settings in (GUIDES, PER_VERTEX):
        strands = grow_along_normals(egg, settings)
        assert strands.root_triangle is not None
        assert strands.root_barycentric is not None
        corners = egg.corners[strands.root_triangle]
        held = np.einsum("nk,nkj->nj", strands.root_barycentric, corners)
        assert strands.roots == pytest.approx(held, abs=1e-7)
        again = bind_roots(strands, egg, place="test")
        assert again.distance.max() < 1e-6
        assert strands.root_uv is not None


def test_the_way_is_a_setting_of_grow(egg: Surface) -> None:
    assert (grow(egg, GUIDES).points == grow_along_normals(egg, GUIDES).points).all()


@pytest.mark.parametrize("count", [0, 1, 2, 999])
def test_the_count_is_exact(egg: Surface, count: int) -> None:
    settings = GrowSettings(method="normals", strand_count=count, cv_count=5)
    strands = grow_along_normals(egg, settings, np.arange(len(egg.positions)))
    assert strands.strand_count == count
    assert strands.is_bound
    assert (strands.point_counts == 5).all()


def test_the_seed_decides_and_nothing_else_does(egg: Surface) -> None:
    def points(seed: int) -> Floats:
        return grow_along_normals(egg, GrowSettings(method="normals", seed=seed)).points

    assert (points(1) == points(1)).all()
    assert (points(1) != points(2)).any()


# --- weights -------------------------------------------------------------------------------------


def test_length_weights_multiply_the_length(sphere: Surface) -> None:
    """Exactly at vertices, linearly between them; length variation only shortens."""
    height = (sphere.positions[:, 2] + 1.0) / 2.0
    strands = grow_along_normals(sphere, PER_VERTEX, length=height)
    vertex = height > 0.0
    assert strands.strand_count == vertex.sum() == len(height) - 1  # none at the south pole
    assert strands.lengths() == pytest.approx(0.1 * height[vertex], rel=1e-4, abs=1e-7)
    between = grow_along_normals(sphere, GUIDES, length=height)
    assert between.lengths() == pytest.approx(0.05 * (between.roots[:, 2] + 1.0), rel=1e-4)
    varied = GrowSettings(**GUIDES.as_dict() | {"length_variation": 0.5})
    share = grow_along_normals(sphere, varied).lengths() / 0.1
    assert 0.5 <= share.min() < 0.52
    assert 0.98 < share.max() <= 1.0


def test_combed_hair_follows_the_length_weights_too(egg: Surface) -> None:
    length = np.where(egg.positions[:, 2] > 0.05, 1.0, 0.5)
    plain = {"strand_count": 300, "length_variation": 0.0, "clump": 0.0, "wave": 0.0, "frizz": 0.0}
    strands = grow(egg, GrowSettings(**plain), length=length)
    height = strands.roots[:, 2]
    assert strands.lengths()[height > 0.07] == pytest.approx(GrowSettings().length, rel=0.02)
    assert strands.lengths()[height < 0.03] == pytest.approx(0.5 * GrowSettings().length, rel=0.02)


def test_one_strand_a_vertex_above_the_threshold(sphere: Surface) -> None:
    density = (sphere.positions[:, 2] + 1.0) / 2.0
    for threshold in (0.0, 0.25, 0.5):
        settings = GrowSettings(**PER_VERTEX.as_dict() | {"threshold": threshold})
        roots = grow_along_normals(sphere, settings, density).roots
        assert len(roots) == (density > threshold).sum()
        assert roots == pytest.approx(sphere.positions[density > threshold])


def test_strands_follow_the_density_even_on_few_triangles() -> None:
    """Chi-square of the roots on a square of two triangles with density x, against the fractions
    (2 i + 1) / 64."""
    square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    settings = GrowSettings(method="normals", strand_count=6400)
    x, y, _ = grow_along_normals(square, settings, square.positions[:, 0]).roots.T
    counts = np.histogram(x, 8, (0.0, 1.0))[0]
    expected = 6400 * (2.0 * np.arange(8) + 1.0) / 64.0
    # 7 degrees of freedom: above 24.3 in one case of a thousand; stratifying makes it smaller
    assert ((counts - expected) ** 2 / expected).sum() < 24.3
    # and across it evenly
    assert ((np.histogram(y, 8, (0.0, 1.0))[0] - 800.0) ** 2 / 800.0).sum() < 24.3
    # the test rejects uniform hair
    even = np.histogram(grow_along_normals(square, settings).roots[:, 0], 8, (0.0, 1.0))[0]
    assert ((even - expected) ** 2 / expected).sum() > 1000.0


def test_no_strand_where_density_or_length_is_zero(sphere: Surface) -> None:
    top, front = sphere.positions[:, 2] > 0.3, sphere.positions[:, 1] < 0.2
    for settings in (GUIDES, PER_VERTEX):
        strands = grow_along_normals(sphere, settings, top.astype(float), front.astype(float))
        assert strands.lengths().min() > 0.0
        assert strands.roots[:, 2].min() > 0.3 - 0.09
        assert strands.roots[:, 1].max() < 0.2 + 0.12  # up to one triangle beyond the last vertex


# --- bad input -----------------------------------------------------------------------------------


def test_broken_triangles_and_loose_vertices_grow_nothing(egg: Surface) -> None:
    """A triangle without area, one on a line, a loose vertex, and two faces back to back."""
    extra = np.array([[1, 0, 0], [1, 0, 0], [1, 0, 1], [2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0]])
    back = np.array([[6, 0, 0], [6, 1, 0], [6, 0, 1]])
    n = len(egg.positions)
    broken = np.array([[0, 1, 2], [3, 4, 5], [0, 0, 0]]) + n
    doubled = np.array([[7, 8, 9], [7, 9, 8]]) + n
    surface = Surface(
        np.concatenate([egg.positions, extra, back]),
        np.concatenate([broken, egg.triangles, doubled]),
    )
    for settings in (GUIDES, PER_VERTEX):
        strands = grow_along_normals(surface, settings)
        assert np.isfinite(strands.points).all()
        assert strands.lengths() == pytest.approx(np.full(strands.strand_count, 0.1), rel=1e-5)
        assert not ((strands.roots[:, 0] > 0.5) & (strands.roots[:, 0] < 5.5)).any()
    on_doubled = grow_along_normals(surface, PER_VERTEX).grid[-3:]
    assert np.abs(np.diff(on_doubled, axis=1)[..., 1:]).max() < 1e-6  # along x, its own normal


@pytest.mark.parametrize("settings", [GUIDES, PER_VERTEX], ids=["spread", "per vertex"])
def test_weights_that_cannot_be_used_are_named(egg: Surface, settings: GrowSettings) -> None:
    count = len(egg.positions)
    gap = np.ones(count)
    gap[7] = np.nan
    for bad, message in (
        (np.zeros(count), "0 on every vertex"),
        (np.full(count, -1.0), "0 on every vertex"),
        (gap, "not a finite number"),
        (np.ones(count + 1), "vertices"),
        (np.ones((count, 3)), "vertices"),
    ):
        with pytest.raises(HairloomError, match=message) as caught:
            grow_along_normals(egg, settings, density=bad)
        assert caught.value.place == "density"
        with pytest.raises(HairloomError, match=message) as caught:
            grow_along_normals(egg, settings, length=bad)
        assert caught.value.place == "length"


def test_nowhere_to_grow_is_reported(egg: Surface) -> None:
    top = (egg.positions[:, 2] > 0.05).astype(float)
    bottom = (egg.positions[:, 2] < -0.05).astype(float)
    flat = Surface(np.zeros((3, 3)), [[0, 1, 2]])
    no_faces = Surface(egg.positions, np.zeros((0, 3)))
    for settings, message in ((GUIDES, "no area"), (PER_VERTEX, "no vertex")):
        with pytest.raises(HairloomError, match=message):
            grow_along_normals(egg, settings, density=top, length=bottom)
        for surface in (flat, no_faces):
            with pytest.raises(HairloomError, match=message):
                grow_along_normals(surface, settings)
    low = GrowSettings(**PER_VERTEX.as_dict() | {"threshold": 0.9})
    with pytest.raises(HairloomError, match="lower the threshold"):
        grow_along_normals(egg, low, density=top * 0.5)


def test_fur_leans_back_and_down_and_bends_to_the_skin(sphere: Surface) -> None:
    settings = replace(GUIDES, strand_count=2000, lift=0.5)
    strands = grow_along_normals(sphere, settings)
    assert strands.lengths() == pytest.approx(np.full(2000, 0.1), rel=1e-4)
    step, normal = directions(strands), strands.roots.astype(np.float64)
    rise = np.einsum("scj,sj->sc", step, normal)
    # on the flanks, far from where hair is upright because it leans to neither side
    flank = np.abs(normal[:, 0]) > 0.5
    angle = np.degrees(np.arcsin(np.clip(rise[flank], -1.0, 1.0)))
    assert 35.0 < np.median(angle[:, 0]) < 55.0
    assert (np.diff(angle, axis=1) < 0.0).mean() > 0.99, "ever nearer to the skin"
    assert rise[flank].min() > 0.0, "and never into it"
    way = strands.grid[flank, -1] - strands.grid[flank, 0]
    assert (way[:, 2] < 0.0).mean() > 0.7 and (way[:, 1] > 0.0).mean() > 0.7
    # tufts: neighbours lean more alike than any two do
    flat = step[:, -1] - rise[:, -1:] * normal
    alike = (flat[1:] * flat[:-1]).sum(axis=1)[flank[1:] & flank[:-1]]
    assert np.median(alike) > np.median((flat[flank] @ flat[flank].T).ravel())
