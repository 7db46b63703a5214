"""Children: a smaller number is the beginning of a larger one, and none crosses a parting."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat_ground import children_settings, guides_at, sheet
from tiers import few_in_commits

from hairloom.addon.arrays import Floats
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.children import Children, make_children
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.roots import bind_roots, root_frames
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.nearest import nearest_points


def spread_guides(surface: Surface, count: int = 100, seed: int = 1) -> StrandSet:
    """Guides at random places of a sheet from 0 to 1, in random, mostly upward directions."""
    random = np.random.default_rng(seed)
    root = random.random((count, 3)) * [1.0, 1.0, 0.0]
    return guides_at(surface, root, random.normal(0.0, 0.05, (count, 3)) + [0.1, 0.0, 0.5])


@pytest.fixture(scope="module")
def groomed(egg: Surface) -> StrandSet:
    """Combed guides on an egg, in two groups."""
    guides = grow(egg, GrowSettings(strand_count=200, cv_count=12), scalp_density(egg))
    return replace(guides, group=np.where(guides.roots[:, 0] < 0.02, 3, 7))


# --- order ---------------------------------------------------------------------------------------


@pytest.mark.alike
@pytest.mark.parametrize(
    ("way", "is_painted"), [("multi", False), ("multi", True), ("single", False)]
)
def test_more_children_move_none(
    egg: Surface, groomed: StrandSet, way: str, is_painted: bool
) -> None:
    """Bit for bit, also beyond the count at which clumps get clumps of their own."""
    density = np.maximum(egg.positions[:, 2], 0.0) if is_painted else None
    values = {"clump": 0.8, "clump_size": 5, "frizz": 0.002, "length_variation": 0.3}
    values |= {"baby_hair": 0.7}

    def children(count: int) -> Children:
        chosen = children_settings(method=way, strand_count=count, **values)
        return make_children(groomed, egg, chosen, density, place="test")

    most = children(9000)
    assert most.strands.strand_count == 9000
    for count in (0, 1, 257, 4095, 4100):
        fewer = children(count)
        first = most.strands.take(np.arange(count))
        assert fewer.strands.strand_count == count
        assert (fewer.strands.points == first.points).all()
        assert (fewer.strands.radius == first.radius).all()
        assert (fewer.strands.group == first.group).all()
        assert (fewer.strands.root_triangle == first.root_triangle).all()
        assert (fewer.strands.root_barycentric == first.root_barycentric).all()
        assert (fewer.weights.guide == most.weights.guide[:count]).all()
        assert (fewer.weights.weight == most.weights.weight[:count]).all()


def test_the_seed_decides_and_nothing_else_does(egg: Surface, groomed: StrandSet) -> None:
    def points(seed: int) -> Floats:
        chosen = ChildrenSettings(method="multi", strand_count=50, seed=seed)
        return make_children(groomed, egg, chosen, place="test").strands.points

    assert (points(1) == points(1)).all()
    assert (points(1) != points(2)).any()


# --- where they grow -----------------------------------------------------------------------------


def test_children_are_bound_where_they_start(egg: Surface, groomed: StrandSet) -> None:
    chosen = ChildrenSettings(method="multi", strand_count=500)
    strands = make_children(groomed, egg, chosen, place="test").strands
    assert strands.grid.shape == (500, 12, 3)
    assert strands.root_triangle is not None
    assert strands.root_barycentric is not None
    frames = root_frames(
        egg.positions, egg.triangles, strands.root_triangle, strands.root_barycentric
    )
    assert (strands.roots == frames.origin.astype(np.float32)).all()
    again = bind_roots(replace(strands, root_uv=None), egg, place="test").strands
    assert strands.root_uv == pytest.approx(again.root_uv, abs=1e-3)


def test_children_grow_among_guides_and_end_where_they_end() -> None:
    """Guides in two rectangles of one sheet; a gap of ten spacings between them stays bare."""
    surface = sheet(40)
    x, y = np.meshgrid(np.linspace(0.1, 0.3, 9), np.linspace(0.1, 0.9, 33))
    left = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    root = np.concatenate([left, left + [0.45, 0.0, 0.0]])
    guides = guides_at(surface, root, np.tile([0.0, 0.0, 0.2], (len(root), 1)))
    children = make_children(guides, surface, children_settings(strand_count=3000), place="test")
    at = children.strands.roots
    margin = 0.41 * 0.0354  # the third neighbour of a corner is across a square of guides
    assert children.notes == ()
    is_left = at[:, 0] < 0.425
    for part, start in ((at[is_left], 0.1), (at[~is_left], 0.55)):
        assert part[:, 0].min() > start - margin
        assert part[:, 0].max() < start + 0.2 + margin
        assert part[:, 1].min() > 0.1 - margin
        assert part[:, 1].max() < 0.9 + margin
    columns, _, _ = np.histogram2d(
        at[:, 0], at[:, 1], bins=[[0.1, 0.2, 0.3], np.linspace(0.1, 0.9, 9)]
    )
    assert columns.min() > 0.8 * columns.max()  # evenly between guides


def test_sparse_guides_are_as_good_as_dense_ones() -> None:
    """Half of the sheet has guides five times as far apart; children cover both alike."""
    surface = sheet(30)
    dense = np.stack(np.meshgrid(np.arange(0.02, 0.5, 0.02), np.arange(0.0, 1.01, 0.02)), -1)
    sparse = np.stack(np.meshgrid(np.arange(0.55, 1.01, 0.1), np.arange(0.0, 1.01, 0.1)), -1)
    flat = np.concatenate([dense.reshape(-1, 2), sparse.reshape(-1, 2)])
    root = np.concatenate([flat, np.zeros((len(flat), 1))], axis=1)
    guides = guides_at(surface, root, np.tile([0.0, 0.0, 0.2], (len(root), 1)))
    at = make_children(
        guides, surface, children_settings(strand_count=4000), place="test"
    ).strands.roots
    is_inside = (at[:, 1] > 0.1) & (at[:, 1] < 0.9)
    in_dense = is_inside & (at[:, 0] > 0.05) & (at[:, 0] < 0.45)
    in_sparse = is_inside & (at[:, 0] > 0.57) & (at[:, 0] < 0.97)
    assert in_dense.sum() == pytest.approx(in_sparse.sum(), rel=0.05)


def test_the_inside_of_a_shell_stays_bare() -> None:
    outside = sheet()
    inside = Surface(outside.positions - [0.0, 0.0, 0.01], outside.triangles[:, ::-1])
    both = Surface(
        np.concatenate([outside.positions, inside.positions]),
        np.concatenate([outside.triangles, inside.triangles + len(outside.positions)]),
    )
    at = make_children(spread_guides(both), both, children_settings(), place="test").strands.roots
    assert (at[:, 2] == 0.0).all()


def test_few_guides_on_one_large_triangle_get_all_their_children() -> None:
    """Only a hundred-thousandth of the triangle's area is near guides."""
    surface = Surface([[-50, -50, 0], [100, -50, 0], [-50, 100, 0]], [[0, 1, 2]])
    guides = spread_guides(surface, 50)
    at = make_children(guides, surface, children_settings(), place="test").strands.roots
    assert len(at) == 400
    assert at.min() > -0.3
    assert at.max() < 1.3


