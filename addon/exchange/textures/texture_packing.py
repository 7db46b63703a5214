"""How the maps of hair cards are put into the channels of an engine's textures.

A preset is data: which files there are, and what each of their channels holds. It includes what
differs between engines: whether green runs up or down in directions, whether colours are sRGB, and
which map roughness is in. It never flips maps: in all files the root of the hair is at the bottom,
the tip at the top, and the top row comes first.

Directions are in the frame of the card, 0.5 d + 0.5: x across it, along u; y up, from root to tip;
z away from the head. Unreal's tangent space has y down the picture, so green is inverted there, in
the tangent as in a normal map. Anisotropy in glTF and Godot is the direction in which
highlights are stretched, which on hair is across the strands: a quarter turn from the tangent.

Sources: Unreal's names and channels are those of its card layouts "Card Default" and "Card Compact"
(Groom asset, Cards, Textures); Unity HDRP 17, Hair Material Inspector and Hair Master Stack
references; Godot 4, BaseMaterial3D; glTF 2.0 with KHR_materials_anisotropy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError

#: The meaning of each map, in a few words; and the value that replaces a missing one.
MAP_MEANINGS = {
    "alpha": ("coverage", 1.0),
    "color": ("colour for a plain material", 1.0),
    "base": ("colour as a factor of the hair's", 1.0),
    "normal": ("normal", 0.5),
    "tangent": ("direction of the strand from root to tip", 0.5),
    "depth": ("depth, larger further from the head, 0.5 in the card's plane", 0.5),
    "along": ("root 0 to tip 1", 0.0),
    "strand_id": ("random number of the strand", 0.0),
    "occlusion": ("ambient occlusion, 1 open", 1.0),
    "shift": ("shift of the highlights, 0.5 none", 0.5),
    "noise": ("breaks up the second highlight", 1.0),
    "roughness": ("roughness", 0.4),
}
_AXES = {
    "color": "red green blue",
    "base": "red green blue",
    "normal": "x y z",
    "tangent": "x y z",
}
_COLORS = ("color", "base")


@dataclass(frozen=True)
class Channel:
    """What one channel of a texture holds.

    source: the name of a map, or "" for a constant.
    component: which of a map's three.
    is_inverted: 1 minus the value, which reverses the component of a direction.
    constant: what a channel without a source holds.
    """

    source: str = ""
    component: int = 0
    is_inverted: bool = False
    constant: float = 0.0

    @property
    def role(self) -> str:
        """What it holds, for whoever writes the engine's material."""
        if not self.source:
            return f"always {self.constant:g}"
        about, _ = MAP_MEANINGS[self.source]
        if self.source not in _AXES:
            return f"{self.source}: {'1 - ' if self.is_inverted else ''}{about}"
        axis = _AXES[self.source].split()[self.component]
        if self.source in _COLORS:
            return f"{self.source}: {axis}"
        value = f"0.5 - 0.5 {axis}" if self.is_inverted else f"0.5 + 0.5 {axis}"
        return f"{self.source}: {value} of the {about}"

    def values(self, maps: Mapping[str, Floats]) -> Floats | float:
        """The channel's values, (height, width) or one for all."""
        if not self.source:
            return self.constant
        if self.source not in maps:
            value: Floats | float = self._missing
        else:
            values = maps[self.source]
            value = values[..., self.component] if values.ndim == 3 else values
        return 1.0 - value if self.is_inverted else value

    @property
    def _missing(self) -> float:
        """The value of a missing map; for directions those of the card's normal, or straight up."""
        up = {"normal": 2, "tangent": 1}.get(self.source)
        return 1.0 if up == self.component else MAP_MEANINGS[self.source][1]


@dataclass(frozen=True)
class TextureLayout:
    """One file of a preset.

    suffix: follows the asset's name.
    channels: one to four of them.
    is_color: red, green and blue are a colour: sRGB in files of integers.
    depth: "uint8", or "uint16" where 8 bits would show as steps.
    is_normal_map: blue follows from red and green, so that two channels are enough.
    """

    suffix: str
    channels: tuple[Channel, ...]
    is_color: bool = False
    depth: str = "uint8"
    is_normal_map: bool = False

    @property
    def sources(self) -> frozenset[str]:
        return frozenset(channel.source for channel in self.channels if channel.source)

    @property
    def has_coverage(self) -> bool:
        """Whether the fourth channel is the coverage of hair."""
        return len(self.channels) == 4 and self.channels[3].source == "alpha"

    @property
    def color_space(self) -> str:
        return "sRGB" if self.is_color else "linear"

    @property
    def roles(self) -> dict[str, str]:
        """Channel -> what it holds, in the words of the JSON sidecar."""
        return {letter: each.role for letter, each in zip("rgba", self.channels, strict=False)}

    def pack(self, maps: Mapping[str, Floats]) -> Floats:
        """(height, width, channels) float32 in [0, 1], colours linear."""
        shape = next(iter(maps.values())).shape[:2]
        pixels: Floats = np.empty((*shape, len(self.channels)), np.float32)
        for index, channel in enumerate(self.channels):
            pixels[..., index] = channel.values(maps)
        return pixels


@dataclass(frozen=True, eq=False)
class PackedTexture:
    """A texture as it goes into a file.

    pixels: (height, width, 1 to 4) float32 in [0, 1], row 0 the lowest; colours are linear here.
    """

    layout: TextureLayout
    pixels: Floats

    @property
    def suffix(self) -> str:
        return self.layout.suffix

    @property
    def color_space(self) -> str:
        return self.layout.color_space

    @property
    def depth(self) -> str:
        return self.layout.depth

    @property
    def roles(self) -> dict[str, str]:
        return self.layout.roles


def _scalar(name: str) -> tuple[Channel]:
    return (Channel(name),)


