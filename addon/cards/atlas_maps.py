"""`AtlasMaps`, the pictures of an atlas, and how the texels between hairs are filled.

They are filled so that filtering and mip maps mix in hair of the same tile only. Between two hairs
of a row values are interpolated; beyond the outermost hair they continue. A row without hair copies
the nearest row of its tile that has some. Hair runs along a tile, so what is near lies in the row.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints
from .atlas_grid import AtlasGrid


@dataclass(frozen=True, eq=False)
class AtlasMaps:
    """Maps of one size, float32 in [0, 1], row 0 the lowest; values of hair continue where alpha is
    0, see `dilated`.

    Directions d are 0.5 d + 0.5 in the card's own frame: x across the card, along u; y along the
    card from root to tip; z away from the head.

    alpha: (h, w) fraction of the texel that strands cover.
    base: (h, w, 3) linear; times `base_gain` it is the factor on the hair's colour.
    normal: (h, w, 3) of the strands, which are round.
    tangent: (h, w, 3) direction of the strands.
    depth: (h, w) 0.5 in the card's plane, larger further outside; 0 and 1 are half a card's mean
        width behind and in front of it.
    along: (h, w) from 0 at the strand's root to 1 at its tip.
    strand_id: (h, w) a random number for each strand, that of the outermost one in the texel.
    occlusion: (h, w) 1 open, 0 occluded, by the strands of the tile.
    relative_depth: see `atlas_depth.relative_depths`; not a map that is written.
    """

    alpha: Floats
    base: Floats
    normal: Floats
    tangent: Floats
    depth: Floats
    along: Floats
    strand_id: Floats
    occlusion: Floats
    base_gain: float = 1.0
    relative_depth: Floats | None = None

    @property
    def by_name(self) -> dict[str, Floats]:
        """All maps by their names, shaped as above."""
        return {name: getattr(self, name) for name in MAP_NAMES}


#: The maps by name.
MAP_NAMES = tuple(
    field.name for field in fields(AtlasMaps) if field.name not in ("base_gain", "relative_depth")
)
#: Values in tiles without hair.
_EMPTY: dict[str, float | tuple[float, ...]] = {
    "base": 1.0,
    "normal": (0.5, 0.5, 1.0),
    "tangent": (0.5, 1.0, 0.5),
    "depth": 0.5,
    "along": 0.0,
    "strand_id": 0.0,
    "occlusion": 1.0,
}


def dilated(maps: AtlasMaps, grid: AtlasGrid) -> AtlasMaps:
    """The maps with values continued where alpha is 0; alpha stays as it is."""
    left, right, fraction = neighbouring_hair(maps.alpha > 0.0, grid)
    is_free = maps.alpha == 0.0
    left, right, fraction = left[is_free], right[is_free], fraction[is_free]
    filled: dict[str, Any] = {}
    for name in MAP_NAMES:
        if name != "alpha":
            image = getattr(maps, name).copy()
            values = _mixed_texels(name, image.reshape(-1, *image.shape[2:]), left, right, fraction)
            values[left < 0] = _EMPTY[name]
            image[is_free] = values
            filled[name] = image
    return replace(maps, **filled)


def _mixed_texels(name: str, texels: Floats, left: Ints, right: Ints, fraction: Floats) -> Floats:
    """Values between two texels, (n, ...)."""
    if name == "strand_id":  # a mean of two IDs would be a third strand's
        return texels[np.where(fraction < 0.5, left, right)]
    mixed = texels[left]
    mixed += (texels[right] - mixed) * fraction.reshape(-1, *[1] * (texels.ndim - 1))
    if name in ("normal", "tangent"):
        vector = mixed - 0.5
        length = np.sqrt(np.einsum("ni,ni->n", vector, vector))
        mixed = 0.5 + vector * (0.5 / np.maximum(length, 1e-6))[:, None]
    return mixed


def tile_edges(size: int, count: int) -> Ints:
    """Where tiles begin, and the end of the last, (count + 1,) [pixels]: a texel belongs to the
    tile that holds its middle."""
    return np.ceil(np.arange(count + 1) * (size / count) - 0.5).astype(np.int64)


def neighbouring_hair(is_hair: Bools, grid: AtlasGrid) -> tuple[Ints, Ints, Floats]:
    """The two texels of hair that each texel lies between, as row * width + column, and the weight
    of the second.

    Both are the texel itself where it has hair, and -1 in tiles without hair.
    """
    height, width = is_hair.shape
    beside = np.full((2, height, width), -1, np.int32)
    fraction = np.zeros((height, width), np.float32)
    for low, high in pairwise(tile_edges(height, grid.rows)):
        for first, last in pairwise(tile_edges(width, grid.columns)):
            tile = is_hair[low:high, first:last]
            with_hair = np.flatnonzero(tile.any(axis=1))
            if len(with_hair):
                columns, fractions = _neighbours_in_rows(tile[with_hair])
                texels = (low + with_hair)[:, None] * width + first + columns
                nearest = _nearest_index(with_hair, high - low)
                beside[:, low:high, first:last] = texels[:, nearest]
                fraction[low:high, first:last] = fractions[nearest]
    return beside[0], beside[1], fraction


def _neighbours_in_rows(is_hair: Bools) -> tuple[Ints, Floats]:
    """The columns of the hair on both sides, (2, rows, columns), and the weight of the second."""
    count = is_hair.shape[1]
    column = np.arange(count)
    left = np.maximum.accumulate(np.where(is_hair, column, -1), axis=1)
    right = np.where(is_hair, column, count)[:, ::-1]
    right = np.minimum.accumulate(right, axis=1)[:, ::-1]
    left, right = np.where(left < 0, right, left), np.where(right == count, left, right)
    fraction = (column - left) / np.maximum(right - left, 1)
    return np.stack([left, right]), np.clip(fraction, 0.0, 1.0).astype(np.float32)


def _nearest_index(places: Ints, count: int) -> Ints:
    """Which of the ascending places is nearest to each of 0 .. count - 1, (count,)."""
    middles = (places[:-1] + places[1:]) / 2.0
    return np.searchsorted(middles, np.arange(count))