def test_a_density_says_where_and_how_many() -> None:
    surface = sheet(20)
    guides = spread_guides(surface, 300)
    density = np.where(surface.positions[:, 0] < 0.5, 1.0, 3.0)
    density[surface.positions[:, 1] > 0.7] = 0.0
    children = make_children(
        guides, surface, children_settings(strand_count=2000), density, place="test"
    )
    at = children.strands.roots
    assert children.notes == ()
    assert at[:, 1].max() <= 0.75
    assert (at[:, 0] > 0.55).sum() / (at[:, 0] < 0.45).sum() == pytest.approx(3.0, rel=0.1)


def test_a_brush_moves_those_alone_that_it_touches() -> None:
    """Where less density is painted, a part of the former roots stays; elsewhere more are added,
    since the total is constant."""
    surface = sheet(20)
    guides = spread_guides(surface, 300)
    away = np.linalg.norm(surface.positions[:, :2] - [0.4, 0.5], axis=1)

    def roots(weight: float) -> tuple[set[bytes], set[bytes]]:
        density = np.where(away < 0.2, weight, 1.0)
        made = make_children(
            guides, surface, children_settings(strand_count=2000), density, place="test"
        )
        at = made.strands.roots
        gap = np.linalg.norm(at[:, :2] - [0.4, 0.5], axis=1)
        return {p.tobytes() for p in at[gap < 0.13]}, {p.tobytes() for p in at[gap > 0.27]}

    (inside, outside), (fewer, more) = roots(1.0), roots(0.4)
    assert fewer < inside and outside < more
    assert len(fewer) / len(inside) == pytest.approx(0.4 * len(more) / len(outside), rel=0.15)


