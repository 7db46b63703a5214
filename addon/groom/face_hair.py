"""Brows and lashes on a face: short, curved strands, placed by weights on the skin.

Each hair is an arc of a circle that leaves the skin at one angle and bends by another. The face is
upright (Z up) and looks to -Y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.face import BROWS, LASHES
from ..strands.join import join_strands
from ..strands.vectors import unit
from .bound_strands import bound_strands
from .grow import grow
from .scalp import sample_roots
from .settings import GrowSettings

_UP = np.array([0.0, 0.0, 1.0])
#: exponent of the lashes' weight: their roots are on the rim of the lid, not on the skin around it
_RIM = 5.0
#: brows do not grow where their weight is less than this
_FAINT = 0.3


@dataclass(frozen=True)
class FaceHair:
    """Numbers of strands and their greatest lengths [m]; strands are up to a third shorter."""

    brow_count: int = 1000
    brow_length: float = 0.0075
    lash_count: int = 420
    upper_lash: float = 0.0095
    lower_lash: float = 0.0055
    cv_count: int = 6
    seed: int = 1


def grow_with_face(
    surface: Surface,
    settings: GrowSettings,
    weights: Mapping[str, Floats],
    length: Floats | None = None,
) -> StrandSet:
    """Hair on the scalp, with brows and lashes, which are fewer where the hair is sparse.

    Args:
        weights: (vertex_count,) each, by the names `scalp`, `brows` and `lashes`.
        length: see `grow`.

    Raises:
        HairloomError: see `grow`; or nowhere to grow.
    """
    hair = grow(surface, settings, weights["scalp"], length)
    full, count = FaceHair(), settings.strand_count
    face = replace(
        full,
        brow_count=min(full.brow_count, count // 4),
        lash_count=min(full.lash_count, count // 10),
        seed=settings.seed,
    )
    return join_strands(hair, grow_face_hair(surface, weights["brows"], weights["lashes"], face))


def grow_face_hair(
    surface: Surface, brows: Floats, lashes: Floats, hair: FaceHair | None = None
) -> StrandSet:
    """Brows and lashes, in groups of their own, so that guides on the scalp never move them.

    Args:
        brows, lashes: (vertex_count,), the density of `grow_brows` and the rim of `grow_lashes`.
    """
    hair = hair or FaceHair()
    return join_strands(grow_brows(surface, brows, hair), grow_lashes(surface, lashes, hair))


def grow_brows(surface: Surface, density: Floats, hair: FaceHair) -> StrandSet:
    """Brows: upwards at their inner end, then ever more outwards, their upper and lower hairs
    towards each other.

    Args:
        density: (vertex_count,), how densely they grow.

    Raises:
        HairloomError: nowhere to grow.
    """
    random = np.random.default_rng(hair.seed)
    grows = np.maximum(density - _FAINT, 0.0) ** 2
    triangle, barycentric = sample_roots(surface, hair.brow_count, grows, random)
    root, normal = _at(surface, triangle, barycentric)
    outward, height = np.abs(root[:, 0]), root[:, 2]
    along = (outward - outward.min()) / max(float(np.ptp(outward)), 1e-6)
    middle = np.interp(along, *_middle_line(along, height))
    # upper hairs lean down and lower ones up, so that the brow is densest in its middle
    spread = np.clip((height - middle) / 0.004, -1.0, 1.0)
    rise = np.interp(along, (0.0, 0.18, 0.5, 1.0), (1.6, 0.75, 0.25, -0.35)) - 0.45 * spread
    rise += random.normal(0.0, 0.12, len(root))
    side = np.sign(root[:, 0])
    growth = np.stack([side, np.zeros_like(side), rise], axis=1)
    length = hair.brow_length * np.interp(along, (0.0, 0.3, 1.0), (0.85, 1.0, 0.75))
    length *= 1.0 - random.random(len(root)) / 3.0
    grid = _bent(root, normal, growth, length, (0.42, -0.34), hair.cv_count)
    return _grouped(bound_strands(grid, triangle, barycentric, surface), BROWS)


def grow_lashes(surface: Surface, rim: Floats, hair: FaceHair) -> StrandSet:
    """Lashes of both eyes: forwards and away from the middle of the eye, curled towards their tips.

    Args:
        rim: (vertex_count,), 1 on the rims of the lids, falling off around them.

    Raises:
        HairloomError: nowhere to grow.
    """
    random = np.random.default_rng(hair.seed + 1)
    triangle, barycentric = sample_roots(surface, hair.lash_count, rim**_RIM, random)
    root, _ = _at(surface, triangle, barycentric)
    aside, height = np.zeros(len(root)), np.zeros(len(root))
    for is_here in (root[:, 0] > 0.0, root[:, 0] <= 0.0):
        if is_here.any():
            low, high = root[is_here].min(axis=0), root[is_here].max(axis=0)
            half = 0.5 * np.maximum(high - low, 1e-6)
            aside[is_here] = (root[is_here, 0] - low[0]) / half[0] - 1.0
            height[is_here] = root[is_here, 2] - 0.5 * (low[2] + high[2])
    is_upper = height > 0.0
    outer = aside * np.sign(root[:, 0])
    fan = 0.75 * aside + random.normal(0.0, 0.08, len(root))
    lift = np.where(is_upper, 0.25, -0.75)
    start = unit(np.stack([fan, np.full_like(fan, -1.0), lift], axis=1))
    curl = np.where(is_upper, 1.0, -0.35) * (1.0 + random.normal(0.0, 0.12, len(root)))
    length = np.where(is_upper, hair.upper_lash, hair.lower_lash)
    length = length * np.interp(outer, (-1.0, 0.3, 1.0), (0.55, 1.0, 0.95))
    length *= 1.0 - random.random(len(root)) / 3.0
    grid = _curled(root, start, _UP, length, curl, hair.cv_count)
    return _grouped(bound_strands(grid, triangle, barycentric, surface), LASHES)


def _at(surface: Surface, triangle: Ints, barycentric: Floats) -> tuple[Floats, Floats]:
    """Points of the surface and its normals there, each (n, 3)."""
    corners = surface.triangles[triangle]
    points = np.einsum("nk,nkj->nj", barycentric, surface.positions[corners].astype(np.float64))
    normals = np.einsum("nk,nkj->nj", barycentric, surface.vertex_normals()[corners])
    return points, unit(normals)


def _middle_line(along: Floats, height: Floats) -> tuple[Floats, Floats]:
    """The mean height of a brow along it, as points to interpolate between."""
    part = np.minimum((along * 8).astype(int), 7)
    count = np.bincount(part, minlength=8)
    total = np.bincount(part, weights=height, minlength=8)
    is_there = count > 0
    return ((np.arange(8) + 0.5) / 8)[is_there], total[is_there] / count[is_there]


def _bent(
    root: Floats,
    normal: Floats,
    growth: Floats,
    length: Floats,
    angles: tuple[float, float],
    cv_count: int,
) -> Floats:
    """Strands that leave the skin at an angle and bend by another [rad], (n, cv_count, 3)."""
    along = unit(growth - normal * np.einsum("ij,ij->i", growth, normal)[:, None])
    lift, bend = angles
    start = np.cos(lift) * along + np.sin(lift) * normal
    return _curled(root, start, normal, length, np.full(len(root), bend), cv_count)


def _curled(
    root: Floats, start: Floats, towards: Floats, length: Floats, bend: Floats, cv_count: int
) -> Floats:
    """Arcs of a circle that start in a direction and bend towards another, (n, cv_count, 3)."""
    across = unit(towards - start * np.sum(start * towards, axis=1)[:, None])
    grid = np.empty((len(root), cv_count, 3))
    grid[:, 0] = root
    step = (length / (cv_count - 1))[:, None]
    for cv in range(1, cv_count):
        turn = (bend * (cv - 0.5) / (cv_count - 1))[:, None]
        grid[:, cv] = grid[:, cv - 1] + step * (np.cos(turn) * start + np.sin(turn) * across)
    return grid


def _grouped(strands: StrandSet, group: int) -> StrandSet:
    return replace(strands, group=np.full(strands.strand_count, group, np.int32))
