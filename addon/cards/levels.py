"""Levels of detail: the same cards with ever fewer triangles, for ever greater distances.

Each level has about half the triangles of the one before: first by fewer rows, as far as the
allowed error permits, which doubles from level to level up to a fraction of a card's width; then by
fewer columns; then by fewer cards, where one card replaces two that lie together. All levels show
the same tiles of the same atlas, and a card keeps its number.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import Floats, Ints
from .card_mesh import CardMesh
from .joining import join_pairs, pairs_to_join
from .segments import fewest_segments, interpolated_rows, segment_errors, strip_edges, with_segments
from .settings import CardSettings
from .strip import Strips, UncutCards, strip_mesh

#: Maximum fraction of triangles that a useful level keeps of the one before.
_MAX_TRIANGLE_RATIO = 0.6
#: Error of rows with which levels start if none is given, and its maximum while cards can be
#: joined, as fractions of the cards' median width: straighter cards would run through the head.
_MIN_ERROR, _MAX_ERROR = 0.05, 0.4
_BISECTIONS = 24
#: Percentage of the places on the edges of all cards that a level's error holds for.
_ERROR_PERCENTILE = 90.0


@dataclass(frozen=True)
class CardLevel:
    """One level of detail.

    error: nine tenths of the places on the edges of all cards are within this distance of the
        level's strips [m].
    represented_by: (card_count,) the card of this level that represents each; empty for shells.
    """

    mesh: CardMesh
    error: float
    represented_by: Ints = field(default_factory=lambda: np.zeros(0, np.int32))


@dataclass(frozen=True)
class _Cut:
    """How the cards of one level are cut; arrays of cards are (card_count, ...).

    strips: at full resolution; those of numbers that are gone are not used.
    represented_by: the number of the card that represents each card of the finest level.
    segments: 0 for numbers that are gone.
    errors: of the strips by number of segments, see `segment_errors`.
    error: allowed for rows [m]; max_error: its maximum, as long as there are cards to be joined.
    """

    strips: Strips
    strand_count: Ints
    represented_by: Ints
    segments: Ints
    errors: Floats
    columns: int
    error: float
    max_error: float

    @property
    def triangle_count(self) -> int:
        return int(self.segments.sum()) * self.columns * 2


def card_levels(
    cards: UncutCards,
    settings: CardSettings,
    error: float | None,
    kept_triangles: Ints | None = None,
) -> tuple[CardLevel, ...]:
    """The levels, finest first: as many as the settings say, or fewer if the triangles can no
    longer be halved.

    Args:
        error: allowed for rows of the finest level [m]; None keeps all rows.
        kept_triangles: (card_count,) triangles of cards that the artist's own replace in the finest
            level: it must not join them with others, and coarser ones have no more; 0: replaced by
            none.
    """
    finest = _finest(cards, settings, error)
    protected = None
    if kept_triangles is not None:
        protected = np.flatnonzero(kept_triangles)
        own = -(-kept_triangles[protected] // (2 * settings.column_count))
        finest.segments[protected] = np.minimum(finest.segments[protected], own)
    cuts = [_within_budget(finest, cards.group, settings, protected)]
    while cuts[-1].triangle_count and len(cuts) < settings.levels:
        target = cuts[-1].triangle_count / 2.0
        coarser = _coarser(cuts[-1], cards.group, settings.segment_count, target)
        if coarser.triangle_count > _MAX_TRIANGLE_RATIO * cuts[-1].triangle_count:
            break
        cuts.append(coarser)
    return tuple(
        CardLevel(
            _level_mesh(cut, cards, settings),
            _silhouette_error(cut, cards.strips),
            cut.represented_by,
        )
        for cut in cuts
    )


def _finest(cards: UncutCards, settings: CardSettings, error: float | None) -> _Cut:
    max_segments = settings.segment_count
    errors = segment_errors(cards.strips, max_segments)
    segments: Ints = np.full(len(cards), max_segments, np.int32)
    if error is not None:
        segments = fewest_segments(errors, error, max_segments)
    if cards.is_absent is not None:
        segments[cards.is_absent] = 0
    median = float(np.median(cards.strips.width)) if len(cards) else 0.0
    numbers = np.arange(len(cards), dtype=np.int32)
    columns, allowed = settings.column_count, error or _MIN_ERROR * median
    max_allowed = max(allowed, _MAX_ERROR * median)
    strips, count = cards.strips, cards.strand_count
    return _Cut(strips, count, numbers, segments, errors, columns, allowed, max_allowed)


def _within_budget(cut: _Cut, group: Ints, settings: CardSettings, protected: Ints | None) -> _Cut:
    """The cut with at most as many triangles as the settings allow, as far as cards can be
    joined."""
    budget = settings.max_triangles
    while budget and cut.triangle_count > budget:
        target = max(float(budget), cut.triangle_count / 2.0)
        coarser = _coarser(cut, group, settings.segment_count, target, protected)
        if coarser.triangle_count == cut.triangle_count:
            break
        cut = coarser
    return cut


def _coarser(
    cut: _Cut, group: Ints, max_segments: int, target: float, protected: Ints | None = None
) -> _Cut:
    """A cut with at most `target` triangles, half of the current number or more, or with as few as
    possible."""
    allowed = min(2.0 * cut.error, cut.max_error)
    if _fewer_rows(cut, allowed, max_segments).triangle_count > target and cut.columns > 1:
        cut = replace(cut, columns=(cut.columns + 1) // 2)
    with_fewest_rows = _fewer_rows(cut, allowed, max_segments)
    if with_fewest_rows.triangle_count > target:
        cut = _fewer_cards(cut, with_fewest_rows.segments, target, group, max_segments, protected)
        with_fewest_rows = _fewer_rows(cut, allowed, max_segments)
    halved = _with_max_triangles(cut, target, allowed, max_segments)
    if halved.triangle_count > target:  # nothing else is left to reduce
        halved = _with_max_triangles(cut, target, float(cut.errors.max(initial=0.0)), max_segments)
    return replace(halved, error=allowed)


def _with_max_triangles(cut: _Cut, target: float, allowed: float, max_segments: int) -> _Cut:
    """Rows by the smallest error that leaves at most `target` triangles, or by the allowed one."""
    low, high = 0.0, allowed
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        if _fewer_rows(cut, middle, max_segments).triangle_count > target:
            low = middle
        else:
            high = middle
    return _fewer_rows(cut, high, max_segments)


def _fewer_rows(cut: _Cut, error: float, max_segments: int) -> _Cut:
    """Fewer rows within the error; no card gets more rows than it has."""
    enough = fewest_segments(cut.errors, error, max_segments)
    return replace(cut, segments=np.minimum(cut.segments, enough))


def _fewer_cards(
    cut: _Cut, segments: Ints, target: float, group: Ints, max_segments: int, protected: Ints | None
) -> _Cut:
    """Cards joined until at most `target` triangles are left, if cards have these segments.

    If one round of pairs is not enough, another follows.
    """
    while True:
        present = np.flatnonzero(cut.segments)
        over = segments[present].sum() - target / (2.0 * cut.columns)
        free = present if protected is None else np.setdiff1d(present, protected)
        pairs = pairs_to_join(cut.strips, cut.strand_count, group, free)
        if over <= 0.0 or not len(pairs):
            break
        freed = np.cumsum(segments[pairs[:, 1]])
        pairs = pairs[: int(np.searchsorted(freed, over)) + 1]
        cut = _with_joined_pairs(cut, pairs)
    return replace(cut, errors=segment_errors(cut.strips, max_segments))


def _with_joined_pairs(cut: _Cut, pairs: Ints) -> _Cut:
    strips, strand_count = join_pairs(cut.strips, cut.strand_count, pairs)
    first, second = pairs.T
    represented_by = np.arange(len(cut.represented_by), dtype=np.int32)
    represented_by[second] = first
    segments = cut.segments.copy()
    segments[first] = np.maximum(segments[first], segments[second])
    segments[second] = 0
    return replace(
        cut,
        strips=strips,
        strand_count=strand_count,
        represented_by=represented_by[cut.represented_by],
        segments=segments,
    )


def _level_mesh(cut: _Cut, cards: UncutCards, settings: CardSettings) -> CardMesh:
    return strip_mesh(_strips_by_segment_count(cut), cards, cut.columns, settings)


def _strips_by_segment_count(cut: _Cut) -> list[tuple[Ints, Strips]]:
    """Strips grouped by their number of segments, with the numbers of their cards."""
    by_count = {int(n): np.flatnonzero(cut.segments == n) for n in np.unique(cut.segments) if n}
    parts: list[tuple[Ints, Strips]] = [
        (cards, with_segments(cut.strips, cards, n)) for n, cards in by_count.items()
    ]
    none = np.zeros(0, np.int32)
    return parts or [(none, cut.strips.select(none))]


def _silhouette_error(cut: _Cut, finest: Strips) -> float:
    """Distance of the edges of all cards at full resolution from this level's strips, perpendicular
    to these [m]: the 90th percentile."""
    along = np.linspace(0.0, 1.0, finest.width.shape[1])
    center, side, tangent = (np.zeros_like(finest.frames.center) for _ in range(3))
    half = np.zeros_like(finest.width)
    for cards, strips in _strips_by_segment_count(cut):
        for whole, cut_rows in (
            (center, strips.frames.center),
            (side, strips.frames.side),
            (tangent, strips.frames.tangent),
        ):
            whole[cards] = interpolated_rows(cut_rows, along, strips.places)
        half[cards] = interpolated_rows(strips.width[..., None], along, strips.places)[..., 0] / 2.0
    present = np.flatnonzero(cut.segments[cut.represented_by])
    owner = cut.represented_by[present]
    away = strip_edges(finest.select(present)) - center[owner][:, :, None]
    aside = np.einsum("crei,cri->cre", away, side[owner])
    clamped = np.clip(aside, -half[owner][..., None], half[owner][..., None])
    ahead = np.einsum("crei,cri->cre", away, tangent[owner])
    offset = away - side[owner][:, :, None] * clamped[..., None]
    offset -= tangent[owner][:, :, None] * ahead[..., None]
    distance = np.linalg.norm(offset, axis=-1)
    return float(np.percentile(distance, _ERROR_PERCENTILE)) if distance.size else 0.0