def test_a_painted_area_without_guides_stays_bare_and_is_reported() -> None:
    surface = sheet(20, 10.0)
    guides = spread_guides(surface, 100)
    children = make_children(guides, surface, children_settings(), np.ones(441), place="test")
    assert children.strands.strand_count == 400
    assert children.strands.roots.max() < 2.0
    assert [note for note in children.notes if "stays bare" in note]


# --- what they are mixed from --------------------------------------------------------------------


def test_in_the_middle_of_three_guides_a_child_is_their_mean() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])
    surface = Surface(corners, [[0, 1, 2]])
    ways = np.array([[0.1, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 1.3]])
    guides = guides_at(surface, corners, ways)
    children = make_children(guides, surface, children_settings(strand_count=2000), place="test")
    roots, weights = children.strands.roots, children.weights.weight
    middle = np.linalg.norm(roots - corners.mean(axis=0), axis=1).argmin()
    assert weights[middle] == pytest.approx(np.full(3, 1 / 3), abs=0.05)
    share = np.linspace(0.0, 1.0, 9)[:, None]
    assert children.strands.grid[middle] == pytest.approx(
        roots[middle] + share * ways.mean(axis=0), abs=0.02
    )


def test_a_child_is_its_root_and_the_weighted_ways_of_its_guides(
    egg: Surface, groomed: StrandSet
) -> None:
    children = make_children(groomed, egg, children_settings(width=2.0), place="test")
    strands, weights = children.strands, children.weights
    grid, radius = groomed.grid.astype(np.float64), groomed.radius.reshape(-1, 12)
    for child in range(0, 400, 7):
        mixed = strands.roots[child].astype(np.float64)
        width = 0.0
        for guide, weight in zip(weights.guide[child], weights.weight[child], strict=True):
            mixed = mixed + weight * (grid[guide] - grid[guide, 0])
            width = width + 2.0 * weight * radius[guide]
        assert strands.grid[child] == pytest.approx(mixed, abs=1e-6)
        assert strands.radius.reshape(-1, 12)[child] == pytest.approx(width, rel=1e-5)


def test_single_strands_run_beside_their_nearest_guide(egg: Surface, groomed: StrandSet) -> None:
    children = make_children(groomed, egg, children_settings(method="single"), place="test")
    weights, strands = children.weights, children.strands
    apart = np.linalg.norm(strands.roots[:, None] - groomed.roots[None], axis=2)
    assert (weights.guide == apart.argmin(axis=1)[:, None]).all()
    assert (weights.weight == [1.0, 0.0, 0.0]).all()
    offset = strands.grid - groomed.grid[weights.guide[:, 0]]
    assert offset == pytest.approx(np.repeat(offset[:, :1], 12, axis=1), abs=1e-6)


@pytest.mark.parametrize("way", ["multi", "single"])
def test_groups_are_never_mixed(egg: Surface, groomed: StrandSet, way: str) -> None:
    chosen = ChildrenSettings(method=way, strand_count=2000, clump=1.0, frizz=0.0)
    children = make_children(groomed, egg, chosen, place="test")
    group = groomed.group[children.weights.guide]
    assert set(children.strands.group.tolist()) == {3, 7}
    assert (group == children.strands.group[:, None]).all()


def combed_apart() -> tuple[Surface, StrandSet]:
    """A flat scalp parted at x = 0.5, with hair that falls to the left and to the right."""
    surface = sheet()
    random = np.random.default_rng(2)
    root = random.random((150, 3)) * [1.0, 1.0, 0.0]
    side = np.where(root[:, 0] < 0.5, -1.0, 1.0)
    way = np.stack([side, random.normal(0.0, 0.05, 150), np.full(150, 0.3)], axis=1) * 0.3
    return surface, guides_at(surface, root, way)


@pytest.mark.parametrize("way", ["multi", "single"])
def test_a_parting_stays(way: str) -> None:
    """Every child falls entirely to one side; if partings are mixed, some fall to none."""
    surface, guides = combed_apart()

    def least_sideways(**values: Any) -> float:
        chosen = children_settings(method=way, strand_count=3000, clump_size=8, **values)
        grid = make_children(guides, surface, chosen, place="test").strands.grid
        return float(np.abs(grid[:, -1, 0] - grid[:, 0, 0]).min())

    assert least_sideways(parting=np.radians(60.0)) > 0.299
    if way == "multi":
        assert least_sideways(parting=np.pi) < 0.15
    # nor do clumps reach across, which would turn their members back
    assert least_sideways(parting=np.radians(60.0), clump=1.0) > 0.2


