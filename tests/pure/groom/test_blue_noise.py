"""Blue-noise roots: a smaller number is the beginning of a larger one, spread by the density."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom import blue_noise
from hairloom.addon.groom.blue_noise import spread_roots
from hairloom.addon.groom.dart_throwing import Samples
from hairloom.addon.groom.triangle_subdivision import Pieces
from hairloom.addon.strands import Surface


def sheet(cells: int = 12, size: float = 1.0) -> Surface:
    """A flat square of triangles, from 0 to `size`."""
    x, y = np.meshgrid(*[np.linspace(0.0, size, cells + 1)] * 2, indexing="ij")
    row, column = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    a = (row * (cells + 1) + column).ravel()
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    positions = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    return Surface(positions, np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)]))


def spread(surface: Surface, count: int, density: Floats | None, seed: int) -> Samples:
    return spread_roots(Pieces.of(surface, density), count, seed)


def points(surface: Surface, roots: Samples) -> Floats:
    corners = surface.corners[roots.triangle].astype(np.float64)
    return np.einsum("nk,nkj->nj", roots.barycentric, corners)


def nearest(of: Floats) -> Floats:
    """Distance of each point to the nearest other one, (n,), by brute force."""
    squared = ((of[:, None] - of[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    return np.sqrt(squared.min(axis=1))


# --- order ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("is_dense_everywhere", few_in_commits([False, True]))
def test_a_smaller_count_is_the_beginning_of_a_larger_one(
    egg: Surface, is_dense_everywhere: bool
) -> None:
    density = None if is_dense_everywhere else np.maximum(egg.positions[:, 2], 0.0)
    roots = spread(egg, 5000, density, 1)
    assert roots.triangle.shape == (5000,)
    assert roots.barycentric.shape == (5000, 3)
    for count in (0, 1, 2, 17, 400, 1024, 4999):
        fewer = spread(egg, count, density, 1)
        assert (fewer.triangle == roots.triangle[:count]).all()
        assert (fewer.barycentric == roots.barycentric[:count]).all()
        assert (fewer.key == roots.key[:count]).all()


def test_the_seed_decides_and_nothing_else_does(egg: Surface) -> None:
    one, again, other = (spread(egg, 300, None, seed) for seed in (1, 1, 2))
    assert (one.triangle == again.triangle).all()
    assert (one.barycentric == again.barycentric).all()
    assert (one.barycentric != other.barycentric).any()


def test_roots_have_names_of_their_own(egg: Surface) -> None:
    assert len(np.unique(spread(egg, 5000, None, 1).key)) == 5000
    assert not np.isin(spread(egg, 5000, None, 2).key, spread(egg, 5000, None, 1).key).any()


@pytest.mark.alike
@pytest.mark.parametrize("factor", [1e-3, 1.0 / 1024.0, 1.7, 1e3, 1024.0])
def test_another_size_hardly_changes_the_roots(egg: Surface, factor: float) -> None:
    """Only rounding differs, and not even that if the ratio is a power of two."""
    sized = replace(egg, positions=egg.positions * np.float32(factor))
    one, other = spread(egg, 5000, None, 1), spread(sized, 5000, None, 1)
    places = dict(zip(one.key.tolist(), one.barycentric, strict=True))
    same = [key for key in other.key.tolist() if key in places]
    is_exact = float(np.log2(factor)).is_integer()
    assert len(same) == 5000 if is_exact else len(same) > 0.97 * 5000
    theirs = dict(zip(other.key.tolist(), other.barycentric, strict=True))
    assert all((places[key] == theirs[key]).all() for key in same)


def test_an_edit_changes_the_roots_beside_it_alone() -> None:
    """If one of 288 triangles is removed, nearly all roots of the others stay."""
    surface = sheet()
    moved = surface.triangles.copy()
    moved[100] = 0
    edited = replace(surface, triangles=moved)
    one, other = (spread(each, 3000, None, 1) for each in (surface, edited))
    elsewhere = one.triangle != 100
    assert np.isin(one.key[elsewhere], other.key).mean() > 0.9


def test_a_part_of_a_surface_has_the_roots_of_the_whole_there() -> None:
    """Except near the border, where darts beyond it reject others, which reject others in turn."""
    pieces = Pieces.of(sheet(), None)
    left = pieces.take(pieces.point[..., 0].max(axis=1) < 0.51)
    whole = spread_roots(pieces, 1000, 1)
    part = spread_roots(left, 1000, 1, pieces)
    inside = whole.key[whole.point[:, 0] < -0.25]
    assert np.isin(inside, part.key).mean() > 0.5


# --- how they lie --------------------------------------------------------------------------------


def test_roots_lie_inside_their_triangles(egg: Surface) -> None:
    barycentric = spread(egg, 3000, None, 3).barycentric
    assert barycentric.min() >= 0.0
    assert barycentric.sum(axis=1) == pytest.approx(np.ones(3000))


def test_every_beginning_is_spread_like_blue_noise() -> None:
    """Distances of nearest neighbours against those of a hexagonal grid, the optimum.

    White noise has a mean of 0.47 and a minimum near 0; pure dart throwing, until no more fit, has
    a minimum of 0.77.
    """
    surface = sheet()
    roots = points(surface, spread(surface, 3000, None, 1))
    white = np.random.default_rng(1).random((2000, 3)) * [1.0, 1.0, 0.0]
    for count in (150, 500, 1000, 1300, 1700, 2200, 3000):
        hexagonal = np.sqrt(2.0 / np.sqrt(3.0) / count)
        distance = nearest(roots[:count]) / hexagonal
        assert distance.min() > 0.53
        assert distance.mean() > 0.74
    noise = nearest(white) / np.sqrt(2.0 / np.sqrt(3.0) / 2000)
    assert noise.min() < 0.05
    assert noise.mean() < 0.5


def test_distances_follow_the_density() -> None:
    """With sixteen times the density, distances are a quarter; both halves keep their minimum."""
    surface = sheet()
    density = np.where(surface.positions[:, 0] < 0.5, 1.0, 16.0)
    roots = points(surface, spread(surface, 3000, density, 2))
    distance = nearest(roots)
    thin, dense = roots[:, 0] < 0.4, roots[:, 0] > 0.6
    for part, area in ((thin, 0.4), (dense, 0.4)):
        hexagonal = np.sqrt(2.0 / np.sqrt(3.0) * area / part.sum())
        assert distance[part].min() > 0.5 * hexagonal
    assert distance[thin].mean() / distance[dense].mean() == pytest.approx(4.0, rel=0.05)


def test_counts_follow_area_and_density(egg: Surface) -> None:
    """The chi-square of roots in slices of the egg against the integral of the density.

    For white noise its mean is the degrees of freedom, here 11; for blue noise it is smaller.
    """
    density = 1.2 + np.sin(20.0 * egg.positions[:, 2]).astype(np.float64)
    count = 20_000
    height = points(egg, spread(egg, count, density, 4))[:, 2]

    corners = egg.corners.astype(np.float64)
    cuts = np.random.default_rng(5).dirichlet([1.0, 1.0, 1.0], 300)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    mass = area[:, None] * (density[egg.triangles] @ cuts.T)
    edges = np.linspace(-0.12, 0.12, 13)
    expected, _ = np.histogram(corners[..., 2] @ cuts.T, edges, weights=mass)
    expected *= count / expected.sum()
    found, _ = np.histogram(height, edges)
    assert ((found - expected) ** 2 / expected).sum() < 11.0


def test_density_is_linear_within_a_triangle() -> None:
    """One triangle with density at one corner: its coordinate b has the density b, and the mean
    1 / 2."""
    surface = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    barycentric = spread(surface, 4000, np.array([1.0, 0.0, 0.0]), 6).barycentric
    assert barycentric.mean(axis=0) == pytest.approx([0.5, 0.25, 0.25], abs=0.005)
    assert (barycentric[:, 0] < 0.5).mean() == pytest.approx(0.5, abs=0.01)  # 3 b^2 - 2 b^3


def test_no_roots_where_the_density_is_zero(egg: Surface) -> None:
    density = (egg.positions[:, 2] > 0.03).astype(np.float64)
    roots = spread(egg, 2000, density, 7)
    at_corners = density[egg.triangles[roots.triangle]]
    assert np.einsum("nk,nk->n", roots.barycentric, at_corners).min() > 0.0


# --- bad input -----------------------------------------------------------------------------------


def test_nowhere_to_grow_is_reported(egg: Surface) -> None:
    flat = Surface(np.zeros((3, 3)), [[0, 1, 2]])
    no_faces = Surface(np.zeros((3, 3)), np.zeros((0, 3)))
    for surface in (flat, no_faces):
        with pytest.raises(HairloomError, match="no area"):
            spread(surface, 10, None, 1)
    lone = Surface(np.concatenate([egg.positions, [[9, 9, 9]]]), egg.triangles)
    on_no_face = np.append(np.zeros(len(egg.positions)), 1.0)
    for surface, density in ((egg, np.zeros(len(egg.positions))), (lone, on_no_face)):
        with pytest.raises(HairloomError, match="no area"):
            spread(surface, 10, density, 1)


def stacked_sheets() -> Surface:
    """A thousand coincident faces."""
    triangles = np.tile([[0, 1, 2]], (1000, 1))
    return Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles)


def needle_and_dust() -> Surface:
    """A sliver a million times as long as wide, one without area, and tiny triangles around a
    point."""
    speck = np.random.default_rng(8).normal(0.0, 1e-6, (300, 3)) + [0.5, 0.5, 0.5]
    corners = [[0, 0, 0], [1, 0, 0], [0, 1e-6, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]]
    return Surface(np.concatenate([corners, speck]), np.arange(306).reshape(-1, 3))


@pytest.mark.parametrize(
    "surface",
    [stacked_sheets(), needle_and_dust(), sheet(3, 1e15), sheet(3, 1e-15)],
    ids=["stacked", "needle", "huge", "tiny"],
)
def test_odd_surfaces_get_their_roots_in_order(surface: Surface) -> None:
    barycentric = spread(surface, 6000, None, 9).barycentric
    assert len(barycentric) == 6000
    assert np.isfinite(barycentric).all()
    fewer = spread(surface, 1500, None, 9)
    assert (fewer.barycentric == barycentric[:1500]).all()


def test_a_full_surface_goes_on_with_plain_roots(monkeypatch: pytest.MonkeyPatch) -> None:
    """If every level counts as full, all roots after the first level are white noise, in a fixed
    order."""
    monkeypatch.setattr(blue_noise, "_FULL", 2.0)
    monkeypatch.setattr(blue_noise, "_FIRST_SURE", 0.0)
    surface = sheet()
    barycentric = spread(surface, 70_000, None, 1).barycentric
    fewer = spread(surface, 500, None, 1)
    assert (fewer.barycentric == barycentric[:500]).all()
    found = nearest(points(surface, fewer)) / np.sqrt(2.0 / np.sqrt(3.0) / 500)
    assert found.mean() < 0.6  # as white noise
