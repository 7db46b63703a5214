"""How much of a pixel cards cover, by their texture."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .card_mesh import CardMesh
from .order_views import Fragments

#: From this alpha on a pixel is opaque, and below the other it is clear: as in the passes.
OPAQUE_ALPHA, LEAST_ALPHA = 0.99, 0.004


def alpha_at(mesh: CardMesh, met: Fragments, alpha: Floats) -> Floats:
    """The nearest texel of each fragment, (fragment_count,); alpha: (height, width)."""
    first = 1.0 - met.second - met.third
    shares = np.stack([first, met.second, met.third], axis=1)
    uv = np.einsum("nc,nci->ni", shares, mesh.uv[mesh.triangles[met.triangle]])
    height, width = alpha.shape
    row = np.clip((uv[:, 1] * height).astype(int), 0, height - 1)
    column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    return alpha[row, column]


def seen_from_afar(alpha: Floats, mesh: CardMesh, pixel: float) -> Floats:
    """The alpha in texels that are about as large on the cards as a pixel of this many metres.

    Halved as often as the finest step above it, as mip maps are; their mean is what counts, since
    the thin strands of one texel each would be met by chance.
    """
    texels = texels_per_metre(alpha, mesh) * pixel
    while texels >= 2.0 and min(alpha.shape) > 1:
        height, width = (2 * (side // 2) for side in alpha.shape)
        alpha = alpha[:height, :width].reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
        texels /= 2.0
    return alpha


def texels_per_metre(alpha: Floats, mesh: CardMesh) -> float:
    """On average over all cards."""
    on_cards = _twice_area(mesh.positions[mesh.triangles])
    on_texture = _twice_area(mesh.uv[mesh.triangles]) * alpha.size
    return float(np.sqrt(on_texture / max(on_cards, 1e-30)))


def _twice_area(corners: Floats) -> float:
    """Of all triangles, (triangle_count, 3, 2 or 3)."""
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    dot = np.einsum("ti,ti->t", one, other)
    squares = np.einsum("ti,ti->t", one, one) * np.einsum("ti,ti->t", other, other)
    return float(np.sqrt(np.maximum(squares - dot * dot, 0.0)).sum())
