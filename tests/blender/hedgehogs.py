"""Strands that stand on the test sphere."""

from __future__ import annotations

import numpy as np

from hairloom.addon.strands import StrandSet


def hedgehog(count: int = 60, points: int = 8, seed: int = 1, groups: int = 2) -> StrandSet:
    """Straight strands of 8 cm, normal to the sphere of radius 0.1 m."""
    outward = np.random.default_rng(seed).normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = 0.1 + np.linspace(0.0, 0.08, points)
    return StrandSet(
        points=(outward[:, None] * along[:, None]).reshape(-1, 3),
        offsets=np.arange(count + 1) * points,
        radius=np.full(count * points, 5.0e-5),
        group=np.arange(count) % groups,
    )
