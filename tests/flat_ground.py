"""A flat square that hair grows on, guides on it, and settings of plain children."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairloom.addon.arrays import Ints
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.strands import StrandSet, Surface

#: children that are mixed from several guides, without any other effect
PLAIN: dict[str, Any] = {
    "method": "multi",
    "length_variation": 0.0,
    "clump": 0.0,
    "frizz": 0.0,
    "baby_hair": 0.0,
}


def children_settings(**values: Any) -> ChildrenSettings:
    return ChildrenSettings(**(PLAIN | {"strand_count": 400} | values))


def sheet(cells: int = 10, size: float = 1.0) -> Surface:
    """A flat square of triangles with UVs, from 0 to `size`."""
    x, y = np.meshgrid(*[np.linspace(0.0, 1.0, cells + 1)] * 2, indexing="ij")
    row, column = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    a = (row * (cells + 1) + column).ravel()
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    positions = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    triangles = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
    return Surface(positions * size, triangles, positions[triangles][..., :2])


def guides_at(
    surface: Surface, root: Any, direction: Any, group: Ints | None = None, cv_count: int = 9
) -> StrandSet:
    """Straight guides, bound to the surface; `root` and `direction` (root to tip): (guide_count,
    3)."""
    root, direction = np.asarray(root, np.float64), np.asarray(direction, np.float64)
    grid = root[:, None] + np.linspace(0.0, 1.0, cv_count)[:, None] * direction[:, None]
    strands = StrandSet(
        grid.reshape(-1, 3),
        np.arange(len(root) + 1) * cv_count,
        np.repeat(np.linspace(1e-4, 2e-4, len(root)), cv_count),
        np.zeros(len(root)) if group is None else group,
    )
    return bind_roots(strands, surface, place="test").strands
