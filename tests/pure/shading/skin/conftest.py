"""Surfaces with known UV maps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hairloom.addon.strands import Surface


def plane(cells: int = 8, size: float = 0.2) -> Surface:
    """A square in xy, from 0 to `size` [m], whose UVs are its x and y over `size`."""
    line = np.linspace(0.0, size, cells + 1)
    x, y = np.meshgrid(line, line)
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    row, column = np.divmod(np.arange(cells * cells), cells)
    low = row * (cells + 1) + column
    up = low + cells + 1
    triangles = np.concatenate(
        [np.stack([low, low + 1, up + 1], axis=1), np.stack([low, up + 1, up], axis=1)]
    )
    return Surface(positions, triangles, positions[triangles][..., :2] / size)


@pytest.fixture
def square() -> Callable[..., Surface]:
    return plane


@pytest.fixture
def two_islands() -> Surface:
    """The square cut along x = 0.1: in the map its right half is turned, smaller and far away."""
    whole = plane()
    assert whole.corner_uv is not None
    uv = whole.corner_uv.astype(np.float64)
    is_right = whole.corners[..., 0].mean(axis=1) > 0.1
    turn = np.radians(35.0)
    turned = uv @ (0.7 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]))
    uv[is_right] = turned[is_right] + (1.0, 1.5)
    return Surface(whole.positions, whole.triangles, uv)
