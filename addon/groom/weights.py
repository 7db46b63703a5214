"""Which three guides each strand rides on, and how much each of them counts.

Strands and guides are compared by their root, and by where they go: a direction that differs
counts like a distance on the scalp, so that the two sides of a parting do not mix.
The weights are those of Franke and Little (in Barnhill 1977; Franke 1982, Scattered data
interpolation): w = (R - d) / (R d) = 1/d - 1/R with R the distance of the fourth nearest guide,
so that a guide fades out before another one takes its place. Their exponent is 1 here, where
scattered data take 2, because strands shall blend rather than flock around the nearest guide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints

GUIDES_PER_STRAND = 3
#: Guide spacings that a difference of 60 degrees in direction counts for.
_SPACINGS_PER_TURN = 4.0
#: Cosine between strand and guide at which the guide is out, and from which it counts fully.
_DIVERGENT, _ALIKE = 0.0, 0.5
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

    Limitations: groups are visited one by one, so tens of thousands of them take long.
    """
    guide = np.zeros((len(root), GUIDES_PER_STRAND), np.int32)
    weight = np.zeros((len(root), GUIDES_PER_STRAND), np.float32)
    strand_way, guide_way = _directions(strand_grid, root), _directions(guide_grid, guide_root)
    by_group = np.argsort(group, kind="stable")
    guides_by_group = np.argsort(guide_group, kind="stable")
    names, first = np.unique(group[by_group], return_index=True)
    sorted_guide_group = guide_group[guides_by_group]
    start = np.searchsorted(sorted_guide_group, names, side="left")
    end = np.searchsorted(sorted_guide_group, names, side="right")
    for index, strands in enumerate(np.split(by_group, first[1:]) if len(names) else []):
        guides = guides_by_group[start[index] : end[index]]
        assert len(guides), "a group without a guide"
        spread = _SPACINGS_PER_TURN * _spacing(guide_root[guides])
        features = np.concatenate([guide_root[guides], spread * guide_way[guides]], axis=1)
        for chunk in np.array_split(strands, -(-len(strands) // _CHUNK)):
            own = np.concatenate([root[chunk], spread * strand_way[chunk]], axis=1)
            candidates = _nearest(own, features, GUIDES_PER_STRAND + 1)
            alike = _likeness(strand_way[chunk], guide_way[guides], candidates)
            chosen, weight[chunk] = _weigh(own, features, candidates, alike)
            guide[chunk] = guides[chosen]
    return GuideWeights(guide, weight)


def _directions(grid: Floats | None, root: Floats) -> Floats:
    """Unit directions from the root to a third of the strand and to its tip, (n, 6); or (n, 0)."""
    if grid is None:
        return np.zeros((len(root), 0), np.float32)
    third = max(1, grid.shape[1] // 3)
    chords = grid[:, [third, -1]] - grid[:, :1]
    length = np.linalg.norm(chords, axis=2, keepdims=True)
    unit = np.divide(chords, length, out=np.zeros_like(chords), where=length > 0.0)
    return unit.reshape(len(grid), 6)


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


def _likeness(strand_way: Floats, guide_way: Floats, candidates: Ints) -> Floats:
    """1 for guides that go where the strand goes, 0 for those that diverge, smooth between."""
    ways = guide_way[candidates].reshape(*candidates.shape, -1, 3)
    cosine = np.einsum("nkwj,nwj->nkw", ways, strand_way.reshape(len(strand_way), -1, 3))
    least = cosine.min(axis=2, initial=1.0)
    x = np.clip((least - _DIVERGENT) / (_ALIKE - _DIVERGENT), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _weigh(own: Floats, features: Floats, candidates: Ints, alike: Floats) -> tuple[Ints, Floats]:
    """The chosen guides (n, 3), indices into features, and their weights (n, 3), largest first."""
    distance = np.linalg.norm(own[:, None] - features[candidates], axis=2).astype(np.float64)
    farthest = distance.max(axis=1, keepdims=True)
    has_fourth = candidates.shape[1] > GUIDES_PER_STRAND
    # at a tie of all four a hair more than 0, so that there is something to share
    reach = farthest * (1.0 + 1e-6) if has_fourth else 2.0 * farthest
    near = np.maximum(distance, np.maximum(1e-9 * reach, np.finfo(np.float64).tiny))
    weight = alike * np.maximum(reach - distance, 0.0) / near
    # a strand that is a guide, or whose guides all diverge, rides on the nearest one alone
    nearest = distance.argmin(axis=1)
    alone = (distance.min(axis=1) == 0.0) | (weight.sum(axis=1) <= 0.0)
    weight[alone] = np.eye(candidates.shape[1])[nearest[alone]]

    order = np.argsort(-weight, axis=1, kind="stable")[:, :GUIDES_PER_STRAND]
    order = np.pad(order, ((0, 0), (0, GUIDES_PER_STRAND - order.shape[1])), mode="edge")
    is_repeated = np.arange(GUIDES_PER_STRAND) >= candidates.shape[1]
    weight = np.where(is_repeated, 0.0, np.take_along_axis(weight, order, axis=1))
    weight /= weight.sum(axis=1, keepdims=True)
    return np.take_along_axis(candidates, order, axis=1), weight.astype(np.float32)
