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
from .merging import pairs_to_join, with_joined
from .segments import edges_of, fewest_segments, interpolated, segment_errors, with_segments
from .settings import CardSettings
from .strip import Strips, UncutCards, strip_mesh

#: Maximum fraction of triangles that a useful level keeps of the one before.
_MAX_KEPT = 0.6
#: Error of rows with which levels start if none is given, and its maximum while cards can be
#: joined, as fractions of the cards' median width: straighter cards would run through the head.
_MIN_ERROR, _MAX_ERROR = 0.05, 0.4
_BISECTIONS = 24
#: Percentage of the places on the edges of all cards that a level's error holds for.
_HELD = 90.0


@dataclass(frozen=True)
class CardLevel:
    """One level of detail.

    error: nine tenths of the places on the edges of all cards are within this distance of the
        level's strips [m].
    owner: (card_count,) the card of this level that represents each; empty for shells.
    """

    mesh: CardMesh
    error: float
    owner: Ints = field(default_factory=lambda: np.zeros(0, np.int32))


@dataclass(frozen=True)
class _Cut:
    """How the cards of one level are cut; arrays of cards are (card_count, ...).

    strips: at full resolution; those of numbers that are gone are not used.
    owner: the number of the card that represents each card of the finest level.
    segments: 0 for numbers that are gone.
    errors: of the strips by number of segments, see `segment_errors`.
    error: allowed for rows [m]; max_error: its maximum, as long as there are cards to be joined.
    """

    strips: Strips
    strand_count: Ints
    owner: Ints
    segments: Ints
    errors: Floats
    columns: int
    error: float
    max_error: float

    @property
    def triangle_count(self) -> int:
        return int(self.segments.sum()) * self.columns * 2


def card_levels(
    cards: UncutCards, settings: CardSettings, error: float | None, kept: Ints | None = None
) -> tuple[CardLevel, ...]:
    """The levels, finest first: as many as the settings say, or fewer if the triangles can no
    longer be halved.

    Args:
        error: allowed for rows of the finest level [m]; None keeps all rows.
        kept: cards that the finest level must not join with others.
    """
    cuts = [_within(_finest(cards, settings, error), cards.group, settings, kept)]
    while cuts[-1].triangle_count and len(cuts) < settings.levels:
        half = cuts[-1].triangle_count / 2.0
        coarser = _coarser(cuts[-1], cards.group, settings.segment_count, half)
        if coarser.triangle_count > _MAX_KEPT * cuts[-1].triangle_count:
            break
        cuts.append(coarser)
    return tuple(
        CardLevel(_mesh(cut, cards, settings), _silhouette_error(cut, cards.strips), cut.owner)
        for cut in cuts
    )


def _finest(cards: UncutCards, settings: CardSettings, error: float | None) -> _Cut:
    most = settings.segment_count
    errors = segment_errors(cards.strips, most)
    segments: Ints = np.full(len(cards), most, np.int32)
    if error is not None:
        segments = fewest_segments(errors, error, most)
    if cards.absent is not None:
        segments[cards.absent] = 0
    median = float(np.median(cards.strips.width)) if len(cards) else 0.0
    numbers = np.arange(len(cards), dtype=np.int32)
    columns, allowed = settings.column_count, error or _MIN_ERROR * median
    max_allowed = max(allowed, _MAX_ERROR * median)
    strips, count = cards.strips, cards.strand_count
    return _Cut(strips, count, numbers, segments, errors, columns, allowed, max_allowed)


def _within(cut: _Cut, group: Ints, settings: CardSettings, kept: Ints | None) -> _Cut:
    """The cut with at most as many triangles as the settings allow, as far as cards can be
    joined."""
    budget = settings.max_triangles
    while budget and cut.triangle_count > budget:
        target = max(float(budget), cut.triangle_count / 2.0)
        coarser = _coarser(cut, group, settings.segment_count, target, kept)
        if coarser.triangle_count == cut.triangle_count:
            break
        cut = coarser
    return cut


