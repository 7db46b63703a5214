"""Which strands become one card: those that lie together from the root to the tip.

k-means (Lloyd 1982) with seeds far from each other (k-means++; Arthur and Vassilvitskii 2007). The
distance of two strands is that of their points at a few stations, so that root and shape count in
one unit, metres.

Along a parting and a hairline no other card covers the roots of the outermost ones. Cards there
hold fewer strands, as artists place narrow cards along a parting.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints, means_by
from ..strands.face import is_face_hair
from ..strands.nearest import nearest_points
from ..strands.vectors import unit
from .strip import mean_spacing

#: Places along a strand that are compared.
_STATIONS = 6
#: Weight of the root over other places: cards should not reach over a parting.
_ROOT_WEIGHT = 2.0
#: Maximum number of strands of a card of brows or lashes, however few cards there are in all: their
#: roots lie all over the brow, and are seen. And maximum number of cards of each of these groups.
_FACE_STRANDS, _MAX_FACE_CARDS = 8, 100
#: Cards at a rim have this many times fewer strands than others, but at most this fraction of all
#: cards, and of all strands, lies there.
_RIM_REFINEMENT, _MAX_AT_RIM = 4.0, 0.4
#: How far behind a root the search for hair is centred, in sides of the square that an average
#: card's roots fill; and within which fraction of that distance hair must lie.
_RIM_DEPTH, _RIM_FREE_PART = 0.5, 0.7
#: The part of a strand, from its root, that gives the direction in which it lies.
_ROOT_PART = 0.2
#: Hair that leans away from the upright by less than this sine covers no roots.
_MIN_LEANING = 1.0 / 3.0
#: Maximum number of strands that the means are found from; others only join the nearest.
_MAX_SAMPLES = 20_000
_ROUNDS = 12
#: Strands in one batch that is compared with all means.
_BATCH = 2048


def cluster_strands(
    grid: Floats, group: Ints, count: int, seed: int = 0, root_normal: Floats | None = None
) -> Ints:
    """The cluster of each strand, (strand_count,) int32, numbered from 0 without gaps.

    No cluster holds strands of two groups. Each group gets clusters in proportion to its strands,
    but at least one, and brows and lashes one for every eight: there may be more than `count`, but
    not more than strands.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        group: (strand_count,).
        count: clusters wanted.
        seed: of the random start.
        root_normal: (strand_count, 3) unit normals of the head under the roots; None: clusters are
            as large at partings and hairlines as elsewhere.
    """
    random = np.random.default_rng(seed)
    features = _features(grid)
    label = np.zeros(len(grid), np.int32)
    groups, sizes = np.unique(group, return_counts=True)
    first = 0
    face_counts = np.minimum(-(-sizes // _FACE_STRANDS), _MAX_FACE_CARDS)
    min_counts = np.where(is_face_hair(groups), face_counts, 1)
    for name, wanted in zip(
        groups, np.maximum(proportional_parts(count, sizes), min_counts), strict=True
    ):
        members = np.flatnonzero(group == name)
        normal = None if root_normal is None or is_face_hair(name) else root_normal[members]
        for part, parts_wanted in _rim_and_rest(grid[members], normal, int(wanted)):
            part_labels = _k_means(features[members[part]], parts_wanted, random)
            label[members[part]] = first + part_labels
            first += int(part_labels.max()) + 1
    return label


def _rim_and_rest(grid: Floats, root_normal: Floats | None, wanted: int) -> list[tuple[Ints, int]]:
    """Strands of one group, at its rim and elsewhere, each part with its number of clusters."""
    everywhere: list[tuple[Ints, int]] = [(np.arange(len(grid)), wanted)]
    if root_normal is None or wanted < 2:
        return everywhere
    is_rim = is_at_rim(grid, root_normal, len(grid) / wanted)
    rim, rest = np.flatnonzero(is_rim), np.flatnonzero(~is_rim)
    if len(rim) > _MAX_AT_RIM * len(grid):  # a fringe is all rim
        return everywhere
    rim_fraction = min(_RIM_REFINEMENT * len(rim) / len(grid), _MAX_AT_RIM)
    rim_wanted = min(round(wanted * rim_fraction), len(rim))
    if not rim_wanted:
        return everywhere
    return [(rest, min(wanted - rim_wanted, len(rest))), (rim, rim_wanted)]


def is_at_rim(grid: Floats, root_normal: Floats, strands_per_card: float) -> Bools:
    """Which strands have roots that no other hair covers, (strand_count,): along partings and
    hairlines.

    A little behind their roots, opposite to the direction in which they lie, there is either no
    root, or one whose hair lies the other way.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        root_normal: (strand_count, 3) unit normals of the head under the roots.
        strands_per_card: on average.
    """
    root = grid[:, 0].astype(np.float64)
    direction = grid[:, max(round(_ROOT_PART * (grid.shape[1] - 1)), 1)] - root
    flat = direction - root_normal * np.einsum("si,si->s", direction, root_normal)[:, None]
    is_lying = np.linalg.norm(flat, axis=1) > _MIN_LEANING * np.linalg.norm(direction, axis=1)
    flat = unit(flat)
    # the nearest of random points is half as far as the spacing of a square grid
    behind = _RIM_DEPTH * strands_per_card**0.5 * 2.0 * mean_spacing(root)
    nearest, away = (found[:, 0] for found in nearest_points(root - behind * flat, root, 1))
    is_over = (away < _RIM_FREE_PART * behind) & (np.einsum("si,si->s", flat, flat[nearest]) > 0.0)
    rim: Bools = is_lying & ~is_over
    return rim


def cluster_of_guides(grid: Floats, group: Ints, guides: Ints) -> Ints:
    """The guide that each strand lies along, (strand_count,) int32 places in `guides`.

    It is the nearest guide of the strand's own group, if that has guides; a guide belongs to
    itself.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        group: (strand_count,).
        guides: (guide_count,) indices of strands.
    """
    features = _features(grid)
    nearest_guide = _nearest_means(features, features[guides])[0]
    for name in np.unique(group[guides]):
        own, theirs = np.flatnonzero(group == name), np.flatnonzero(group[guides] == name)
        nearest_guide[own] = theirs[_nearest_means(features[own], features[guides[theirs]])[0]]
    nearest_guide[guides] = np.arange(len(guides))
    return nearest_guide.astype(np.int32)


def proportional_parts(count: int, sizes: Ints) -> Ints:
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
    samples = features
    if len(features) > _MAX_SAMPLES:
        chosen = random.choice(len(features), max(_MAX_SAMPLES, count), replace=False)
        samples = features[np.sort(chosen)]
    means = _initial_means(samples, count, random)
    for _ in range(_ROUNDS):
        label, gap = _nearest_means(samples, means)
        sizes = np.bincount(label, minlength=count)
        # a mean that has lost all its strands moves to the strand farthest from its mean
        empty = np.flatnonzero(sizes == 0)
        farthest = np.argsort(-gap, kind="stable")[: len(empty)]
        means = means_by(label, samples, count).astype(np.float32)
        means[empty] = samples[farthest]
    label, _ = _nearest_means(features, means)
    # where means coincide, rounding of distances could put equal strands into different clusters
    _, first, same = np.unique(features, axis=0, return_index=True, return_inverse=True)
    return np.unique(label[first][same], return_inverse=True)[1].astype(np.int32)


def _initial_means(features: Floats, count: int, random: np.random.Generator) -> Floats:
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


def _nearest_means(features: Floats, means: Floats) -> tuple[Ints, Floats]:
    """The nearest mean of each, (n,), and the squared distance [m^2]."""
    label = np.empty(len(features), np.int64)
    gap = np.empty(len(features), np.float32)
    size, turned = np.einsum("ij,ij->i", means, means), np.ascontiguousarray(-2.0 * means.T)
    for start in range(0, len(features), _BATCH):
        part = features[start : start + _BATCH]
        table = part @ turned
        table += size
        nearest = table.argmin(axis=1)
        label[start : start + _BATCH] = nearest
        gap[start : start + _BATCH] = table[np.arange(len(part)), nearest]
    return label, gap + np.einsum("ij,ij->i", features, features)
