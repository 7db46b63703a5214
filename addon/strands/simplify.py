"""As few points as a strand's own shape needs.

Points are left out as Douglas and Peucker do (1973), for all strands at once. A segment is cut
where the strand strays farthest from it, until all that it stands for lies within a tolerance.
Then, until a strand has kept its length, the segments that lose most of it are cut. Last, the curve
that is drawn through the points, see refine/smooth.py, has to stay as near as the segments: it
swings out where a long one meets a short one, so the long one is cut in the middle.

Widths and colours are held to in the same way, as further coordinates of a point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from .arc_length import lengths, steps
from .strand_set import StrandSet

#: A width may be off by this fraction of its strand's largest, and a colour by this much.
_RADIUS_ERROR, _COLOR_ERROR = 0.1, 0.03
#: In one round those segments of a strand are cut that lose more than this part of what the worst
#: one loses.
_WORST = 0.5
#: Segments that stray less than this, in what is allowed, are best cut in the middle.
_NEARLY_STRAIGHT = 0.01
#: A segment that is so many times as long as its neighbour is cut for the curve's sake.
_UNEVEN = 2.0
#: Rounds in which the curve is brought near.
_ROUNDS = 24
#: Strands that would have too many points are allowed more, so often at most, and so much at least.
_ATTEMPTS, _LOOSER = 20, 1.1
#: Points looked at at once, so that memory stays small.
_CHUNK = 1_000_000
#: How far a segment is looked at along the curve.
_SAMPLES = np.array([0.25, 0.5, 0.75])
_TINY = 1.0e-30


@dataclass(frozen=True)
class Simplified:
    """Strands with as few points as they need.

    is_limited: (strand_count,) which of them need more points than they may have.
    """

    strands: StrandSet
    is_limited: Bools


def simplify(
    strands: StrandSet,
    stray: float,
    *,
    loss: float = 0.005,
    fewest: int = 2,
    most: int = 256,
) -> Simplified:
    """The same strands with points left out; roots and tips stay where they are.

    Args:
        stray: how far the strands' segments, and the curve through their points, may be from where
            the strands were [m].
        loss: which fraction of its length a strand may lose.
        fewest: so many points each strand has at least, about evenly spaced, for what bends it
            later; put in between where it has too few.
        most: so many points it has at most. One that needs more strays more, and is limited.
    """
    assert 2 <= fewest <= most, (fewest, most)
    strands = _filled(strands, fewest)
    keeps, limited = [], []
    for part in _chunks(strands.offsets):
        shape = _Shape.of(strands, part, stray)
        kept, is_limited = _kept(shape, loss, fewest, most)
        keeps.append(kept)
        limited.append(is_limited)
    if not keeps:
        return Simplified(strands, np.zeros(0, bool))
    return Simplified(_with_points(strands, np.concatenate(keeps)), np.concatenate(limited))


@dataclass(frozen=True)
class _Shape:
    """Some strands, all their errors in units of what is allowed.

    points: (n, 3). values: (n, k) what else points have. way: (n,) along all strands.
    offsets: (m + 1,).
    """

    points: Floats
    values: Floats
    way: Floats
    offsets: Ints

    @classmethod
    def of(cls, strands: StrandSet, part: slice, stray: float) -> _Shape:
        offsets = strands.offsets[part.start : part.stop + 1].astype(np.int64)
        chosen = slice(int(offsets[0]), int(offsets[-1]))
        offsets = offsets - offsets[0]
        counts = np.diff(offsets)
        points = strands.points[chosen].astype(np.float64)
        radius = strands.radius[chosen]
        widest = np.maximum(np.maximum.reduceat(radius, offsets[:-1]), _TINY)
        values = [radius / np.repeat(_RADIUS_ERROR * widest, counts)]
        if strands.color is not None:
            values += list(np.nan_to_num(strands.color[chosen]).T / _COLOR_ERROR)
        points -= np.repeat(points[offsets[:-1]], counts, axis=0)  # as exact far from the origin
        way = np.cumsum(steps(points, offsets)) / stray
        return cls(points / stray, np.stack(values, axis=1), way, offsets)

    @property
    def lengths(self) -> Floats:
        return self.way[self.offsets[1:] - 1] - self.way[self.offsets[:-1]]

    def taken(self, strands: Ints) -> tuple[_Shape, Ints]:
        """These strands alone, and which points they have."""
        counts = np.diff(self.offsets)[strands]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        inside = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts)
        points = np.repeat(self.offsets[strands], counts) + inside
        shape = _Shape(self.points[points], self.values[points], self.way[points], offsets)
        return shape, points

    def looser(self, factor: Floats) -> _Shape:
        """The same where each strand is allowed so much more, (m,)."""
        every = np.repeat(factor, np.diff(self.offsets))[:, None]
        points = self.points / every
        way = np.cumsum(steps(points, self.offsets))
        return _Shape(points, self.values / every, way, self.offsets)


@dataclass(frozen=True)
class _Segments:
    """Segments that stand for the points between their ends, in any order.

    first, last: (n,) their ends. stray: (n,) of what lies between. cut: (n,) where they are best
    cut; the first end where nothing lies between. loss: (n,) of length.
    """

    first: Ints
    last: Ints
    stray: Floats
    cut: Ints
    loss: Floats

    @classmethod
    def of(cls, shape: _Shape, first: Ints, last: Ints) -> _Segments:
        chord = shape.points[last] - shape.points[first]
        loss = shape.way[last] - shape.way[first] - np.linalg.norm(chord, axis=1)
        stray, cut = np.zeros(len(first)), first.copy()
        count = last - first - 1
        has_any = np.flatnonzero(count > 0)
        if len(has_any):
            stray[has_any], cut[has_any] = _farthest(shape, first[has_any], last[has_any])
        return cls(first, last, stray, cut, loss)

    @property
    def can_be_cut(self) -> Bools:
        return self.cut > self.first

    def chosen(self, which: Bools | Ints) -> _Segments:
        return _Segments(*(values[which] for values in vars(self).values()))

    def ordered(self) -> _Segments:
        order = np.argsort(self.first)
        return self.chosen(order)

    def joined(self, other: _Segments) -> _Segments:
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return _Segments(*(np.concatenate(pair) for pair in pairs))

    def cut_at(self, shape: _Shape, which: Bools, cut: Ints | None = None) -> _Segments:
        """With two segments in place of each of those chosen."""
        gone, at = self.chosen(which), self.cut[which] if cut is None else cut[which]
        halves = _Segments.of(
            shape, np.concatenate([gone.first, at]), np.concatenate([at, gone.last])
        )
        return self.chosen(~which).joined(halves)


def _farthest(shape: _Shape, first: Ints, last: Ints) -> tuple[Floats, Ints]:
    """How far what lies between is from segments that have something between their ends, and where
    they are best cut: there, or in the middle of what is straight."""
    count = last - first - 1
    group = np.repeat(np.arange(len(first)), count)
    starts = np.cumsum(count) - count
    between = np.arange(len(group)) - starts[group] + first[group] + 1
    origin = shape.points[first]
    chord = shape.points[last] - origin
    size = np.maximum(np.einsum("ij,ij->i", chord, chord), _TINY)
    away = shape.points[between] - origin[group]
    part = np.clip(np.einsum("ij,ij->i", away, chord[group]) / size[group], 0.0, 1.0)
    away -= part[:, None] * chord[group]
    stray = np.sqrt(np.einsum("ij,ij->i", away, away))
    whole = np.maximum(shape.way[last] - shape.way[first], _TINY)
    part = (shape.way[between] - shape.way[first][group]) / whole[group]
    low, high = shape.values[first], shape.values[last]
    for channel in range(shape.values.shape[1]):
        straight = low[group, channel] + part * (high - low)[group, channel]
        np.maximum(stray, np.abs(shape.values[between, channel] - straight), out=stray)
    most = np.maximum.reduceat(stray, starts)
    found = np.flatnonzero(stray == most[group])[::-1]
    cut = np.empty(len(first), np.int64)
    cut[group[found]] = between[found]  # the first of equals is written last
    return most, np.where(most > _NEARLY_STRAIGHT, cut, _middle(shape, first, last))


def _middle(shape: _Shape, first: Ints, last: Ints) -> Ints:
    """The points that are nearest to the middle of segments, but not their ends if there are
    others."""
    wanted = 0.5 * (shape.way[first] + shape.way[last])
    after = np.searchsorted(shape.way, wanted)
    before = np.maximum(after - 1, 0)
    is_before = wanted - shape.way[before] < shape.way[np.minimum(after, last)] - wanted
    return np.clip(np.where(is_before, before, after), np.minimum(first + 1, last), last - 1)


def _kept(shape: _Shape, loss: float, fewest: int, most: int) -> tuple[Bools, Bools]:
    """Which points stay, (n,), and which strands are limited, (m,)."""
    kept = _needed(shape, np.full(len(shape.offsets) - 1, loss), fewest)
    count = np.add.reduceat(kept, shape.offsets[:-1], dtype=np.int64)
    too_many = count > most
    asked, factor = np.flatnonzero(too_many), np.ones(len(count))
    for _ in range(_ATTEMPTS):
        if not len(asked):
            break
        factor[asked] *= np.maximum(count[asked] / most, _LOOSER)
        part, points = shape.taken(asked)
        again = _needed(part.looser(factor[asked]), loss * factor[asked], fewest)
        kept[points] = again
        count[asked] = np.add.reduceat(again, part.offsets[:-1], dtype=np.int64)
        asked = asked[count[asked] > most]
    for strand_number in asked.tolist():  # whatever it is, it is not a shape
        own = slice(shape.offsets[strand_number], shape.offsets[strand_number + 1])
        kept[own] = False
        kept[np.linspace(own.start, own.stop - 1, most).round().astype(int)] = True
    return kept, too_many


def _needed(shape: _Shape, loss: Floats, fewest: int) -> Bools:
    """Which points stay for errors of 1 and these losses (m,), however many, (n,)."""
    kept = _evenly_spaced(shape, fewest)
    ends = np.flatnonzero(kept)
    is_tip = np.zeros(len(kept), bool)
    is_tip[shape.offsets[1:] - 1] = True
    is_segment = ~is_tip[ends[:-1]]
    segments = _Segments.of(shape, ends[:-1][is_segment], ends[1:][is_segment])
    segments = _smooth(shape, _long(shape, _near(shape, segments), loss))
    kept[segments.first] = kept[segments.last] = True
    return kept


def _near(shape: _Shape, segments: _Segments) -> _Segments:
    """Cut until nothing strays too far."""
    done = segments.chosen(segments.stray <= 1.0)
    opened = segments.chosen(segments.stray > 1.0)
    while len(opened.first):
        halves = opened.cut_at(shape, np.ones(len(opened.first), bool))
        done = done.joined(halves.chosen(halves.stray <= 1.0))
        opened = halves.chosen(halves.stray > 1.0)
    return done


def _long(shape: _Shape, segments: _Segments, loss: Floats) -> _Segments:
    """Cut until strands have kept their lengths."""
    allowed, count = loss * shape.lengths, len(shape.offsets) - 1
    while True:
        strand = np.searchsorted(shape.offsets, segments.first, side="right") - 1
        lost = np.bincount(strand, segments.loss, minlength=count)
        worst = np.zeros(count)
        can_be_cut = segments.can_be_cut & (lost > allowed)[strand]
        np.maximum.at(worst, strand[can_be_cut], segments.loss[can_be_cut])
        is_worst = can_be_cut & (segments.loss >= _WORST * worst[strand]) & (segments.loss > 0.0)
        if not is_worst.any():
            return segments
        segments = _near(shape, segments.cut_at(shape, is_worst))


def _smooth(shape: _Shape, segments: _Segments) -> _Segments:
    """Cut until the curve through the points is near."""
    for _ in range(_ROUNDS):
        segments = segments.ordered()
        size = np.linalg.norm(shape.points[segments.last] - shape.points[segments.first], axis=1)
        has_before = np.concatenate([[False], segments.last[:-1] == segments.first[1:]])
        has_after = np.append(has_before[1:], False)
        is_off = _curve_stray(shape, segments, has_before, has_after) > 1.0
        # a neighbour that is much longer bends the curve
        cut = np.zeros(len(size), bool)
        off = np.flatnonzero(is_off)
        for step, has in ((-1, has_before), (1, has_after)):
            beside = np.clip(off + step, 0, len(size) - 1)
            is_long = has[off] & (size[beside] > _UNEVEN * size[off])
            cut[beside[is_long & segments.can_be_cut[beside]]] = True
        is_helped = np.zeros(len(size), bool)
        is_helped[:-1] |= cut[1:] & has_after[:-1]
        is_helped[1:] |= cut[:-1] & has_before[1:]
        cut |= is_off & ~is_helped & segments.can_be_cut
        if not cut.any():
            break
        middle = segments.cut.copy()
        middle[cut] = _middle(shape, segments.first[cut], segments.last[cut])
        segments = _near(shape, segments.cut_at(shape, cut, middle))
    return segments


def _curve_stray(shape: _Shape, segments: _Segments, has_before: Bools, has_after: Bools) -> Floats:
    """How far the curve through the points of ordered segments is from where strands were, (n,)."""
    p1, p2 = shape.points[segments.first], shape.points[segments.last]
    p0, p3 = 2.0 * p1 - p2, 2.0 * p2 - p1
    p0[has_before] = p1[:-1][has_before[1:]]
    p3[has_after] = p2[1:][has_after[:-1]]
    a, b, c = p0 - p1, p2 - p1, p3 - p1
    u = _SAMPLES[:, None, None]
    samples = p1 + 0.5 * u * (b - a + u * (2.0 * a + 4.0 * b - c + u * (c - a - 3.0 * b)))
    count = segments.last - segments.first
    group = np.repeat(np.arange(len(count)), count)
    starts = np.cumsum(count) - count
    begin = np.arange(len(group)) - starts[group] + segments.first[group]
    origin = shape.points[begin]
    chord = shape.points[begin + 1] - origin
    size = np.maximum(np.einsum("ij,ij->i", chord, chord), _TINY)
    farthest = np.zeros(len(count))
    for sample in samples:
        away = sample[group] - origin
        part = np.clip(np.einsum("ij,ij->i", away, chord) / size, 0.0, 1.0)
        away -= part[:, None] * chord
        nearest = np.minimum.reduceat(np.einsum("ij,ij->i", away, away), starts)
        np.maximum(farthest, nearest, out=farthest)
    return np.sqrt(farthest)


def _evenly_spaced(shape: _Shape, fewest: int) -> Bools:
    """Roots, tips and the points nearest to `fewest` - 2 even stations between them, (n,)."""
    kept = np.zeros(len(shape.way), bool)
    first, last = shape.offsets[:-1], shape.offsets[1:] - 1
    kept[first] = kept[last] = True
    for station in np.linspace(0.0, 1.0, fewest)[1:-1]:
        wanted = shape.way[first] + station * (shape.way[last] - shape.way[first])
        after = np.clip(np.searchsorted(shape.way, wanted), first + 1, last)
        is_before = wanted - shape.way[after - 1] < shape.way[after] - wanted
        kept[np.where(is_before, after - 1, after)] = True
    return kept


def _filled(strands: StrandSet, fewest: int) -> StrandSet:
    """The same, with points on long segments, so that none is longer than `fewest` need."""
    if fewest <= 2 or not strands.strand_count:
        return strands
    step = steps(strands.points, strands.offsets)
    room = np.repeat(lengths(strands.points, strands.offsets), strands.point_counts) / (fewest - 1)
    parts = np.ones(strands.point_count, np.int64)
    has_length = room > 0.0
    parts[has_length] = np.ceil(step[has_length] / room[has_length] - 1e-6).astype(np.int64)
    parts = np.maximum(parts, 1)
    if (parts == 1).all():
        return strands
    # each point becomes as many as its segment has parts, itself the last of them
    place = np.repeat(np.arange(strands.point_count), parts)
    ends = np.cumsum(parts)
    part = np.arange(ends[-1]) - np.repeat(ends - parts, parts) + 1
    weight = (part / parts[place]).astype(np.float32)
    before = np.maximum(place - 1, 0)

    def mixed(values: Floats) -> Floats:
        own = weight if values.ndim == 1 else weight[:, None]
        between = values[before] + (values[place] - values[before]) * own
        return np.where(own < 1.0, between, values[place])

    return replace(
        strands,
        points=mixed(strands.points),
        offsets=np.concatenate([[0], ends])[strands.offsets],
        radius=mixed(strands.radius),
        color=None if strands.color is None else mixed(strands.color),
    )


def _with_points(strands: StrandSet, kept: Bools) -> StrandSet:
    """The same without the points that do not stay."""
    if kept.all():
        return strands
    return replace(
        strands,
        points=strands.points[kept],
        offsets=np.concatenate([[0], np.cumsum(kept)])[strands.offsets],
        radius=strands.radius[kept],
        color=None if strands.color is None else strands.color[kept],
    )


def _chunks(offsets: Ints) -> list[slice]:
    """Runs of strands with about as many points each."""
    count = len(offsets) - 1
    wanted = np.arange(_CHUNK, int(offsets[-1]) + _CHUNK, _CHUNK)
    ends = np.unique(np.minimum(np.searchsorted(offsets, wanted), count))
    begins = np.concatenate([[0], ends])[: len(ends)]
    pairs = zip(begins.tolist(), ends.tolist(), strict=True)
    return [slice(begin, end) for begin, end in pairs if end > begin]
