"""Refined strands as they are drawn, for tests and benchmarks: corners, and the GPU's factors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hairloom.addon.arrays import Floats, Ints
from hairloom.addon.refine.detail import stations
from hairloom.addon.refine.smooth import points_at

if TYPE_CHECKING:
    from hairloom.addon.render.detail_pass import DetailOrder


def adaptive_points(points: Floats, factors: Ints) -> tuple[Floats, Ints]:
    """The corners of the drawn strands: (point_count, 3) float32 and offsets (strand_count + 1,).

    Args:
        points: (strand_count, cv_count, 3).
        factors: (strand_count, cv_count - 1), each at least 1.
    """
    offsets = np.zeros(len(factors) + 1, np.int64)
    np.cumsum(stations(factors)[:, -1] + 1, out=offsets[1:])
    # the tip is one more place, at the end of the last segment
    counts = factors.astype(np.int64)
    counts[:, -1] += 1
    strand_count, segment_count = factors.shape
    strand = np.repeat(np.arange(strand_count), counts.sum(axis=1))
    segment = np.repeat(np.tile(np.arange(segment_count), strand_count), counts.ravel())
    first = np.repeat(np.cumsum(counts.ravel()) - counts.ravel(), counts.ravel())
    u = (np.arange(len(segment)) - first).astype(np.float32) / factors[strand, segment]
    corners = points_at(np.asarray(points, np.float32), strand, segment, u.astype(np.float32))
    return corners, offsets


def read_factors(order: DetailOrder, strand_count: int, cv_count: int) -> Ints:
    """The factors of an uneven order, read back, (strand_count, cv_count - 1)."""
    from hairloom.addon.render.strand_layout import FACTORS_IN_TEXEL
    from hairloom.addon.render.textures import texture_to_array

    texels = (cv_count - 2) // FACTORS_IN_TEXEL + 1
    texels_read = texture_to_array(order.factors).reshape(-1, 4)[: strand_count * texels]
    factors = np.ascontiguousarray(texels_read).view(np.uint8).reshape(strand_count, -1)
    return factors[:, : cv_count - 1].astype(np.int32)


def point_textures(snapshot: Any) -> dict[str, Any]:
    """The textures that detail is computed from, as a snapshot's draw makes them."""
    from hairloom.addon.render.strand_curves import spans_texture
    from hairloom.addon.render.textures import texture_from

    packed = np.concatenate([snapshot.points, snapshot.radius[:, None]], axis=1)
    return {
        "cv_points": texture_from(snapshot.layout.pixels(packed), "RGBA32F"),
        "strand_spans": spans_texture(snapshot.layout),
    }
