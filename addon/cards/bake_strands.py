"""The strands of an atlas laid flat into its tiles.

A strip has one row per CV of the strands. CV r of a strand lies at row r, moved along the strip by
its offset from that row; across the strip it lies at its offset along the row's side. Rows near a
slanted root edge are as slanted as their cards are. The height over the strip's plane is the depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..strands.vectors import unit_or
from .atlas import AtlasPlan
from .strip import root_slants

#: Part of a card's width within which strands occlude those behind them.
_OCCLUSION_WIDTH = 0.25
#: Part of a card's width, from its middle, in which strands are never moved.
_UNMOVED_WIDTH = 0.35
#: Stations that replace each segment, so that bends are smooth.
PIECES_PER_SEGMENT = 4
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class FlatStrands:
    """Ribbons on the atlas, straight from station to station, all float32; tile after tile.

    place: (n, station_count, 2) in the atlas, 0 to 1.
    half_width: (n, station_count, 2) from `place` to the right edge.
    along: (n, station_count) from 0 at the strand's root to 1 at its tip.
    depth: (n, station_count) 0 to 1 as in AtlasMaps.
    tangent: (n, station_count, 3) unit vectors in the card's frame.
    base: (n, station_count, 3) the strand's colour as a factor of the hair's, over base_gain.
    occlusion: (n, station_count) fraction of the light from the front that the tile's other strands
        let through.
    strand_id: (n,) from 0 to 1, at random, no two the same.
    """

    place: Floats
    half_width: Floats
    along: Floats
    depth: Floats
    tangent: Floats
    base: Floats
    occlusion: Floats
    strand_id: Floats
    base_gain: float = 1.0

    def __len__(self) -> int:
        return len(self.strand_id)


def strand_ids(count: int) -> Floats:
    """A distinct number for each strand, evenly spaced in 0 to 1 in random order, (count,)."""
    ids: Floats = (np.random.default_rng(0).permutation(count) + 0.5) / count
    return ids


def flat_strands(
    plan: AtlasPlan, grid: Floats, radius: Floats, base: Floats | None = None
) -> FlatStrands:
    """The strands of the plan in its tiles; none reaches beyond its tile.

    Args:
        grid: (strand_count, cv_count, 3) [m] of all strands, as in plan_atlas.
        radius: (strand_count, cv_count) [m], as strands are drawn.
        base: (strand_count, cv_count, 3) the colour of each strand as a factor of the hair's, see
            shading.drawn_strands; 1 where there is none.
    """
    tile, strips = plan.tile_of_strand, plan.strips
    points, frames = grid[plan.strands], strips.frames
    away = points - frames.center[tile]
    axes = (frames.side, frames.tangent, frames.normal)
    aside, ahead, outside = (np.einsum("sri,sri->sr", away, axis[tile]) for axis in axes)
    width: Floats = np.maximum(strips.width[tile], _TINY)
    row_count = points.shape[1]
    if plan.root_slope is not None:
        ahead = ahead - aside * plan.root_slope[tile, None] * root_slants(
            np.linspace(0.0, 1.0, row_count, dtype=np.float32)
        )
    spacing = np.linalg.norm(np.gradient(frames.center, axis=1), axis=-1)[tile] * (row_count - 1)
    spacing = np.maximum(spacing, _TINY)
    radii = radius[plan.strands] * plan.thickness[tile, None] / width
    color, gain = _normalized_colors(plan, base, points.shape)
    cv_values = (
        aside / width,
        _scaled_into_strip(np.linspace(0.0, 1.0, row_count) + ahead / spacing),
        np.clip(0.5 + outside / np.maximum(strips.width.mean(axis=1), _TINY)[tile, None], 0.0, 1.0),
        radii,
        width / spacing,
        _occlusion(plan, aside / width, radii, outside),
    )
    subdivided = [_subdivided(value[..., None])[..., 0] for value in cv_values]
    across, along, depth, thickness, aspect, occlusion = subdivided

    half = _half_width(across, along, np.maximum(thickness, 0.0), aspect)
    across = 0.5 + _compressed(across, np.abs(half[..., 0]), plan)
    along = np.clip(along, np.abs(half[..., 1]), 1.0 - np.abs(half[..., 1]))
    place = plan.grid.uv(tile[:, None], across, along)
    edge = plan.grid.uv(tile[:, None], across + half[..., 0], along + half[..., 1])
    parts = {
        "place": place,
        "half_width": edge - place,
        "along": np.broadcast_to(np.linspace(0.0, 1.0, place.shape[1]), place.shape[:2]),
        "depth": np.clip(depth, 0.0, 1.0),
        "tangent": _tangents(points, *(axis[tile] for axis in axes)),
        "base": np.clip(_subdivided(color), 0.0, 1.0),
        "occlusion": np.clip(occlusion, 0.0, 1.0),
        "strand_id": strand_ids(len(points)),
    }
    single = {name: part.astype(np.float32) for name, part in parts.items()}
    return FlatStrands(**single, base_gain=gain)


def _half_width(across: Floats, along: Floats, thickness: Floats, aspect: Floats) -> Floats:
    """From a ribbon's middle to its edge, perpendicular to the strand on the card,
    (n, stations, 2).

    Args:
        across, along: place in the tile. thickness: radius in widths of the card.
        aspect: width of the card in its lengths.
    """
    slope = np.gradient(np.stack([across * aspect, along], axis=-1), axis=1)
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), _TINY)
    half = np.stack([slope[..., 1], -slope[..., 0] * aspect], axis=-1) * thickness[..., None]
    clipped: Floats = np.clip(half, -0.5, 0.5)
    return clipped


def _subdivided(values: Floats) -> Floats:
    """PIECES_PER_SEGMENT stations per segment, (n, stations, channels), by Catmull and Rom 1974."""
    ends = 2.0 * values[:, [0, -1]] - values[:, [1, -2]]
    wide = np.concatenate([ends[:, :1], values, ends[:, 1:]], axis=1)
    p0, p1, p2, p3 = (wide[:, i : wide.shape[1] - 3 + i, None] for i in range(4))
    u = (np.arange(PIECES_PER_SEGMENT) / PIECES_PER_SEGMENT)[:, None]
    a, b, c = p0 - p1, p2 - p1, p3 - p1
    fine = p1 + 0.5 * u * (b - a + u * (2.0 * a + 4.0 * b - c + u * (c - a - 3.0 * b)))
    inner = fine.reshape(len(values), -1, values.shape[-1])
    return np.concatenate([inner, values[:, -1:]], axis=1)


def _scaled_into_strip(along: Floats) -> Floats:
    """Strands that begin before the strip or end behind it, scaled into it, each as a whole."""
    low = np.minimum(along.min(axis=1, keepdims=True), 0.0)
    high = np.maximum(along.max(axis=1, keepdims=True), 1.0)
    return (along - low) / (high - low)


def _compressed(across: Floats, half: Floats, plan: AtlasPlan) -> Floats:
    """Places across in -0.5 to 0.5: where strands reach further out, those beyond _KEPT are
    compressed.

    Thus nothing is cut off, and each strand keeps its neighbours.
    """
    far = np.maximum.reduceat(np.abs(across) + half, plan.offsets[:-1], axis=0)
    far = np.maximum(far, 0.5)[plan.tile_of_strand]
    beyond = (np.abs(across) - _UNMOVED_WIDTH) * (0.5 - _UNMOVED_WIDTH) / (far - _UNMOVED_WIDTH)
    place = np.where(
        np.abs(across) <= _UNMOVED_WIDTH, across, np.sign(across) * (_UNMOVED_WIDTH + beyond)
    )
    return np.clip(place, half - 0.5, 0.5 - half)


def _tangents(points: Floats, side: Floats, tangent: Floats, normal: Floats) -> Floats:
    slope = np.gradient(points, axis=1)
    parts = [np.einsum("sri,sri->sr", slope, axis) for axis in (side, tangent, normal)]
    return unit_or(_subdivided(np.stack(parts, axis=-1)), (0.0, 1.0, 0.0), _TINY)


def _normalized_colors(
    plan: AtlasPlan, base: Floats | None, shape: tuple[int, ...]
) -> tuple[Floats, float]:
    """Colours no brighter than 1, and what they were divided by."""
    if base is None:
        return np.ones(shape), 1.0
    shade = base[plan.strands]
    gain = max(float(shade.max(initial=0.0)), 1.0)
    return shade / gain, gain


def _occlusion(plan: AtlasPlan, across: Floats, radius: Floats, outside: Floats) -> Floats:
    """exp(-tau), with tau the mean number of strands that light from the front meets before each
    CV.

    Strands of the same row within _NEAR of the card's width count, by the fraction of it that they
    cover.

    Args:
        across, radius: (n, cv_count) in widths of the card. outside: (n, cv_count) [m].
    """
    occlusion = np.ones_like(across)
    for first, last in zip(plan.offsets[:-1], plan.offsets[1:], strict=True):
        own = slice(first, last)
        for row in range(across.shape[1]):
            place, thick, depth = across[own, row], radius[own, row], outside[own, row]
            is_before = depth > depth[:, None]
            is_near = np.abs(place - place[:, None]) < 0.5 * _OCCLUSION_WIDTH
            tau = (is_before & is_near) @ (2.0 * thick / _OCCLUSION_WIDTH)
            occlusion[own, row] = np.exp(-tau)
    return occlusion