def _vector(name: str, *inverted: int) -> tuple[Channel, ...]:
    return tuple(Channel(name, axis, axis in inverted) for axis in range(3))


_GREEN = 1
_COLOR = _vector("color")
#: for shaders that colour hair themselves, beside what a plain material shows
_BASE = TextureLayout("_base", _vector("base"), is_color=True)
#: The direction across the strands, in the card's plane: (y, -x) of their tangent.
_ACROSS = (Channel("tangent", 1), Channel("tangent", 0, is_inverted=True))
_UINT16 = "uint16"
_STRANDS = (Channel("along"), Channel("strand_id"), Channel("depth"))

PRESETS: dict[str, tuple[TextureLayout, ...]] = {
    "hairloom": (
        TextureLayout("_color", _COLOR, is_color=True),
        TextureLayout("_alpha", _scalar("alpha")),
        _BASE,
        TextureLayout("_normal", _vector("normal"), is_normal_map=True),
        TextureLayout("_tangent", _vector("tangent"), depth=_UINT16),
        TextureLayout("_depth", _scalar("depth"), depth=_UINT16),
        TextureLayout("_along", _scalar("along"), depth=_UINT16),
        TextureLayout("_strand_id", _scalar("strand_id"), depth=_UINT16),
        TextureLayout("_occlusion", _scalar("occlusion")),
        TextureLayout("_shift", _scalar("shift"), depth=_UINT16),
        TextureLayout("_noise", _scalar("noise")),
    ),
    "gltf": (
        TextureLayout("_baseColor", (*_COLOR, Channel("alpha")), is_color=True),
        TextureLayout(
            "_occlusionRoughnessMetallic",
            (Channel("occlusion"), Channel("roughness"), Channel(constant=0.0)),
        ),
        TextureLayout("_normal", _vector("normal"), is_normal_map=True),
        TextureLayout("_anisotropy", (*_ACROSS, Channel(constant=1.0))),
        _BASE,
    ),
    "unreal": (
        TextureLayout("_Depth", _scalar("depth")),
        TextureLayout("_Coverage", _scalar("alpha")),
        TextureLayout("_Tangent", _vector("tangent", _GREEN)),
        TextureLayout(
            "_Attributes", (Channel(constant=0.0), Channel("along"), Channel("strand_id"))
        ),
        TextureLayout("_Material", (*_COLOR, Channel("roughness")), is_color=True),
        TextureLayout(
            "_Auxiliary",
            (Channel("occlusion"), Channel("shift"), Channel("noise"), Channel(constant=1.0)),
        ),
        _BASE,
    ),
    "unreal_compact": (
        TextureLayout("_TangentCoordU", (*_vector("tangent", _GREEN), Channel("along"))),
        TextureLayout(
            "_CoverageDepthSeed", (Channel("alpha"), Channel("depth"), Channel("strand_id"))
        ),
        TextureLayout("_ColorRoughness", (*_COLOR, Channel("roughness")), is_color=True),
        _BASE,
    ),
    "unity_hdrp": (
        TextureLayout("_BaseColorMap", (*_COLOR, Channel("alpha")), is_color=True),
        TextureLayout("_NormalMap", _vector("normal"), is_normal_map=True),
        TextureLayout("_AOMap", _scalar("occlusion")),
        TextureLayout("_SmoothnessMask", _scalar("noise")),
        TextureLayout("_HairStrandDirection", _vector("tangent")),
        TextureLayout("_RootIdDepth", _STRANDS),
        _BASE,
    ),
    "godot": (
        TextureLayout("_albedo", (*_COLOR, Channel("alpha")), is_color=True),
        TextureLayout("_normal", _vector("normal"), is_normal_map=True),
        TextureLayout("_flow", (*_ACROSS, Channel(constant=0.5), Channel(constant=1.0))),
        TextureLayout("_ao", _scalar("occlusion")),
        TextureLayout("_rootIdDepth", _STRANDS),
        _BASE,
    ),
}


def texture_layouts(preset: str, maps: Mapping[str, Floats]) -> list[TextureLayout]:
    """The files of a preset for these maps, (height, width, ...), without those of which all maps
    are missing.

    Raises:
        HairloomError: no such preset, no map at all, another map than those of MAP_MEANINGS, or
            maps of several sizes or with the wrong channels.
    """
    if preset not in PRESETS:
        raise HairloomError(
            f"there is no texture packing '{preset}'",
            place="Texture packing",
            remedy=f"Choose one of {', '.join(PRESETS)}",
        )
    _check(maps)
    return [layout for layout in PRESETS[preset] if layout.sources & maps.keys()]


def pack_textures(maps: Mapping[str, Floats], preset: str) -> list[PackedTexture]:
    """All textures of a preset.

    Args:
        maps: name -> (height, width), or (height, width, 3) for base, normal and tangent, in
            [0, 1], of one size. A missing one is replaced by a neutral value, see MAP_MEANINGS.

    Raises:
        HairloomError: as `layouts` does.
    """
    return [PackedTexture(layout, layout.pack(maps)) for layout in texture_layouts(preset, maps)]


def _check(maps: Mapping[str, Floats]) -> None:
    for name, values in maps.items():
        expected = next(iter(maps.values())).shape[:2] + ((3,) if name in _AXES else ())
        if name not in MAP_MEANINGS or values.shape != expected or 0 in expected:
            raise HairloomError(
                f"the map '{name}' of shape {values.shape} cannot be packed",
                place="Texture packing",
                remedy=f"Use maps of one size named {', '.join(MAP_MEANINGS)}; {', '.join(_AXES)} "
                "have three channels",
            )
    if not maps:
        raise HairloomError(
            "there are no maps to pack", place="Texture packing", remedy="Bake an atlas first"
        )
