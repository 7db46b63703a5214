"""Marschner's look-up tables on the GPU, for the last few fibre shapes.

The tables do not depend on the hair's colour, and grooms with the same fibre share their textures.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any

from ..arrays import Floats
from ..shading.drawn_strands import mean_look
from ..shading.marschner.look import fibre_of, pack_fibre
from ..shading.marschner.tables import MarschnerTables, marschner_tables, shape_of
from ..shading.settings import ShadingSettings
from ..shading.volume.dual import Fractions, fractions, mean_forward
from .opacity_maps import OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import released_with_shaders
from .snapshot import Snapshot
from .textures import texture_from, volume_from

#: shapes kept; one at the default size is 14 MB
CAPACITY = 4
#: samplers of look_up() in lib_marschner.glsl
MARSCHNER_TEXTURES = (
    ("FLOAT_3D", "longitudinal"),
    ("FLOAT_2D", "azimuthal"),
    ("FLOAT_2D", "paths"),
)
#: samplers of fractions_at() in lib_dual.glsl
FRACTIONS_TEXTURES = (("FLOAT_2D", "fractions_forward"), ("FLOAT_2D", "fractions_backward"))


@dataclass(frozen=True)
class _Tables:
    fractions: Fractions
    textures: dict[str, Any]


class MarschnerTextures:
    """Textures for fibre shapes, made on first use; keeps the last CAPACITY shapes."""

    def __init__(self) -> None:
        self._cache: OrderedDict[Any, _Tables] = OrderedDict()
        released_with_shaders(self)

    def textures(self, shading: ShadingSettings, size: int) -> dict[str, Any]:
        """Textures by the names of MARSCHNER_TEXTURES, `size` texels across."""
        kept = self._tables(shading, size).textures
        return {name: kept[name] for _, name in MARSCHNER_TEXTURES}

    def fractions(self, shading: ShadingSettings, size: int) -> dict[str, Any]:
        """Textures by the names of FRACTIONS_TEXTURES, made of tables `size` texels across."""
        kept = self._tables(shading, size).textures
        return {name: kept[name] for _, name in FRACTIONS_TEXTURES}

    def forward(self, shading: ShadingSettings, size: int) -> Floats:
        """The fraction of light that a strand scatters forward, by colour, (3,)."""
        return mean_forward(self._tables(shading, size).fractions.forward, shading)

    def _tables(self, shading: ShadingSettings, size: int) -> _Tables:
        shape = shape_of(fibre_of(shading))
        key = (shape, size)
        if key not in self._cache:
            tables = marschner_tables(shape, size)
            sides = fractions(tables)
            self._cache[key] = _Tables(sides, _textures(tables, sides))
            while len(self._cache) > CAPACITY:
                self._cache.popitem(last=False)
        self._cache.move_to_end(key)
        return self._cache[key]

    def release(self) -> None:
        """Release all textures; the next call makes them again."""
        self._cache.clear()


#: shared by all passes
MARSCHNER = MarschnerTextures()


def marschner_feature(snapshot: Snapshot) -> ShaderFeature:
    """The feature of programs that shade by Marschner's model."""
    shading = snapshot.shading
    textures = MARSCHNER.textures(shading, snapshot.table_size)
    return ShaderFeature(
        name="marschner",
        blocks={"fibre": ("Fibre", pack_fibre(shading))},
        textures={name: (kind, textures[name]) for kind, name in MARSCHNER_TEXTURES},
        defines={"MARSCHNER": 1},
    )


def scattering_feature(snapshot: Snapshot) -> ShaderFeature:
    """The feature of programs that add light scattered between strands, in Marschner's model."""
    textures = MARSCHNER.fractions(snapshot.shading, snapshot.table_size)
    return ShaderFeature(
        name="scattering",
        textures={name: (kind, textures[name]) for kind, name in FRACTIONS_TEXTURES},
        numbers={
            "scatter_density": ("FLOAT", snapshot.volume.density),
            "skin_color": ("VEC3", snapshot.skin_color),
        },
        defines={"SCATTERING": 1},
    )


def under_hair_feature(snapshot: Snapshot, maps: OpacityMaps) -> ShaderFeature:
    """The feature of programs that shade surfaces under hair, with its maps."""
    feature = maps.feature
    return replace(feature, numbers={"hair_forward": ("VEC3", hair_forward(snapshot))})


def hair_forward(snapshot: Snapshot) -> tuple[float, float, float]:
    """The fraction of light that hair scatters forward to surfaces under it, by colour; 0 without
    light from strand to strand.
    """
    shading = mean_look(snapshot.color, snapshot.shading)
    if shading.model != "marschner" or not snapshot.volume.scattering:
        return 0.0, 0.0, 0.0
    red, green, blue = MARSCHNER.forward(shading, snapshot.table_size).tolist()
    return red, green, blue


def _textures(tables: MarschnerTables, sides: Fractions) -> dict[str, Any]:
    return {
        "fractions_forward": texture_from(sides.forward, "RGBA32F"),
        "fractions_backward": texture_from(sides.backward, "RGBA32F"),
        "longitudinal": volume_from(tables.longitudinal),
        "azimuthal": texture_from(tables.azimuthal, "RGBA32F"),
        "paths": texture_from(tables.paths, "RGBA32F"),
    }
