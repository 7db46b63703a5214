"""One strip for each cluster of strands: where it runs, how it lies, how wide it is, how fine.

A strip runs along the mean of its strands. It turns about that line, as a whole and without
twist, so that the strands spread along its width and it still faces away from the head. Each row is
as wide as its strands lie, and rows are only as many as the allowed error asks for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints
from ..strands.frames import tangents, transported_normals
from .atlas_grid import AtlasGrid
from .card_mesh import CardMesh
from .clusters import cluster_strands
from .settings import CardSettings
from .strip import CardFrames, Strips, scattered_tiles, strip_mesh

#: Half a card's width in standard deviations of its strands: sqrt(3) holds evenly spread strands.
_COVERING = 1.8
#: How much facing away from the head counts beside lying along the strands' spread.
_FACING_WEIGHT = 0.35
_TURNS = 72
#: Least width of a row, as a share of the median; a single strand's card has it throughout.
_LEAST_WIDTH = 0.25
#: Numbers of segments that are tried.
_SEGMENTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)


def cluster_cards(
    grid: Floats, radius: Floats, group: Ints, root_normal: Floats, settings: CardSettings
) -> CardMesh:
    """A card for each cluster of strands; occlusion is 1 until it is computed.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        radius: (strand_count, cv_count) [m].
        group: (strand_count,); no card holds strands of two.
        root_normal: (strand_count, 3) unit normals of the head under the roots.
    """
    single = round(settings.card_count * settings.fly_aways)
    cluster = cluster_strands(grid, group, max(settings.card_count - single, 1), settings.seed)
    cluster = with_fly_aways(grid, cluster, single)
    strips = fit_strips(grid, radius, cluster, root_normal, settings)
    segments = segment_counts(strips, settings.error, settings.segment_count)
    chosen = ((np.flatnonzero(segments == count), int(count)) for count in np.unique(segments))
    parts = [(cards, with_segments(strips, cards, count)) for cards, count in chosen]
    atlas = AtlasGrid(columns=settings.atlas_columns)
    tile = scattered_tiles(len(strips), atlas, settings.seed)
    return strip_mesh(parts, _group_of(cluster, group, len(tile)), tile, atlas, settings)


def _group_of(cluster: Ints, group: Ints, card_count: int) -> Ints:
    """The group of each card, (card_count,); crossed ones come after all others."""
    _, first = np.unique(cluster, return_index=True)
    return np.resize(group[first], card_count)


def with_fly_aways(grid: Floats, cluster: Ints, count: int) -> Ints:
    """The clusters, and behind them so many strands alone, those farthest from their cluster.

    The last strand of a cluster stays in it.
    """
    away = grid - _Mean(cluster).of(grid)[cluster]
    gap = np.einsum("sri,sri->s", away, away)
    nearest = np.argsort(gap, kind="stable")
    stays = np.zeros(len(cluster), bool)
    stays[nearest[np.unique(cluster[nearest], return_index=True)[1]]] = True
    farthest = nearest[::-1]
    leaving = farthest[~stays[farthest]][:count]
    label = cluster.copy()
    label[leaving] = cluster.max() + 1 + np.arange(len(leaving), dtype=np.int32)
    return label


def fit_strips(
    grid: Floats, radius: Floats, cluster: Ints, root_normal: Floats, settings: CardSettings
) -> Strips:
    """Strips in the order of the clusters, with as many rows as there are CVs; where they are to be
    crossed, the second ones of all clusters follow.

    Args:
        cluster: (strand_count,), from 0 without gaps. Others as in cluster_cards.
    """
    mean = _Mean(cluster)
    center = mean.of(grid)
    tangent = tangents(center)
    outwards = mean.of(root_normal)
    normal = transported_normals(tangent, outwards)
    side = np.cross(tangent, normal)

    away = grid - center[cluster]
    ahead = np.einsum("sri,sri->sr", away, normal[cluster])
    aside = np.einsum("sri,sri->sr", away, side[cluster])
    spread = mean.of(np.stack([ahead * ahead, aside * aside, ahead * aside], axis=-1))
    turn = _best_turn(spread, normal, side, outwards)
    thickness = mean.of(radius)
    strips: list[tuple[CardFrames, Floats]] = []
    for further in (0.0, np.pi / 2.0)[: 1 + settings.crossed]:
        cosine, sine = np.cos(turn + further)[:, None], np.sin(turn + further)[:, None]
        turned = normal * cosine[..., None] + side * sine[..., None]
        variance = _smoothed(np.maximum(_along(spread, cosine, sine), 0.0))
        half = settings.cover * _COVERING * np.sqrt(variance) + thickness
        frames = CardFrames(center, tangent, turned, np.cross(tangent, turned))
        strips.append((frames, 2.0 * half))
    return _stacked(strips)


def _stacked(strips: Sequence[tuple[CardFrames, Floats]]) -> Strips:
    """All of them, no row of which is much narrower than most are."""
    width = np.concatenate([each for _, each in strips])
    width = np.maximum(width, _LEAST_WIDTH * np.median(width))
    names = ("center", "tangent", "normal", "side")
    parts = (np.concatenate([getattr(frames, name) for frames, _ in strips]) for name in names)
    return Strips(CardFrames(*(part.astype(np.float32) for part in parts)), width)


def segment_counts(strips: Strips, error: float, most: int) -> Ints:
    """The fewest segments with which both edges stay within `error` [m] of the strip, (n,)."""
    edges = _edges(strips)
    count = np.full(len(edges), most, np.int32)
    is_open = np.ones(len(edges), bool)
    for segments in [s for s in _SEGMENTS if s < most]:
        coarse = _interpolated(edges, np.linspace(0.0, 1.0, segments + 1))
        again = _interpolated(coarse, np.linspace(0.0, 1.0, edges.shape[1]))
        worst = np.linalg.norm(again - edges, axis=-1).max(axis=(1, 2))
        fits = is_open & (worst <= error)
        count[fits] = segments
        is_open &= ~fits
    return count


def with_segments(strips: Strips, chosen: Ints, segments: int) -> Strips:
    """The chosen strips with this many segments, equally spaced in CVs."""
    along = np.linspace(0.0, 1.0, segments + 1)
    frames = strips.frames
    center = _interpolated(frames.center[chosen], along)
    tangent = _unit(_interpolated(frames.tangent[chosen], along))
    normal = _interpolated(frames.normal[chosen], along)
    normal = _unit(normal - tangent * np.einsum("cri,cri->cr", normal, tangent)[..., None])
    width = _interpolated(strips.width[chosen][..., None], along)[..., 0]
    return Strips(CardFrames(center, tangent, normal, np.cross(tangent, normal)), width)


class _Mean:
    """Means over the strands of each cluster."""

    def __init__(self, cluster: Ints) -> None:
        self._order = np.argsort(cluster, kind="stable")
        counts = np.bincount(cluster)
        self._counts, self._starts = counts, np.cumsum(counts) - counts

    def of(self, values: Floats) -> Floats:
        """(strand_count, ...) to (cluster_count, ...)."""
        sums = np.add.reduceat(values[self._order], self._starts, axis=0, dtype=np.float64)
        shape = (-1, *[1] * (values.ndim - 1))
        mean: Floats = (sums / self._counts.reshape(shape)).astype(np.float32)
        return mean


def _best_turn(spread: Floats, normal: Floats, side: Floats, outwards: Floats) -> Floats:
    """The turn of each strip [rad] that lays it along the spread and lets it face outwards.

    Of the whole turn in steps, the one with the most of: the share of the strands' variance that
    lies along the width, and _FACING_WEIGHT times the mean cosine between normal and outwards.
    """
    turns = np.linspace(-np.pi, np.pi, _TURNS, endpoint=False)
    cosine, sine = np.cos(turns)[:, None, None], np.sin(turns)[:, None, None]
    total = np.maximum(spread[..., :2].sum(axis=(1, 2)), 1e-20)
    score = _along(spread[None], cosine, sine).sum(axis=2) / total
    length = np.maximum(np.linalg.norm(outwards, axis=1), 1e-12)
    ahead = np.einsum("cri,ci->c", normal, outwards) / length / normal.shape[1]
    aside = np.einsum("cri,ci->c", side, outwards) / length / normal.shape[1]
    score += _FACING_WEIGHT * (ahead * cosine[..., 0] + aside * sine[..., 0])
    best: Floats = turns[score.argmax(axis=0)]
    return best


def _along(spread: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Variance along side cos - normal sin, of (..., 3) variances ahead, aside and of both."""
    ahead, aside, both = np.moveaxis(spread, -1, 0)
    variance: Floats = aside * cosine**2 + ahead * sine**2 - 2.0 * both * sine * cosine
    return variance


def _smoothed(rows: Floats) -> Floats:
    """Each row's value mixed with its neighbours', (card_count, row_count)."""
    wide = np.pad(rows, ((0, 0), (1, 1)), mode="edge")
    return (wide[:, :-2] + 2.0 * wide[:, 1:-1] + wide[:, 2:]) / 4.0


def _edges(strips: Strips) -> Floats:
    """Both edges of each strip, (card_count, row_count, 2, 3) [m]."""
    half = strips.frames.side * (strips.width / 2.0)[..., None]
    return np.stack([strips.frames.center - half, strips.frames.center + half], axis=2)


def _interpolated(rows: Floats, along: Floats) -> Floats:
    """Rows at these places from 0 to 1, linearly between, (card_count, len(along), ...)."""
    place = along * (rows.shape[1] - 1)
    left = np.minimum(place.astype(int), rows.shape[1] - 2)
    share = (place - left).astype(np.float32).reshape(1, -1, *[1] * (rows.ndim - 2))
    mixed: Floats = rows[:, left] * (1.0 - share) + rows[:, left + 1] * share
    return mixed


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
