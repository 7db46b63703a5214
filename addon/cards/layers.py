"""Layers: how deep in the hair a card lies, from the scalp to the surface.

Artists build hair in layers: an opaque one next to the head, others that break it up, and loose
strands last. A card's layer follows from the number of other cards below and above it along its own
normal. So hair that hangs far from the head has layers too, and thin hair has only the lowest.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .strip import Strips

#: Places along a card at which its neighbours are counted.
_STATIONS = 5
#: Maximum number of places of other cards.
_MAX_OTHERS = 4096
#: Number of such places within reach of a probe where cards lie in one sheet.
_NEIGHBOURS_IN_REACH = 6.0
#: Minimum cosine between the normals of cards on the same side of the head.
_MIN_NORMAL_COSINE = 0.3
#: Places nearer than this to a card's own plane, in terms of the reach, are neither below nor above
#: it.
_PLANE_TOLERANCE = 1.0e-3
_CHUNK = 1024


def card_layers(strips: Strips, count: int) -> Ints:
    """The layer of each card, (card_count,) int32 from 0, next to the head, to `count` - 1.

    All layers have about equally many cards, but all cards with none below them are in the lowest.
    """
    depth = card_depths(strips)
    deeper = np.searchsorted(np.sort(depth), depth, side="left")
    layer: Ints = (deeper * count // max(len(depth), 1)).astype(np.int32)
    return layer


def card_depths(strips: Strips) -> Floats:
    """0 for a card with none below it, towards 1 with ever more below and none above, (n,)."""
    rows = np.linspace(0, strips.width.shape[1] - 1, _STATIONS).round().astype(int)
    place = strips.frames.center[:, rows].reshape(-1, 3)
    normal = strips.frames.normal[:, rows].reshape(-1, 3)
    card = np.repeat(np.arange(len(strips)), len(rows))
    others = np.linspace(0, len(place) - 1, min(len(place), _MAX_OTHERS)).round().astype(int)
    reach = _NEIGHBOURS_IN_REACH * _area(strips) / (np.pi * len(others))
    fraction = np.empty(len(place))
    for start in range(0, len(place), _CHUNK):
        chosen = slice(start, start + _CHUNK)
        below, above = _count_below_and_above(
            (place[chosen], normal[chosen], card[chosen]),
            (place[others], normal[others], card[others]),
            reach,
        )
        fraction[chosen] = below / np.maximum(below + above, 1)
    return fraction.reshape(len(strips), -1).mean(axis=1)


def _count_below_and_above(
    probes: tuple[Floats, Floats, Ints], others: tuple[Floats, Floats, Ints], reach: float
) -> tuple[Ints, Ints]:
    """How many others lie below and above each probe along its normal, two of (probe_count,).

    Args:
        probes, others: places, unit normals, cards.
        reach: squared distance from the probe's normal line within which others count [m^2].
    """
    (place, normal, card), (other_place, other_normal, other_card) = probes, others
    height = normal @ other_place.T - np.einsum("pi,pi->p", normal, place)[:, None]
    squared = (
        np.einsum("pi,pi->p", place, place)[:, None]
        + np.einsum("oi,oi->o", other_place, other_place)
        - 2.0 * place @ other_place.T
    )
    is_seen = (
        (squared - height**2 < reach)
        & (normal @ other_normal.T > _MIN_NORMAL_COSINE)
        & (card[:, None] != other_card)
    )
    level = _PLANE_TOLERANCE * reach**0.5
    below, above = height < -level, height > level
    return (is_seen & below).sum(axis=1), (is_seen & above).sum(axis=1)


def _area(strips: Strips) -> float:
    """Area of all strips together [m^2]."""
    pieces = np.linalg.norm(np.diff(strips.frames.center, axis=1), axis=2)
    return float((pieces * (strips.width[:, 1:] + strips.width[:, :-1]) / 2.0).sum())