def test_three_guides_of_which_two_go_apart_are_not_mixed() -> None:
    """Fanned out by 40 degrees each, so that the outer two are 80 apart, beyond the parting
    angle."""
    surface = sheet()
    angle = np.radians(np.linspace(-80.0, 80.0, 5))
    way = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    place = np.array([[0.2, 0.2], [0.8, 0.2], [0.5, 0.5], [0.2, 0.8], [0.8, 0.8]])
    root = np.concatenate([place, np.zeros((5, 1))], axis=1)
    guides = guides_at(surface, root, way)
    chosen = children_settings(strand_count=2000, parting=np.radians(65.0))
    weights = make_children(guides, surface, chosen, place="test").weights
    for one, two in itertools.combinations(range(3), 2):
        both = (weights.weight[:, one] > 0.0) & (weights.weight[:, two] > 0.0)
        cosine = np.einsum("nj,nj->n", way[weights.guide[:, one]], way[weights.guide[:, two]])
        assert (cosine[both] >= np.cos(np.radians(65.0))).all()
    assert (weights.weight[:, 1] > 0.0).mean() > 0.3


# --- what makes them differ ----------------------------------------------------------------------


def turned(grid: Floats) -> Floats:
    """Straight strands replaced with quarter circles."""
    angle = np.linspace(0.0, 0.5 * np.pi, grid.shape[1])
    arc = np.stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1) * 0.3
    return grid[:, :1] + arc


def test_lengths_lie_in_the_range_and_on_the_way_of_the_guides() -> None:
    surface = sheet()
    guides = spread_guides(surface)
    guides = guides.with_points(turned(guides.grid).reshape(-1, 3))
    whole = make_children(guides, surface, children_settings(), place="test").strands
    cut = make_children(
        guides, surface, children_settings(length_variation=0.6), place="test"
    ).strands
    share = cut.lengths() / whole.lengths()
    assert share.min() == pytest.approx(0.4, abs=0.02)
    assert share.max() == pytest.approx(1.0, abs=0.02)
    assert share.mean() == pytest.approx(0.7, abs=0.02)
    # all points stay on the circle, and tips are at the remaining length along it
    middle = cut.roots + np.array([0.3, 0.0, 0.0], np.float32)
    away = np.linalg.norm(cut.grid - middle[:, None], axis=2)
    assert away == pytest.approx(np.full(away.shape, 0.3), abs=1e-3)  # chords would be 1.4e-3 off
    segment = np.linalg.norm(np.diff(cut.grid, axis=1), axis=2)
    assert segment == pytest.approx(np.tile(segment.mean(1)[:, None], 8), rel=0.02)


def test_scattered_children_differ_from_their_neighbours_as_guides_do() -> None:
    """Otherwise fur would form patches around its guides that reflect light differently."""
    surface, guides = sheet(), spread_guides(sheet(), 400)
    ways = guides.grid[:, -1] - guides.grid[:, 0]

    def unlike(scatter: float) -> float:
        """Mean difference of a child's vector from root to tip and its nearest neighbour's."""
        made = make_children(
            guides, surface, children_settings(strand_count=4000, scatter=scatter), place="test"
        ).strands.grid
        near, _ = nearest_points(made[:, 0], made[:, 0], 2)
        way = made[:, -1] - made[:, 0]
        return float(np.linalg.norm(way - way[near[:, 1]], axis=1).mean())

    random = np.random.default_rng(1).permutation(len(ways))
    of_guides = float(np.linalg.norm(ways - ways[random], axis=1).mean())
    # a child is the mean of up to three guides
    assert unlike(1.0) > 0.5 * of_guides > 1.5 * unlike(0.0)


def test_more_scattered_children_move_none() -> None:
    surface, guides = sheet(), spread_guides(sheet())
    few, many = (
        make_children(guides, surface, children_settings(strand_count=n, scatter=1.0), place="test")
        for n in (100, 400)
    )
    np.testing.assert_array_equal(few.strands.grid, many.strands.grid[:100])


