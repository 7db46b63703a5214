"""Colours that are painted on the surface under hair, looked up where its strands stand.

They are scene-linear and premultiplied by their opacity when they are mixed between corners of
triangles and between pixels, so that paint on an unpainted surface gets no dark border.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Ints
from .masks import sample_bilinear


@dataclass(frozen=True, eq=False)
class PaintedColor:
    """Painted colours; values are finite and not negative."""

    def at(self, triangle: Ints, barycentric: Floats) -> Floats:
        """Red, green, blue and opacity, (n, 4), where roots (n,), (n, 3) are."""
        raise NotImplementedError

    @property
    def triangle_count(self) -> int:
        """The number of triangles of the painted surface."""
        raise NotImplementedError

    def mirrored(self) -> PaintedColor:
        """The same on triangles whose corners are in the other order."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class SurfaceColor(PaintedColor):
    """corners: (triangle_count, 3, 4) float32, at the corners of the surface's triangles."""

    corners: Floats

    def at(self, triangle: Ints, barycentric: Floats) -> Floats:
        a, b, c = self.corners[triangle].astype(np.float64).transpose(1, 0, 2)
        # by differences, so that it is exactly even where it is painted evenly
        found: Floats = a + barycentric[:, 1:2] * (b - a) + barycentric[:, 2:3] * (c - a)
        return found

    @property
    def triangle_count(self) -> int:
        return len(self.corners)

    def mirrored(self) -> SurfaceColor:
        return SurfaceColor(self.corners[:, ::-1])


@dataclass(frozen=True, eq=False)
class ImageColor(PaintedColor):
    """pixels: (height, width, k) float32 as they are stored, the lowest row first.
    decode: decodes such pixels (n, k) to colours (n, 4). corner_uv: (triangle_count, 3, 2).

    Only pixels under roots are decoded, so that hair can follow a brush on a large image.
    """

    pixels: Floats
    decode: Callable[[Floats], Floats]
    corner_uv: Floats

    def at(self, triangle: Ints, barycentric: Floats) -> Floats:
        uv = np.einsum("nk,nkj->nj", barycentric, self.corner_uv[triangle])
        return sample_bilinear(self.pixels, uv, self.decode)

    @property
    def triangle_count(self) -> int:
        return len(self.corner_uv)

    def mirrored(self) -> ImageColor:
        return replace(self, corner_uv=self.corner_uv[:, ::-1])
