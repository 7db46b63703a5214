"""Shafts of light from bright parts of the picture; the reference is shading/bright_shafts.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..shading.bright_shafts import (
    BRIGHTEST,
    KNEE,
    LARGEST,
    BrightRegion,
    BrightRegions,
    bright_regions,
    cell_side,
    node_spacing,
    wants_bright,
)
from ..shading.shafts import LightOnScreen, PolarGrid, has_length, shaft_length
from ..shading.shafts_settings import ShaftSettings
from . import gpu_objects
from .camera import Camera
from .shader_program import ShaderRecipe, program
from .shafts_block import BLOCKS, STRUCTS, pack_shafts
from .textures import texture_from, texture_to_array

_PART = ShaderRecipe(
    name="bright_part",
    compute="bright_part.comp.glsl",
    textures=(("FLOAT_2D", "picture_color"), ("FLOAT_2D", "background")),
    images=(("RGBA32F", "bright"),),
    numbers=tuple(("FLOAT", name) for name in ("threshold", "knee", "brightest", "largest")),
)
_CELLS = ShaderRecipe(
    name="bright_cells",
    compute="bright_cells.comp.glsl",
    textures=(("FLOAT_2D", "bright"),),
    images=(("RGBA32F", "cells"),),
    integers=("cell_side",),
)
_BLUR = ShaderRecipe(
    name="bright_blur",
    compute="bright_blur.comp.glsl",
    structs=STRUCTS,
    blocks=BLOCKS,
    textures=(("FLOAT_2D", "bright"), ("FLOAT_2D", "weights")),
    images=(("RGBA32F", "rays"),),
    numbers=(("FLOAT", "node_spacing"),),
    group_size=(64,),
)
_ADD = ShaderRecipe(
    name="bright_add",
    compute="bright_add.comp.glsl",
    structs=STRUCTS,
    blocks=BLOCKS,
    textures=(("FLOAT_2D", "rays"),),
    images=(("RGBA32F", "picture", "READ_WRITE"),),
)


class BrightShafts:
    """The bright parts of a picture at construction, to be added as shafts later.

    Args:
        picture_color: RGBA32F texture, scene-linear and premultiplied.
        background: its background, an RGBA32F texture of its size or of one texel.
    """

    def __init__(
        self, picture_color: Any, background: Any, camera: Camera, settings: ShaftSettings
    ) -> None:
        self._settings = settings
        self._size = picture_color.width, picture_color.height
        self._length = shaft_length(camera.projection, picture_color.height, settings.length)
        self._bright: Any = None
        self.regions = BrightRegions((), 0.0)
        if wants_bright(settings) and has_length(self._length):
            self._find_bright_parts(picture_color, background)

    def add_to(self, picture: Any) -> None:
        """Add the shafts to an RGBA32F texture of the same size; without any it stays
        bit-identical.
        """
        for region in self.regions.regions:
            self._add_region(picture, region)

    def _find_bright_parts(self, picture_color: Any, background: Any) -> None:
        width, height = self._size
        threshold = self._settings.bright_threshold
        self._bright = gpu_objects.texture(self._size, format="RGBA32F")
        part = program(_PART)
        part.bind(
            textures={"picture_color": picture_color, "background": background},
            images={"bright": self._bright},
            numbers={
                "threshold": threshold,
                "knee": KNEE * threshold,
                "brightest": BRIGHTEST,
                "largest": LARGEST,
            },
        )
        part.dispatch(width, height)
        side = cell_side(width, height)
        cells = gpu_objects.texture((-(-width // side), -(-height // side)), format="RGBA32F")
        counting = program(_CELLS)
        counting.bind(
            textures={"bright": self._bright},
            images={"cells": cells},
            integers={"cell_side": side},
        )
        counting.dispatch(cells.width, cells.height)
        self.regions = bright_regions(texture_to_array(cells), width, height)

    def _add_region(self, picture: Any, region: BrightRegion) -> None:
        width, height = self._size
        grid = PolarGrid.over(region.center, width, height, self._settings.samples)
        factor = self._settings.bright_strength * self.regions.scale
        red, green, blue = (float(factor * each) for each in self._settings.tint)
        light = LightOnScreen(region.center, (red, green, blue), 1.0, self._length)
        block = gpu_objects.uniform_buffer(pack_shafts(light, grid))
        weights = texture_from(region.weights[..., None], "R32F")
        rays = gpu_objects.texture((grid.radii, grid.angles), format="RGBA32F")
        blur, add = program(_BLUR), program(_ADD)
        blur.bind(
            blocks={"shafts": block},
            textures={"bright": self._bright, "weights": weights},
            images={"rays": rays},
            numbers={"node_spacing": node_spacing(width, height)},
        )
        blur.dispatch(grid.angles)
        add.bind(blocks={"shafts": block}, textures={"rays": rays}, images={"picture": picture})
        add.dispatch(width, height)


def one_texel(color: tuple[float, float, float, float]) -> Any:
    """A texture of one texel: a premultiplied background colour."""
    return texture_from(np.array([[color]], np.float32), "RGBA32F")
