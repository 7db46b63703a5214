"""Direct solvers for small banded systems, one per guide, for all guides at once.

Rows are CVs or segments, so a sweep down the band is a Python loop of numpy calls on whole rows.
Only +, -, *, / are used, which IEEE 754 rounds alike everywhere: no BLAS. For a few hundred guides
the overhead of calls dominates, so arrays are split into rows once, and ufuncs with an output
argument are used instead of operators, which are slower.
"""

from __future__ import annotations

import numpy as np
from numpy import divide, multiply, subtract

from ..arrays import Floats


def solve_tridiagonal(diagonal: Floats, beside: Floats, right: Floats) -> None:
    """Solve symmetric tridiagonal systems in place: `right` becomes the solution.

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
    """Symmetric positive definite pentadiagonal matrices, factored as L D L^T for many right sides:
    one for all guides, or one for each.

    Args:
        main, beside, beyond: (n, 1) or (n, guide_count) float64, the diagonals; entry i of the
            others couples rows i and i + 1, and i and i + 2. Entries beyond the matrix are not
            read.

    near, far: float32 of the same shape, L[i, i - 1] and L[i, i - 2]. inverse_pivot: 1 / D.
    """

    def __init__(self, main: Floats, beside: Floats, beyond: Floats) -> None:
        near, far, pivot = np.zeros_like(main), np.zeros_like(main), np.zeros_like(main)
        for i in range(len(main)):
            if i >= 2:
                far[i] = beyond[i - 2] / pivot[i - 2]
            if i >= 1:
                above = far[i] * pivot[i - 2] * near[i - 1] if i >= 2 else 0.0
                near[i] = (beside[i - 1] - above) / pivot[i - 1]
            pivot[i] = main[i]
            pivot[i] -= near[i] ** 2 * pivot[i - 1] if i >= 1 else 0.0
            pivot[i] -= far[i] ** 2 * pivot[i - 2] if i >= 2 else 0.0
        self._take(*(each.astype(np.float32) for each in (near, far, 1.0 / pivot)))

    def _take(self, near: Floats, far: Floats, inverse_pivot: Floats) -> None:
        self.near, self.far, self.inverse_pivot = near, far, inverse_pivot
        # arrays without axes, which numpy handles in half the time of plain numbers
        self._near, self._far = (
            [np.array(row[0]) if len(row) == 1 else row for row in rows] for rows in (near, far)
        )

    def part(self, guides: slice) -> SharedBand:
        """The matrices of these guides, if each guide has its own."""
        some = SharedBand.__new__(SharedBand)
        some._take(*(each[:, guides] for each in (self.near, self.far, self.inverse_pivot)))
        return some

    def solve(self, right: Floats) -> None:
        """Replace `right` (3, n, guide_count) float32 by the solution."""
        if not right.shape[1]:
            return
        band = np.ascontiguousarray(right.transpose(1, 0, 2))  # x, y and z of a row at once
        rows, scratch = list(band), np.empty_like(band[0])
        for i, row in enumerate(rows[1:], 1):
            subtract(row, multiply(rows[i - 1], self._near[i], scratch), row)
            if i >= 2:
                subtract(row, multiply(rows[i - 2], self._far[i], scratch), row)
        band *= self.inverse_pivot[:, None]
        for i, row in reversed(list(enumerate(rows[:-1], 1))):
            subtract(row, multiply(rows[i], self._near[i], scratch), row)
            if i + 1 < len(rows):
                subtract(row, multiply(rows[i + 1], self._far[i + 1], scratch), row)
        right[:] = band.transpose(1, 0, 2)
