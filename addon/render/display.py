"""Blender's view transform as a look-up table for our shaders.

The table is a cube with a shaper: log2(radiance / DARKEST + 1), scaled so that radiance 1, where
the transform "Standard" has its kink, lies on a texel; the last texel is 24 times white. Exposure
is a factor before the table and gamma a power after it, so neither needs another table.

Errors against Blender's own pictures of 6,000 colours of lit hair, in 1/255: AgX 0.08 on average
and 1.7 at most, Standard 0.1. For arbitrary colours, where AgX clips channels, 3.4 at most, and 6
with its strongest looks. With 48 texels errors were half as large again. False Color, which has
steps, is blurred by a texel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from .shader_feature import ShaderFeature
from .shader_program import released_with_shaders
from .textures import volume_from

SIZE = 64
#: the texel of radiance 1
_KNEE = 40
#: texels are spaced linearly in radiance below this, and in stops above it
DARKEST = 2.0**-8
_STOPS = float(np.log2(1.0 / DARKEST + 1.0)) * (SIZE - 1) / _KNEE


def shaped(radiance: Floats) -> Floats:
    """Places of radiances along an axis of the table, in [0, 1].

    Twin of `display_shaped` in gpu_shaders/lib_output.glsl.
    """
    return np.clip(np.log2(np.maximum(radiance, 0.0) / DARKEST + 1.0) / _STOPS, 0.0, 1.0)


def table_radiances() -> Floats:
    """The radiances at the texels, (SIZE, SIZE, SIZE, 3); axes: blue, green, red."""
    axis = DARKEST * (np.exp2(np.linspace(0.0, _STOPS, SIZE)) - 1.0)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([red, green, blue], axis=-1).astype(np.float32)


class DisplayTable:
    """The code values of `table_radiances`, (SIZE, SIZE, SIZE, 3) in [0, 1], with their texture."""

    def __init__(self, codes: Floats) -> None:
        if codes.shape != (SIZE, SIZE, SIZE, 3):
            raise ValueError(f"a display table has shape {codes.shape}")
        self.codes = codes
        self._texture: Any = None
        released_with_shaders(self)

    @property
    def texture(self) -> Any:
        """RGBA32F, made by the first draw that needs it."""
        if self._texture is None:
            opaque = np.ones((*self.codes.shape[:3], 1), np.float32)
            self._texture = volume_from(np.concatenate([self.codes, opaque], axis=-1))
        return self._texture

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self._texture = None


@dataclass(frozen=True, eq=False)
class Display:
    """The view transform of a view.

    gain: factor on the radiance, 2 to the power of the exposure.
    gamma: code values are raised to 1 / gamma.
    """

    table: DisplayTable
    gain: float = 1.0
    gamma: float = 1.0

    @property
    def shaper(self) -> tuple[float, float, float, float]:
        """`display_shaper` of the shader: gain / DARKEST, 1 / stops, texels, 1 / gamma."""
        return self.gain / DARKEST, 1.0 / _STOPS, float(SIZE), 1.0 / self.gamma

    @property
    def feature(self) -> ShaderFeature:
        """The feature of programs that apply the view transform."""
        return ShaderFeature(
            name="display",
            textures={"display_table": ("FLOAT_3D", self.table.texture)},
            numbers={"display_shaper": ("VEC4", self.shaper)},
            defines={"DISPLAY": 1},
        )

    def display_code(self, radiance: Floats) -> Floats:
        """Code values of radiances (..., 3), in [0, 1].

        Twin of `display_code` in gpu_shaders/lib_output.glsl, except that a GPU may round filter
        weights to eight bits.
        """
        place = shaped(self.gain * np.asarray(radiance, np.float64)) * (SIZE - 1)
        before = np.minimum(place.astype(int), SIZE - 2)
        fraction = place - before
        red, green, blue = np.moveaxis(before, -1, 0)
        found = np.zeros(place.shape)
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(np.array(corner) == 1, fraction, 1.0 - fraction), axis=-1)
            codes = self.table.codes[blue + corner[2], green + corner[1], red + corner[0]]
            found += weight[..., None] * codes
        return found ** (1.0 / self.gamma)
