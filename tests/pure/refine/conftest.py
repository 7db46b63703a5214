"""The exact curve in the picture, by brute force, and the error of drawn lines."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.refine.detail import PictureView

SAMPLES = 2000


def power_basis(cvs: Floats) -> Floats:
    """Coefficients of 1, t, t^2, t^3 of each segment, (segment_count, 4, 3) float64.

    From the tangents at both ends (Hermite's form), not from the Bezier form under test.
    """
    points = np.asarray(cvs, np.float64)
    padded = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    slope = (padded[2:] - padded[:-2]) / 2
    start, end, slope_start, slope_end = points[:-1], points[1:], slope[:-1], slope[1:]
    return np.stack(
        [
            start,
            slope_start,
            3 * (end - start) - 2 * slope_start - slope_end,
            2 * (start - end) + slope_start + slope_end,
        ],
        axis=1,
    )


def curve(coefficients: Floats, t: Floats) -> Floats:
    """Points (n, 3) of one segment (4, 3) at t (n,)."""
    return np.polynomial.polynomial.polyval(t, coefficients).T


def seen(points: Floats, view: PictureView) -> tuple[Floats, Floats]:
    """Pixels from the middle of the picture (n, 2), and clip coordinates (n, 4)."""
    clip = np.column_stack([points, np.ones(len(points))]) @ view.view_projection.T
    return clip[:, :2] / clip[:, 3:] * view.half_size, clip


def distance_to_line(points: Floats, corners: Floats) -> Floats:
    """From each point (n, 2) to the nearest point of a polyline (m, 2), (n,)."""
    way = np.diff(corners, axis=0)
    away = points[:, None] - corners[:-1]
    length = (way * way).sum(axis=1)
    along = np.clip((away * way).sum(axis=2) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    return np.linalg.norm(away - along[..., None] * way, axis=2).min(axis=1)


def drawn_error(coefficients: Floats, pieces: int, view: PictureView) -> float:
    """Largest distance [pixels] of the exact curve from its drawing in straight `pieces`."""
    exact, _ = seen(curve(coefficients, np.linspace(0.0, 1.0, SAMPLES)), view)
    corners, _ = seen(curve(coefficients, np.arange(pieces + 1) / pieces), view)
    return float(distance_to_line(exact, corners).max())


@pytest.fixture(scope="session")
def exact() -> Any:
    """The functions above."""
    return sys.modules[__name__]
