"""The files that strands are written to and read from: suffixes, layouts, and what they hold."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import HairloomError
from .files.file_names import with_added_suffix
from .files.file_space import FileSpace
from .groom_presets import PRESETS, GroomPreset
from .hair_file import MAX_SEGMENTS
from .tressfx_layout import VERTEX_COUNTS

_UNLIMITED = (1 << 31) - 1


@dataclass(frozen=True)
class StrandFormat:
    """One of the formats.

    name: on the command line.
    entry: in the File menu. about: the tooltip there.
    suffixes: of such files, in lower case, the usual one first.
    layouts: for the engines that it supports, the usual one first; only one without the option
        `engine`.
    options: the parameters of `StrandExportSettings` that apply to such a file.
    has_motion: whether a file can hold positions over time.
    """

    name: str
    title: str
    entry: str
    about: str
    suffixes: tuple[str, ...]
    layouts: tuple[GroomPreset, ...]
    options: tuple[str, ...]
    has_motion: bool


def _usd(
    name: str, title: str, up: str, units_per_metre: float, parts: str = "strands"
) -> GroomPreset:
    unit = "Metres" if units_per_metre == 1.0 else "Centimetres"
    about = f"{unit}, {up} up" + (", strands and guides" if parts == "both" else "")
    space = FileSpace(up, units_per_metre)
    return GroomPreset(name, title, about, space, _UNLIMITED, parts=parts, basis="cubic")


ALEMBIC = StrandFormat(
    "alembic",
    "Groom Alembic",
    "Hair groom (.abc)",
    "Write hair as an Alembic groom, with all that engines need",
    (".abc",),
    tuple(PRESETS.values()),
    ("engine", "basis", "parts", "by_group", "use_bake"),
    has_motion=True,
)
USD = StrandFormat(
    "usd",
    "USD",
    "Hair strands (.usdc/.usd/.usda)",
    "Write hair as USD curves, with all that engines need as primvars",
    (".usdc", ".usd", ".usda"),
    (
        _usd("blender", "Blender", "Z", 1.0),
        _usd("unreal", "Unreal", "Z", 100.0, "both"),
        _usd("unity", "Unity", "Y", 1.0),
        _usd("maya", "Maya", "Y", 100.0),
        _usd("houdini", "Houdini", "Y", 1.0),
    ),
    ("engine", "basis", "up", "scale", "parts", "by_group", "use_bake"),
    has_motion=True,
)
TRESSFX = StrandFormat(
    "tressfx",
    "TressFX",
    "TressFX (.tfx)",
    "Write hair as TressFX, with the same number of points on each strand",
    (".tfx",),
    (
        GroomPreset(
            "tressfx",
            "TressFX",
            "Metres, Y up",
            FileSpace("Y", 1.0),
            VERTEX_COUNTS[-1],
            parts="strands",
        ),
    ),
    (
        "up",
        "scale",
        "parts",
        "by_group",
        "bones",
        "vertex_count",
        "held_count",
        "pad_to_64",
        "point_uv",
    ),
    has_motion=False,
)
HAIR = StrandFormat(
    "hair",
    "Cem Yuksel's .hair",
    "Cem Yuksel's hair (.hair)",
    "Write hair in Cem Yuksel's format, which renderers and papers use",
    (".hair",),
    (
        GroomPreset(
            "hair",
            "Cem Yuksel's .hair",
            "Metres, Z up",
            FileSpace("Z", 1.0),
            MAX_SEGMENTS + 1,
            parts="strands",
        ),
    ),
    ("up", "scale", "parts", "by_group", "point_uv"),
    has_motion=False,
)
STRAND_FORMATS = (ALEMBIC, USD, TRESSFX, HAIR)
SUFFIXES = tuple(suffix for each in STRAND_FORMATS for suffix in each.suffixes)


def strand_format(path: Path) -> StrandFormat:
    """The format that a file's suffix names.

    Raises:
        HairloomError: it names none.
    """
    suffix = path.suffix.lower()
    for each in STRAND_FORMATS:
        if suffix in each.suffixes:
            return each
    raise HairloomError(
        f"'{path.suffix}' is not the suffix of a strand file"
        if path.suffix
        else "it has no suffix",
        place=str(path),
        remedy="Choose one of " + ", ".join(SUFFIXES),
    )


def format_of(path: Path, name: str | None = None) -> tuple[Path, StrandFormat]:
    """The format of a file to write, and its path, which gets the usual suffix where it has none.

    Args:
        name: of the format; None: the suffix decides.

    Raises:
        HairloomError: the suffix is of no format, or of another one; or it names no file.
    """
    if name is None:
        return path, strand_format(path)
    (named,) = (each for each in STRAND_FORMATS if each.name == name)
    if path.suffix.lower() in named.suffixes:
        return path, named
    if path.suffix.lower() in SUFFIXES:
        raise HairloomError(
            f"'{path.suffix}' is not the suffix of {named.title}",
            place=str(path),
            remedy=f"Use {named.suffixes[0]}, or omit the format",
        )
    return with_added_suffix(path, named.suffixes[0]), named
