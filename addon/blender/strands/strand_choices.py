"""What an artist may choose where strands are written: identifier, label, description."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...errors import HairloomError
from ...exchange.files.names import plain_name
from ...exchange.strand_formats import STRAND_FORMATS, StrandFormat, strand_format
from ...exchange.strand_output import ENGINES, StrandOutput
from ...exchange.tressfx_layout import VERTEX_COUNTS

#: the formats by name
FORMATS: Mapping[str, StrandFormat] = MappingProxyType({each.name: each for each in STRAND_FORMATS})

type Items = tuple[tuple[str, str, str], ...]

ALEMBIC_ENGINES: Items = (
    ("unreal", "Unreal", "Centimetres, Z up, left-handed as Unreal is: import without a turn"),
    ("unity", "Unity", "Centimetres, Y up, strands only, an object for each group"),
    ("blender", "Blender", "Metres, Y up, as Blender's own Alembic files"),
)
USD_ENGINES: Items = (
    ("blender", "Blender", "Metres, Z up"),
    ("unreal", "Unreal", "Centimetres, Z up, strands and guides"),
    ("unity", "Unity", "Metres, Y up"),
    ("maya", "Maya", "Centimetres, Y up"),
    ("houdini", "Houdini", "Metres, Y up"),
)
PARTS: Items = (
    ("engine", "As the Engine Wants", "Unreal gets strands and guides, all others the strands"),
    ("strands", "Strands", "All that is seen"),
    ("guides", "Guides", "The guides alone"),
    ("both", "Strands and Guides", "All that is seen, and copies of the guides marked as such"),
)
SEVERAL: Items = (
    ("one", "One File", "All hair in one file, each with groups of its own"),
    ("each", "A File Each", "Each hair in a file of its own, named after it"),
)
BASES: Items = (
    ("engine", "As Usual", "Straight in Alembic, curved in USD"),
    ("linear", "Straight", "Straight lines between points"),
    ("cubic", "Curved", "Catmull-Rom curves through the points"),
)
FRAMES: Items = (
    ("still", "This Frame", "The hair as it is now"),
    ("scene", "Scene Range", "All frames of the scene"),
    ("own", "Frames", "A range of frames"),
)
UP_AXES: Items = (
    ("Y", "Y Up", "The file's Y axis points up, as in most engines"),
    ("Z", "Z Up", "The file's Z axis points up, as in Blender"),
)
COUNTS: Items = (
    ("fit", "As Needed", "The smallest that holds the longest strand"),
    *((str(count), str(count), f"{count} vertices on each strand") for count in VERTEX_COUNTS),
)
assert all(
    tuple(name for name, *_ in items) == ENGINES[kind]
    for kind, items in (("alembic", ALEMBIC_ENGINES), ("usd", USD_ENGINES))
)


def strand_output(values: Any) -> StrandOutput:
    """How an operator, or a command line, with such properties writes; it need not have all."""

    def chosen(name: str, usual: Any = "") -> Any:
        value = getattr(values, name, usual)
        return usual if value in ("engine", "fit", None) else value

    own_space = chosen("own_space", True)
    count = chosen("vertex_count", None)
    return StrandOutput(
        engine=chosen("engine"),
        parts=chosen("parts"),
        by_group=chosen("by_group", False),
        up=chosen("up") if own_space else "",
        scale=chosen("scale", None) if own_space else None,
        basis=chosen("basis"),
        vertex_count=None if count is None else int(count),
        held_count=chosen("held_count", 1),
        fills_groups=chosen("fills_groups", False),
        point_uv=chosen("point_uv", False),
    )


def path_in(path: Path, format_name: str | None) -> tuple[Path, StrandFormat]:
    """The file and its format: by its suffix, or with the suffix of a format that is asked for.

    Raises:
        HairloomError: the suffix is of no format, or of another one.
    """
    if format_name is None:
        return path, strand_format(path)
    kind = FORMATS[format_name]
    if path.suffix.lower() in kind.suffixes:
        return path, kind
    known = [suffix for each in STRAND_FORMATS for suffix in each.suffixes]
    if path.suffix.lower() in known:
        raise HairloomError(
            f"'{path.suffix}' is not the suffix of {kind.title}",
            place=str(path),
            remedy=f"Use {kind.suffixes[0]}, or leave out the format",
        )
    return path.with_name(path.name + kind.suffixes[0]), kind


def file_of(path: Path, hair_name: str, *, is_alone: bool) -> Path:
    """Where a hair goes; of several in a file each, it has its name behind the file's."""
    return path if is_alone else path.with_stem(f"{path.stem}_{plain_name(hair_name)}")
