"""The layers of opacity maps as tiles of one picture, for inspection."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from ..shading.lights import LIGHT_CAPACITY
from . import gpu_objects
from .feature_programs import UniformBlocks, bound
from .opacity_maps import OpacityMaps
from .shader_program import ShaderRecipe
from .shader_source import TILE_GAP
from .textures import texture_to_array

#: pixels along a side of a tile, at most
_TILE = 256
_RECIPE = ShaderRecipe(
    name="opacity_tiles",
    compute="opacity_tiles.comp.glsl",
    structs=("struct_opacity.glsl",),
    images=(("RGBA32F", "tiles"),),
    integers=("map_index", "tile_count", "tile_columns", "texels_across"),
)


def opacity_tiles(maps: OpacityMaps, layer_count: int) -> Floats:
    """The transmittance behind each layer, (height, width, 4) scene-linear.

    Row 0 is at the bottom. The layers of a map are in rows from the top left on, 16 layers as
    4 x 4. For deep layers the first tile is the depth at which they start, bright near the light.
    The maps of several lights are below one another, in the order of the lights.

    Args:
        layer_count: number of layers of a map, see shading.volume.opacity.layer_ends.

    Raises:
        HairloomError: no light has a map.
    """
    numbers = maps.values[: 5 * 4 * LIGHT_CAPACITY].reshape(5, LIGHT_CAPACITY, 4)[4, :, 0]
    map_count = int((numbers >= 0.0).sum())
    if not map_count:
        raise HairloomError(
            "no light casts a shadow of the hair here",
            place="Show Opacity Map",
            remedy="Add a light outside of the hair, and raise Max Lights in Shadows if it is 0",
        )
    return np.concatenate([_tiles(maps, each, layer_count) for each in reversed(range(map_count))])


def _tiles(maps: OpacityMaps, number: int, layer_count: int) -> Floats:
    count = layer_count + int(maps.starts is not None)
    columns = int(np.ceil(np.sqrt(count)))
    across = -(-maps.slots[0].width // _TILE)
    pitch = maps.slots[0].width // across + TILE_GAP
    width, height = columns * pitch, -(-count // columns) * pitch
    tiles = gpu_objects.texture((width, height), format="RGBA32F")
    blocks = UniformBlocks()
    shader = bound(
        _RECIPE,
        [maps.feature],
        blocks,
        images={"tiles": tiles},
        integers={
            "map_index": number,
            "tile_count": count,
            "tile_columns": columns,
            "texels_across": across,
        },
    )
    shader.dispatch(width, height)
    return texture_to_array(tiles)
