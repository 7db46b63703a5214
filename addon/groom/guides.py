"""Choosing guides: the strands that are simulated, spread evenly over the scalp."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet
from ..strands.face import is_face_hair
from .settings import GuideSettings

#: Maximum candidates per guide: with more, spreading gets no better, only slower.
_CANDIDATES_PER_GUIDE = 100
#: This many brows or lashes count as one strand when guides are allotted, since they hardly move.
_FACE_HAIR_PER_STRAND = 32


def choose_guides(strands: StrandSet, settings: GuideSettings, kind: Ints | None = None) -> Ints:
    """Indices of the strands that become guides, (guide_count,) int64, ascending.

    Each group, and each kind within it, gets guides in proportion to its size, at least one; brows
    and lashes hardly get more. They are spread over its roots by farthest-point sampling (Gonzalez
    1985): the next guide is the root farthest from all guides so far. The same seed gives the same
    guides. There are never more guides than strands.

    Args:
        kind: (strand_count,) what the strands are held by, see `Holds.kinds`; None: all alike.
    """
    random = np.random.default_rng(settings.seed)
    group = split_by_kind(strands.group, kind)
    _, first, group = np.unique(group, return_index=True, return_inverse=True)
    names = strands.group[first]
    by_group = np.argsort(group, kind="stable")
    sizes = np.bincount(group)
    moving = np.where(is_face_hair(names), -(-sizes // _FACE_HAIR_PER_STRAND), sizes)
    fractions = guide_counts(moving, settings.guide_count)
    members = np.split(by_group, np.cumsum(sizes)[:-1]) if len(sizes) else []
    chosen = [
        _spread(strands.roots, member, int(fraction), random)
        for member, fraction in zip(members, fractions, strict=True)
    ]
    return np.sort(np.concatenate([np.zeros(0, np.int64), *chosen]))


def split_by_kind(group: Ints, kind: Ints | None) -> Ints:
    """Groups split by kind, (strand_count,); only strands of one such group share guides."""
    if kind is None or not kind.any():
        return group
    _, both = np.unique(np.stack([group, kind], axis=1), axis=0, return_inverse=True)
    return both.ravel()


def guide_counts(sizes: Ints, guide_count: int) -> Ints:
    """How many guides each group gets, (group_count,): one each, then by largest remainder.

    Never more than the group's size; in total guide_count, but at most the number of strands and at
    least the number of groups.
    """
    total, group_count = int(sizes.sum()), len(sizes)
    spare = min(guide_count, total) - group_count
    if spare <= 0 or total == group_count:
        return np.ones(group_count, np.int64)
    # quotas beyond the first guide of each group, so that none can exceed its group's size
    quota = spare * (sizes - 1) / (total - group_count)
    fraction = np.floor(quota).astype(np.int64)
    left_over = spare - int(fraction.sum())
    fraction[np.argsort(fraction - quota, kind="stable")[:left_over]] += 1
    return fraction + 1


def _spread(roots: Floats, member: Ints, count: int, random: np.random.Generator) -> Ints:
    """`count` of these strands, their roots far from each other."""
    if count >= len(member):
        return member
    if len(member) > count * _CANDIDATES_PER_GUIDE:
        member = random.choice(member, count * _CANDIDATES_PER_GUIDE, replace=False)
    x, y, z = np.ascontiguousarray(roots[member].T)
    chosen = np.empty(count, np.int64)
    nearest = np.full(len(member), np.inf, np.float32)
    latest = int(random.integers(len(member)))
    for index in range(count):
        chosen[index] = latest
        distance = (x - x[latest]) ** 2 + (y - y[latest]) ** 2 + (z - z[latest]) ** 2
        np.minimum(nearest, distance, out=nearest)
        nearest[latest] = -1.0  # never again, even where roots coincide
        latest = int(nearest.argmax())
    return member[chosen]
