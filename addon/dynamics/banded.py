"""Direct solves of small banded systems, one a guide, in step with all guides.

Rows are CVs or segments, so a sweep down the band is a Python loop of whole-row numpy calls.
Only +, -, *, / are used, which IEEE 754 rounds alike everywhere: no BLAS. For some hundred guides
the calls cost more than the numbers, so arrays are taken apart into rows once, and functions that
are given where to write stand for operators, which take longer.
"""

from __future__ import annotations

import numpy as np
from numpy import divide, multiply, subtract

from ..arrays import Floats


def solve_tridiagonal(diagonal: Floats, beside: Floats, right: Floats) -> None:
    """Solve symmetric tridiagonal systems in place: `right` becomes the answer.

    Thomas's algorithm without pivoting, as the systems are positive definite.

    Args:
        diagonal: (n, guide_count), overwritten.
        beside: (n - 1, guide_count), entry i couples rows i and i + 1.
        right: (n, guide_count).
    """
    if not len(right):
        return
    pivots, answers, ratios = list(diagonal), list(right), list(np.empty_like(beside))
    scratch = np.empty_like(right[0])
    pivot, answer = pivots[0], answers[0]
    for ratio, upper, below, answer_below in zip(
        ratios, beside, pivots[1:], answers[1:], strict=True
    ):
        divide(upper, pivot, ratio)
        subtract(below, multiply(ratio, upper, scratch), below)
        subtract(answer_below, multiply(ratio, answer, scratch), answer_below)
        pivot, answer = below, answer_below
    right /= diagonal
    for ratio, above in zip(reversed(ratios), reversed(answers[:-1]), strict=True):
        subtract(above, multiply(ratio, answer, scratch), above)
        answer = above


class SharedBand:
    """One symmetric positive definite matrix with two diagonals beside the main one, factored as
    L D L^T, to be solved for many right sides.

    Args:
        matrix: (n, n) float64; entries farther than two from the diagonal are taken as zero.

    near, far: (n,) float32, L beside the diagonal: row i takes near[i] of row i - 1, far[i] of
    i - 2. inverse_pivot: (n,) float32, 1 / D.
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
        self.near, self.far = near.astype(np.float32), far.astype(np.float32)
        self.inverse_pivot = (1.0 / pivot).astype(np.float32)
        # arrays without axes: numpy takes these in half the time that it needs for numbers
        self._near, self._far = (
            [np.array(factor) for factor in factors] for factors in (self.near, self.far)
        )

    def solve(self, right: Floats) -> None:
        """Replace `right` (3, n, guide_count) float32 by the solution."""
        if not right.shape[1]:
            return
        band = np.ascontiguousarray(right.transpose(1, 0, 2))  # x, y and z of a row in one go
        rows, scratch = list(band), np.empty_like(band[0])
        for i, row in enumerate(rows[1:], 1):
            subtract(row, multiply(rows[i - 1], self._near[i], scratch), row)
            if i >= 2:
                subtract(row, multiply(rows[i - 2], self._far[i], scratch), row)
        band *= self.inverse_pivot[:, None, None]
        for i, row in reversed(list(enumerate(rows[:-1], 1))):
            subtract(row, multiply(rows[i], self._near[i], scratch), row)
            if i + 1 < len(rows):
                subtract(row, multiply(rows[i + 1], self._far[i + 1], scratch), row)
        right[:] = band.transpose(1, 0, 2)
