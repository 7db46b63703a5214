"""TressFX .tfx grooms, versions 3 and 4: little-endian, strand after strand, root first.

Layout after AMD's TressFXFileFormat.h (versions 3.1 and 4.x). Version 3 stores positions as
float3, version 4 as float4 whose w is the inverse mass, 0 where a vertex is held. Everything else
a file may hold (colours, vertex UVs, guide indices) is not read.

Limitations: a file has one radius a strand, so a taper is not kept; groups are not stored.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from ..strands import StrandSet
from ..strands.clean import clean
from ..strands.resample import resample
from .atomic import write_bytes_atomic
from .axes import from_z_up, to_z_up

#: Thicker than any hair [m]: such a thickness is a coefficient or in another unit.
THICKEST_RADIUS = 5.0e-3
#: What TressFX's own loader accepts.
VERTEX_COUNTS = (4, 8, 16, 32, 64)

_HEADER_4 = np.dtype(
    [
        ("version", "<f4"),
        ("strand_count", "<u4"),
        ("vertex_count", "<u4"),
        ("positions", "<u4"),
        ("strand_uv", "<u4"),
        ("vertex_uv", "<u4"),
        ("thickness", "<u4"),
        ("color", "<u4"),
        ("reserved", "<u4", (32,)),
    ]
)
_HEADER_3 = np.dtype(
    [
        ("version", "<f4"),
        ("strand_count", "<u4"),
        ("vertex_count", "<u4"),
        ("follow_count", "<u4"),
        ("both_ends_immovable", "<u4"),
        ("reserved", "<u4", (31,)),
        ("positions", "<u4"),
        ("thickness", "<u4"),
        ("strand_uv", "<u4"),
        ("color", "<u4"),
        ("guide", "<u4"),
        ("vertex_uv", "<u4"),
        ("reserved_end", "<u4", (32,)),
    ]
)
#: major version -> header, floats of a position
_LAYOUTS = {3: (_HEADER_3, 3), 4: (_HEADER_4, 4)}


@dataclass(frozen=True)
class ReadGroom:
    """What a file held that can be used.

    strands: Z up, metres.
    dropped: reason -> number of strands left out.
    version: as the file says, such as 4.0.
    source: the file.
    """

    strands: StrandSet
    dropped: dict[str, int]
    version: float
    source: Path


def read_tfx(path: Path, up: str = "Y", scale: float = 1.0) -> ReadGroom:
    """Read a groom.

    Args:
        up: the file's up axis, "Y" or "Z"; Blender's is Z.
        scale: metres in one unit of the file.

    Raises:
        HairloomError: the file cannot be read, is no TressFX 3 or 4 file, is cut short, or holds
            no usable strand.
    """
    file = _File(path)
    version = file.version()
    header_type, width = _LAYOUTS[int(version)]
    header = file.array("header", 0, header_type, 1)[0]
    strand_count, vertex_count = file.counts(header)

    points = file.block("positions", header, strand_count * vertex_count, width)[:, :3]
    radius = file.block("thickness", header, strand_count, 1) if header["thickness"] else None
    uv = file.block("strand_uv", header, strand_count, 2) if header["strand_uv"] else None
    # What overflows becomes infinite, and what is not finite is dropped and counted.
    with np.errstate(over="ignore", invalid="ignore"):
        points = to_z_up(points, up) * np.float32(scale)
        radius = None if radius is None else _plausible(radius[:, 0] * np.float32(scale))
        cleaned = clean(
            points,
            np.arange(strand_count + 1) * vertex_count,
            radius=None if radius is None else np.repeat(radius, vertex_count),
            root_uv=uv,
        )
    if not cleaned.strands.strand_count:
        reasons = ", ".join(f"{count} with {reason}" for reason, count in cleaned.dropped.items())
        raise file.error(f"none of its strands can be used ({reasons})", "Export the groom again")
    return ReadGroom(cleaned.strands, cleaned.dropped, version, path)


def write_tfx(
    path: Path,
    strands: StrandSet,
    *,
    up: str = "Y",
    scale: float = 1.0,
    vertex_count: int | None = None,
) -> None:
    """Write a groom as version 4: root held, radius of the root as thickness, root UVs if known.

    Args:
        strands: Z up, metres; resampled where their CV count is not `vertex_count`.
        up: the file's up axis, "Y" or "Z".
        scale: metres in one unit of the file.
        vertex_count: 4, 8, 16, 32 or 64; the smallest that holds the longest strand when None.

    Raises:
        HairloomError: no strands, a vertex count TressFX refuses, or nothing can be written there.
    """
    if not strands.strand_count:
        raise HairloomError(
            "there are no strands to write", place=str(path), remedy="Choose hair that has strands"
        )
    uniform = resample(strands, _vertex_count(vertex_count, strands, path))
    vertices = np.ones((*uniform.grid.shape[:2], 4), "<f4")
    vertices[..., :3] = from_z_up(uniform.grid, up) / np.float32(scale)
    vertices[:, 0, 3] = 0.0
    blocks = {"positions": vertices, "thickness": uniform.radius[uniform.offsets[:-1]] / scale}
    if uniform.root_uv is not None:
        blocks["strand_uv"] = uniform.root_uv

    header = np.zeros(1, _HEADER_4)
    header["version"] = 4.0
    header["strand_count"], header["vertex_count"] = vertices.shape[:2]
    content = bytearray(_HEADER_4.itemsize)
    for name, block in blocks.items():
        header[name] = len(content)
        content += np.ascontiguousarray(block, "<f4").tobytes()
    content[: _HEADER_4.itemsize] = header.tobytes()
    write_bytes_atomic(path, content)


def _plausible(radius: Floats) -> Floats:
    """NaN, which `clean` replaces, where this cannot be a radius in metres."""
    return np.where((radius > 0.0) & (radius <= THICKEST_RADIUS), radius, np.float32(np.nan))


def _vertex_count(wanted: int | None, strands: StrandSet, path: Path) -> int:
    if wanted is None:
        longest = int(strands.point_counts.max())
        return next((count for count in VERTEX_COUNTS if count >= longest), VERTEX_COUNTS[-1])
    if wanted not in VERTEX_COUNTS:
        raise HairloomError(
            f"TressFX does not take {wanted} vertices a strand",
            place=str(path),
            remedy="Use 4, 8, 16, 32 or 64",
        )
    return wanted


class _File:
    """A file whose every read is first checked against its size, and fails with its place."""

    def __init__(self, path: Path) -> None:
        self._path = path
        if path.is_dir():
            raise self.error("this is a folder, not a file", "Choose a .tfx file")
        try:
            self._size = os.stat(path).st_size
        except OSError as error:
            raise self._unreadable(error) from error
        if not self._size:
            raise self.error("the file is empty", "Export the groom again")

    def version(self) -> float:
        """The version at byte 0, when it is one that we read."""
        version = float(self.array("version", 0, "<f4", 1)[0])
        if 3.0 <= version < 5.0:
            return version
        raise self.error(
            f"this is no TressFX 3 or 4 file: its version, at byte 0, reads as {version:.6g}",
            "Choose a .tfx file, or export it again as version 4",
        )

    def counts(self, header: np.void) -> tuple[int, int]:
        strand_count, vertex_count = int(header["strand_count"]), int(header["vertex_count"])
        for name, place, count in (
            ("strands", 4, strand_count),
            ("vertices a strand", 8, vertex_count),
        ):
            if not count:
                raise self.error(f"it holds no {name} (byte {place})", "Export the groom again")
        return strand_count, vertex_count

    def block(self, name: str, header: np.void, count: int, width: int) -> Floats:
        """The floats that the header's offset of this name points to, (count, width) float32."""
        offset = int(header[name])
        if offset < header.dtype.itemsize:
            raise self.error(
                f"the {name} would start at byte {offset}, inside the header",
                "The file is damaged: copy or export it again",
            )
        return self.array(name, offset, "<f4", count * width).reshape(count, width)

    def array(self, name: str, offset: int, dtype: str | np.dtype[np.void], count: int) -> Floats:
        """`count` items from byte `offset`; nothing is allocated before the file is known to
        hold them."""
        end = offset + count * np.dtype(dtype).itemsize
        if end > self._size:
            raise self.error(
                f"the {name}, bytes {offset:,} to {end:,}, reach past the end of the file, "
                f"which has {self._size:,} bytes",
                "The file is cut short or damaged: copy or export it again",
            )
        try:
            return np.fromfile(self._path, dtype, count, offset=offset)
        except OSError as error:
            raise self._unreadable(error) from error

    def error(self, problem: str, remedy: str) -> HairloomError:
        return HairloomError(problem, place=str(self._path), remedy=remedy)

    def _unreadable(self, error: OSError) -> HairloomError:
        return self.error(
            f"this file cannot be read ({error.strerror or error})",
            "Check the path and that you may read it",
        )
