"""The result of reading a groom's file, and the checks that readers share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet
from ..strands.clean import Cleaned, clean
from .files.binary_file import BinaryFile
from .files.file_space import FileSpace
from .groom import Groom


@dataclass(frozen=True)
class ReadGroom:
    """The usable content of a file.

    groom: Z up, metres.
    version: as the file names it, such as "1.5"; "" where it names none.
    axes: how the file's axes were read, in metres.
    notes: what of the file is not in the groom.
    """

    groom: Groom
    version: str
    axes: FileSpace
    notes: tuple[str, ...]

    @property
    def strands(self) -> StrandSet:
        return self.groom.strands

    @property
    def dropped(self) -> dict[str, int]:
        """Reason -> number of strands left out."""
        return dict(self.groom.dropped)

    @property
    def source(self) -> Path:
        return self.groom.source or Path()


def usable_strands(
    file: BinaryFile,
    points: Floats,
    offsets: Ints,
    radius: Floats | None,
    root_uv: Floats | None,
    color: Floats | None = None,
) -> Cleaned:
    """The file's strands without those that cannot be used.

    Raises:
        HairloomError: none is left.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        cleaned = clean(points, offsets, radius=radius, root_uv=root_uv, color=color)
    if not cleaned.strands.strand_count:
        reasons = ", ".join(f"{count} with {reason}" for reason, count in cleaned.dropped.items())
        raise file.error(f"none of its strands can be used ({reasons})", "Export the groom again")
    return cleaned


def finite_or_zero(values: Floats) -> Floats:
    """Values of any shape, with 0 instead of those that are not finite."""
    is_finite = np.isfinite(values)
    return values if is_finite.all() else np.where(is_finite, values, np.float32(0.0))


def values_of_kept_points(values: Floats, offsets: Ints, cleaned: Cleaned) -> Floats:
    """Values of all points of the file, (point_count, ...), without those of dropped strands."""
    if not cleaned.dropped:
        return values
    is_kept = np.zeros(len(offsets) - 1, bool)
    is_kept[cleaned.curve_indices] = True
    return values[np.repeat(is_kept, np.diff(offsets))]


def unique_identities(identities: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """IDs, and attributes that refer to them; empty if strands share an ID. Adds to `notes`."""
    numbers = identities.get("strand_id")
    if numbers is None:
        return identities
    _, owners = np.unique(numbers, return_counts=True)
    sharing = int(owners[owners > 1].sum())
    if not sharing:
        return identities
    notes.append(
        f"IDs were left out, because strands share them ({sharing:,} of {len(numbers):,} do)"
    )
    return {}
