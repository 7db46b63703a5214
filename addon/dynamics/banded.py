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


def solve_tridiagonal(diagonal: Floats, off_diagonal: Floats, right: Floats) -> None:
    """Solve symmetric tridiagonal systems in place: `right` becomes the solution.

    Thomas's algorithm without pivoting, as the systems are positive definite.

    Args:
        diagonal: (n, guide_count), overwritten.
        off_diagonal: (n - 1, guide_count), entry i couples rows i and i + 1.
        right: (n, guide_count).
    """
    if not len(right):
        return
    pivots, answers, ratios = list(diagonal), list(right), list(np.empty_like(off_diagonal))
    scratch = np.empty_like(right[0])
    pivot, answer = pivots[0], answers[0]
    for ratio, upper, below, answer_below in zip(
        ratios, off_diagonal, pivots[1:], answers[1:], strict=True
    ):
        divide(upper, pivot, ratio)
        subtract(below, multiply(ratio, upper, scratch), below)
        subtract(answer_below, multiply(ratio, answer, scratch), answer_below)
        pivot, answer = below, answer_below
    right /= diagonal
    for ratio, above in zip(reversed(ratios), reversed(answers[:-1]), strict=True):
        subtract(above, multiply(ratio, answer, scratch), above)
        answer = above


class PentadiagonalSystem:
    """Symmetric positive definite pentadiagonal matrices, factored as L D L^T for many right sides:
    one for all guides, or one for each.

    Args:
        main, beside, beyond: (n, 1) or (n, guide_count) float64, the diagonals; entry i of the
            others couples rows i and i + 1, and i and i + 2. Entries beyond the matrix are not
            read.

    lower_1, lower_2: float32 of the same shape, L[i, i - 1] and L[i, i - 2]. inverse_pivot: 1 / D.
    """

    def __init__(self, diagonal: Floats, off_diagonal_1: Floats, off_diagonal_2: Floats) -> None:
        lower_1, lower_2, pivot = (
            np.zeros_like(diagonal),
            np.zeros_like(diagonal),
            np.zeros_like(diagonal),
        )
        for i in range(len(diagonal)):
            if i >= 2:
                lower_2[i] = off_diagonal_2[i - 2] / pivot[i - 2]
            if i >= 1:
                above = lower_2[i] * pivot[i - 2] * lower_1[i - 1] if i >= 2 else 0.0
                lower_1[i] = (off_diagonal_1[i - 1] - above) / pivot[i - 1]
            pivot[i] = diagonal[i]
            pivot[i] -= lower_1[i] ** 2 * pivot[i - 1] if i >= 1 else 0.0
            pivot[i] -= lower_2[i] ** 2 * pivot[i - 2] if i >= 2 else 0.0
        self._set_factors(*(each.astype(np.float32) for each in (lower_1, lower_2, 1.0 / pivot)))

    def _set_factors(self, lower_1: Floats, lower_2: Floats, inverse_pivot: Floats) -> None:
        self.lower_1, self.lower_2, self.inverse_pivot = lower_1, lower_2, inverse_pivot
        # arrays without axes, which numpy handles in half the time of plain numbers
        self._lower_1, self._lower_2 = (
            [np.array(row[0]) if len(row) == 1 else row for row in rows]
            for rows in (lower_1, lower_2)
        )

    def part(self, guides: slice) -> PentadiagonalSystem:
        """The matrices of these guides, if each guide has its own."""
        some = PentadiagonalSystem.__new__(PentadiagonalSystem)
        some._set_factors(
            *(each[:, guides] for each in (self.lower_1, self.lower_2, self.inverse_pivot))
        )
        return some

    def solve(self, right: Floats) -> None:
        """Replace `right` (3, n, guide_count) float32 by the solution."""
        if not right.shape[1]:
            return
        band = np.ascontiguousarray(right.transpose(1, 0, 2))  # x, y and z of a row at once
        rows, scratch = list(band), np.empty_like(band[0])
        for i, row in enumerate(rows[1:], 1):
            subtract(row, multiply(rows[i - 1], self._lower_1[i], scratch), row)
            if i >= 2:
                subtract(row, multiply(rows[i - 2], self._lower_2[i], scratch), row)
        band *= self.inverse_pivot[:, None]
        for i, row in reversed(list(enumerate(rows[:-1], 1))):
            subtract(row, multiply(rows[i], self._lower_1[i], scratch), row)
            if i + 1 < len(rows):
                subtract(row, multiply(rows[i + 1], self._lower_2[i + 1], scratch), row)
        right[:] = band.transpose(1, 0, 2)
