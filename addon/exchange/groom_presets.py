"""What engines require of a groom Alembic, and a check of what they will see of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from .files.file_space import FileSpace
from .groom import Groom

#: Thinner than any hair of any creature [m]. A width of 0 makes Unity drop all widths.
MIN_WIDTH = 1.0e-9
#: Widths over this fraction of the hair's length are a mistake in units.
MAX_WIDTH_RATIO = 0.1


@dataclass(frozen=True)
class GroomPreset:
    """How a file of strands is laid out for one engine.

    title, about: texts for the artist.
    space: the file's unit and axes.
    max_points: longer curves are resampled to this count; the engine would cut or refuse them.
    min_points: of a curve that the engine accepts.
    max_strands: of a group that the engine accepts.
    parts: "strands" without guides, "guides" alone, or "both".
    splits_groups: one curves object for each group instead of one for all.
    has_curve_uv: root UVs are also written as the curves' own UVs, one for each point.
    basis: "linear", or "cubic" for Catmull-Rom, which goes through the points as well.
    """

    name: str
    title: str
    about: str
    space: FileSpace
    max_points: int
    min_points: int = 2
    max_strands: int | None = None
    parts: str = "both"
    splits_groups: bool = False
    has_curve_uv: bool = False
    basis: str = "linear"


#: Unreal does not convert a groom's axes on import: it is left-handed with Z up, and meshes from
#: Blender arrive there with y mirrored. It stores a point's number in 8 bits, a curve's in 22.
UNREAL = GroomPreset(
    "unreal",
    "Unreal",
    "Centimetres, Z up, left-handed as Unreal is: import it without a rotation",
    FileSpace("Z", 100.0, is_mirrored=True),
    max_points=255,
    max_strands=(1 << 22) - 1,
)
#: Unity's Alembic importer takes files as right-handed with Y up and scales them by 0.01, unless
#: set otherwise: so centimetres. Its hair package needs all strands, in a curves object for each
#: group, and reads root UVs from the curves.
UNITY = GroomPreset(
    "unity",
    "Unity",
    "Centimetres, Y up, strands only, an object for each group",
    FileSpace("Y", 100.0),
    max_points=128,
    min_points=3,
    max_strands=64_000,
    parts="strands",
    splits_groups=True,
    has_curve_uv=True,
)
#: As Blender's own Alembic files are, bit-exact.
BLENDER = GroomPreset(
    "blender",
    "Blender",
    "Metres, Y up, as Blender's own Alembic files",
    FileSpace("Y", 1.0),
    max_points=1 << 16,
)
PRESETS = {preset.name: preset for preset in (UNREAL, UNITY, BLENDER)}


def select_parts(groom: Groom, parts: str) -> Groom:
    """The strands, the guides, or both."""
    if parts == "strands":
        return groom.without_guides()
    return groom.guides() if parts == "guides" else groom


def selected_strands(groom: Groom, parts: str) -> Ints:
    """Indices (n,) of the strands that `select_parts` takes."""
    count = groom.strands.strand_count
    if parts == "both" or (parts == "strands" and groom.is_guide is None):
        return np.arange(count)
    is_guide = np.zeros(count, bool) if groom.is_guide is None else groom.is_guide
    return np.flatnonzero(is_guide if parts == "guides" else ~is_guide)


def preflight(groom: Groom, preset: GroomPreset) -> dict[str, Any]:
    """What the engine will see of a groom written with this preset, in the file's units and axes.

    Returns:
        strands, guides, points: counts; groups: group -> number of its strands, or of its guides
            where there are only guides.
        points_per_curve, width: least and most; length: shortest and longest.
        lowest, highest: corners of the bounds.
        resampled: strands with more points than the engine takes.
        warnings: sentences for the artist; only a lack of strands keeps the groom from being
            written.
    """
    written = select_parts(groom, preset.parts)
    strands = written.strands
    is_guide = (
        np.zeros(strands.strand_count, bool) if written.is_guide is None else written.is_guide
    )
    guides = int(is_guide.sum())
    counts = np.minimum(strands.point_counts, preset.max_points)
    visible_groups = strands.group if is_guide.all() else strands.group[~is_guide]
    ids, sizes = np.unique(visible_groups, return_counts=True)
    corners = preset.space.to_file(np.stack(strands.bounds()))
    scale = preset.space.units_per_metre
    return {
        "preset": preset.name,
        "strands": strands.strand_count - guides,
        "guides": guides,
        "points": int(counts.sum()),
        "groups": dict(zip(ids.tolist(), sizes.tolist(), strict=True)),
        "points_per_curve": _range(counts),
        "width": _range(np.maximum(strands.radius * 2.0, MIN_WIDTH) * scale),
        "length": _range(strands.lengths() * scale),
        "lowest": corners.min(axis=0).tolist(),
        "highest": corners.max(axis=0).tolist(),
        "resampled": int((strands.point_counts > preset.max_points).sum()),
        "warnings": list(_warnings(groom, written, preset)),
    }


def _warnings(groom: Groom, written: Groom, preset: GroomPreset) -> list[str]:
    strands = written.strands
    if not strands.strand_count:
        what = "guides" if preset.parts == "guides" else "strands"
        return [f"The engine will see no {what}"]
    warnings = []
    zero = int((strands.radius <= 0.0).sum())
    if zero:
        warnings.append(f"{zero} points have no width: they are written as {MIN_WIDTH * 1e6:g} um")
    widest = 2.0 * float(strands.radius.max()) / max(float(np.median(strands.lengths())), 1.0e-30)
    if widest > MAX_WIDTH_RATIO:
        warnings.append(f"Widths reach {widest:.0%} of the strands' length: check the units")
    if len(np.unique(strands.group)) == 1:
        warnings.append("All strands are in one group: they can have only one material")
    if strands.root_uv is None:
        warnings.append("There are no root UVs: the engine generates some, or has none")
    long = int((strands.point_counts > preset.max_points).sum())
    if long:
        warnings.append(f"{long} strands are resampled to {preset.max_points} points")
    short = int((strands.point_counts < preset.min_points).sum())
    if short:
        warnings.append(f"{short} strands have fewer than {preset.min_points} points")
    largest_group = int(np.unique(strands.group, return_counts=True)[1].max())
    if preset.max_strands is not None and largest_group > preset.max_strands:
        warnings.append(
            f"A group has {largest_group} strands; the engine takes {preset.max_strands}"
        )
    if written.closest_guides is not None and preset.parts != "both":
        warnings.append("Closest guides are left out: they need strands and guides in one file")
    if preset.parts == "both" and (groom.is_guide is None or not groom.is_guide.any()):
        warnings.append("No strand is marked as a guide: the engine chooses some")
    return warnings


def _range(values: Floats | Ints) -> tuple[float, float]:
    return (values.min().item(), values.max().item()) if len(values) else (0, 0)
