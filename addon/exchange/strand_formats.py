"""The files that strands are written to and read from: their suffixes, and what they can hold."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import HairloomError


@dataclass(frozen=True)
class StrandFormat:
    """One of the formats.

    name: as the command line has it.
    suffixes: of such files, in lower case, the usual one first.
    has_motion: whether a file can hold positions over time.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    has_motion: bool


ALEMBIC = StrandFormat("alembic", "Groom Alembic", (".abc",), has_motion=True)
USD = StrandFormat("usd", "USD", (".usdc", ".usd", ".usda"), has_motion=True)
TRESSFX = StrandFormat("tressfx", "TressFX", (".tfx",), has_motion=False)
HAIR = StrandFormat("hair", "Cem Yuksel's .hair", (".hair",), has_motion=False)
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
        f"'{path.suffix}' is no suffix of files of strands" if path.suffix else "it has no suffix",
        place=str(path),
        remedy="Choose one of " + ", ".join(SUFFIXES),
    )
