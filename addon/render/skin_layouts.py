"""A cache of heads' layouts from render to render: making one takes longer than drawing it.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..shading.skin.layout import SkinLayout, skin_layout
from ..strands import Surface

#: number of heads that are kept
_CAPACITY = 8
#: Largest relative change of a head's edges with which a layout is reused; the width of the blur is
#: wrong by as much there.
_STRETCH = 0.05


@dataclass(frozen=True, eq=False)
class _Kept:
    triangles: Ints
    corner_uv: Floats
    edges: Floats
    resolution: int
    layout: SkinLayout

    def fits(self, surface: Surface, edges: Floats, resolution: int) -> bool:
        return (
            self.resolution == resolution
            and np.array_equal(self.triangles, surface.triangles)
            and surface.corner_uv is not None
            and np.array_equal(self.corner_uv, surface.corner_uv)
            and bool((np.abs(edges - self.edges) <= _STRETCH * self.edges).all())
        )


_kept: list[_Kept] = []


def layout_of(surface: Surface, resolution: int) -> SkinLayout:
    """`skin_layout`, or an earlier result that also fits this surface."""
    edges = np.linalg.norm(surface.corners - np.roll(surface.corners, 1, axis=1), axis=2)
    for kept in _kept:
        if kept.fits(surface, edges, resolution):
            return kept.layout
    layout = skin_layout(surface, resolution)
    if surface.corner_uv is not None:
        _kept.append(_Kept(surface.triangles, surface.corner_uv, edges, resolution, layout))
    del _kept[:-_CAPACITY]
    return layout


def forget() -> None:
    """Clear the cache."""
    _kept.clear()
