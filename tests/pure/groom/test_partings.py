"""Partings: the sides of roots against the formula of the line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flat_ground import children_settings, guides_at, sheet

from hairloom.addon.arrays import Bools, Floats
from hairloom.addon.groom.children import make_children
from hairloom.addon.groom.parting_settings import PartingSettings
from hairloom.addon.groom.partings import Partings, comb_from_partings
from hairloom.addon.groom.weights import guide_weights
from hairloom.addon.strands import StrandSet, Surface

SURFACE = sheet()


def waved(y: Floats) -> Floats:
    """The line's x at y."""
    return 0.5 + 0.08 * np.sin(9.0 * y)


def line(first: float = -0.05, last: float = 1.05, pieces: int = 120) -> Floats:
    """The straight pieces of the line, a little above the sheet."""
    y = np.linspace(first, last, pieces + 1)
    points = np.stack([waved(y), y, np.full(len(y), 0.01)], axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)


def is_right(points: Floats) -> Bools:
    return points[..., 0] > waved(points[..., 1])


def upright(count: int = 150, **values: Any) -> StrandSet:
    """Upright guides, which only a line can part; none lies on the line."""
    random = np.random.default_rng(4)
    root = random.random((count, 3)) * [1.0, 1.0, 0.0]
    root = root[np.abs(root[:, 0] - waved(root[:, 1])) > 1e-3]
    return guides_at(SURFACE, root, np.tile([0.0, 0.0, 0.3], (len(root), 1)), **values)


def both_sides(guides: StrandSet, weights: Any) -> Bools:
    """Whether each strand blends guides of both sides of the line."""
    side = is_right(guides.roots)[weights.guide]
    counts = weights.weight > 0.0
    return (side & counts).any(axis=1) & (~side & counts).any(axis=1)


@pytest.mark.parametrize(
    "values", [{}, {"scatter": 1.5}, {"method": "single"}, {"parting": 0.3}], ids=str
)
def test_no_child_blends_guides_of_both_sides_and_each_takes_its_own(values: Any) -> None:
    guides, partings = upright(), Partings.of(line(), SURFACE)
    chosen = children_settings(strand_count=3000, **values)
    made = make_children(guides, SURFACE, chosen, None, partings, place="test")
    assert not both_sides(guides, made.weights).any()
    root = made.strands.roots
    is_clear = np.abs(root[:, 0] - waved(root[:, 1])) > 1e-3  # the line is made of straight pieces
    of_guide = is_right(guides.roots)[made.weights.guide[:, 0]]
    assert (of_guide == is_right(root))[is_clear].all()
    if chosen.method == "multi":  # without the line, many do
        free = make_children(guides, SURFACE, chosen, None, place="test")
        assert both_sides(guides, free.weights).sum() > 100


def test_groups_of_both_sides_are_kept_as_well() -> None:
    """The nearest guide on the same side of the line decides about the group, not the nearest of
    all."""
    random = np.random.default_rng(2)
    guides = upright()
    guides = StrandSet(
        guides.points,
        guides.offsets,
        guides.radius,
        random.integers(0, 2, guides.strand_count),
        guides.root_uv,
        guides.root_triangle,
        guides.root_barycentric,
    )
    partings = Partings.of(line(), SURFACE)
    made = make_children(
        guides, SURFACE, children_settings(strand_count=2000), None, partings, place="test"
    )
    assert not both_sides(guides, made.weights).any()
    group = guides.group[made.weights.guide]
    assert (group == group[:, :1]).all()


def test_clumps_stay_on_their_side() -> None:
    """With full clumping, upright strands end above the middle of their clump."""
    partings = Partings.of(line(), SURFACE)
    chosen = children_settings(strand_count=4000, clump=1.0, clump_size=8, parting=3.0)
    for lines, count in ((partings, 0), (None, 20)):
        made = make_children(upright(), SURFACE, chosen, None, lines, place="test")
        root, tip = made.strands.grid[:, 0], made.strands.grid[:, -1]
        clear = np.minimum(*(np.abs(p[:, 0] - waved(p[:, 1])) for p in (root, tip))) > 1e-3
        crossing = (is_right(root) != is_right(tip)) & clear
        assert crossing.sum() == 0 if count == 0 else crossing.sum() > count


