"""One strip for each cluster of strands: its path, orientation and width.

A strip runs along the mean of its strands. It turns about that line, as a whole and without
twist, so that the strands spread along its width and it still faces away from the head. Each row is
as wide as its strands are spread, and the last one reaches to where most of them end.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints, piece_starts
from ..strands.frames import tangents, transported_normals
from .clusters import cluster_strands
from .settings import CardSettings
from .strip import MAX_ROOT_SLOPE, CardFrames, Strips

#: Half a card's width in standard deviations of its strands: sqrt(3) covers evenly spread strands.
_COVERED_DEVIATIONS = 1.8
#: Weight of facing away from the head, relative to lying along the strands' spread.
_FACING_WEIGHT = 0.35
_TURN_STEPS = 72
#: Minimum width of a row, as a fraction of the median; a single strand's card has it throughout.
_MIN_WIDTH = 0.25
#: How far a card reaches beyond the mean tip, in standard deviations of where its strands end.
_TIP_REACH = 1.3
#: And before the mean root: sqrt(3) covers evenly spread roots, so that no parting is bald.
_ROOT_REACH = 1.7
#: Cards of hair that leans away from the upright by more than this sine reach back in full.
_MIN_LEANING = 1.0 / 3.0
_TINY = 1e-30


def cluster_of_strands(
    grid: Floats, group: Ints, settings: CardSettings, root_normal: Floats | None = None
) -> Ints:
    """The card of each strand, (strand_count,) int32: clusters first, then the fly-aways.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        group: (strand_count,); no card holds strands of two.
        root_normal: (strand_count, 3), see `cluster_strands`.
    """
    fly_away_count = round(settings.card_count * settings.fly_aways)
    wanted = max(settings.card_count - fly_away_count, 1)
    cluster = cluster_strands(grid, group, wanted, settings.seed, root_normal)
    return with_fly_aways(grid, cluster, fly_away_count)


def with_fly_aways(grid: Floats, cluster: Ints, count: int) -> Ints:
    """The clusters, then the `count` strands farthest from their cluster, each alone.

    The last strand of a cluster stays in it.
    """
    away = grid - _ClusterMeans(cluster).of(grid)[cluster]
    gap = np.einsum("sri,sri->s", away, away)
    nearest = np.argsort(gap, kind="stable")
    is_staying = np.zeros(len(cluster), bool)
    is_staying[nearest[np.unique(cluster[nearest], return_index=True)[1]]] = True
    farthest = nearest[::-1]
    leaving = farthest[~is_staying[farthest]][:count]
    label = cluster.copy()
    label[leaving] = cluster.max() + 1 + np.arange(len(leaving), dtype=np.int32)
    return label


def fit_strips(
    grid: Floats, radius: Floats, cluster: Ints, root_normal: Floats, settings: CardSettings
) -> Strips:
    """Strips in the order of the clusters, with as many rows as there are CVs; with crossed pairs,
    the second strips of all clusters follow.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        radius: (strand_count, cv_count) [m].
        cluster: (strand_count,), from 0 without gaps.
        root_normal: (strand_count, 3) unit normals of the head under the roots.
    """
    means = _ClusterMeans(cluster)
    center = means.of(grid)
    tangent = tangents(center)
    outwards = means.of(root_normal)
    normal = transported_normals(tangent, outwards)
    side = np.cross(tangent, normal)

    away = grid - center[cluster]
    ahead = np.einsum("sri,sri->sr", away, normal[cluster])
    aside = np.einsum("sri,sri->sr", away, side[cluster])
    spread = means.of(np.stack([ahead * ahead, aside * aside, ahead * aside], axis=-1))
    turn = _best_turn(spread, normal, side, outwards)
    thickness = means.of(radius)
    frames = _turned(center, tangent, normal, side, turn)
    beyond = away[:, 0] - frames.tangent[cluster, 0] * _ahead_of_slant(frames, grid, cluster)
    center[:, 0] -= _root_extensions(beyond, tangent[:, 0], outwards, means, cluster)
    center[:, -1] += tangent[:, -1] * _tip_extensions(away[:, -1], tangent[:, -1], means, cluster)
    strips: list[tuple[CardFrames, Floats]] = []
    for further in (0.0, np.pi / 2.0)[: 1 + settings.crossed]:
        cosine, sine = np.cos(turn + further)[:, None], np.sin(turn + further)[:, None]
        variance = _smoothed(np.maximum(_variance_along(spread, cosine, sine), 0.0))
        half = settings.cluster_width * _COVERED_DEVIATIONS * np.sqrt(variance) + thickness
        strips.append((_turned(center, tangent, normal, side, turn + further), 2.0 * half))
    return _concatenated(strips)


def _turned(
    center: Floats, tangent: Floats, normal: Floats, side: Floats, turn: Floats
) -> CardFrames:
    """Frames turned about their tangents by (n,) [rad]."""
    cosine, sine = np.cos(turn)[:, None, None], np.sin(turn)[:, None, None]
    turned = normal * cosine + side * sine
    return CardFrames(center, tangent, turned, np.cross(tangent, turned))


def root_slopes(frames: CardFrames, grid: Floats, cluster: Ints) -> Floats:
    """Slope of the line through the roots of each card's strands, along over across the card,
    (card_count,): least squares.

    Args:
        frames: with a row for each CV.
        grid: (strand_count, cv_count, 3) [m], root first.
        cluster: (strand_count,) the card of each strand.
    """
    away = grid[:, 0] - frames.center[cluster, 0]
    aside, ahead = (
        np.einsum("si,si->s", away, axis[cluster, 0]) for axis in (frames.side, frames.tangent)
    )
    count = np.bincount(cluster)
    ahead = ahead - (np.bincount(cluster, ahead) / count)[cluster]
    aside = aside - (np.bincount(cluster, aside) / count)[cluster]
    spread = np.maximum(np.bincount(cluster, aside**2), _TINY)
    slope = np.bincount(cluster, aside * ahead) / spread
    return np.clip(slope, -MAX_ROOT_SLOPE, MAX_ROOT_SLOPE).astype(np.float32)


def _ahead_of_slant(frames: CardFrames, grid: Floats, cluster: Ints) -> Floats:
    """How far the slanted root edge lies ahead of its middle at each root, (strand_count, 1)
    [m]."""
    away = grid[:, 0] - frames.center[cluster, 0]
    aside = np.einsum("si,si->s", away, frames.side[cluster, 0])
    ahead: Floats = aside * root_slopes(frames, grid, cluster)[cluster]
    return ahead[:, None]


def _tip_extensions(away: Floats, tangent: Floats, mean: _ClusterMeans, cluster: Ints) -> Floats:
    """Distance that a card reaches beyond the mean tip to cover its longer strands, (n, 1) [m].

    Args:
        away: (strand_count, 3) from the mean tip to each strand's.
    """
    ahead = np.einsum("si,si->s", away, tangent[cluster])
    return _TIP_REACH * np.sqrt(mean.of(ahead * ahead))[:, None]


def _root_extensions(
    away: Floats, tangent: Floats, outwards: Floats, mean: _ClusterMeans, cluster: Ints
) -> Floats:
    """From where a card begins to the mean root, so that it covers its rearmost roots, (n, 3) [m].

    The card reaches back along the head, as far as its roots are spread, however steeply hair
    leaves the head. Hair that stands upright has no rearmost roots.

    Args:
        away: (strand_count, 3) from the mean root to each strand's.
        outwards: (n, 3) the mean normal of the head.
    """
    up = outwards / np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-12)
    flat = tangent - up * np.einsum("ci,ci->c", tangent, up)[:, None]
    lying = np.linalg.norm(flat, axis=1, keepdims=True)
    forward = flat / np.maximum(lying, 1e-12)
    ahead = np.einsum("si,si->s", away, forward[cluster])
    deviation = np.sqrt(mean.of(ahead * ahead))[:, None]
    reach: Floats = forward * np.minimum(lying / _MIN_LEANING, 1.0) * _ROOT_REACH * deviation
    return reach


def _concatenated(strips: Sequence[tuple[CardFrames, Floats]]) -> Strips:
    """All strips in one, with rows no narrower than _MIN_WIDTH of the median."""
    width = np.concatenate([each for _, each in strips])
    width = np.maximum(width, _MIN_WIDTH * np.median(width))
    names = ("center", "tangent", "normal", "side")
    parts = (np.concatenate([getattr(frames, name) for frames, _ in strips]) for name in names)
    return Strips(CardFrames(*(part.astype(np.float32) for part in parts)), width)


class _ClusterMeans:
    """Means over the strands of each cluster."""

    def __init__(self, cluster: Ints) -> None:
        self._order = np.argsort(cluster, kind="stable")
        counts = np.bincount(cluster)
        self._counts, self._starts = counts, piece_starts(counts)

    def of(self, values: Floats) -> Floats:
        """(strand_count, ...) to (cluster_count, ...)."""
        sums = np.add.reduceat(values[self._order], self._starts, axis=0, dtype=np.float64)
        shape = (-1, *[1] * (values.ndim - 1))
        mean: Floats = (sums / self._counts.reshape(shape)).astype(np.float32)
        return mean


def _best_turn(spread: Floats, normal: Floats, side: Floats, outwards: Floats) -> Floats:
    """The turn of each strip [rad] that lays it along the spread and lets it face outwards.

    Of steps of the whole turn, the one with the largest sum of the fraction of the strands'
    variance that lies along the width, and _FACING_WEIGHT times the mean cosine between normal and
    outwards.
    """
    turns = np.linspace(-np.pi, np.pi, _TURN_STEPS, endpoint=False)
    cosine, sine = np.cos(turns)[:, None, None], np.sin(turns)[:, None, None]
    total = np.maximum(spread[..., :2].sum(axis=(1, 2)), 1e-20)
    score = _variance_along(spread[None], cosine, sine).sum(axis=2) / total
    length = np.maximum(np.linalg.norm(outwards, axis=1), 1e-12)
    ahead = np.einsum("cri,ci->c", normal, outwards) / length / normal.shape[1]
    aside = np.einsum("cri,ci->c", side, outwards) / length / normal.shape[1]
    score += _FACING_WEIGHT * (ahead * cosine[..., 0] + aside * sine[..., 0])
    best: Floats = turns[score.argmax(axis=0)]
    return best


def _variance_along(spread: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Variance along side cos - normal sin, from (..., 3): variances ahead and aside, and
    covariance."""
    ahead, aside, both = np.moveaxis(spread, -1, 0)
    variance: Floats = aside * cosine**2 + ahead * sine**2 - 2.0 * both * sine * cosine
    return variance


def _smoothed(rows: Floats) -> Floats:
    """Each row's value blended with its neighbours', (card_count, row_count)."""
    wide = np.pad(rows, ((0, 0), (1, 1)), mode="edge")
    return (wide[:, :-2] + 2.0 * wide[:, 1:-1] + wide[:, 2:]) / 4.0
