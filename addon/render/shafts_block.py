"""The block of gpu_shaders/struct_shafts.glsl."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..shading.shafts import REACH, LightOnScreen, PolarGrid

#: structs and blocks of recipes that read it
STRUCTS, BLOCKS = ("struct_shafts.glsl",), (("Shafts", "shafts"),)


def pack_shafts(light: LightOnScreen, grid: PolarGrid) -> Floats:
    """The block of gpu_shaders/struct_shafts.glsl in std140, (16,) float32."""
    middle = np.cos(grid.middle), np.sin(grid.middle)
    floats: list[float] = [*light.radiance, light.depth, *grid.center, *middle, grid.span]
    floats += [grid.nearest, grid.step, np.exp(-grid.step / light.length)]
    floats += [-np.expm1(-grid.nearest / light.length), 1.0 / (REACH * light.length)]
    whole = np.array([grid.angles, grid.is_round], np.int32)
    return np.concatenate([np.array(floats, np.float32), whole.view(np.float32)])
