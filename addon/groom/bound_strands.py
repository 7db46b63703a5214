"""Shared by all methods of growing: segment lengths, weights on the mesh, the strand set."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.strand_set import DEFAULT_RADIUS


def segment_fractions(cv_count: int, ratio: float) -> Floats:
    """Fraction of each segment in the strand's length, (cv_count - 1,), summing to 1.

    A geometric series, each segment `ratio` times as long as the one before it: with a ratio above
    1 they get longer to the tip (Nguyen and Donnelly 2005, GPU Gems 2, chapter 23).
    """
    fraction = ratio ** np.arange(cv_count - 1)
    return fraction / fraction.sum()


def checked_weights(weights: Floats | None, surface: Surface, name: str) -> Floats | None:
    """Weights of the vertices, (vertex_count,) float64, with negative ones raised to 0.

    Args:
        name: what they weigh, for messages.

    Raises:
        HairloomError: another number of values than vertices, one that is not finite, or none
            above zero.
    """
    if weights is None:
        return None
    values = np.asarray(weights, np.float64)
    vertex_count = len(surface.positions)
    if values.shape != (vertex_count,):
        raise HairloomError(
            f"the {name} has shape {values.shape}, but the mesh has {vertex_count:,} vertices",
            place=name,
            remedy="Give one value for each vertex",
        )
    if not np.isfinite(values).all():
        raise HairloomError(
            f"the {name} of a vertex is not a finite number",
            place=name,
            remedy="Paint or compute it again",
        )
    if not (values > 0.0).any():
        raise HairloomError(
            f"the {name} is 0 on every vertex, so there is no area on which hair may grow",
            place=name,
            remedy="Paint weights where hair is to grow, or choose another group",
        )
    return np.maximum(values, 0.0)


def interpolate_weights(
    weights: Floats, surface: Surface, triangle: Ints, barycentric: Floats
) -> Floats:
    """Weights of the vertices (vertex_count,) at points of the surface, (n,)."""
    result: Floats = np.einsum("nk,nk->n", barycentric, weights[surface.triangles[triangle]])
    return result


def bound_strands(grid: Floats, triangle: Ints, barycentric: Floats, surface: Surface) -> StrandSet:
    """Strands of one CV count (strand_count, cv_count, 3), held where they grow, with root UVs.

    Their widths are yet to be found (`widths`).
    """
    strand_count, cv_count = grid.shape[:2]
    root_uv = None
    if surface.corner_uv is not None:
        root_uv = np.einsum("sk,skj->sj", barycentric, surface.corner_uv[triangle])
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(strand_count + 1) * cv_count,
        radius=np.full(strand_count * cv_count, DEFAULT_RADIUS),
        group=np.zeros(strand_count, np.int32),
        root_uv=root_uv,
        root_triangle=triangle,
        root_barycentric=barycentric,
        has_widths=False,
    )
