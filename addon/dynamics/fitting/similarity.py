"""The motion of points as a whole: the best rotation, scale and translation between two sets.

Umeyama 1991, "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns",
after Kabsch 1976: with H = U S V^T the singular value decomposition of the centered sets'
covariance,

    R = U D V^T,   scale = tr(S D) / variance,   D = diag(1, 1, det(U) det(V)),

so that R never mirrors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats

#: Points lie on a line if their second largest extent is below this fraction of the largest.
_LINE = 1.0e-3


@dataclass(frozen=True)
class Similarity:
    """A similarity and its error.

    matrix: (4, 4) float64. error: [m], root mean square of the remaining distances.
    """

    matrix: Floats
    error: float

    @property
    def scale(self) -> float:
        return float(np.cbrt(np.linalg.det(self.matrix[:3, :3])))


def fit_similarity(before: Floats, now: Floats) -> Similarity | None:
    """The similarity that moves points (n, 3) closest to where they are now, (n, 3) [m].

    None if it cannot be determined: fewer than three points, points on a line or in one place,
    before or now, or points that are not finite.
    """
    before, now = np.asarray(before, np.float64), np.asarray(now, np.float64)
    if len(before) < 3 or not (np.isfinite(before).all() and np.isfinite(now).all()):
        return None
    middle_before, middle_now = before.mean(axis=0), now.mean(axis=0)
    one, other = before - middle_before, now - middle_now
    if _is_a_line(one) or _is_a_line(other):
        return None
    left, size, right = np.linalg.svd(other.T @ one)
    if np.linalg.det(left) * np.linalg.det(right) < 0.0:
        left[:, 2] *= -1.0
        size[2] *= -1.0
    matrix = np.eye(4)
    matrix[:3, :3] = (left @ right) * (size.sum() / (one * one).sum())
    matrix[:3, 3] = middle_now - matrix[:3, :3] @ middle_before
    gap = other - one @ matrix[:3, :3].T
    return Similarity(matrix, float(np.sqrt((gap * gap).sum(axis=1).mean())))


def _is_a_line(centered: Floats) -> bool:
    """Whether points (n, 3) around the origin span less than a plane."""
    width = np.sqrt(np.maximum(np.linalg.eigvalsh(centered.T @ centered), 0.0))
    return bool(width[1] <= _LINE * width[2])