def test_beyond_its_end_a_line_parts_nothing() -> None:
    guides, partings = upright(), Partings.of(line(last=0.5, pieces=60), SURFACE)
    made = make_children(
        guides, SURFACE, children_settings(strand_count=3000), None, partings, place="test"
    )
    mixed, y = both_sides(guides, made.weights), made.strands.roots[:, 1]
    assert not mixed[y < 0.35].any()
    assert mixed[y > 0.65].sum() > 30


def test_own_strands_follow_guides_of_their_side() -> None:
    strands = upright(900)
    guides = strands.take(np.arange(0, strands.strand_count, 6))
    grids = {"strand_grid": strands.grid, "guide_grid": guides.grid}
    rows = strands.roots, strands.group, guides.roots, guides.group
    partings = Partings.of(line(), SURFACE)
    assert not both_sides(guides, guide_weights(*rows, **grids, partings=partings)).any()
    assert both_sides(guides, guide_weights(*rows, **grids)).any()
    nowhere = Partings.of(line() + [5.0, 0.0, 0.0], sheet(size=0.001))
    same, free = (guide_weights(*rows, **grids, partings=one) for one in (nowhere, None))
    assert (same.guide == free.guide).all()
    assert (same.weight == free.weight).all()


def test_crossed_is_what_brute_force_finds_on_a_plane() -> None:
    """Brute force: two ends are on different sides of a line across the whole sheet, or not."""
    random = np.random.default_rng(7)
    root, other = random.random((1500, 3)), random.random((1500, 5, 3))
    root[:, 2] = other[..., 2] = 0.0
    other = root[:, None] + 0.1 * (other - 0.5)  # short, so that none crosses a wave twice
    other[..., 2] = 0.0
    found = Partings.of(line(-1.0, 2.0, 900), sheet()).crossed(root, other)
    inside = ((other > 0.0) | (other == 0.0)).all(axis=2) & (other <= 1.0).all(axis=2)
    clear = np.abs(other[..., 0] - waved(other[..., 1])) > 1e-3
    clear &= (np.abs(root[:, 0] - waved(root[:, 1])) > 1e-3)[:, None]
    expected = is_right(root)[:, None] != is_right(other)
    assert expected[clear & inside].sum() > 50
    assert (found == expected)[clear & inside].mean() > 0.999


def test_a_line_on_the_other_side_of_a_head_parts_nothing(egg: Surface) -> None:
    """A line from the front over the top to the back of an egg with half-axes of 8, 10 and 12
    cm."""
    angle = np.linspace(0.1, np.pi - 0.1, 30)
    arch = np.stack([np.zeros(30), 0.1 * np.cos(angle), 0.12 * np.sin(angle)], axis=1)
    partings = Partings.of(np.stack([arch[:-1], arch[1:]], axis=1), egg)
    for height, is_parted in ((0.12, True), (-0.12, False)):
        left, right = np.array([-0.01, 0.0, height]), np.array([0.01, 0.0, height])
        assert partings.crossed(left[None], right[None, None])[0, 0] == is_parted


def test_combed_hair_leans_away_and_keeps_its_lengths() -> None:
    strands, partings = upright(400), Partings.of(line(), SURFACE)
    chosen = PartingSettings(amount=1.0, width=0.5, lift=0.0)
    points = comb_from_partings(strands, partings, SURFACE, chosen).reshape(strands.grid.shape)
    before = np.linalg.norm(np.diff(strands.grid, axis=1), axis=2)
    assert np.abs(np.linalg.norm(np.diff(points, axis=1), axis=2) - before).max() < 1e-6
    assert (points[:, 0] == strands.grid[:, 0]).all()
    distance = np.abs(strands.roots[:, 0] - waved(strands.roots[:, 1]))
    beside, far = distance < 0.05, distance > 0.25
    right = np.where(is_right(strands.roots), 1.0, -1.0)
    lean = right * (points[:, -1, 0] - points[:, 0, 0])
    assert lean[beside].min() > 0.05
    assert (points[far] == strands.grid[far]).all()
    none = comb_from_partings(strands, partings, SURFACE, PartingSettings(amount=0.0))
    assert (none == strands.points).all()
