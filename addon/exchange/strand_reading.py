"""Reading strands from a file of any format, by its suffix."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ..errors import HairloomError
from .alembic.groom_alembic_read import read_groom_alembic
from .groom import Groom
from .hair_file import read_hair_file
from .read_groom import ReadGroom
from .strand_formats import ALEMBIC, HAIR, TRESSFX, USD, strand_format
from .tressfx import read_tfx
from .usd.groom_usd_read import read_usd

#: which part of a file with strands and guides is read
PARTS = ("strands", "guides", "both")
#: limits of the factors on the lengths of a groom and of a head
SCALE_LIMITS = (1.0e-6, 1.0e6)


def read_strands(
    path: Path,
    *,
    up: str | None = None,
    scale: float = 1.0,
    parts: str = "strands",
    python: Sequence[str] | None = None,
) -> ReadGroom:
    """Read a groom in Blender's space.

    Args:
        path: .abc, .usdc, .usd, .usda, .tfx or .hair.
        up: the file's up axis, "Y" or "Z". None: as USD files and our own Alembic files name it;
            else Z in a .hair file, and Y in others.
        scale: factor on lengths, beside the file's own unit; a .tfx or .hair file has none and is
            taken to be in metres.
        parts: one of PARTS. Of a file with guides alone, "strands" gives these.
        python: the command that starts another Python, see `subprocess_reader.run_reader`.

    Returns:
        The result of the format's reader, with notes on what was left out. Closest guides are only
        kept if both strands and guides are.

    Raises:
        HairloomError: a scale outside its limits, another suffix, no guides where they are wanted,
            or a file that cannot be read.
    """
    if parts not in PARTS:
        raise HairloomError(
            f"'{parts}' is not a part", place="parts", remedy="Use " + ", ".join(PARTS)
        )
    check_scale(scale, "scale")
    read = _READERS[strand_format(path).name](path, up, scale, python)
    groom, note = _parts(read.groom, parts, path)
    return replace(read, groom=groom, notes=(*read.notes, *note))


def check_scale(scale: float, place: str) -> None:
    """Refuse a factor on lengths that is outside its limits, or not a number.

    Raises:
        HairloomError: it is. place: the setting, for the message.
    """
    low, high = SCALE_LIMITS
    if not low <= scale <= high:
        remedy = f"Use a number from {low:g} to {high:g}"
        raise HairloomError(f"{scale:g} cannot be used", place=place, remedy=remedy)


type Reader = Callable[[Path, str | None, float, Sequence[str] | None], ReadGroom]

_READERS: dict[str, Reader] = {
    ALEMBIC.name: lambda path, up, scale, python: read_groom_alembic(
        path, up=up, factor=scale, python=python
    ),
    USD.name: lambda path, up, scale, python: read_usd(path, up=up, factor=scale, python=python),
    TRESSFX.name: lambda path, up, scale, _: read_tfx(path, up=up or "Y", scale=scale),
    HAIR.name: lambda path, up, scale, _: read_hair_file(path, up=up or "Z", scale=scale),
}


def _parts(groom: Groom, parts: str, path: Path) -> tuple[Groom, tuple[str, ...]]:
    """The wanted part of a groom, and notes on the rest."""
    is_guide = groom.is_guide
    guide_count = 0 if is_guide is None else int(is_guide.sum())
    strand_count = groom.strands.strand_count - guide_count
    if parts == "both":
        return groom, ()
    if parts == "guides":
        if not guide_count:
            raise HairloomError(
                "none of its strands is marked as a guide",
                place=str(path),
                remedy="Import its strands instead",
            )
        note = f"{path.name}: {strand_count:,} strands were left out." if strand_count else ""
        return _without_closest_guides(groom.guides()), tuple(filter(None, [note]))
    if not guide_count:
        return _without_closest_guides(groom), ()
    if not strand_count:
        return _without_closest_guides(groom), (
            f"{path.name}: it holds only guides: {guide_count:,} of them.",
        )
    note = f"{path.name}: {guide_count:,} guides were left out."
    return _without_closest_guides(replace(groom.without_guides(), is_guide=None)), (note,)


def _without_closest_guides(groom: Groom) -> Groom:
    """The groom without closest guides, which are no longer in it."""
    return replace(groom, closest_guides=None, guide_weights=None)
