"""A square of scalp with a few strands on it."""

from __future__ import annotations

import numpy as np

from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet, Surface

GUIDES = GuideSettings(guide_count=30, cv_count=6)


def sheet(*, has_uv: bool = True) -> Surface:
    """A square of 0.2 m in the plane z = 0, 10 x 10 fields."""
    step = np.linspace(-0.1, 0.1, 11)
    x, y = np.meshgrid(step, step, indexing="xy")
    positions = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(10)[:, None] * 11 + np.arange(10)).reshape(-1, 1)
    fields = corner + np.array([0, 1, 12, 0, 12, 11])
    triangles = fields.reshape(-1, 3).astype(np.int32)
    uv = positions[triangles][..., :2] / 0.2 + 0.5
    return Surface(positions, triangles, uv if has_uv else None)


def wig_strands(count: int = 60) -> StrandSet:
    """Strands of six points that lean over to +X."""
    root = np.random.default_rng(2).uniform(-0.09, 0.09, (count, 3)) * [1.0, 1.0, 0.0]
    along = np.linspace(0.0, 1.0, 6)[:, None] * np.array([0.05, 0.0, 0.1])
    points = (root[:, None] + along).reshape(-1, 3)
    return StrandSet(points, np.arange(count + 1) * 6, np.full(6 * count, 1e-4), np.zeros(count))


def turn_strands(strands: StrandSet, indices: np.ndarray, angle: float) -> StrandSet:
    """Strands of which those in `indices` are turned about Z, around their roots."""
    points = strands.points.copy()
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    for strand in indices:
        points_of_strand = slice(strands.offsets[strand], strands.offsets[strand + 1])
        root = points[points_of_strand][0]
        points[points_of_strand] = root + (points[points_of_strand] - root) @ turn.T
    return strands.with_points(points)
