"""Two cards that lie together become one that covers both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats, Ints
from ..strands.frames import tangents
from ..strands.vectors import unit
from .strip import CardFrames, Strips

#: Places along a card that are compared.
_STATIONS = 6
#: Neighbours of a card that it may be joined with.
_NEIGHBOURS = 8
_CHUNK = 1024


def pairs_to_join(strips: Strips, strand_count: Ints, group: Ints, numbers: Ints) -> Ints:
    """Pairs of cards, (pair_count, 2), those with the smallest loss first; no card is in two of
    them.

    The loss is the growth of the strands' squared distances from the middle of their card (Ward
    1963): single strands join the cards beside them first. The first of a pair is the one that
    represents more strands. No pair has cards of two groups.

    Args:
        numbers: the cards that exist; others are ignored.
    """
    first, second, loss = _neighbours(strips, strand_count, group, numbers)
    is_free = np.ones(len(strips), bool)
    pairs = []
    for index in np.argsort(loss, kind="stable"):
        one, other = int(first[index]), int(second[index])
        if is_free[one] and is_free[other]:
            is_free[one] = is_free[other] = False
            pairs.append((one, other) if strand_count[one] >= strand_count[other] else (other, one))
    return np.array(pairs, np.int32).reshape(-1, 2)


def join_pairs(strips: Strips, strand_count: Ints, pairs: Ints) -> tuple[Strips, Ints]:
    """All strips, where the first of each pair covers both, and how many strands they represent.

    The joined card runs along the mean of both, with the orientation of the first. Its width is the
    geometric mean of two: the one that covers strands spread evenly over both, and the sum of both
    widths, without which more skin would show through. So two cards side by side become one as wide
    as both together, and two on top of each other one 1.4 times as wide.
    """
    first, second = pairs.T
    frames, width = strips.frames, strips.width
    fraction = (strand_count[second] / (strand_count[first] + strand_count[second]))[:, None, None]
    center = frames.center[first] * (1.0 - fraction) + frames.center[second] * fraction
    tangent = tangents(center)
    normal = frames.normal[first]
    normal = unit(normal - tangent * np.einsum("cri,cri->cr", normal, tangent)[..., None])
    side = np.cross(tangent, normal)
    squared = sum(
        part * _squared_width(strips, each, center, side)
        for part, each in ((1.0 - fraction[..., 0], first), (fraction[..., 0], second))
    )
    spread, both = np.sqrt(squared), width[first] + width[second]
    covering = np.sqrt(spread * np.maximum(both, spread))
    all_frames = CardFrames(
        _with_changed(frames.center, first, center),
        _with_changed(frames.tangent, first, tangent),
        _with_changed(frames.normal, first, normal),
        _with_changed(frames.side, first, side),
    )
    count = strand_count.copy()
    count[first] += strand_count[second]
    return replace(strips, frames=all_frames, width=_with_changed(width, first, covering)), count


def _neighbours(
    strips: Strips, strand_count: Ints, group: Ints, numbers: Ints
) -> tuple[Ints, Ints, Floats]:
    """Cards, neighbours of the same group, and the loss by joining them, each (n,)."""
    rows = np.linspace(0, strips.width.shape[1] - 1, _STATIONS).round().astype(int)
    place = strips.frames.center[:, rows]
    place = (place - place.reshape(-1, 3).mean(axis=0)).reshape(len(strips), -1)
    found: list[tuple[Ints, Ints, Floats]] = []
    for name in np.unique(group[numbers]):
        own = numbers[group[numbers] == name]
        near = min(_NEIGHBOURS, len(own) - 1)
        for start in range(0, len(own) if near else 0, _CHUNK):
            chosen = own[start : start + _CHUNK]
            gap = _squared_distances(place[chosen], place[own])
            gap[np.arange(len(chosen)), start + np.arange(len(chosen))] = np.inf
            nearest = np.argpartition(gap, near - 1, axis=1)[:, :near]
            one, other = np.repeat(chosen, near), own[nearest.ravel()]
            count = strand_count[one], strand_count[other]
            weight = count[0] * count[1] / (count[0] + count[1])
            found.append((one, other, weight * np.take_along_axis(gap, nearest, axis=1).ravel()))
    if not found:
        return np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0)
    first, second, loss = (np.concatenate(part) for part in zip(*found, strict=True))
    return first, second, loss


def _squared_distances(some: Floats, all_of_them: Floats) -> Floats:
    squared: Floats = (
        np.einsum("si,si->s", some, some)[:, None]
        + np.einsum("ai,ai->a", all_of_them, all_of_them)
        - 2.0 * some @ all_of_them.T
    )
    return np.maximum(squared, 0.0)


def _squared_width(strips: Strips, chosen: Ints, center: Floats, side: Floats) -> Floats:
    """Contributions of the chosen strips to the squared width of the strip that covers them,
    (n, rows).

    Strands that are spread evenly over a width w have the variance w^2 / 12.
    """
    aside = np.einsum("cri,cri->cr", strips.frames.center[chosen] - center, side)
    lies_along = np.einsum("cri,cri->cr", strips.frames.side[chosen], side)
    squared: Floats = (strips.width[chosen] * lies_along) ** 2 + 12.0 * aside**2
    return squared


def _with_changed(values: Floats, chosen: Ints, changed: Floats) -> Floats:
    copy = np.array(values, np.float32)
    copy[chosen] = changed
    return copy