def test_clump_draws_the_tips_of_locks_together() -> None:
    """By the factor `clump`, towards one of the first children; roots and clump middles stay."""
    surface = sheet()
    guides = spread_guides(surface, 400)
    count, size = 2000, 16
    loose = make_children(
        guides, surface, children_settings(strand_count=count), place="test"
    ).strands
    chosen = children_settings(strand_count=count, clump=0.7, clump_size=size)
    drawn = make_children(guides, surface, chosen, place="test").strands
    middles = 4096 // size
    assert (drawn.roots == loose.roots).all()
    assert (
        drawn.points.reshape(count, -1)[:middles] == loose.points.reshape(count, -1)[:middles]
    ).all()

    move = (drawn.grid - loose.grid)[middles:]
    goal = loose.grid[middles:] + move / 0.7
    to_middle = np.linalg.norm(goal[:, None, -1] - loose.grid[None, :middles, -1], axis=2)
    middle = to_middle.argmin(axis=1)
    assert to_middle.min(axis=1).max() < 1e-5
    share = np.linspace(0.0, 1.0, 9)[None, :, None]
    expected = 0.7 * share * (loose.grid[middle] - loose.grid[middles:])
    assert move == pytest.approx(expected, abs=1e-6)
    # the middle is the nearest one, so clumps are compact
    root = loose.roots
    apart = np.linalg.norm(root[middles:, None] - root[None, :middles], axis=2)
    assert (apart.argmin(axis=1) == middle).mean() > 0.99


def test_locks_stay_as_large_as_children_get_more() -> None:
    """With twice as many children there are twice as many clump middles."""
    surface = sheet()
    guides = spread_guides(surface, 200)
    chosen = children_settings(strand_count=16_384, clump=1.0, clump_size=32)
    tips = make_children(guides, surface, chosen, place="test").strands.grid[:, -1]
    for first, last in ((0, 4096), (4096, 8192), (8192, 16_384)):
        places = np.unique(tips[:last].round(5), axis=0)
        assert len(places) <= 1.02 * 4096 / 32  # clumps of clumps end where the first ones do
        assert len(np.unique(tips[first:last].round(5), axis=0)) > 100


def test_frizz_strays_as_far_as_it_says_and_not_at_the_root(
    egg: Surface, groomed: StrandSet
) -> None:
    flat = (1.0, 1.0, 1.0, 1.0, 1.0)
    calm = make_children(
        groomed, egg, children_settings(strand_count=2000), place="test"
    ).strands.grid

    def strayed(**values: Any) -> Floats:
        chosen = children_settings(strand_count=2000, frizz=0.004, **values)
        grid = make_children(groomed, egg, chosen, place="test").strands.grid
        assert (grid[:, 0] == calm[:, 0]).all()
        return np.asarray(grid - calm) / float(np.median(groomed.lengths()))

    away = np.linalg.norm(strayed(frizz_along=flat), axis=2)[:, 1:]
    assert away.max() <= 0.004 * (1.0 + 1e-3)
    assert away.max() > 0.0039
    assert np.sqrt((away**2).mean(axis=0)) == pytest.approx(np.full(11, 0.002), rel=0.1)
    assert np.abs(strayed(frizz_along=flat).mean(axis=(0, 1))).max() < 1e-4  # to no side
    to_tip = np.linalg.norm(strayed(frizz_along=(0.0, 0.0, 0.0, 0.0, 1.0)), axis=2)
    assert to_tip[:, :8].max() == 0.0
    assert to_tip[:, -1].max() > 0.003


def test_frizz_is_smooth_and_of_the_length_it_says(egg: Surface) -> None:
    """It changes sides about twice per wave, and not at every CV."""
    straight = GrowSettings(
        method="normals",
        strand_count=200,
        cv_count=32,
        length=0.3,
        length_variation=0.0,
        segment_ratio=1.0,
    )
    guides = grow(egg, straight)
    calm = make_children(guides, egg, children_settings(), place="test").strands.grid

    def sides(frizz_length: float) -> float:
        chosen = children_settings(frizz=0.008, frizz_length=frizz_length / 0.3)
        stray = make_children(guides, egg, chosen, place="test").strands.grid - calm
        return float((np.diff(np.sign(stray[:, 1:, 0]), axis=1) != 0.0).sum(axis=1).mean())

    long, short, shortest = sides(0.3), sides(0.06), sides(0.0003)
    assert long < 3.5
    assert short == pytest.approx(2.0 * 0.3 / 0.06, rel=0.35)
    assert shortest < 0.85 * 31  # three segments a wave, which strands can still show


