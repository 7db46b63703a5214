"""TressFX .tfx grooms, versions 3 and 4: little-endian, strand after strand, root first.

Layout after AMD's TressFXFileFormat.h (versions 3.1 and 4.x). Version 3 stores positions as
float3, version 4 as float4 whose w is the inverse mass, 0 where a vertex is held. TressFX calls all
strands of a file guides: it grows follow hairs around them when it loads them, in version 3 as many
as the file says, in version 4 as many as the game says. `tfxbone` is the skinning.

Root UVs count v from the top of the picture, as AMD's shaders and its exporter for Maya do.

Limitations: a file has one radius a strand, so a taper is not kept; groups are not stored, so each
needs a file of its own (see `strand_writing`). AMD's loaders do not read the thickness, and its
header names no unit; here it is the radius, since AMD's shaders multiply it with a radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats
from ..errors import HairloomError
from ..strands import StrandSet
from ..strands.resample import resample
from .files.axes import from_z_up, to_z_up
from .files.binary_file import write_blocks
from .files.file_space import FileSpace
from .groom import Groom
from .groom_presets import select_parts
from .read_groom import ReadGroom, finite_or_zero, usable_strands, values_of_kept_points
from .tressfx_layout import HEADER_4, VERTEX_COUNTS, TressfxFile

#: TressFX simulates this many strands at a time.
STRANDS_AT_ONCE = 64


@dataclass(frozen=True)
class ReadTressfx(ReadGroom):
    """A .tfx file.

    is_held: (point_count,) bool, vertices with an inverse mass of 0.
    vertex_uv: (point_count, 2) float32, or None.
    follow_count: follow hairs that TressFX grows for each strand, as a file of version 3 says.
    """

    is_held: Bools
    vertex_uv: Floats | None
    follow_count: int


def read_tfx(path: Path, up: str = "Y", scale: float = 1.0) -> ReadTressfx:
    """Read a groom.

    Args:
        up: the file's up axis, "Y" or "Z"; Blender's is Z.
        scale: metres in one unit of the file.

    Raises:
        HairloomError: the file cannot be read, is no TressFX 3 or 4 file, is cut short, or holds
            no usable strand.
    """
    file = TressfxFile(path)
    count, positions = file.vertex_count, file.positions()
    thickness, strand_uv = file.strand_values("thickness", 1), file.strand_values("strand_uv", 2)
    color, vertex_uv = file.vertex_values("color", 4), file.vertex_values("vertex_uv", 2)
    # overflow gives infinity, and strands that are not finite are dropped and counted
    with np.errstate(over="ignore", invalid="ignore"):
        points = to_z_up(positions[:, :3], up) * np.float32(scale)
        radius = None if thickness is None else thickness[:, 0] * np.float32(scale)
    offsets = np.arange(file.strand_count + 1) * count
    cleaned = usable_strands(
        file,
        points,
        offsets,
        None if radius is None else np.repeat(radius, count),
        None if strand_uv is None else _flip_v(strand_uv),
        None if color is None else color[:, :3],
    )
    if file.position_width == 4:
        is_held = values_of_kept_points(positions[:, 3], offsets, cleaned) == 0.0
    else:
        is_held = file.held_vertices(cleaned.strands.strand_count)
    groom = Groom(
        cleaned.strands,
        name=path.stem,
        dropped=cleaned.dropped,
        source=path,
    )
    return ReadTressfx(
        groom,
        f"{file.version:g}",
        FileSpace(up),
        _reading_notes(path.name, file, color),
        is_held,
        None
        if vertex_uv is None
        else finite_or_zero(values_of_kept_points(vertex_uv, offsets, cleaned)),
        file.follow_count,
    )


def write_tfx(
    path: Path,
    hair: StrandSet | Groom,
    *,
    up: str = "Y",
    scale: float = 1.0,
    vertex_count: int | None = None,
    parts: Literal["strands", "guides", "both"] = "strands",
    held_count: int = 1,
    multiple_of_64: bool = False,
    vertex_uv: bool = False,
) -> tuple[str, ...]:
    """Write a groom as version 4: radius of the root as thickness, root UVs and colours if known.

    Args:
        hair: Z up, metres; resampled where the CV count is not `vertex_count`.
        up: the file's up axis, "Y" or "Z".
        scale: metres in one unit of the file.
        vertex_count: 4, 8, 16, 32 or 64; the smallest that holds the longest strand when None.
        parts: the strands that are seen, the guides alone (TressFX grows follow hairs around
            them), or both.
        held_count: vertices from the root on whose inverse mass is 0; AMD's exporter holds two.
        multiple_of_64: repeat the last strand until TressFX's thread groups are full. Version 4
            does so when it loads a file, version 3 leaves out the strands beyond.
        vertex_uv: write UVs of vertices as well, u across the strands by their number, v from 0 at
            the root to 1 at the tip.

    Returns:
        Notes on what the file cannot store of this groom.

    Raises:
        HairloomError: no strands, a vertex count TressFX refuses, a file beyond 4 GiB, or nothing
            can be written there.
    """
    groom = select_parts(hair if isinstance(hair, Groom) else Groom(hair), parts)
    strands = groom.strands
    if not strands.strand_count:
        raise HairloomError(
            "there are no strands to write", place=str(path), remedy="Choose hair that has strands"
        )
    count = _vertex_count(vertex_count, strands, path)
    uniform = resample(strands, count)
    grid = uniform.grid
    vertices = np.empty((len(grid), count, 4), "<f4")
    np.divide(from_z_up(grid, up), np.float32(scale), out=vertices[..., :3])
    vertices[..., 3] = 1.0
    vertices[:, :held_count, 3] = 0.0
    blocks = {"positions": vertices}
    if uniform.root_uv is not None:
        blocks["strand_uv"] = _flip_v(uniform.root_uv)
    if vertex_uv:
        blocks["vertex_uv"] = _vertex_uv(len(grid), count)
    if uniform.color is not None:
        opaque = np.ones((len(grid), count, 4), "<f4")
        opaque[..., :3] = uniform.color.reshape(-1, count, 3)
        blocks["color"] = opaque
    blocks["thickness"] = uniform.radius[uniform.offsets[:-1]] / np.float32(scale)
    repeated_count = -len(grid) % STRANDS_AT_ONCE if multiple_of_64 else 0
    if repeated_count:
        blocks = {name: _padded(block, repeated_count) for name, block in blocks.items()}
    _write(path, blocks)
    return _writing_notes(path.name, groom, uniform, repeated_count)


def _write(path: Path, blocks: dict[str, Floats]) -> None:
    header = np.zeros(1, HEADER_4)
    header["version"] = 4.0
    header["strand_count"], header["vertex_count"] = blocks["positions"].shape[:2]
    end = HEADER_4.itemsize
    written_blocks: list[NDArray[Any] | bytes] = []
    for name, block in blocks.items():
        gap = -end % 8  # as the format requires
        if end + gap > np.iinfo(np.uint32).max:
            raise HairloomError(
                "TressFX files are limited to 4 GiB, and this groom is larger",
                place=str(path),
                remedy="Write fewer strands, or fewer vertices per strand",
            )
        header[name] = end + gap
        written_blocks += [bytes(gap), np.ascontiguousarray(block, "<f4")]
        end += gap + block.size * 4
    write_blocks(path, [header, *written_blocks])


def _flip_v(uv: Floats) -> Floats:
    """UVs (n, 2) with v flipped: Blender counts it from the bottom of a picture, and TressFX, which
    looks up colours of roots with it, from the top as Direct3D does."""
    return np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)


def _vertex_count(wanted: int | None, strands: StrandSet, path: Path) -> int:
    if wanted is None:
        longest = int(strands.point_counts.max())
        return next((count for count in VERTEX_COUNTS if count >= longest), VERTEX_COUNTS[-1])
    if wanted not in VERTEX_COUNTS:
        raise HairloomError(
            f"TressFX does not support {wanted} vertices per strand",
            place=str(path),
            remedy="Use 4, 8, 16, 32 or 64",
        )
    return wanted


def _vertex_uv(strand_count: int, count: int) -> Floats:
    uv = np.empty((strand_count, count, 2), "<f4")
    uv[..., 0] = ((np.arange(strand_count) + 0.5) / strand_count)[:, None]
    uv[..., 1] = np.linspace(0.0, 1.0, count)
    return uv


def _padded(block: Floats, repeated_count: int) -> Floats:
    return np.concatenate([block, np.repeat(block[-1:], repeated_count, axis=0)])


def _reading_notes(name: str, file: TressfxFile, color: Floats | None) -> tuple[str, ...]:
    notes = []
    if file.follow_count:
        notes.append(
            f"{name}: TressFX grows {file.follow_count} follow hairs around each strand of this "
            "file, which does not contain them. Use children from guides instead."
        )
    clear = 0 if color is None else int((color[:, 3] != 1.0).sum())
    if color is not None and clear:
        notes.append(
            f"{name}: the alpha of its colours is not kept; {clear:,} of {len(color):,} are not "
            "opaque."
        )
    return tuple(notes)


def _writing_notes(
    name: str, groom: Groom, uniform: StrandSet, repeated_count: int
) -> tuple[str, ...]:
    strands, notes = groom.strands, []
    longest = int(strands.point_counts.max())
    count = len(uniform.grid[0])
    long = int((strands.point_counts > count).sum())
    if long:
        notes.append(
            f"{name}: strands of up to {longest} points were resampled to {count} ({long:,} of "
            f"{strands.strand_count:,})."
        )
    if (strands.group != strands.group[0]).any():
        notes.append(f"{name}: .tfx holds no groups. Write a file for each group to keep them.")
    radius = uniform.radius.reshape(-1, count)
    if (radius != radius[:, :1]).any():
        notes.append(
            f"{name}: .tfx holds one thickness per strand, that of the root; tapers are lost."
        )
    if groom.strand_id is not None or groom.closest_guides is not None:
        notes.append(f"{name}: .tfx holds no strand IDs and no closest guides.")
    if repeated_count:
        notes.append(
            f"{name}: the last strand was repeated {repeated_count} times, to a multiple of 64."
        )
    return tuple(notes)
