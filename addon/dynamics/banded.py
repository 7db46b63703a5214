"""Direct solves of small banded systems, one a guide, in step with all guides.

Rows are CVs or segments, so a sweep down the band is a Python loop of whole-row numpy calls.
Only +, -, *, / are used, which IEEE 754 rounds alike everywhere: no BLAS.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats


def solve_tridiagonal(diagonal: Floats, beside: Floats, right: Floats) -> None:
    """Solve symmetric tridiagonal systems in place: `right` becomes the answer.

    Thomas's algorithm without pivoting, as the systems are positive definite.

    Args:
        diagonal: (n, guide_count), overwritten.
        beside: (n - 1, guide_count), entry i couples rows i and i + 1.
        right: (n, guide_count).
    """
    count = len(right)
    ratio = np.empty_like(beside)
    scratch = np.empty_like(right[0]) if count else right
    for i in range(1, count):
        np.divide(beside[i - 1], diagonal[i - 1], out=ratio[i - 1])
        np.multiply(ratio[i - 1], beside[i - 1], out=scratch)
        diagonal[i] -= scratch
        np.multiply(ratio[i - 1], right[i - 1], out=scratch)
        right[i] -= scratch
    right /= diagonal
    for i in range(count - 2, -1, -1):
        np.multiply(ratio[i], right[i + 1], out=scratch)
        right[i] -= scratch


class SharedBand:
    """One symmetric positive definite matrix with two diagonals beside the main one, factored as
    L D L^T, to be solved for many right sides.

    Args:
        matrix: (n, n) float64; entries farther than two from the diagonal are taken as zero.
    """

    def __init__(self, matrix: Floats) -> None:
        count = len(matrix)
        near, far, pivot = np.zeros(count), np.zeros(count), np.zeros(count)
        for i in range(count):
            if i >= 2:
                far[i] = matrix[i, i - 2] / pivot[i - 2]
            if i >= 1:
                above = far[i] * pivot[i - 2] * near[i - 1] if i >= 2 else 0.0
                near[i] = (matrix[i, i - 1] - above) / pivot[i - 1]
            pivot[i] = matrix[i, i]
            pivot[i] -= near[i] ** 2 * pivot[i - 1] if i >= 1 else 0.0
            pivot[i] -= far[i] ** 2 * pivot[i - 2] if i >= 2 else 0.0
        self._near = [np.float32(value) for value in near]
        self._far = [np.float32(value) for value in far]
        self._inverse_pivot = (1.0 / pivot).astype(np.float32)[:, None]

    def solve(self, right: Floats) -> None:
        """Replace `right` (3, n, guide_count) float32 by the solution."""
        count = right.shape[1]
        row = [right[:, i] for i in range(count)]
        scratch = np.empty_like(row[0]) if count else right
        for i in range(1, count):
            row[i] -= np.multiply(row[i - 1], self._near[i], out=scratch)
            if i >= 2:
                row[i] -= np.multiply(row[i - 2], self._far[i], out=scratch)
        right *= self._inverse_pivot
        for i in range(count - 2, -1, -1):
            row[i] -= np.multiply(row[i + 1], self._near[i + 1], out=scratch)
            if i + 2 < count:
                row[i] -= np.multiply(row[i + 2], self._far[i + 2], out=scratch)