# --- scale ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", few_in_commits([2.0**-10, 2.0**10]))
@pytest.mark.parametrize("method", ["multi", "single"])
def test_children_are_the_same_at_any_scale(
    egg: Surface, groomed: StrandSet, method: str, factor: float
) -> None:
    """With all settings that shape them: the same number, places and shapes."""
    chosen = ChildrenSettings(method=method, strand_count=1000)
    one = make_children(groomed, egg, chosen, place="test")
    larger = replace(egg, positions=egg.positions * np.float32(factor))
    guides = replace(
        groomed,
        points=groomed.points * np.float32(factor),
        radius=groomed.radius * np.float32(factor),
    )
    other = make_children(guides, larger, chosen, place="test")
    assert (other.strands.root_triangle == one.strands.root_triangle).all()
    size = float(np.median(groomed.lengths()))
    assert other.strands.points / factor == pytest.approx(one.strands.points, abs=1e-5 * size)
    assert other.strands.radius / factor == pytest.approx(one.strands.radius, rel=1e-5)
    assert other.notes == one.notes


# --- bad input -----------------------------------------------------------------------------------


def test_no_guides_and_nowhere_to_grow_are_reported(egg: Surface, groomed: StrandSet) -> None:
    with pytest.raises(HairloomError, match="no guides"):
        make_children(groomed.take(np.zeros(0, np.int64)), egg, children_settings(), place="test")
    with pytest.raises(HairloomError, match="no area"):
        make_children(groomed, egg, children_settings(), np.zeros(len(egg.positions)), place="test")
    with pytest.raises(HairloomError, match="vertices"):
        make_children(groomed, egg, children_settings(), np.ones(3), place="test")
    flat = Surface(0.0 * egg.positions, egg.triangles)
    with pytest.raises(HairloomError, match="no area"):
        make_children(groomed, flat, children_settings(), place="test")


def all_in_one_place(surface: Surface) -> StrandSet:
    return guides_at(surface, [[0.5, 0.5, 0.0]] * 7, np.random.default_rng(3).normal(size=(7, 3)))


def of_no_length(surface: Surface) -> StrandSet:
    return guides_at(
        surface, np.random.default_rng(4).random((20, 3)) * [1, 1, 0], np.zeros((20, 3))
    )


def guide_pairs(surface: Surface) -> StrandSet:
    """Each guide twice, so that its nearest neighbour is at the same place."""
    guides = spread_guides(surface, 30)
    return guides.take(np.repeat(np.arange(30), 2))


def first_guides(count: int) -> Callable[[Surface], StrandSet]:
    return lambda surface: spread_guides(surface, count)


@pytest.mark.alike
@pytest.mark.parametrize("way", ["multi", "single"])
@pytest.mark.parametrize(
    ("guides", "has_note"),
    [
        (first_guides(1), True),
        (first_guides(2), True),
        (first_guides(3), False),
        (all_in_one_place, True),
        (of_no_length, False),
        (guide_pairs, False),
    ],
    ids=["one", "two", "three", "one place", "no length", "pairs"],
)
def test_odd_guides_still_get_children(
    guides: Callable[[Surface], StrandSet], has_note: bool, way: str
) -> None:
    surface = sheet()
    chosen = ChildrenSettings(method=way, strand_count=300)
    children = make_children(guides(surface), surface, chosen, place="test")
    assert children.strands.strand_count == 300
    assert np.isfinite(children.strands.points).all()
    assert children.weights.weight.sum(axis=1) == pytest.approx(np.ones(300))
    if way == "multi":
        assert bool(children.notes) == has_note


def test_a_tuft_stays_close_to_its_guides() -> None:
    surface = sheet()
    guides = all_in_one_place(surface)
    at = make_children(guides, surface, children_settings(), place="test").strands.roots
    away = np.linalg.norm(at - [0.5, 0.5, 0.0], axis=1)
    assert away.max() <= 0.11 * guides.lengths().mean()


@pytest.mark.parametrize("extreme", ["low", "high"])
def test_all_extremes_of_the_sliders_give_finite_children(
    egg: Surface, groomed: StrandSet, extreme: str
) -> None:
    side = 0 if extreme == "low" else 1
    values = {
        p.name: p.hard_range[side]
        for p in ChildrenSettings.parameters()
        if p.hard_range is not None and p.name != "strand_count" and not p.name.endswith("_along")
    }
    chosen = ChildrenSettings.from_dict(values | {"strand_count": 300, "method": "multi"}, "test")
    children = make_children(groomed, egg, chosen, place="test")
    assert children.strands.strand_count == 300
    assert np.isfinite(children.strands.points).all()
