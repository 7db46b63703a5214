"""Which strands become one card: those that lie together from the root to the tip.

k-means (Lloyd 1982) with seeds far from each other (k-means++; Arthur and Vassilvitskii 2007). Two
strands are as far apart as their points at a few stations are, so that root and shape count in one
unit, metres.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.face import is_face_hair

#: Places along a strand that are compared.
_STATIONS = 6
#: How much more than another place the root counts: cards shall not reach over a parting.
_ROOT_WEIGHT = 2.0
#: Cards of brows and of lashes, however few there are in all: six a side make a brow, three a rim
#: the lashes of a lid.
_MIN_FACE_CARDS = 12
#: Strands that the means are found from; the others only join the nearest.
_MAX_LEARNT = 20_000
_ROUNDS = 12
#: Strands that are compared with all means at once.
_CHUNK = 2048


def cluster_strands(grid: Floats, group: Ints, count: int, seed: int = 0) -> Ints:
    """The cluster of each strand, (strand_count,) int32, numbered from 0 without gaps.

    No cluster holds strands of two groups. Each group gets clusters in proportion to its strands,
    but at least one, and brows and lashes at least a dozen: there may be a few more than `count`,
    but never more than strands.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        group: (strand_count,).
        count: clusters wanted.
        seed: another one gives other clusters.
    """
    random = np.random.default_rng(seed)
    features = _features(grid)
    label = np.zeros(len(grid), np.int32)
    groups, sizes = np.unique(group, return_counts=True)
    first = 0
    least = np.where(is_face_hair(groups), np.minimum(_MIN_FACE_CARDS, sizes), 1)
    for name, wanted in zip(groups, np.maximum(shared_out(count, sizes), least), strict=True):
        own = np.flatnonzero(group == name)
        found = _k_means(features[own], int(wanted), random)
        label[own] = first + found
        first += int(found.max()) + 1
    return label


def cluster_of_guides(grid: Floats, group: Ints, guides: Ints) -> Ints:
    """The guide that each strand lies along, (strand_count,) int32 places in `guides`.

    It is the nearest one of the strand's own group, where that has guides; a guide's is itself.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        group: (strand_count,).
        guides: (guide_count,) indices of strands.
    """
    features = _features(grid)
    found = _nearest(features, features[guides])[0]
    for name in np.unique(group[guides]):
        own, theirs = np.flatnonzero(group == name), np.flatnonzero(group[guides] == name)
        found[own] = theirs[_nearest(features[own], features[guides[theirs]])[0]]
    found[guides] = np.arange(len(guides))
    return found.astype(np.int32)


def shared_out(count: int, sizes: Ints) -> Ints:
    """`count` split by size, one at least and no more than the size, (n,): largest remainders."""
    fraction = count * sizes / max(int(sizes.sum()), 1)
    parts = np.floor(fraction).astype(np.int64)
    over = np.argsort(parts - fraction, kind="stable")[: max(count - int(parts.sum()), 0)]
    parts[over] += 1
    return np.clip(parts, 1, sizes)


def _features(grid: Floats) -> Floats:
    """The points that are compared, (strand_count, 3 * _STATIONS) float32 [m]."""
    stations = np.linspace(0, grid.shape[1] - 1, _STATIONS).round().astype(int)
    middle = grid.reshape(-1, 3).mean(axis=0)
    places = (grid[:, stations] - middle).astype(np.float32)
    places[:, 0] *= np.sqrt(_ROOT_WEIGHT)
    return places.reshape(len(grid), -1)


def _k_means(features: Floats, count: int, random: np.random.Generator) -> Ints:
    learnt = features
    if len(features) > _MAX_LEARNT:
        chosen = random.choice(len(features), max(_MAX_LEARNT, count), replace=False)
        learnt = features[np.sort(chosen)]
    means = _far_apart(learnt, count, random)
    for _ in range(_ROUNDS):
        label, gap = _nearest(learnt, means)
        sizes = np.bincount(label, minlength=count)
        # a mean that has lost all its strands goes to the strand that lies worst
        lost = np.flatnonzero(sizes == 0)
        worst = np.argsort(-gap, kind="stable")[: len(lost)]
        sums = np.stack([np.bincount(label, part, count) for part in learnt.T], axis=1)
        means = (sums / np.maximum(sizes, 1)[:, None]).astype(np.float32)
        means[lost] = learnt[worst]
    label, _ = _nearest(features, means)
    return np.unique(label, return_inverse=True)[1].astype(np.int32)


def _far_apart(features: Floats, count: int, random: np.random.Generator) -> Floats:
    """k-means++: each next one chosen with a chance that grows with the squared distance."""
    chosen = np.empty(count, np.int64)
    chosen[0] = random.integers(len(features))
    gap = np.full(len(features), np.inf, np.float32)
    for turn in range(1, count):
        away = features - features[chosen[turn - 1]]
        gap = np.minimum(gap, np.einsum("ij,ij->i", away, away))
        total = np.cumsum(gap, dtype=np.float64)
        place = np.searchsorted(total, random.random() * total[-1], side="right")
        chosen[turn] = min(place, len(features) - 1)
    return features[chosen]


def _nearest(features: Floats, means: Floats) -> tuple[Ints, Floats]:
    """The nearest mean of each, (n,), and the squared distance [m^2]."""
    label = np.empty(len(features), np.int64)
    gap = np.empty(len(features), np.float32)
    size, turned = np.einsum("ij,ij->i", means, means), np.ascontiguousarray(-2.0 * means.T)
    for start in range(0, len(features), _CHUNK):
        part = features[start : start + _CHUNK]
        table = part @ turned
        table += size
        nearest = table.argmin(axis=1)
        label[start : start + _CHUNK] = nearest
        gap[start : start + _CHUNK] = table[np.arange(len(part)), nearest]
    return label, gap + np.einsum("ij,ij->i", features, features)
