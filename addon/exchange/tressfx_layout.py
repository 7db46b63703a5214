"""The layouts of .tfx files of versions 3 and 4, and a file of either, read block by block."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..arrays import Bools, Floats
from .files.binary_file import BinaryFile

#: What TressFX's own loader accepts.
VERTEX_COUNTS = (4, 8, 16, 32, 64)

HEADER_4 = np.dtype(
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
HEADER_3 = np.dtype(
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
_LAYOUTS = {3: (HEADER_3, 3), 4: (HEADER_4, 4)}


class TressfxFile(BinaryFile):
    """A .tfx file with a valid header.

    Raises:
        HairloomError: the file cannot be read, or is no TressFX 3 or 4 file.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.version = self._version()
        layout, self.position_width = _LAYOUTS[int(self.version)]
        self._header = self.array("header", 0, layout, 1)[0]
        self.strand_count = self._count("strand_count", "strands", 4)
        self.vertex_count = self._count("vertex_count", "vertices a strand", 8)

    @property
    def follow_count(self) -> int:
        """The number of follow hairs of each strand; only version 3 stores it."""
        return int(self._header["follow_count"]) if self.position_width == 3 else 0

    def held_vertices(self, strand_count: int) -> Bools:
        """Which vertices of these strands a file of version 3 holds, as its loader does: the
        first two, and the last two where both ends are immovable; (vertices,)."""
        is_held = np.zeros((strand_count, self.vertex_count), bool)
        is_held[:, :2] = True
        if self._header["both_ends_immovable"]:
            is_held[:, -2:] = True
        return is_held.ravel()

    def positions(self) -> Floats:
        """(vertices, position_width) float32; the fourth of them is the inverse mass."""
        return self._block("positions", self.strand_count * self.vertex_count, self.position_width)

    def vertex_values(self, name: str, width: int) -> Floats | None:
        """(vertices, width) float32, or None where the file has none of them."""
        return self._optional(name, self.strand_count * self.vertex_count, width)

    def strand_values(self, name: str, width: int) -> Floats | None:
        """(strand_count, width) float32, or None where the file has none of them."""
        return self._optional(name, self.strand_count, width)

    def _version(self) -> float:
        """The version at byte 0, if it is one that can be read."""
        version = float(self.array("version", 0, "<f4", 1)[0])
        if 3.0 <= version < 5.0:
            return version
        raise self.error(
            f"this is not a TressFX 3 or 4 file: its version, at byte 0, reads as {version:.6g}",
            "Choose a .tfx file, or export it again as version 4",
        )

    def _count(self, name: str, what: str, place: int) -> int:
        count = int(self._header[name])
        if not count:
            raise self.error(f"it holds no {what} (byte {place})", "Export the groom again")
        return count

    def _optional(self, name: str, count: int, width: int) -> Floats | None:
        return self._block(name, count, width) if self._header[name] else None

    def _block(self, name: str, count: int, width: int) -> Floats:
        """The floats that the header's offset of this name points to."""
        offset = int(self._header[name])
        if offset < self._header.dtype.itemsize:
            raise self.error(
                f"the {name} would start at byte {offset}, inside the header",
                "The file is damaged: copy or export it again",
            )
        return self.array(name, offset, "<f4", count * width).reshape(count, width)
