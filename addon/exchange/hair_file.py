"""Cem Yuksel's .hair files (cyHairFile), which many renderers and papers read: little-endian.

A header of 128 bytes, then the arrays whose bits are set, each of all strands, root first: segments
(u16 a strand), points, thickness, transparency, colour, and UVs of points, which LuxCore added
(bit 32; the specification keeps it for later). A value without an array is the same for all strands
and is in the header. Thickness is the diameter, as LuxCore reads it.

Units and axes are not stored: Yuksel's own models have Z up. Groups are not stored either.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet
from .files.axes import from_z_up, to_z_up
from .files.binary_file import BinaryFile, write_blocks
from .files.file_space import FileSpace
from .groom import Groom
from .groom_presets import select_parts
from .read_groom import ReadGroom, finite_or_zero, usable_strands, values_of_kept_points

_SEGMENTS, _POINTS, _THICKNESS, _TRANSPARENCY, _COLOR, _UV = 1, 2, 4, 8, 16, 32
_DTYPES: dict[int, np.dtype[Any]] = {
    _SEGMENTS: np.dtype("<u2"),
    _POINTS: np.dtype("<f4"),
    _THICKNESS: np.dtype("<f4"),
    _TRANSPARENCY: np.dtype("<f4"),
    _COLOR: np.dtype("<f4"),
    _UV: np.dtype("<f4"),
}
#: bit -> name in messages, values of each strand or point
_ARRAYS = {
    _SEGMENTS: ("segments", 1),
    _POINTS: ("points", 3),
    _THICKNESS: ("thickness", 1),
    _TRANSPARENCY: ("transparency", 1),
    _COLOR: ("colours", 3),
    _UV: ("UVs", 2),
}
#: Maximum segments of a strand, which fit into 16 bits.
MAX_SEGMENTS = 0xFFFF
_WHITE = (1.0, 1.0, 1.0)

HEADER = np.dtype(
    [
        ("signature", "S4"),
        ("strand_count", "<u4"),
        ("point_count", "<u4"),
        ("arrays", "<u4"),
        ("segments", "<u4"),
        ("thickness", "<f4"),
        ("transparency", "<f4"),
        ("color", "<f4", (3,)),
        ("info", "S88"),
    ]
)


@dataclass(frozen=True)
class ReadHairFile(ReadGroom):
    """A .hair file.

    info: a text by the program that wrote it.
    transparency: (point_count,) float32 from 0, opaque, to 1.
    """

    info: str
    transparency: Floats


def read_hair_file(path: Path, up: str = "Z", scale: float = 1.0) -> ReadHairFile:
    """Read a groom.

    Args:
        up: the file's up axis, "Y" or "Z"; Blender's is Z.
        scale: metres in one unit of the file.

    Raises:
        HairloomError: the file cannot be read, is no .hair file, is cut short, its counts do not
            fit each other, or it holds no usable strand.
    """
    file = _HairFile(path)
    counts, points = file.point_counts(), file.points()
    offsets = np.concatenate([[0], np.cumsum(counts)])
    thickness, uv = file.values(_THICKNESS), file.values(_UV)
    with np.errstate(over="ignore", invalid="ignore"):
        half = np.float32(0.5) * np.float32(scale)
        radius = half * (file.default("thickness") if thickness is None else thickness)
        points = to_z_up(points, up) * np.float32(scale)
    cleaned = usable_strands(
        file,
        points,
        offsets,
        np.broadcast_to(radius, len(points)),
        None if uv is None else uv[np.minimum(offsets[:-1], len(uv) - 1)],
        _color(file, len(points)),
    )

    transparency = file.values(_TRANSPARENCY)
    if transparency is None:
        transparency = np.broadcast_to(file.default("transparency"), len(points))
    groom = Groom(
        cleaned.strands,
        name=path.stem,
        dropped=cleaned.dropped,
        source=path,
    )
    notes: tuple[str, ...] = ()
    clear = int((transparency != 0.0).sum())
    if clear:
        notes = (
            f"{path.name}: its transparency is not kept; {clear:,} of {len(transparency):,} points "
            "are not opaque.",
        )
    return ReadHairFile(
        groom,
        "",
        FileSpace(up),
        notes,
        file.info,
        finite_or_zero(values_of_kept_points(transparency, offsets, cleaned)),
    )


def write_hair_file(
    path: Path,
    hair: StrandSet | Groom,
    *,
    up: str = "Z",
    scale: float = 1.0,
    parts: Literal["strands", "guides", "both"] = "strands",
    uv: bool = False,
) -> tuple[str, ...]:
    """Write a groom with thickness, and colours if known; values common to all go into the header.

    Args:
        hair: Z up, metres; of any point counts.
        up: the file's up axis, "Y" or "Z".
        scale: metres in one unit of the file.
        parts: the strands that are seen, the guides, or both.
        uv: write root UVs as LuxCore's UVs of points; other readers may refuse such a file.

    Returns:
        Notes on what the file cannot store of this groom.

    Raises:
        HairloomError: no strands, a strand of more than 65,535 segments, or nothing can be written
            there.
    """
    groom = select_parts(hair if isinstance(hair, Groom) else Groom(hair), parts)
    strands = groom.strands
    if not strands.strand_count:
        raise HairloomError(
            "there are no strands to write", place=str(path), remedy="Choose hair that has strands"
        )
    header = np.zeros(1, HEADER)
    header["signature"] = b"HAIR"
    header["strand_count"], header["point_count"] = strands.strand_count, strands.point_count
    header["color"] = _WHITE
    header["info"] = b"Hairloom"
    unit = np.float32(scale)
    arrays: dict[int, NDArray[Any]] = {_POINTS: from_z_up(strands.points, up) / unit}
    segments = strands.point_counts - 1
    _store_constant_or_array(header, arrays, "segments", _SEGMENTS, segments)
    _store_constant_or_array(
        header, arrays, "thickness", _THICKNESS, strands.radius * (np.float32(2.0) / unit)
    )
    if groom.color is not None:
        _store_constant_or_array(header, arrays, "color", _COLOR, groom.color)
    if uv and strands.root_uv is not None:
        arrays[_UV] = np.repeat(strands.root_uv, strands.point_counts, axis=0)
    if _SEGMENTS in arrays and segments.max() > MAX_SEGMENTS:
        raise HairloomError(
            f"a strand has {segments.max():,} segments, and .hair files hold up to "
            f"{MAX_SEGMENTS:,} per strand",
            place=str(path),
            remedy="Resample the hair to fewer points",
        )
    header["arrays"] = sum(arrays)
    blocks = (arrays[bit].astype(_DTYPES[bit], copy=False) for bit in sorted(arrays))
    write_blocks(path, [header, *blocks])
    return _writing_notes(path.name, groom, _UV in arrays)


def _store_constant_or_array(
    header: NDArray[Any], arrays: dict[int, NDArray[Any]], name: str, bit: int, values: NDArray[Any]
) -> None:
    """One value in the header where all are the same, else an array.

    White in the header means that there are no colours, so white hair gets an array, too.
    """
    is_constant = bool((values == values[:1]).all())
    if is_constant and not (bit == _COLOR and (values[0] == 1.0).all()):
        header[name] = values[0]
    else:
        arrays[bit] = values


def _color(file: _HairFile, point_count: int) -> Floats | None:
    values = file.values(_COLOR)
    if values is not None:
        return values
    default = file.default("color")
    return None if (default == _WHITE).all() else np.broadcast_to(default, (point_count, 3))


class _HairFile(BinaryFile):
    """A .hair file with a valid header and complete arrays."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        if self.array("signature", 0, "S4", 1)[0] != b"HAIR":
            raise self.error(
                "this is not a .hair file: it does not begin with HAIR", "Choose a .hair file"
            )
        self._header = self.array("header", 0, HEADER, 1)[0]
        self._strand_count = int(self._header["strand_count"])
        self._point_count = int(self._header["point_count"])
        self._bits = int(self._header["arrays"])
        if not self._strand_count or not self._bits & _POINTS:
            raise self.error("it holds no strands", "Export the groom again")
        if self._bits > sum(_ARRAYS):
            raise self.error(
                f"it holds unknown arrays (bits {self._bits:#x}, byte 12)",
                "The file is damaged, or newer than this reader",
            )
        self._check_arrays()

    @property
    def info(self) -> str:
        return bytes(self._header["info"]).decode("utf-8", "replace")

    def default(self, name: str) -> Any:
        """The value for all strands, where there is no array."""
        return self._header[name]

    def point_counts(self) -> Ints:
        """Points of each strand, (strand_count,).

        Raises:
            HairloomError: they do not add up to the file's points.
        """
        segments = self.values(_SEGMENTS)
        each = int(self._header["segments"]) + 1
        total = each * self._strand_count
        if segments is not None:
            total = int(segments.sum(dtype=np.int64)) + self._strand_count
        if total != self._point_count:
            raise self.error(
                f"its strands have {total:,} points together, but its header states "
                f"{self._point_count:,} (byte 8)",
                "The file is damaged: copy or export it again",
            )
        if segments is None:
            return np.full(self._strand_count, each, np.int64)
        return segments.astype(np.int64) + 1

    def points(self) -> Floats:
        """(point_count, 3) float32."""
        values = self.values(_POINTS)
        assert values is not None
        return values

    def values(self, bit: int) -> NDArray[Any] | None:
        """The array of this bit, a row for each strand or point; None where there is none."""
        if not self._bits & bit:
            return None
        name, width = _ARRAYS[bit]
        start = HEADER.itemsize + sum(self._bytes(other) for other in _ARRAYS if other < bit)
        values = self.array(name, start, _DTYPES[bit], self._items(bit) * width)
        return values.reshape(-1, width) if width > 1 else values

    def _check_arrays(self) -> None:
        start = HEADER.itemsize
        for bit, (name, _) in _ARRAYS.items():
            self.check(name, start, self._bytes(bit))
            start += self._bytes(bit)

    def _items(self, bit: int) -> int:
        return self._strand_count if bit == _SEGMENTS else self._point_count

    def _bytes(self, bit: int) -> int:
        """Bytes of an array in this file; 0 where it has none."""
        if not self._bits & bit:
            return 0
        return self._items(bit) * _ARRAYS[bit][1] * _DTYPES[bit].itemsize


def _writing_notes(name: str, groom: Groom, has_uv: bool) -> tuple[str, ...]:
    strands, notes = groom.strands, []
    if (strands.group != strands.group[0]).any():
        notes.append(f"{name}: .hair holds no groups. Write a file for each group to keep them.")
    if strands.root_uv is not None and not has_uv:
        notes.append(f"{name}: .hair holds no root UVs, except in the manner of LuxCore.")
    if groom.strand_id is not None or groom.closest_guides is not None:
        notes.append(f"{name}: .hair holds no strand IDs and no closest guides.")
    return tuple(notes)
