"""Square sheets before a view: cards whose right order is obvious."""

from __future__ import annotations

import numpy as np

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.order_views import SphereView

VIEW = SphereView(np.array([0.01, 0.0, 0.004]), 1.0, np.array([0.0, -1.0, 0.0]), 32)


def sheets(depths: tuple[float, ...], turned: tuple[bool, ...] = ()) -> CardMesh:
    """Square sheets of half the picture's width; a larger depth is nearer to VIEW's eye."""
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]) * 0.5
    points = np.concatenate([square - [0.0, depth, 0.0] for depth in depths])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    turned = turned or (False,) * len(depths)
    triangles = [4 * card + (faces[:, ::-1] if over else faces) for card, over in enumerate(turned)]
    ones = np.ones(len(points))
    return CardMesh(
        positions=points,
        triangles=np.concatenate(triangles),
        uv=np.tile([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (len(depths), 1)),
        normal=points,
        tangent=points,
        occlusion=ones,
        card=np.repeat(np.arange(len(depths)), 2),
        along=ones,
    )
