"""As many points as each strand needs, so that its shape stays what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from .arc_length import along
from .join import joined
from .resample import resample
from .strand_set import StrandSet

#: Points that a strand may have, at most.
MAX_POINTS = 256
#: Of its length a strand may lose this.
LOST = 0.005
#: A strand may stray by this part of the hair's median length: 0.2 mm of 25 cm.
STRAY = 8.0e-4
#: Each count that is tried is larger than the one before by about this factor.
_STEP = 1.25
#: Points tried at once.
_CHUNK = 1_000_000


def with_needed_points(strands: StrandSet, least: int, most: int = MAX_POINTS) -> StrandSet:
    """The same strands with fewer points where these do, and more where there are few.

    A strand is resampled evenly to as few points as it takes to lose at most LOST of its length and
    to stray by at most STRAY of the median length of all. Where that is no fewer than its own, it
    keeps its own, and one of fewer than `least` gets more between them.
    """
    own = strands.point_counts
    if not strands.strand_count or (own == least).all():
        return strands
    needed, is_even = _needed(strands, least, most)
    if np.array_equal(needed, own) and not is_even.any():
        return strands
    parts, order = [], []
    for count in np.unique(needed).tolist():
        for are_even in (False, True):
            chosen = np.flatnonzero((needed == count) & (is_even == are_even))
            if len(chosen):
                some = strands.take(chosen)
                parts.append(resample(some, count) if are_even else _refined(some, count))
                order.append(chosen)
    whole = parts[0]
    for part in parts[1:]:
        whole = joined(whole, part)
    return whole.take(np.argsort(np.concatenate(order)))


def _needed(strands: StrandSet, least: int, most: int) -> tuple[Ints, Bools]:
    """How many points each strand gets, and whether evenly, (strand_count,) each."""
    own = strands.point_counts
    needed, is_even = np.clip(own, least, most), own > most
    stray = STRAY * float(np.median(strands.lengths()))
    left = np.flatnonzero(own != least)
    for count in _counts(least, most):
        left = left[(own[left] > count) | (count == least)]
        if not len(left):
            break
        suffices = np.zeros(len(left), bool)
        size = max(_CHUNK // max(int(own[left].max()), count), 1)
        for start in range(0, len(left), size):
            part = strands.take(left[start : start + size])
            suffices[start : start + size] = _suffices(part, count, stray)
        needed[left[suffices]], is_even[left[suffices]] = count, True
        left = left[~suffices]
    return needed, is_even


def _counts(least: int, most: int) -> list[int]:
    counts, count = [], float(least)
    while count < most:
        counts.append(round(count))
        count *= _STEP
    return counts


def _suffices(strands: StrandSet, count: int, stray: float) -> Bools:
    """Whether each strand is the same by `count` even points."""
    even = resample(strands, count)
    kept = even.lengths() >= (1.0 - LOST) * strands.lengths()
    # each point against the place as far along the even ones: no nearer than the nearest
    place = along(strands.points, strands.offsets) * (count - 1)
    before = np.minimum(place.astype(np.int64), count - 2)
    part = (place - before)[:, None]
    before += np.repeat(np.arange(strands.strand_count) * count, strands.point_counts)
    on_even = even.points[before] * (1.0 - part) + even.points[before + 1] * part
    away = np.linalg.norm(strands.points - on_even, axis=1)
    return np.asarray(kept & (np.maximum.reduceat(away, strands.offsets[:-1]) <= stray))


def _refined(strands: StrandSet, count: int) -> StrandSet:
    """With `count` points, their own among them: the others lie between these, most of them where
    they are far apart."""
    if (strands.point_counts == count).all():
        return strands
    left = np.empty((strands.strand_count, count), np.int64)
    weight = np.empty((strands.strand_count, count))
    own = strands.point_counts
    for number in np.unique(own).tolist():
        some = np.flatnonzero(own == number)
        points = strands.take(some).grid.astype(np.float64)
        pieces = _pieces(np.linalg.norm(np.diff(points, axis=1), axis=2), count - 1)
        begin = np.cumsum(pieces, axis=1) - pieces
        segment = (np.arange(count)[:, None] >= begin[:, None]).sum(axis=2) - 1
        inside = np.arange(count) - np.take_along_axis(begin, segment, axis=1)
        weight[some] = inside / np.take_along_axis(pieces, segment, axis=1)
        left[some] = strands.offsets[some, None] + segment
    part = weight[..., None].astype(np.float32)

    def between(values: Floats) -> Floats:
        near, far = values[left], values[left + 1]
        mixed: Floats = np.where(part == 1.0, far, near + (far - near) * part)
        return mixed.reshape(-1, values.shape[1])

    return replace(
        strands,
        points=between(strands.points),
        offsets=np.arange(strands.strand_count + 1) * count,
        radius=between(strands.radius[:, None])[:, 0],
        color=None if strands.color is None else between(strands.color),
    )


def _pieces(length: Floats, count: int) -> Ints:
    """How many pieces each segment gets, (n, segments): at least one each, and by length."""
    segments = length.shape[1]
    wanted = length / np.maximum(length.sum(axis=1, keepdims=True), 1.0e-30) * (count - segments)
    pieces = wanted.astype(np.int64)
    spare = count - segments - pieces.sum(axis=1)
    rank = np.argsort(np.argsort(pieces - wanted, axis=1, kind="stable"), axis=1, kind="stable")
    return pieces + 1 + (rank < spare[:, None])
