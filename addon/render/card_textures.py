"""Textures of hair cards on the GPU, with their mip maps packed: see shading/card_texture.py."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from ..arrays import Floats
from ..cards.atlas_grid import AtlasGrid
from ..exchange.textures.mip_maps import mip_levels
from ..shading.card_texture import LEVELS, packed_levels
from ..shading.textures import HairTextures
from .card_snapshot import CardSnapshot
from .shader_program import released_with_shaders
from .textures import texture_from

#: textures that repeat in u and v; the others are clamped
_REPEATED = ("shift", "noise")


class CardTextures:
    """The textures of the last cards. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._pictures: HairTextures | None = None
        self._grid = AtlasGrid()
        self._textures: dict[str, Any] = {}
        released_with_shaders(self)

    @property
    def tiles(self) -> tuple[float, float]:
        """Columns and rows of the atlas, as shaders take them."""
        return tiles_of(self._grid)

    def texture(self, name: str) -> Any:
        """The texture of that name, of HairTextures."""
        return self._textures[name]

    def upload(self, cards: CardSnapshot) -> None:
        """Upload the textures of these cards, unless they are there already."""
        pictures, grid = cards.textures, cards.mesh.atlas
        if self._pictures is not pictures or self._grid != grid:
            for _ in self.uploading(pictures, grid, packed_textures(pictures, grid)):
                pass

    def uploading(
        self, pictures: HairTextures, grid: AtlasGrid, packed: Iterable[tuple[str, Floats]]
    ) -> Generator[None]:
        """Upload one texture per step; packed: see `packed_textures`."""
        self.release()
        textures: dict[str, Any] = {}
        for name, texels in packed:
            texture = texture_from(texels, "R16F" if texels.shape[-1] == 1 else "RGBA16F")
            texture.extend_mode("EXTEND")
            textures[name] = texture
            yield
        self._pictures, self._grid, self._textures = pictures, grid, textures

    def release(self) -> None:
        """Release the textures; the next draw uploads them again."""
        self._pictures, self._textures = None, {}


def packed_textures(pictures: HairTextures, grid: AtlasGrid) -> Iterator[tuple[str, Floats]]:
    """Name and texels of each texture, see shading/card_texture.py. Thread-safe."""
    for name, levels in _levels(pictures, grid):
        yield name, packed_levels(levels, is_repeated=name in _REPEATED)


def tiles_of(grid: AtlasGrid) -> tuple[float, float]:
    """Columns and rows of an atlas, as shaders take them."""
    return float(grid.columns), float(grid.rows)


def _levels(pictures: HairTextures, grid: AtlasGrid) -> Iterator[tuple[str, list[Floats]]]:
    """The mip levels of each texture, weighted by alpha.

    Adapts to mip_levels: its maps are in [0, 1], while the base of an atlas may be brighter; and
    textures that repeat have no tiles.
    """
    for name, picture in vars(pictures).items():
        if not isinstance(picture, np.ndarray):
            continue
        most = max(float(picture.max(initial=0.0)), 1.0)
        kind = name if name in ("normal", "tangent") else "alpha" if name == "alpha" else "base"
        maps: dict[str, Floats] = {kind: picture / np.float32(most)}
        if name not in ("alpha", *_REPEATED) and pictures.alpha.shape == picture.shape[:2]:
            maps["alpha"] = pictures.alpha
        tiles = None if name in _REPEATED else grid
        levels = islice(mip_levels(maps, grid=tiles, threshold=None), LEVELS)
        yield name, [_texels(level[kind], most) for level in levels]


def _texels(picture: Floats, most: float) -> Floats:
    """A level in the layout of its texture, (height, width, 1 or 4)."""
    if picture.ndim == 2:
        return picture[..., None] * np.float32(most)
    opaque = np.ones((*picture.shape[:2], 1), np.float32)
    return np.concatenate([picture * np.float32(most), opaque], axis=-1)