def _coarser(cut: _Cut, group: Ints, most: int, half: float, kept: Ints | None = None) -> _Cut:
    """A cut with at most `half` triangles, half of the current number or more, or with as few as
    possible."""
    allowed = min(2.0 * cut.error, cut.max_error)
    if _fewer_rows(cut, allowed, most).triangle_count > half and cut.columns > 1:
        cut = replace(cut, columns=(cut.columns + 1) // 2)
    least = _fewer_rows(cut, allowed, most)
    if least.triangle_count > half:
        cut = _fewer_cards(cut, least.segments, half, group, most, kept)
        least = _fewer_rows(cut, allowed, most)
    halved = _halved(cut, half, allowed, most)
    if halved.triangle_count > half:  # nothing else is left to reduce
        halved = _halved(cut, half, float(cut.errors.max(initial=0.0)), most)
    return replace(halved, error=allowed)


def _halved(cut: _Cut, half: float, allowed: float, most: int) -> _Cut:
    """Rows by the smallest error that leaves at most `half` triangles, or by the allowed one."""
    low, high = 0.0, allowed
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        if _fewer_rows(cut, middle, most).triangle_count > half:
            low = middle
        else:
            high = middle
    return _fewer_rows(cut, high, most)


def _fewer_rows(cut: _Cut, error: float, most: int) -> _Cut:
    """Fewer rows within the error; no card gets more rows than it has."""
    enough = fewest_segments(cut.errors, error, most)
    return replace(cut, segments=np.minimum(cut.segments, enough))


def _fewer_cards(
    cut: _Cut, segments: Ints, half: float, group: Ints, most: int, kept: Ints | None
) -> _Cut:
    """Cards joined until at most `half` triangles are left, if cards have these segments.

    If one round of pairs is not enough, another follows.
    """
    while True:
        there = np.flatnonzero(cut.segments)
        over = segments[there].sum() - half / (2.0 * cut.columns)
        free = there if kept is None else np.setdiff1d(there, kept)
        pairs = pairs_to_join(cut.strips, cut.strand_count, group, free)
        if over <= 0.0 or not len(pairs):
            break
        freed = np.cumsum(segments[pairs[:, 1]])
        pairs = pairs[: int(np.searchsorted(freed, over)) + 1]
        cut = _joined(cut, pairs)
    return replace(cut, errors=segment_errors(cut.strips, most))


def _joined(cut: _Cut, pairs: Ints) -> _Cut:
    strips, strand_count = with_joined(cut.strips, cut.strand_count, pairs)
    kept, gone = pairs.T
    stands_for = np.arange(len(cut.owner), dtype=np.int32)
    stands_for[gone] = kept
    segments = cut.segments.copy()
    segments[kept] = np.maximum(segments[kept], segments[gone])
    segments[gone] = 0
    owner = stands_for[cut.owner]
    return replace(cut, strips=strips, strand_count=strand_count, owner=owner, segments=segments)


def _mesh(cut: _Cut, cards: UncutCards, settings: CardSettings) -> CardMesh:
    return strip_mesh(_parts(cut), cards, cut.columns, settings)


def _parts(cut: _Cut) -> list[tuple[Ints, Strips]]:
    """Strips grouped by their number of segments, with the numbers of their cards."""
    by_count = {int(n): np.flatnonzero(cut.segments == n) for n in np.unique(cut.segments) if n}
    parts: list[tuple[Ints, Strips]] = [
        (cards, with_segments(cut.strips, cards, n)) for n, cards in by_count.items()
    ]
    none = np.zeros(0, np.int32)
    return parts or [(none, cut.strips.of(none))]


def _silhouette_error(cut: _Cut, finest: Strips) -> float:
    """Distance of the edges of all cards at full resolution from this level's strips, perpendicular
    to these [m]: the 90th percentile."""
    along = np.linspace(0.0, 1.0, finest.width.shape[1])
    center, side, tangent = (np.zeros_like(finest.frames.center) for _ in range(3))
    half = np.zeros_like(finest.width)
    for cards, strips in _parts(cut):
        center[cards] = interpolated(strips.frames.center, along)
        side[cards] = interpolated(strips.frames.side, along)
        tangent[cards] = interpolated(strips.frames.tangent, along)
        half[cards] = interpolated(strips.width[..., None], along)[..., 0] / 2.0
    there = np.flatnonzero(cut.segments[cut.owner])
    owner = cut.owner[there]
    away = edges_of(finest.of(there)) - center[owner][:, :, None]
    aside = np.einsum("crei,cri->cre", away, side[owner])
    held = np.clip(aside, -half[owner][..., None], half[owner][..., None])
    ahead = np.einsum("crei,cri->cre", away, tangent[owner])
    off = away - side[owner][:, :, None] * held[..., None]
    off -= tangent[owner][:, :, None] * ahead[..., None]
    distance = np.linalg.norm(off, axis=-1)
    return float(np.percentile(distance, _HELD)) if distance.size else 0.0
