"""Marschner's look-up tables on the GPU, those of the last few shapes of fibre.

Hair's colour is in no table, so sliders of colour change nothing here; grooms of one kind of hair
share their textures.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

from ..shading.marschner.look import fibre_of
from ..shading.marschner.tables import MarschnerTables, marschner_tables, shape_of
from ..shading.settings import ShadingSettings
from ..shading.volume.dual import shares
from .shader_program import released_with_shaders
from .textures import texture_from, volume_from

#: shapes kept; one at the default size is 14 MB
CAPACITY = 4
#: samplers of look_up() in lib_marschner.glsl
MARSCHNER_TEXTURES = (
    ("FLOAT_3D", "longitudinal"),
    ("FLOAT_2D", "azimuthal"),
    ("FLOAT_2D", "paths"),
)
#: samplers of shares_at() in lib_dual.glsl
SHARES_TEXTURES = (("FLOAT_2D", "shares_forward"), ("FLOAT_2D", "shares_backward"))


class MarschnerTextures:
    """Makes textures for a shape of fibre when it is first asked, and keeps the last CAPACITY."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Any, dict[str, Any]] = OrderedDict()
        released_with_shaders(self)

    def of(self, shading: ShadingSettings, size: int) -> dict[str, Any]:
        """Textures by the names of MARSCHNER_TEXTURES, `size` texels across."""
        return self._named(MARSCHNER_TEXTURES, shading, size)

    def shares(self, shading: ShadingSettings, size: int) -> dict[str, Any]:
        """Textures by the names of SHARES_TEXTURES, made of tables `size` texels across."""
        return self._named(SHARES_TEXTURES, shading, size)

    def _named(
        self, names: tuple[tuple[str, str], ...], shading: ShadingSettings, size: int
    ) -> dict[str, Any]:
        shape = shape_of(fibre_of(shading))
        key = (shape, size)
        if key not in self._kept:
            self._kept[key] = _textures(marschner_tables(shape, size))
            while len(self._kept) > CAPACITY:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return {name: self._kept[key][name] for _, name in names}

    def release(self) -> None:
        """Let go of all textures; the next call makes them again."""
        self._kept.clear()


#: what all passes share
MARSCHNER = MarschnerTextures()


def _textures(tables: MarschnerTables) -> dict[str, Any]:
    parts = shares(tables)
    return {
        "shares_forward": texture_from(parts.forward, "RGBA32F"),
        "shares_backward": texture_from(parts.backward, "RGBA32F"),
        "longitudinal": volume_from(tables.longitudinal),
        "azimuthal": texture_from(tables.azimuthal, "RGBA32F"),
        "paths": texture_from(tables.paths, "RGBA32F"),
    }
