"""Clumps of children: later children are drawn towards some of the earlier ones.

Every prefix of the children's order is spread evenly, so the first ones are the middles of clumps.
The first 4,096 children have one middle for every `clump_size` of them. Whenever the number of
children doubles, so does that of middles: the former ones, and as many of the children since. So as
strands are added, a clump becomes a clump of clumps, the average size of clumps stays, and no child
ever changes its clump.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..params.curve import sample_curve
from ..strands.result_cache import NO_CACHE, ResultCache
from .children_settings import ChildrenSettings
from .partings import Partings
from .weights import by_group, directions, likeness, nearest_on_same_side

#: Children of the first level.
_FIRST_LEVEL = 4096
#: Nearest middles that are considered for each child; those of another direction drop out.
_CANDIDATES = 6
#: How far away a middle may be, in distances from one middle to the next.
_REACH = 3.0
_CHUNK = 2048


@dataclass(frozen=True, eq=False)
class Clumps:
    """The child towards which each child is drawn, and how far, as decided when they grew.

    middle: (child_count,), a child's own index if it is not drawn. strength: (child_count,) 0 to 1.
    """

    middle: Ints
    strength: Floats

    def outermost(self) -> Ints:
        """The middle of the largest clump that each child is in, (child_count,)."""
        found = np.where(self.strength > 0.0, self.middle, np.arange(len(self.middle)))
        while not np.array_equal(found, further := found[found]):
            found = further
        return found

    def with_middles(self, chosen: Ints) -> Ints:
        """The indices (n,) of children and of all that their shapes depend on, ascending."""
        found = np.unique(chosen)
        while len(more := np.setdiff1d(self.middle[found], found)):
            found = np.union1d(found, more)
        return found

    def with_members(self, chosen: Bools) -> Bools:
        """These children (child_count,) and all whose shapes depend on them."""
        found = chosen
        while (more := found | found[self.middle]).sum() > found.sum():
            found = more
        return found

    def joined(
        self,
        root: Floats,
        group: Ints,
        near_root: Floats,
        near_group: Ints,
        near: Ints,
        partings: Partings | None,
    ) -> Clumps:
        """The clumps with n more children, numbered after the others. Each joins the clump of the
        nearest child that is drawn, of its group and on its side of partings.

        Args:
            near: (m,) indices of the children that may be their neighbours.
        """
        count = len(self.middle)
        middle, strength = count + np.arange(len(root)), np.zeros(len(root))
        is_drawn = self.strength[near] > 0.0
        near, near_root, near_group = near[is_drawn], near_root[is_drawn], near_group[is_drawn]
        for own, others in by_group(group, near_group):
            if not len(others):
                continue
            found, _, crossed = nearest_on_same_side(
                partings, root[own], near_root[others], 1, root[own]
            )
            beside = near[others[found[:, 0]]]
            joins = np.ones(len(own), bool) if crossed is None else ~crossed[:, 0]
            middle[own[joins]] = self.middle[beside[joins]]
            strength[own[joins]] = self.strength[beside[joins]]
        return Clumps(
            np.concatenate([self.middle, middle]), np.concatenate([self.strength, strength])
        )


def clump_children(
    grid: Floats,
    group: Ints,
    settings: ChildrenSettings,
    painted: Floats,
    partings: Partings | None = None,
    cache: ResultCache = NO_CACHE,
) -> Clumps:
    """Draw the children of each clump towards its middle, in place; roots stay.

    Args:
        grid: (child_count, cv_count, 3) float32 [m], in the order in which they grew.
        group: (child_count,).
        painted: (child_count,) factor on the setting.
        partings: no clump has strands on both sides of these.
        cache: results of the last call.
    """
    clumps = Clumps(np.arange(len(grid)), np.zeros(len(grid)))
    if not settings.clump or settings.clump_size == 1:
        return clumps
    fraction = _fraction(settings, grid.shape[1])
    for first, last in _levels(len(grid)):
        middle_count = max(1, round(last / settings.clump_size))
        member = np.arange(max(first, middle_count), min(last, len(grid)))
        if len(member):
            middle, strength = _middles(
                grid,
                group,
                member,
                middle_count,
                settings.parting,
                partings,
                cache,
                f"middles from {first}",
            )
            clumps.middle[member], clumps.strength[member] = middle, strength
            _pull(grid, member, middle, strength * painted[member], fraction)
    return clumps


def clump_as_before(
    grid: Floats, number: Ints, clumps: Clumps, settings: ChildrenSettings, painted: Floats
) -> None:
    """`clump_children` for some of the children, in place, with the middles that they had.

    Args:
        grid: (n, cv_count, 3) float32 [m]. number: (n,) ascending, the indices of these children,
            which include all their middles.
        painted: (n,) factor on the setting.
    """
    fraction = _fraction(settings, grid.shape[1])
    for first, last in _levels(int(number.max(initial=-1)) + 1):
        is_drawn = (number >= first) & (number < last) & (clumps.strength[number] > 0.0)
        member = np.flatnonzero(is_drawn)
        own = number[member]
        middle = np.searchsorted(number, clumps.middle[own])
        _pull(grid, member, middle, clumps.strength[own] * painted[member], fraction)


def _levels(count: int) -> Iterator[tuple[int, int]]:
    """The first child of each level, and the first of the next level."""
    first, last = 0, _FIRST_LEVEL
    while first < count:
        yield first, last
        first, last = last, 2 * last


def _fraction(settings: ChildrenSettings, cv_count: int) -> Floats:
    """How far CVs are drawn, (cv_count,)."""
    fraction = settings.clump * sample_curve(settings.clump_along, np.linspace(0.0, 1.0, cv_count))
    fraction[0] = 0.0
    return fraction


def _pull(grid: Floats, member: Ints, middle: Ints, strength: Floats, fraction: Floats) -> None:
    """Draw strands of the grid towards others, in place."""
    for start in range(0, len(member), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        pull = np.minimum(strength[chunk, None] * fraction, 1.0).astype(np.float32)[..., None]
        own = grid[member[chunk]]
        grid[member[chunk]] = own + pull * (grid[middle[chunk]] - own)


def _middles(
    grid: Floats,
    group: Ints,
    member: Ints,
    middle_count: int,
    parting: float,
    partings: Partings | None,
    cache: ResultCache,
    level: str,
) -> tuple[Ints, Floats]:
    """The middle of each member's clump (n,), and how far it draws the member, 0 to 1."""
    root = grid[:, 0]
    reach = _REACH * _typical_spacing(root[:middle_count], cache, f"{level}, apart")
    near = np.zeros((len(member), _CANDIDATES), np.int64)
    gap = np.full(near.shape, np.inf)  # where there are fewer
    for of_group, middles in by_group(group[member], group[:middle_count]):
        if not len(middles):
            continue
        name = f"{level}, group {group[middles[0]]}"
        found, away = cache.nearest(name, root[member[of_group]], root[middles], _CANDIDATES)
        near[of_group, : found.shape[1]], gap[of_group, : found.shape[1]] = middles[found], away
    member_direction = directions(grid[member], root[member])
    middle_direction = directions(grid[:middle_count], root[:middle_count])
    alike = likeness(member_direction[:, None], middle_direction[near], parting)
    alike[(gap > reach) | np.isinf(gap)] = 0.0
    if partings is not None:
        alike[partings.crossed(root[member], root[near])] = 0.0
    best = (alike > 0.0).argmax(axis=1)[:, None]
    middle = np.where(np.isinf(gap[:, 0]), member, np.take_along_axis(near, best, axis=1)[:, 0])
    return middle, np.take_along_axis(alike, best, axis=1)[:, 0]


def _typical_spacing(root: Floats, cache: ResultCache, name: str) -> float:
    """Typical distance from one root to the next [m]; infinite for a single one."""
    if len(root) < 2:
        return np.inf
    _, gap = cache.nearest(name, root, root, 2)
    return float(np.median(gap[:, 1]))
