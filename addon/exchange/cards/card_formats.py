"""The files that cards are written to: their suffixes, axes, units and names of attributes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...arrays import Floats
from ...errors import HairloomError
from ..files.axes import from_z_up
from ..files.file_names import with_added_suffix

_OCCLUSION = "ambient occlusion of the vertex, from 0 enclosed to 1 open"
_OPENNESS = (
    f"first component: {_OCCLUSION}; multiply the shaded colour by it. Second component: position "
    "of the vertex along the strands, from 0 at the root to 1 at the tip"
)
_REST = "rest pose"
_NORMAL = "of the card, away from the head, rounded across the card"
_TANGENT = "xyz across the strands, along u; strands run from root to tip along "
_TILE_TOP = "texture coordinates, v from the top: v decreases from root to tip of a tile"
_TILE = "texture coordinates, v from the bottom: v increases from root to tip of a tile"


@dataclass(frozen=True)
class CardFormat:
    """One of the formats.

    name: on the command line.
    entry, about: in the list of formats of the dialog.
    suffixes: of such files, the usual one first.
    up: "Y" or "Z"; axes are right-handed.
    unit: of lengths in the file. units_per_metre: how many of them are a metre.
    attributes: the file's name of each attribute of a vertex -> its meaning.
    extra: attributes that are added where custom ones are requested.
    """

    name: str
    title: str
    entry: str
    about: str
    suffixes: tuple[str, ...]
    up: str
    unit: str
    units_per_metre: float
    attributes: Mapping[str, str]
    extra: Mapping[str, str]

    def to_file_space(self, points: Floats) -> Floats:
        """Points or vectors of world space, Z up [m], in the file's axes and unit, (..., 3)."""
        return from_z_up(points, self.up) * self.units_per_metre

    @property
    def space(self) -> dict[str, object]:
        """Its axes and units, as the sidecar has them."""
        return {
            "handedness": "right",
            "up": self.up,
            "unit": self.unit,
            "metres_per_unit": 1.0 / self.units_per_metre,
            "front": "triangles counter-clockwise seen from outside",
        }


GLB = CardFormat(
    "glb",
    "glTF Binary",
    "glTF (.glb)",
    "Metres, Y up; for three.js, Godot and most others",
    (".glb",),
    "Y",
    "metre",
    1.0,
    {
        "POSITION": _REST,
        "NORMAL": _NORMAL,
        "TANGENT": _TANGENT + "TANGENT.w * cross(NORMAL, TANGENT.xyz)",
        "TEXCOORD_0": _TILE_TOP,
        "TEXCOORD_1": _OPENNESS,
    },
    {"_AO": _OCCLUSION},
)
FBX = CardFormat(
    "fbx",
    "FBX",
    "FBX (.fbx)",
    "Centimetres, Y up, with a LOD group; for Unreal and Unity",
    (".fbx",),
    "Y",
    "centimetre",
    100.0,
    {
        "Vertices": _REST,
        "LayerElementNormal": _NORMAL,
        "LayerElementTangent 0": "across the strands, along u",
        "LayerElementBinormal 0": "along the strands, from root to tip",
        "LayerElementUV 0": _TILE,
        "LayerElementUV 1": _OPENNESS
        + ". An importer that flips v of textures also flips the second component",
    },
    {},
)
USD = CardFormat(
    "usd",
    "Universal Scene Description",
    "USD (.usd)",
    "Metres, Z up",
    (".usd", ".usda", ".usdc"),
    "Z",
    "metre",
    1.0,
    {
        "points": _REST,
        "normals": _NORMAL,
        "primvars:tangents": _TANGENT + "cross(normals, tangents)",
        "primvars:st": _TILE,
        "primvars:st1": _OPENNESS,
    },
    {"primvars:_AO": _OCCLUSION},
)
OBJ = CardFormat(
    "obj",
    "Wavefront OBJ",
    "Wavefront (.obj)",
    "Metres, Y up; without tangents",
    (".obj",),
    "Y",
    "metre",
    1.0,
    {
        "v": f"{_REST}, followed by a colour. Red: {_OCCLUSION}. Green: position of the vertex "
        "along the strands, from 0 at the root to 1 at the tip",
        "vn": _NORMAL,
        "vt": f"{_TILE}. Tangents are along u",
    },
    {},
)
FORMATS = (GLB, FBX, USD, OBJ)
SUFFIXES = tuple(suffix for each in FORMATS for suffix in each.suffixes)


def format_of(path: Path, name: str | None = None) -> tuple[Path, CardFormat]:
    """The format of a file to write, and its path, which gets the usual suffix where it has none.

    Args:
        name: of the format; None: the suffix decides.

    Raises:
        HairloomError: another suffix, or one that is not of the format; or it names no file.
    """
    suffix = path.suffix.lower()
    for known in FORMATS:
        if suffix in known.suffixes and name in (None, known.name):
            return path, known
    named = next((known for known in FORMATS if known.name == name), None)
    if named is not None and suffix not in SUFFIXES:
        return with_added_suffix(path, named.suffixes[0]), named
    suffixes = named.suffixes if named else SUFFIXES
    raise HairloomError(
        f"cards cannot be written as '{path.suffix}'" + (f" in the format {name}" if name else ""),
        place=str(path),
        remedy=f"Use {', '.join(suffixes)}",
    )
