"""Which three guides each strand rides on, and how much each of them counts.

Strands and guides are compared by their roots and by their directions: a difference in direction
counts like a distance on the scalp, so that the two sides of a parting do not mix.
The weights are those of Franke and Little (in Barnhill 1977; Franke 1982, Scattered data
interpolation): w = (R - d) / (R d) = 1/d - 1/R with R the distance of the fourth nearest guide,
so that a guide fades out before another one takes its place. Their exponent is 1 here, where
scattered data take 2, because strands should blend rather than flock around the nearest guide.

A child has no direction of its own yet: it is on the side of its nearest guide, and guides that
diverge from that one, or from each other, are left out (`child_weights`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.nearest import nearest_points
from ..strands.result_cache import NO_CACHE, ResultCache
from ..strands.vectors import unit
from .partings import Partings

GUIDES_PER_STRAND = 3
#: Guide spacings that a difference of 60 degrees in direction counts for.
_SPACINGS_PER_TURN = 4.0
#: Cosine between strand and guide at which the guide is out, and from which it counts fully.
_DIVERGENT, _ALIKE = 0.0, 0.5
#: Fraction of the parting's angle up to which a guide counts fully for a child.
_SURELY_TOGETHER = 2.0 / 3.0
#: Number of nearest guides considered for a child; beyond a parting most of them drop out.
_CHILD_CANDIDATES = 8
#: The same where a parting is between a strand and any of its nearest guides.
_MANY_CANDIDATES = 32
#: Strands weighed at once, so that their table of distances stays in the cache.
_CHUNK = 2048


@dataclass(frozen=True)
class GuideWeights:
    """guide: (strand_count, 3) int32, indices into the guides; an unused one repeats another.
    weight: (strand_count, 3) float32, not negative, summing to 1, largest first.
    """

    guide: Ints
    weight: Floats


def guide_weights(
    root: Floats,
    group: Ints,
    guide_root: Floats,
    guide_group: Ints,
    *,
    strand_grid: Floats | None = None,
    guide_grid: Floats | None = None,
    partings: Partings | None = None,
) -> GuideWeights:
    """The three guides of each strand, of its own group only; a guide rides on itself alone.

    Args:
        root: (strand_count, 3) [m].
        group: (strand_count,); each group has at least one guide.
        guide_root: (guide_count, 3) [m].
        guide_group: (guide_count,).
        strand_grid: (strand_count, cv_count, 3) [m], to keep partings; or None, to look at
            the roots only.
        guide_grid: (guide_count, cv_count, 3) [m], with strand_grid.
        partings: no strand follows a guide across these, unless its group has no other.

    Limitations: groups are visited one by one, so tens of thousands of them take long.
    """
    guide = np.zeros((len(root), GUIDES_PER_STRAND), np.int32)
    weight = np.zeros((len(root), GUIDES_PER_STRAND), np.float32)
    strand_direction, guide_direction = (
        directions(strand_grid, root),
        directions(guide_grid, guide_root),
    )
    for strands, guides in by_group(group, guide_group):
        assert len(guides), "a group without a guide"
        spread = _SPACINGS_PER_TURN * _spacing(guide_root[guides])
        features = np.concatenate([guide_root[guides], spread * guide_direction[guides]], axis=1)
        for chunk in np.array_split(strands, -(-len(strands) // _CHUNK)):
            own = np.concatenate([root[chunk], spread * strand_direction[chunk]], axis=1)
            candidates = _nearest(own, features, GUIDES_PER_STRAND + 1)
            if partings is not None:
                candidates = _on_one_side(
                    partings, root[chunk], guide_root[guides], own, features, candidates
                )
            alike = likeness(strand_direction[chunk, None], guide_direction[guides][candidates])
            if partings is not None:
                crossed = partings.crossed(root[chunk], guide_root[guides][candidates])
                alike[crossed] = 0.0
            gap = np.linalg.norm(own[:, None] - features[candidates], axis=2)
            chosen, weight[chunk] = _weigh(gap.astype(np.float64), alike)
            guide[chunk] = guides[np.take_along_axis(candidates, chosen, axis=1)]
    return GuideWeights(guide, weight)


def _on_one_side(
    partings: Partings,
    root: Floats,
    guide_root: Floats,
    own: Floats,
    features: Floats,
    candidates: Ints,
) -> Ints:
    """The candidates (n, k), nearest first; where a parting is before any of them, replaced by the
    nearest guides on this side of it."""
    crossed = partings.crossed(root, guide_root[candidates]).any(axis=1)
    found = candidates.copy()
    behind = np.flatnonzero(crossed)
    if not len(behind):
        return found
    more = _nearest(own[behind], features, _MANY_CANDIDATES)
    is_behind = partings.crossed(root[behind], guide_root[more])
    order = np.argsort(is_behind, axis=1, kind="stable")[:, : candidates.shape[1]]
    found[behind] = np.take_along_axis(more, order, axis=1)
    return found


def child_weights(
    root: Floats,
    guide_root: Floats,
    guide_group: Ints,
    guide_grid: Floats,
    parting: float,
    partings: Partings | None = None,
    grown: Floats | None = None,
    cache: ResultCache = NO_CACHE,
) -> GuideWeights:
    """The three guides that a child at each root mixes: all of one group, all on one side.

    The nearest guide decides about both.

    Args:
        root: (child_count, 3) [m].
        guide_root: (guide_count, 3) [m], at least one.
        guide_group: (guide_count,).
        guide_grid: (guide_count, cv_count, 3) [m].
        parting: guides that diverge by more than this are not mixed [rad].
        partings: no child takes a guide from behind these, unless its group has no other, and none
            mixes guides with one between them.
        grown: (child_count, 3) [m], where they grow, if `root` is where they take shapes from; this
            is the place that partings are seen from.
        cache: results of the last call.
    """
    grown = root if grown is None else grown
    guide = np.zeros((len(root), GUIDES_PER_STRAND), np.int32)
    weight = np.zeros((len(root), GUIDES_PER_STRAND), np.float32)
    guide_direction = directions(guide_grid, guide_root)
    of_child = _nearest_group(root, guide_root, guide_group, partings, grown, cache)
    for children, guides in by_group(of_child, guide_group):
        name = f"guides, group {guide_group[guides[0]]}"
        near, gap, crossed = nearest_on_same_side(
            partings,
            root[children],
            guide_root[guides],
            _CHILD_CANDIDATES,
            grown[children],
            cache,
            name,
        )
        near = guides[near]
        alike = likeness(guide_direction[near[:, :1]], guide_direction[near], parting)
        if crossed is not None:
            alike[crossed] = 0.0
        mixable, away, alike = _usable_first(near, gap, alike)
        alike = _agreeing(guide_direction[mixable], alike, parting)
        if partings is not None:
            alike = _unparted(partings, guide_root[mixable], alike)
        chosen, weight[children] = _weigh(away, alike)
        guide[children] = np.take_along_axis(mixable, chosen, axis=1)
    return GuideWeights(guide, weight)


def _nearest_group(
    root: Floats,
    guide_root: Floats,
    guide_group: Ints,
    partings: Partings | None,
    grown: Floats,
    cache: ResultCache,
) -> Ints:
    """Group of the guide that is nearest to each root on its side of partings, (n,)."""
    if (guide_group == guide_group[0]).all():
        return np.full(len(root), guide_group[0])
    nearest, _, _ = nearest_on_same_side(partings, root, guide_root, 1, grown, cache, "guides, all")
    return guide_group[nearest[:, 0]]


def nearest_on_same_side(
    partings: Partings | None,
    root: Floats,
    among: Floats,
    count: int,
    grown: Floats,
    cache: ResultCache = NO_CACHE,
    name: str = "",
) -> tuple[Ints, Floats, Bools | None]:
    """`nearest_points`, and which of them are behind a parting, seen from `grown`; None without
    partings. If any is, they are the points nearest to `grown`, those behind partings last.

    Args:
        cache: results of the last call with this name.
    """
    near, gap = cache.nearest(name, root, among, count)
    if partings is None:
        return near, gap, None
    crossed = partings.crossed(grown, among[near])
    behind = np.flatnonzero(crossed.any(axis=1))
    if len(behind):
        more, away = nearest_points(grown[behind], among, max(_MANY_CANDIDATES, count))
        is_behind = partings.crossed(grown[behind], among[more])
        order = np.argsort(is_behind, axis=1, kind="stable")[:, : near.shape[1]]
        for found, wider in ((near, more), (gap, away), (crossed, is_behind)):
            found[behind] = np.take_along_axis(wider, order, axis=1)
    return near, gap, crossed


def by_group(group: Ints, guide_group: Ints) -> Iterator[tuple[Ints, Ints]]:
    """The strands and the guides of each group of strands, as ascending indices."""
    order = np.argsort(group, kind="stable")
    guide_order = np.argsort(guide_group, kind="stable")
    names, first = np.unique(group[order], return_index=True)
    start = np.searchsorted(guide_group[guide_order], names, side="left")
    end = np.searchsorted(guide_group[guide_order], names, side="right")
    members = np.split(order, first[1:]) if len(names) else []
    for strands, begin, stop in zip(members, start, end, strict=True):
        yield strands, guide_order[begin:stop]


def directions(grid: Floats | None, root: Floats) -> Floats:
    """Unit directions from the root to a third of the strand and to its tip, (n, 6); or (n, 0)."""
    if grid is None:
        return np.zeros((len(root), 0), np.float32)
    third = max(1, grid.shape[1] // 3)
    chords = grid[:, [third, -1]] - grid[:, :1]
    return unit(chords).reshape(len(grid), 6)


def _spacing(guide_root: Floats) -> float:
    """Typical distance from one guide to the next [m]; 0 for a single one."""
    if len(guide_root) < 2:
        return 0.0
    some = guide_root[:: -(-len(guide_root) // 256)]
    squared = ((some[:, None] - guide_root[None]) ** 2).sum(axis=2)
    return float(np.sqrt(np.median(np.partition(squared, 1, axis=1)[:, 1])))


def _nearest(own: Floats, features: Floats, count: int) -> Ints:
    """The nearest guides of each strand, nearest first, (n, at most count)."""
    center = features.mean(axis=0)
    one, two = own - center, features - center
    table = (two * two).sum(axis=1) - 2.0 * (one @ two.T)  # squared distance less |one|^2
    rows = np.arange(len(own))
    nearest = np.empty((len(own), min(count, len(features))), np.int64)
    for rank in range(nearest.shape[1]):
        nearest[:, rank] = table.argmin(axis=1)
        table[rows, nearest[:, rank]] = np.inf
    return nearest


def likeness(
    own_direction: Floats, other_direction: Floats, parting: float | None = None
) -> Floats:
    """1 for strands of the same direction, 0 for those that diverge, smooth between.

    Args:
        own_direction, other_direction: (n, k, 6) or (n, k, 0) `directions`, broadcast with each
            other.
        parting: the angle from which they diverge [rad]; None: 90 degrees, alike up to 60.
    """
    divergent, alike = _DIVERGENT, _ALIKE
    if parting is not None:
        divergent, alike = np.cos(parting), np.cos(_SURELY_TOGETHER * parting)
    least = np.ones(np.broadcast_shapes(own_direction.shape, other_direction.shape)[:2])
    for chord in range(0, own_direction.shape[2], 3):
        parts = (
            own_direction[..., axis] * other_direction[..., axis]
            for axis in range(chord, chord + 3)
        )
        np.minimum(least, sum(parts), out=least)
    x = np.clip((least - divergent) / max(alike - divergent, 1e-6), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _usable_first(near: Ints, gap: Floats, alike: Floats) -> tuple[Ints, Floats, Floats]:
    """The candidates (n, k), those that may be mixed first, nearest first; four columns at most.

    Others fill up the columns, at such a distance that all those that may be mixed count.
    """
    order = np.argsort(alike <= 0.0, axis=1, kind="stable")[:, : GUIDES_PER_STRAND + 1]
    near = np.take_along_axis(near, order, axis=1)
    gap, alike = (np.take_along_axis(part, order, axis=1) for part in (gap, alike))
    farthest = np.where(alike > 0.0, gap, 0.0).max(axis=1, keepdims=True)
    return near, np.where(alike > 0.0, gap, 2.0 * farthest), alike


def _agreeing(direction: Floats, alike: Floats, parting: float) -> Floats:
    """Likeness (n, k), reduced for a guide that diverges from a nearer one that is mixed."""
    agreed = alike.copy()
    for later in range(2, alike.shape[1]):
        for earlier in range(1, later):
            both = likeness(direction[:, [later]], direction[:, [earlier]], parting)[:, 0]
            is_mixed = agreed[:, earlier] > 0.0
            agreed[:, later] = np.where(
                is_mixed, np.minimum(agreed[:, later], both), agreed[:, later]
            )
    return agreed


def _unparted(partings: Partings, root: Floats, alike: Floats) -> Floats:
    """Likeness (n, k), 0 for a guide with a parting between it and a nearer one that is mixed.

    Args:
        root: (n, k, 3) of the guides.
    """
    unparted = alike.copy()
    for later in range(1, alike.shape[1]):
        for earlier in range(later):
            crossed = partings.crossed(root[:, later], root[:, [earlier]])[:, 0]
            is_mixed = (unparted[:, earlier] > 0.0) | (earlier == 0)
            unparted[crossed & is_mixed, later] = 0.0
    return unparted


def _weigh(distance: Floats, alike: Floats) -> tuple[Ints, Floats]:
    """Which three of the candidates (n, k) are chosen, and their weights, largest first.

    Args:
        distance: (n, k), k at most one more than are chosen.
        alike: (n, k), 1 for a guide that counts fully.
    """
    farthest = distance.max(axis=1, keepdims=True)
    has_fourth = distance.shape[1] > GUIDES_PER_STRAND
    # slightly beyond the farthest, so that four equally far guides get weights above 0
    reach = farthest * (1.0 + 1e-6) if has_fourth else 2.0 * farthest
    near = np.maximum(distance, np.maximum(1e-9 * reach, np.finfo(np.float64).tiny))
    weight = alike * np.maximum(reach - distance, 0.0) / near
    # a strand that is a guide, or whose guides all diverge, rides on the nearest one alone
    nearest = distance.argmin(axis=1)
    alone = (distance.min(axis=1) == 0.0) | (weight.sum(axis=1) <= 0.0)
    weight[alone] = np.eye(distance.shape[1])[nearest[alone]]

    order = np.argsort(-weight, axis=1, kind="stable")[:, :GUIDES_PER_STRAND]
    order = np.pad(order, ((0, 0), (0, GUIDES_PER_STRAND - order.shape[1])), mode="edge")
    is_repeated = np.arange(GUIDES_PER_STRAND) >= distance.shape[1]
    weight = np.where(is_repeated, 0.0, np.take_along_axis(weight, order, axis=1))
    weight /= weight.sum(axis=1, keepdims=True)
    return order, weight.astype(np.float32)
