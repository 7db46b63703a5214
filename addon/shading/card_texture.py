"""Card textures with their mip maps in one texture, since Blender's GPU textures have one level.

    +---+---+        level 0 on the left, as large as the picture
    |   | 1 |        the others in slots above each other on the right, each half as high as the
    | 0 +---+        one before it
    |   | 2 |
    +---+---+        each with a border of one texel, so that linear filtering never meets a
                     neighbour: the border repeats the picture, or extends its edge

A pixel's level follows from the step in the texture to the next pixel (Williams 1983, "Pyramidal
parametrics"); the two nearest levels are blended. Alpha is averaged unweighted, because it is
blended; the other channels are weighted by coverage, see exchange/textures/mip_maps.py. Twin of
gpu_shaders/lib_card_texture.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints

#: Number of levels: a texture may be drawn 32 times smaller than it is.
LEVELS = 6
#: Height of all slots together beyond what their levels need [texels].
SLACK = 3 << (LEVELS - 1)
_BORDER = 1


def packed_levels(levels: Sequence[Floats], *, is_repeated: bool) -> Floats:
    """One texture of all levels, (height + SLACK, 3 / 2 width + 4, channels) float32.

    Args:
        levels: at most LEVELS of (height, width, channels), each half the one before, rounded down,
            and at least 1; the last one is repeated where there are fewer.
        is_repeated: whether borders wrap around; else they repeat the edge.
    """
    height, width, channels = levels[0].shape
    across = width + max(width // 2, 1) + 4 * _BORDER
    whole = np.zeros((height + SLACK, across, channels), np.float32)
    for level in range(LEVELS):
        image = levels[min(level, len(levels) - 1)]
        left, low = level_corner((width, height), level)
        rows = slice(low - _BORDER, low + image.shape[0] + _BORDER)
        columns = slice(left - _BORDER, left + image.shape[1] + _BORDER)
        wide = ((_BORDER, _BORDER), (_BORDER, _BORDER), (0, 0))
        whole[rows, columns] = np.pad(image, wide, mode="wrap" if is_repeated else "edge")
    return whole


def picture_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of level 0, from those of a packed texture."""
    return (2 * (width - 4 * _BORDER) + 1) // 3, height - SLACK


def level_corner(size: tuple[int, int], level: int) -> tuple[int, int]:
    """The lower left texel of a level, column and row. size: (width, height) of level 0."""
    if level == 0:
        return _BORDER, _BORDER
    slots = size[1] + SLACK
    return size[0] + 3 * _BORDER, slots - (slots >> (level - 1)) + _BORDER


def wanted_level(to_right: Floats, to_top: Floats, size: tuple[int, int]) -> Floats:
    """The level at which a pixel is no larger than a texel, (...); may lie between two levels.

    Args:
        to_right, to_top: (..., 2) step in the texture to the pixel on the right, and to the one
            above.
    """
    longest = np.maximum(
        *(((step * np.array(size)) ** 2).sum(axis=-1) for step in (to_right, to_top))
    )
    level: Floats = np.clip(0.5 * np.log2(np.maximum(longest, 1.0)), 0.0, LEVELS - 1.0)
    return level


def within_tile(place: Floats, texels: Ints, tiles: tuple[int, int]) -> Floats:
    """A place (..., 2) moved far enough into its tile that filtering mixes in no other tile.

    Args:
        texels: (2,) width and height of the level. tiles: columns and rows.
    """
    count = np.asarray(tiles, np.float64)
    tile = np.clip(np.floor(place * count), 0.0, count - 1.0)
    margin = np.minimum(0.5 / np.asarray(texels), 0.5 / count)
    moved: Floats = np.clip(place, tile / count + margin, (tile + 1.0) / count - margin)
    return moved


def card_texel(
    packed: Floats, place: Floats, level: Floats, tiles: tuple[int, int] | None = None
) -> Floats:
    """Values of a packed texture (rows, columns, channels) at places (n, 2), (n, channels).

    Args:
        level: (n,) see `wanted_level`. tiles: columns and rows; None: the picture repeats.
    """
    lower = np.floor(level).astype(int)
    part = (level - lower)[:, None]
    upper = np.minimum(lower + 1, LEVELS - 1)
    near, far = (_in_level(packed, place, each, tiles) for each in (lower, upper))
    mixed: Floats = near + (far - near) * part
    return mixed


def _in_level(packed: Floats, place: Floats, level: Ints, tiles: tuple[int, int] | None) -> Floats:
    """The same from one level for each place, filtered linearly."""
    size = picture_size(packed.shape[1], packed.shape[0])
    at = np.empty((len(place), 2))
    for each in range(LEVELS):
        texels = np.maximum(np.array(size) >> each, 1)
        own = level == each
        moved = place[own] % 1.0 if tiles is None else within_tile(place[own], texels, tiles)
        at[own] = level_corner(size, each) + moved * texels - 0.5
    column, row = np.floor(at).astype(int).T
    right, up = (at - np.floor(at)).T[..., None]
    low = packed[row, column] * (1.0 - right) + packed[row, column + 1] * right
    high = packed[row + 1, column] * (1.0 - right) + packed[row + 1, column + 1] * right
    mixed: Floats = low * (1.0 - up) + high * up
    return mixed
