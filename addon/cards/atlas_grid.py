"""`AtlasGrid`: a texture divided into equal tiles, each of which holds one strip of hair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints


@dataclass(frozen=True)
class AtlasGrid:
    """Tiles are counted along rows from the lower left one.

    padding: fraction of a tile's width, and of its height, that is left free on each of its sides.
    """

    columns: int = 1
    rows: int = 1
    padding: tuple[float, float] = (0.0, 0.0)

    @property
    def tile_count(self) -> int:
        return self.columns * self.rows

    def uv(self, tile: Ints, across: Floats, along: Floats) -> Floats:
        """Places in the texture, (..., 2): `across` and `along` from 0 to 1 within a tile.

        All three are broadcast against each other.
        """
        row, column = np.divmod(tile, self.columns)
        (free_across, free_along) = self.padding
        u = (column + free_across + across * (1.0 - 2.0 * free_across)) / self.columns
        v = (row + free_along + along * (1.0 - 2.0 * free_along)) / self.rows
        places: Floats = np.stack(np.broadcast_arrays(u, v), axis=-1).astype(np.float32)
        return places

    def tile_at(self, uv: Floats) -> Ints:
        """The tile that places (n, 2) in the texture lie in; beside it the nearest, (n,) int32."""
        column = np.clip(np.floor(uv[:, 0] * self.columns), 0, self.columns - 1)
        row = np.clip(np.floor(uv[:, 1] * self.rows), 0, self.rows - 1)
        tiles: Ints = (row * self.columns + column).astype(np.int32)
        return tiles
