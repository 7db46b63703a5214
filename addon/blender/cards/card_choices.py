"""What an artist may choose where cards are written: identifier, label, description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...cards.export_settings import CardExportSettings
from ...exchange.cards.card_formats import FBX, FORMATS, GLB, OBJ, USD
from ...exchange.files.names import plain_name
from ..properties.properties import settings_of
from .files import CardOutput

FORMAT_ITEMS = (
    (GLB.name, "glTF (.glb)", "Metres, Y up; for three.js, Godot and most others"),
    (FBX.name, "FBX (.fbx)", "Centimetres, Y up, with a LOD group; for Unreal and Unity"),
    (USD.name, "USD (.usd)", "Metres, Z up"),
    (OBJ.name, "Wavefront (.obj)", "Metres, Y up; without tangents"),
)
SUFFIXES = tuple(suffix for each in FORMATS for suffix in each.suffixes)


def suffix_of(format_name: str, path: str) -> str:
    """The usual suffix of a format, or the one that the path has where it is of the format."""
    (chosen,) = (each for each in FORMATS if each.name == format_name)
    suffix = Path(path).suffix.lower()
    return suffix if suffix in chosen.suffixes else chosen.suffixes[0]


def card_output(values: Any, path: Path, hair_name: str) -> CardOutput:
    """How an operator with these properties writes to a path; a suffix that is known counts."""
    is_known = path.suffix.lower() in SUFFIXES
    settings = settings_of(values, CardExportSettings)
    return CardOutput(None if is_known else values.format, plain_name(hair_name), settings)


def file_stem(hair_name: str) -> str:
    """What a file is called after the hair in it."""
    return plain_name(hair_name)
