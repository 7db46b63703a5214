"""How a whole groom has turned since rest: one rotation, from some CVs of some of its guides.

Limitation: fur on several limbs gets their mean rotation.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .constraints import PINNED_COUNT

#: Maximum number of guides that the rotation is computed from.
SAMPLED_GUIDES = 256


def best_rotation(rest: Floats, carried: Floats) -> Floats:
    """The rotation (3, 3) float64 that best fits the whole groom from rest to where it is carried.

    Args:
        rest, carried: rows (3, cv_count, guide_count) [m].
    """
    return fit_rotation(sample_around_mean(rest.T), sample_guides(carried.T))


def sample_guides(grid: Floats) -> Floats:
    """The pinned CVs and the tips of evenly chosen guides, rows (3, n) float64, of a grid
    (guide_count, cv_count, 3)."""
    cvs = [*range(min(PINNED_COUNT, grid.shape[1])), grid.shape[1] - 1]
    stride = max(-(-len(grid) // SAMPLED_GUIDES), 1)
    places = np.asarray(grid)[::stride, cvs]
    return np.ascontiguousarray(places.transpose(2, 1, 0), np.float64).reshape(3, -1)


def sample_roots(grid: Floats) -> Floats:
    """The pinned CVs of evenly chosen guides, which move with the head, rows (3, n) float64, of a
    grid (guide_count, cv_count, 3).

    All CVs if there are fewer than three guides, since two roots do not determine a rotation.
    """
    stride = max(-(-len(grid) // SAMPLED_GUIDES), 1)
    places = np.asarray(grid)[::stride, : PINNED_COUNT if len(grid) > PINNED_COUNT else None]
    return np.ascontiguousarray(places.transpose(2, 1, 0), np.float64).reshape(3, -1)


def sample_around_mean(grid: Floats) -> Floats:
    """`sample_guides` of a grid, relative to its own mean, (3, n) float64."""
    places = sample_guides(grid)
    return places - places.mean(axis=1, keepdims=True) if places.size else places


def fit_rotation(rest: Floats, now: Floats) -> Floats:
    """The rotation (3, 3) float64 from `sample_around_mean` to `sample_guides`.

    Kabsch 1976. A small multiple of the identity selects the smallest rotation if the groom does
    not determine one, like a single straight guide.
    """
    covariance = np.einsum("in,jn->ij", now, rest)  # no BLAS: it would wake its threads for this
    covariance.flat[::4] += 1.0e-6 * np.einsum("in,in->", rest, rest) + 1.0e-12
    left, _, right = np.linalg.svd(covariance)
    rotation: Floats = left @ right
    if _determinant(rotation) < 0.0:
        left[:, 2] *= -1.0
        rotation = left @ right
    return rotation


def _determinant(matrix: Floats) -> float:
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
